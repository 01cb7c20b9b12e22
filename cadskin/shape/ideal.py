"""Ideal surfaces of features (ISO 17450-1, ISO 22432): what the CAD model says a face is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Literal, TypeAlias

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import GeometryError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["Cone", "Cylinder", "Freeform", "IdealSurface", "Plane", "Sphere", "SurfaceKind", "Torus"]

SurfaceKind: TypeAlias = Literal[
    "plane", "cylinder", "cone", "sphere", "torus", "bspline", "revolution", "extrusion", "offset", "other"
]


def _unit(vector: Vectors, name: str) -> Vectors:
    array = np.asarray(vector, dtype=np.float64)
    length = float(np.linalg.norm(array))
    if array.shape != (3,) or not np.isfinite(length) or length == 0.0:
        raise GeometryError(
            f"{name} must be a vector of three finite numbers that is not zero, got {vector!r}"
        )
    return frozen(array / length)


def _positive(value: float, name: str) -> float:
    if not (np.isfinite(value) and value > 0):
        raise GeometryError(f"{name} must be positive and finite, got {value}")
    return float(value)


@dataclass(frozen=True, eq=False)
class Plane:
    """A plane: ``origin`` (3,) [mm] and unit ``normal`` (3,), out of the material."""

    kind: ClassVar[SurfaceKind] = "plane"
    origin: Points
    normal: Vectors

    def __post_init__(self) -> None:
        """Check and freeze."""
        object.__setattr__(self, "origin", frozen(self.origin, shape=(3,), name="origin"))
        object.__setattr__(self, "normal", _unit(self.normal, "normal"))

    def distance(self, points: Points) -> Floats:
        """Signed distance (k,) [mm] of points (k, 3), positive on the side of the normal."""
        return np.asarray((points - self.origin) @ self.normal)


@dataclass(frozen=True, eq=False)
class Cylinder:
    """A cylinder: a point of the axis ``origin`` (3,) [mm], unit ``axis`` (3,), ``radius`` [mm]."""

    kind: ClassVar[SurfaceKind] = "cylinder"
    origin: Points
    axis: Vectors
    radius: float

    def __post_init__(self) -> None:
        """Check and freeze."""
        object.__setattr__(self, "origin", frozen(self.origin, shape=(3,), name="origin"))
        object.__setattr__(self, "axis", _unit(self.axis, "axis"))
        object.__setattr__(self, "radius", _positive(self.radius, "radius"))

    def distance(self, points: Points) -> Floats:
        """Signed distance (k,) [mm], positive outside of the cylinder."""
        return _radii(points, self.origin, self.axis)[0] - self.radius


@dataclass(frozen=True, eq=False)
class Cone:
    """A cone: ``apex`` (3,) [mm], unit ``axis`` (3,) from the apex into the cone, ``half_angle`` [rad]."""

    kind: ClassVar[SurfaceKind] = "cone"
    apex: Points
    axis: Vectors
    half_angle: float

    def __post_init__(self) -> None:
        """Check and freeze."""
        object.__setattr__(self, "apex", frozen(self.apex, shape=(3,), name="apex"))
        object.__setattr__(self, "axis", _unit(self.axis, "axis"))
        if not 0 < self.half_angle < np.pi / 2:
            raise GeometryError(f"half_angle must be between 0 and pi/2, got {self.half_angle}")

    def distance(self, points: Points) -> Floats:
        """Signed distance (k,) [mm] to the nappe that the axis points into, positive outside."""
        radius, height = _radii(points, self.apex, self.axis)
        sine, cosine = np.sin(self.half_angle), np.cos(self.half_angle)
        behind = height * cosine + radius * sine < 0  # nearest point is the apex
        return np.where(behind, np.hypot(radius, height), radius * cosine - height * sine)


@dataclass(frozen=True, eq=False)
class Sphere:
    """A sphere: ``centre`` (3,) [mm], ``radius`` [mm]."""

    kind: ClassVar[SurfaceKind] = "sphere"
    centre: Points
    radius: float

    def __post_init__(self) -> None:
        """Check and freeze."""
        object.__setattr__(self, "centre", frozen(self.centre, shape=(3,), name="centre"))
        object.__setattr__(self, "radius", _positive(self.radius, "radius"))

    def distance(self, points: Points) -> Floats:
        """Signed distance (k,) [mm], positive outside."""
        return np.asarray(np.linalg.norm(points - self.centre, axis=1) - self.radius)


@dataclass(frozen=True, eq=False)
class Torus:
    """A torus: ``centre`` (3,) [mm], unit ``axis`` (3,), ``major_radius`` and ``minor_radius`` [mm]."""

    kind: ClassVar[SurfaceKind] = "torus"
    centre: Points
    axis: Vectors
    major_radius: float
    minor_radius: float

    def __post_init__(self) -> None:
        """Check and freeze."""
        object.__setattr__(self, "centre", frozen(self.centre, shape=(3,), name="centre"))
        object.__setattr__(self, "axis", _unit(self.axis, "axis"))
        object.__setattr__(self, "major_radius", _positive(self.major_radius, "major_radius"))
        object.__setattr__(self, "minor_radius", _positive(self.minor_radius, "minor_radius"))

    def distance(self, points: Points) -> Floats:
        """Signed distance (k,) [mm] to the tube, positive outside of it."""
        radius, height = _radii(points, self.centre, self.axis)
        return np.hypot(radius - self.major_radius, height) - self.minor_radius


@dataclass(frozen=True)
class Freeform:
    """A surface without a closed form here: B-spline, revolution, extrusion, offset or other.

    Its exact points, normals and curvatures stand at the feature's samples; it has no ``distance``.
    """

    kind: SurfaceKind = "bspline"


IdealSurface: TypeAlias = Plane | Cylinder | Cone | Sphere | Torus | Freeform


def _radii(points: Points, origin: Points, axis: Vectors) -> tuple[Floats, Floats]:
    """Distance to an axis and height along it, for points (k, 3)."""
    relative = np.asarray(points) - origin
    height = relative @ axis
    return np.linalg.norm(relative - height[:, None] * axis, axis=1), height
