"""Rigid and low-order defects: small displacement fields u, seen along the normal, d = n . u(p).

References
----------
Bourdet, Mathieu, Lartigue, Ballu: The concept of the small displacement torsor in metrology, Series on
Advances in Mathematics for Applied Sciences 40 (1996).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._parameters import direction_of, finite, vector_of
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.base import MM, RAD, DeviationModel
from cadskin.deviation.coordinates import area_frame, surface_coordinates
from cadskin.deviation.registry import register
from cadskin.deviation.samplers import FixedSampler

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["Bend", "DisplacementModel", "Shift", "SizeOffset", "Taper", "Thermal", "Tilt", "Torsor", "Twist"]

_Z = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class DisplacementModel(DeviationModel):
    """A displacement field u(p) of the selected features together: d = n . u.

    Without a ``centre`` it is the centroid of the area of the selected features.
    """

    @abstractmethod
    def displacement(self, points: Points, centre: Points) -> Points:
        """Return the displacement (k, 3) [mm] of points (k, 3) [mm]; ``centre`` (3,) [mm]."""

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Project the displacement on the normals."""
        needs_numbers(self)
        chosen = tuple(nominal.features if features is None else features)
        given = getattr(self, "centre", None)
        centre = _centroid(nominal, chosen) if given is None else np.array(given)
        rows = np.concatenate([np.arange(f.start, f.stop) for f in chosen] or [np.zeros(0, dtype=np.int64)])
        points = nominal.surface.points[nominal.samples.vertex_ids[rows]]
        values = np.zeros(nominal.n_samples)
        moved = self.displacement(points, centre)
        values[rows] = np.einsum("ij,ij->i", nominal.samples.normals[rows], moved)
        return FixedSampler(values)


def _centroid(nominal: NominalModel, features: Sequence[Feature]) -> Points:
    triangles = np.concatenate([np.zeros(0, dtype=np.int64), *[f.triangle_ids for f in features]])
    if not len(triangles):
        return np.zeros(3)
    corners = nominal.surface.triangles[triangles]
    return area_frame(nominal.surface.points, corners, np.array(_Z)).centroid


def _unit(vector: tuple[float, float, float]) -> Vectors:
    return np.asarray(np.array(vector) / np.linalg.norm(vector))


@register
@dataclass(frozen=True, eq=False, repr=False)
class Shift(DisplacementModel):
    """A translation of the selected features.

    Parameters
    ----------
    vector : (3,) float
        [mm].

    Examples
    --------
    >>> Shift((0.0, 0.0, 0.02))
    Shift(vector=(0.0, 0.0, 0.02) mm)
    """

    name: ClassVar[str] = "shift"
    vector: tuple[float, float, float] = field(metadata=MM)

    def __post_init__(self) -> None:
        """Check the vector."""
        object.__setattr__(self, "vector", vector_of(self.vector, "vector", "mm", self))

    def displacement(self, points: Points, centre: Points) -> Points:
        """Return the same vector everywhere."""
        del centre
        return np.broadcast_to(np.array(self.vector), points.shape)


@register
@dataclass(frozen=True, eq=False, repr=False)
class Tilt(DisplacementModel):
    """A small rotation of the selected features about an axis through ``centre``: u = angle axis x (p - c).

    Parameters
    ----------
    angle : float
        [rad]; the displacement is linear in it.
    axis : (3,) float
    centre : (3,) float, optional
        [mm].

    Examples
    --------
    >>> Tilt(0.001, (1, 0, 0))
    Tilt(angle=0.001 rad, axis=(1.0, 0.0, 0.0))
    """

    name: ClassVar[str] = "tilt"
    angle: float = field(metadata=RAD)
    axis: tuple[float, float, float] = _Z
    centre: tuple[float, float, float] | None = field(default=None, metadata=MM)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "angle", finite(self.angle, "angle", "rad", self))
        object.__setattr__(self, "axis", direction_of(self.axis, "axis", "", self))
        if self.centre is not None:
            object.__setattr__(self, "centre", vector_of(self.centre, "centre", "mm", self))

    def displacement(self, points: Points, centre: Points) -> Points:
        """Return angle times axis x (p - c)."""
        return np.cross(self.angle * _unit(self.axis), points - centre)


@register
@dataclass(frozen=True, eq=False, repr=False)
class Torsor(DisplacementModel):
    """A small displacement torsor: u = t + w x (p - c).

    Parameters
    ----------
    translation : (3,) float
        t [mm].
    rotation : (3,) float
        w [rad].
    centre : (3,) float, optional
        c [mm].
    """

    name: ClassVar[str] = "torsor"
    translation: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), metadata=MM)
    rotation: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), metadata=RAD)
    centre: tuple[float, float, float] | None = field(default=None, metadata=MM)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "translation", vector_of(self.translation, "translation", "mm", self))
        object.__setattr__(self, "rotation", vector_of(self.rotation, "rotation", "rad", self))
        if self.centre is not None:
            object.__setattr__(self, "centre", vector_of(self.centre, "centre", "mm", self))

    def displacement(self, points: Points, centre: Points) -> Points:
        """Return t + w x (p - c)."""
        return np.array(self.translation) + np.cross(np.array(self.rotation), points - centre)


