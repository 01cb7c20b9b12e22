"""The place and shape of an ideal surface while it is being fitted, and small motions of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["COLUMNS", "Pose", "frame_about", "rotation"]

COLUMNS = ("tx", "ty", "tz", "rx", "ry", "rz", "s0", "s1")  # the small motions a pose knows


@dataclass(frozen=True, eq=False)
class Pose:
    """A frame and two shape numbers.

    Parameters
    ----------
    origin : (3,) float
        Origin of the frame [mm].
    axes : (3, 3) float
        Columns are the axes of the frame in the world: ``world = axes @ local + origin``.
    shape : (2,) float
        Shape numbers of the surface; see `cadskin.shape.association._kernels`.
    """

    origin: Points
    axes: Vectors
    shape: Floats

    @property
    def axis(self) -> Vectors:
        """Third axis of the frame (3,): normal of a plane, axis of a cylinder."""
        return np.ascontiguousarray(self.axes[:, 2])

    def moved(self, step: Floats) -> Pose:
        """Return the pose after a small motion ``[tx, ty, tz, rx, ry, rz, s0, s1]`` in its own frame."""
        return Pose(
            self.origin + self.axes @ step[:3],
            np.ascontiguousarray(self.axes @ rotation(step[3:6])),
            self.shape + step[6:],
        )

    def local(self, points: Points) -> Points:
        """Return the coordinates (n, 3) of world points in the frame."""
        out: Points = (points - self.origin) @ self.axes
        return out

    def tidy(self) -> Pose:
        """Return the pose with axes made orthonormal again after many products."""
        left, _, right = np.linalg.svd(self.axes)
        return Pose(self.origin, np.ascontiguousarray(left @ right), self.shape)


def rotation(vector: Floats) -> Floats:
    """Return the rotation matrix (3, 3) of a rotation vector (3,) [rad] (Rodrigues).

    Examples
    --------
    >>> rotation(np.array([0, 0, np.pi / 2])).round(12)[:, 0].tolist()
    [0.0, 1.0, 0.0]
    """
    angle = float(np.sqrt(vector @ vector))
    x, y, z = vector
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    if angle < 1e-8:  # the third-order term is below rounding
        return np.asarray(np.eye(3) + cross + 0.5 * cross @ cross)
    half = np.sin(0.5 * angle) / (0.5 * angle)
    return np.asarray(np.eye(3) + np.sin(angle) / angle * cross + 0.5 * half * half * cross @ cross)


def frame_about(axis: Vectors, first: Vectors | None = None) -> Vectors:
    """Return right-handed axes (3, 3) whose third column is ``axis``.

    Parameters
    ----------
    axis : (3,) float
        Need not be of unit length.
    first : (3,) float, optional
        Direction for the first column, made perpendicular to ``axis``.

    Raises
    ------
    AssociationError
        A zero vector, or ``first`` parallel to ``axis``.
    """
    axis = np.asarray(axis, dtype=np.float64)
    length = float(np.linalg.norm(axis))
    if not np.isfinite(length) or length == 0.0:
        raise AssociationError(f"a direction must be a finite vector that is not zero, got {axis.tolist()}")
    third = axis / length
    if first is None:
        first = np.eye(3)[int(np.argmin(np.abs(third)))]
    e1 = np.asarray(first, dtype=np.float64) - (np.asarray(first) @ third) * third
    size = float(np.linalg.norm(e1))
    if size <= 1e-12 * float(np.linalg.norm(first)):
        raise AssociationError("the two directions of a frame are parallel; they must differ")
    e1 /= size
    e1 -= (e1 @ third) * third
    e1 /= np.linalg.norm(e1)
    return np.ascontiguousarray(np.stack([e1, np.cross(third, e1), third], axis=1))
