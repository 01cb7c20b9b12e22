"""Systematic deviations: second-order shapes with a peak-to-valley amplitude in mm."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from cadskin.deviation._parameters import finite
from cadskin.deviation.base import MM, RAD, DeviationModel, FixedSampler, register
from cadskin.deviation.coordinates import surface_coordinates
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.deviation.base import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["FormModel", "Paraboloid"]


@dataclass(frozen=True, eq=False, repr=False)
class FormModel(DeviationModel):
    """A systematic form: a height over the surface coordinates of each feature.

    Each selected feature gets its own form, in its own coordinates (`cadskin.deviation.coordinates`), with
    the same amplitude: ``.on(">Z")`` puts it on one face.

    Parameters
    ----------
    amplitude : float
        Peak-to-valley height over the samples of the feature [mm]; negative turns the form over.
    centre : (2,) float
        Apex in the feature's coordinates [mm]; (0, 0) is the centroid of its area.
    rotation : float
        Angle of the form's first axis from the feature's [rad].
    """

    amplitude: float = field(metadata=MM)
    centre: tuple[float, float] = field(default=(0.0, 0.0), metadata=MM)
    rotation: float = field(default=0.0, metadata=RAD)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "amplitude", finite(self.amplitude, "amplitude", "mm", self))
        object.__setattr__(self, "rotation", finite(self.rotation, "rotation", "rad", self))
        if np.shape(self.centre) != (2,):
            raise DeviationError(f"{type(self).__name__}: centre must be two numbers, got {self.centre!r}")
        x, y = (finite(value, "centre", "mm", self) for value in self.centre)
        object.__setattr__(self, "centre", (x, y))

    @abstractmethod
    def height(self, x: Floats, y: Floats) -> Floats:
        """Return the height (k,) [mm] at coordinates (k,) [mm] from the centre, with the amplitude."""

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Evaluate the form on every feature."""
        values = np.zeros(nominal.n_samples)
        for feature in nominal.features if features is None else features:
            values[feature.rows] = self.on_coordinates(surface_coordinates(feature))
        return FixedSampler(values)

    def on_coordinates(self, coordinates: Floats) -> Floats:
        """Return the form (k,) [mm] at surface coordinates (k, 2) [mm]."""
        shifted = coordinates - np.array(self.centre)
        cosine, sine = np.cos(self.rotation), np.sin(self.rotation)
        return self.height(
            shifted[:, 0] * cosine + shifted[:, 1] * sine, shifted[:, 1] * cosine - shifted[:, 0] * sine
        )


@register
@dataclass(frozen=True, eq=False, repr=False)
class Paraboloid(FormModel):
    """A paraboloid, z = a (x² + ratio y²) scaled to its peak-to-valley: dished (+) or crowned (-).

    The apex is at zero; with a positive amplitude the border stands out of the material.

    Parameters
    ----------
    amplitude : float
        Peak-to-valley height over the samples of the feature [mm].
    centre : (2,) float
        Apex in the feature's coordinates [mm].
    rotation : float
        Angle of the x axis [rad].
    ratio : float
        Curvature along y over curvature along x: 1 round, 0 a parabolic cylinder, -1 a saddle.

    References
    ----------
    Zhang et al. 2013, doi:10.1177/0954405412466987, section on systematic deviations, figure 3.

    Examples
    --------
    >>> Paraboloid(0.05)
    Paraboloid(amplitude=0.05 mm)
    """

    name: ClassVar[str] = "paraboloid"
    ratio: float = 1.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        super().__post_init__()
        object.__setattr__(self, "ratio", finite(self.ratio, "ratio", "", self))

    def height(self, x: Floats, y: Floats) -> Floats:
        """Return amplitude times the normalised quadratic form."""
        quadratic = x * x + self.ratio * (y * y)
        span = float(np.ptp(quadratic)) if len(quadratic) else 0.0
        return self.amplitude / span * quadratic if span > 0 else np.zeros_like(quadratic)
