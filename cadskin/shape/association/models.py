"""Distance models: points against one ideal surface, or against patches that move together."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol, TypeAlias

import numpy as np

from cadskin.shape.association import _kernels
from cadskin.shape.association.pose import Pose

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Vectors

__all__ = [
    "FREEFORM",
    "ClosestPoints",
    "CompositeModel",
    "DistanceModel",
    "Patch",
    "SurfaceModel",
    "concatenate",
]

# (n, 3) points in the patch's frame -> signed distances (n,), unit normals at the foot points (n, 3)
ClosestPoints: TypeAlias = "Callable[[Points], tuple[Floats, Vectors]]"
FREEFORM = -1  # kind of a patch that is given by a function


class DistanceModel(Protocol):
    """Points and their signed distances to a surface at a `Pose`."""

    def __len__(self) -> int:
        """Return the number of points."""

    def take(self, ids: Ints) -> DistanceModel:
        """Return the model of some of the points."""

    def distances(self, pose: Pose) -> Floats:
        """Return the signed distances (n,) [mm]."""

    def rows(self, pose: Pose) -> tuple[Floats, Floats]:
        """Return the signed distances (n,) and their Jacobian (n, 8) in the columns of a pose."""

    def length(self, pose: Pose) -> float:
        """Return the largest distance of a point from the origin of the pose [mm]."""

    def angular_shape(self) -> bool:
        """Tell whether the second shape number is an angle."""

    def bend(self, pose: Pose) -> float:
        """Return the smallest radius of curvature of a distance at the points [mm]; infinite for a plane."""


@dataclass(frozen=True, eq=False)
class SurfaceModel:
    """Points (n, 3) against one ideal surface ``kind`` (see `_kernels`)."""

    kind: int
    points: Points

    def __len__(self) -> int:
        return len(self.points)

    def take(self, ids: Ints) -> SurfaceModel:
        """Return the model of some of the points."""
        return replace(self, points=np.ascontiguousarray(self.points[ids]))

    def distances(self, pose: Pose) -> Floats:
        """Return the signed distances (n,) [mm]."""
        out: Floats = _kernels.distances(self.points, self.kind, pose.origin, pose.axes, pose.shape)
        return out

    def rows(self, pose: Pose) -> tuple[Floats, Floats]:
        """Return distances (n,) and Jacobian (n, 8)."""
        distance, jacobian = _kernels.rows(self.points, self.kind, pose.origin, pose.axes, pose.shape)
        return distance, jacobian

    def length(self, pose: Pose) -> float:
        """Return the largest distance of a point from the origin of the pose [mm]."""
        return _reach(self.points, pose)

    def angular_shape(self) -> bool:
        """Tell whether the second shape number is an angle."""
        return self.kind == _kernels.CONE

    def bend(self, pose: Pose) -> float:
        """Return the smallest distance of a point from the axis, centre or centre line [mm]."""
        if self.kind == _kernels.PLANE:
            return np.inf
        if self.kind == _kernels.CONE:
            across = pose.local(self.points)[:, :2]
            return float(np.linalg.norm(across, axis=1).min())
        return float(self.distances(pose).min() + pose.shape[0])


@dataclass(frozen=True, eq=False)
class Patch:
    """One surface in the nominal frame.

    Parameters
    ----------
    kind : int
        An ideal surface, or `FREEFORM`.
    place : Pose
        Its own frame and shape numbers, in the nominal frame.
    sign : float
        +1 where the surface's own normal points out of the material, -1 where it points into it.
    offset : float
        Subtracted from the signed distance [mm].
    closest : callable, optional
        Distances and normals of a `FREEFORM` patch.
    """

    kind: int
    place: Pose
    sign: float = 1.0
    offset: float = 0.0
    closest: ClosestPoints | None = None

    def rows(self, points: Points, placed: Pose) -> tuple[Floats, Vectors]:
        """Return distances (n,) and normals (n, 3) in the patch's frame, which stands at ``placed``."""
        if self.closest is not None:
            values, normals = self.closest(placed.local(points))
        else:
            values, jacobian = SurfaceModel(self.kind, np.ascontiguousarray(points)).rows(placed)
            normals = -jacobian[:, :3]
        return self.sign * values - self.offset, self.sign * normals

    def distances(self, points: Points, placed: Pose) -> Floats:
        """Return the distances (n,) of points to the patch, whose frame stands at ``placed``."""
        if self.closest is not None:
            return self.rows(points, placed)[0]
        return (
            self.sign * SurfaceModel(self.kind, np.ascontiguousarray(points)).distances(placed) - self.offset
        )


@dataclass(frozen=True, eq=False)
class CompositeModel:
    """Points (n, 3) against patches that move together; ``owner`` (n,) is the patch of each point."""

    patches: tuple[Patch, ...]
    points: Points
    owner: Ints

    def __len__(self) -> int:
        return len(self.points)

    def take(self, ids: Ints) -> CompositeModel:
        """Return the model of some of the points."""
        return replace(self, points=self.points[ids], owner=self.owner[ids])

    def _parts(self, pose: Pose) -> list[tuple[Patch, Ints, Pose]]:
        found = []
        for index, patch in enumerate(self.patches):
            ids = np.flatnonzero(self.owner == index)
            if len(ids):
                axes = np.ascontiguousarray(pose.axes @ patch.place.axes)
                origin = pose.origin + pose.axes @ patch.place.origin
                found.append((patch, ids, Pose(origin, axes, patch.place.shape)))
        return found

    def distances(self, pose: Pose) -> Floats:
        """Return the signed distances (n,) [mm]."""
        out = np.zeros(len(self))
        for patch, ids, placed in self._parts(pose):
            out[ids] = patch.distances(self.points[ids], placed)
        return out

    def rows(self, pose: Pose) -> tuple[Floats, Floats]:
        """Return distances (n,) and Jacobian (n, 8)."""
        out, normals = np.zeros(len(self)), np.zeros((len(self), 3))
        for patch, ids, placed in self._parts(pose):
            out[ids], local = patch.rows(self.points[ids], placed)
            normals[ids] = local @ patch.place.axes.T
        return out, _rigid_jacobian(pose.local(self.points), normals)

    def length(self, pose: Pose) -> float:
        """Return the largest distance of a point from the origin of the pose [mm]."""
        return _reach(self.points, pose)

    def angular_shape(self) -> bool:
        """Tell whether the second shape number is an angle."""
        return False

    def bend(self, pose: Pose) -> float:
        """Return the smallest radius of curvature of a distance at the points [mm]."""
        bends = [
            SurfaceModel(patch.kind, np.ascontiguousarray(self.points[ids])).bend(placed)
            for patch, ids, placed in self._parts(pose)
            if patch.kind != FREEFORM
        ]
        return min(bends, default=np.inf)


def concatenate(parts: Sequence[tuple[Patch, Points]]) -> CompositeModel:
    """Return the composite of patches, each with its own points."""
    owner = np.repeat(np.arange(len(parts)), [len(points) for _, points in parts])
    stacked = np.concatenate([np.asarray(points, dtype=np.float64).reshape(-1, 3) for _, points in parts])
    return CompositeModel(tuple(patch for patch, _ in parts), stacked, owner)


def _rigid_jacobian(local: Points, normals: Points) -> Floats:
    jacobian = np.zeros((len(local), _kernels.N_COLUMNS))
    jacobian[:, :3] = -normals
    jacobian[:, 3:6] = -np.cross(local, normals)
    return jacobian


def _reach(points: Points, pose: Pose) -> float:
    return float(_kernels.farthest(points, pose.origin))