@register
@dataclass(frozen=True, eq=False, repr=False)
class SizeOffset(DeviationModel):
    """A constant deviation: material added (+) everywhere; a hole gets smaller, a shaft larger.

    Parameters
    ----------
    offset : float
        [mm], or a share of a tolerance; on a cylinder the diameter changes by twice that.
    """

    name: ClassVar[str] = "size"
    offset: Any = field(metadata=MM)

    def __post_init__(self) -> None:
        """Check the offset."""
        object.__setattr__(self, "offset", number_or_share(self.offset, "offset", self, finite))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Return the offset everywhere."""
        needs_numbers(self)
        del features
        return FixedSampler(np.full(nominal.n_samples, self.offset))


@register
@dataclass(frozen=True, eq=False, repr=False)
class Taper(DeviationModel):
    """A deviation that grows linearly along the second surface coordinate (the axis of a cylinder or cone).

    Parameters
    ----------
    amplitude : float
        Difference between the two ends of each feature [mm]; zero in the middle.
    """

    name: ClassVar[str] = "taper"
    amplitude: Any = field(metadata=MM)

    def __post_init__(self) -> None:
        """Check the amplitude."""
        object.__setattr__(self, "amplitude", number_or_share(self.amplitude, "amplitude", self, finite))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Evaluate on every feature."""
        needs_numbers(self)
        return form_sampler(
            nominal, features, lambda f: self.amplitude * _position(surface_coordinates(f)[:, 1])
        )


def _position(height: Floats) -> Floats:
    """Position along a length, -1/2 to 1/2."""
    span = float(np.ptp(height)) if len(height) else 0.0
    return (height - 0.5 * (height.max() + height.min())) / span if span > 0 else np.zeros_like(height)


@dataclass(frozen=True, eq=False, repr=False)
class _AlongAxis(DisplacementModel):
    """A displacement that depends on the position s = -1/2 .. 1/2 along an axis."""

    def position(self, points: Points, axis: tuple[float, float, float]) -> Floats:
        """Return s of points (k, 3): their extent along the axis is one."""
        return _position(points @ _unit(axis))


@register
@dataclass(frozen=True, eq=False, repr=False)
class Bend(_AlongAxis):
    """A bow of the selected features along an axis: u = amplitude (1 - 4 s²) direction, s = -1/2 .. 1/2.

    Parameters
    ----------
    amplitude : float
        Height of the bow over its ends [mm].
    axis : (3,) float
        Along the length.
    direction : (3,) float
        To which the middle moves.
    """

    name: ClassVar[str] = "bend"
    amplitude: Any = field(metadata=MM)
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    direction: tuple[float, float, float] = _Z

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "amplitude", number_or_share(self.amplitude, "amplitude", self, finite))
        object.__setattr__(self, "axis", direction_of(self.axis, "axis", "", self))
        object.__setattr__(self, "direction", direction_of(self.direction, "direction", "", self))

    def displacement(self, points: Points, centre: Points) -> Points:
        """Return the bow at each point."""
        del centre
        bow = self.amplitude * (1.0 - 4.0 * self.position(points, self.axis) ** 2)
        return np.asarray(bow[:, None] * _unit(self.direction))


@register
@dataclass(frozen=True, eq=False, repr=False)
class Twist(_AlongAxis):
    """A twist of the selected features: the sections turn about the axis by angle times s, s = -1/2 .. 1/2.

    Parameters
    ----------
    angle : float
        Between the two ends [rad].
    axis : (3,) float
    centre : (3,) float, optional
        A point of the axis [mm].
    """

    name: ClassVar[str] = "twist"
    angle: float = field(metadata=RAD)
    axis: tuple[float, float, float] = _Z
    centre: tuple[float, float, float] | None = field(default=None, metadata=MM)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "angle", finite(self.angle, "angle", "rad", self))
        object.__setattr__(self, "axis", direction_of(self.axis, "axis", "", self))
        if self.centre is not None:
            object.__setattr__(self, "centre", vector_of(self.centre, "centre", "mm", self))

    def displacement(self, points: Points, centre: Points) -> Points:
        """Return s angle axis x (p - c)."""
        turn = self.angle * self.position(points, self.axis)
        return np.asarray(turn[:, None] * np.cross(_unit(self.axis), points - centre))


@register
@dataclass(frozen=True, eq=False, repr=False)
class Thermal(DisplacementModel):
    """Free thermal expansion from a fixed centre, with a uniform temperature gradient g.

    u = alpha ((delta_T + g . r) r - |r|² g / 2), r = p - c: the displacement without stress whose strain is
    alpha times the temperature.

    Parameters
    ----------
    delta_T : float
        Temperature over the reference temperature at the centre [K].
    alpha : float
        Coefficient of thermal expansion [1/K]; steel 11.5e-6, aluminium 23e-6.
    gradient : (3,) float
        [K/mm].
    centre : (3,) float, optional
        The point that stays [mm].

    References
    ----------
    Boley, Weiner: Theory of thermal stresses, Wiley 1960, section 9.3 (linear temperature fields).
    """

    name: ClassVar[str] = "thermal"
    delta_T: float = field(metadata={"unit": "K"})
    alpha: float = field(default=11.5e-6, metadata={"unit": "1/K"})
    gradient: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), metadata={"unit": "K/mm"})
    centre: tuple[float, float, float] | None = field(default=None, metadata=MM)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "delta_T", finite(self.delta_T, "delta_T", "K", self))
        object.__setattr__(self, "alpha", finite(self.alpha, "alpha", "1/K", self))
        object.__setattr__(self, "gradient", vector_of(self.gradient, "gradient", "K/mm", self))
        if self.centre is not None:
            object.__setattr__(self, "centre", vector_of(self.centre, "centre", "mm", self))

    def displacement(self, points: Points, centre: Points) -> Vectors:
        """Return the displacement without stress."""
        r = points - centre
        gradient = np.array(self.gradient)
        temperature = self.delta_T + r @ gradient
        squared = np.einsum("ij,ij->i", r, r)
        return np.asarray(self.alpha * (temperature[:, None] * r - 0.5 * squared[:, None] * gradient))
