"""What a systematic form is: a height over coordinates of each feature, in its own frame or any frame."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from cadskin.deviation._parameters import direction_of, finite, vector_of
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.base import MM, RAD, DeviationModel
from cadskin.deviation.coordinates import Vector3, form_coordinates
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["FormModel", "Framed", "check_frame", "placed", "scaled"]


class Framed(Protocol):
    """A model with a frame: its apex and first axis in the feature's coordinates or in space."""

    @property
    def centre(self) -> tuple[float, float]:
        """Apex [mm]."""

    @property
    def origin(self) -> Vector3 | None:
        """Point of space in place of the centroid [mm]."""

    @property
    def direction(self) -> Vector3 | None:
        """Direction of space in place of the feature's first axis."""


@dataclass(frozen=True, eq=False, repr=False)
class FormModel(DeviationModel):
    """A systematic form: a height over the surface coordinates of each feature.

    Each selected feature gets its own form, in its own coordinates (`cadskin.deviation.coordinates`), with
    the same amplitude: ``.on(">Z")`` puts it on one face. With ``origin`` and ``direction`` the coordinates
    are those of any frame in space instead.

    Parameters
    ----------
    amplitude : float
        Peak-to-valley height over the samples of the feature [mm]; negative turns the form over.
    centre : (2,) float
        Apex in the feature's coordinates [mm]; (0, 0) is the centroid of its area.
    rotation : float
        Angle of the form's first axis from the feature's [rad].
    origin : (3,) float, optional
        A point of space whose foot on the surface takes the place of the centroid [mm].
    direction : (3,) float, optional
        Direction of space that takes the place of the feature's first axis, seen along the normal.
    """

    amplitude: Any = field(metadata=MM)
    centre: tuple[float, float] = field(default=(0.0, 0.0), metadata=MM)
    rotation: float = field(default=0.0, metadata=RAD)
    origin: Vector3 | None = field(default=None, metadata=MM, kw_only=True)
    direction: Vector3 | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "amplitude", number_or_share(self.amplitude, "amplitude", self, finite))
        object.__setattr__(self, "rotation", finite(self.rotation, "rotation", "rad", self))
        check_frame(self)

    @abstractmethod
    def height(self, x: Floats, y: Floats) -> Floats:
        """Return the height (k,) [mm] at coordinates (k,) [mm] from the centre, with the amplitude."""

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Evaluate the form on every feature."""
        needs_numbers(self)
        return form_sampler(nominal, features, self._on)

    def _on(self, feature: Feature) -> Floats:
        return self.height(*placed(feature, self, self.rotation))


def scaled(form: Floats, amplitude: float) -> Floats:
    """Return a form (k,) scaled to a height from peak to valley [mm]; zero where it is constant."""
    span = float(np.ptp(form)) if len(form) else 0.0
    return np.asarray(amplitude / span * form) if span > 0 else np.zeros_like(form)


def _centre(centre: tuple[float, float], owner: object) -> tuple[float, float]:
    if not isinstance(centre, (tuple, list, np.ndarray)) or len(centre) != 2:
        raise DeviationError(f"{type(owner).__name__}: centre must be two numbers, got {centre!r}")
    return finite(centre[0], "centre", "mm", owner), finite(centre[1], "centre", "mm", owner)


def check_frame(model: Framed) -> None:
    """Check and freeze centre, origin and direction of a form."""
    object.__setattr__(model, "centre", _centre(model.centre, model))
    for key, check in (("origin", vector_of), ("direction", direction_of)):
        value = getattr(model, key)
        if value is not None:
            object.__setattr__(model, key, check(value, key, "mm" if key == "origin" else "", model))


def placed(feature: Feature, model: Framed, rotation: float) -> tuple[Floats, Floats]:
    """Coordinates along the axes of a form, from its apex."""
    return form_coordinates(
        feature,
        centre=model.centre,
        rotation=rotation,
        origin=model.origin,
        direction=model.direction,
    )
