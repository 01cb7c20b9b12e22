"""Rigid motions of measured parts: value object, best motion of paired points, small steps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import StatisticsError
from cadskin.shape.association.pose import rotation

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cadskin._typing import Floats, Points, Vectors

__all__ = ["RigidMotion", "best_motion", "small_motion"]


@dataclass(frozen=True, eq=False)
class RigidMotion:
    """A rotation and a translation, never a scale: ``moved = rotation @ point + translation``.

    Parameters
    ----------
    rotation : (3, 3) float
    translation : (3,) float
        [mm].

    Raises
    ------
    StatisticsError
        A matrix that is not a proper rotation to 1e-6.

    Examples
    --------
    >>> RigidMotion(translation=[1, 0, 0]).apply(np.zeros((1, 3))).tolist()
    [[1.0, 0.0, 0.0]]
    """

    rotation: Floats = field(default_factory=lambda: np.eye(3))
    translation: Vectors = field(default_factory=lambda: np.zeros(3))

    def __post_init__(self) -> None:
        """Check and freeze; rounding is taken off the rotation."""
        matrix = frozen(self.rotation, shape=(3, 3), name="rotation")
        left, stretch, right = np.linalg.svd(matrix)
        if np.abs(stretch - 1).max() > 1e-6 or np.linalg.det(matrix) < 0:
            raise StatisticsError(
                "a rigid motion has a proper rotation matrix, without scale or mirror; "
                f"this one has stretches {stretch.round(6).tolist()}, determinant {np.linalg.det(matrix):.6g}"
            )
        object.__setattr__(self, "rotation", frozen(left @ right))
        object.__setattr__(self, "translation", frozen(self.translation, shape=(3,), name="translation"))

    def apply(self, points: ArrayLike) -> Points:
        """Return the moved points (n, 3) [mm]."""
        return np.asarray(np.asarray(points, dtype=np.float64) @ self.rotation.T + self.translation)

    def after(self, first: RigidMotion) -> RigidMotion:
        """Return the motion that does ``first`` and then this one."""
        return RigidMotion(
            self.rotation @ first.rotation, self.rotation @ first.translation + self.translation
        )

    @property
    def inverse(self) -> RigidMotion:
        """The motion back."""
        return RigidMotion(self.rotation.T, -self.rotation.T @ self.translation)

    @property
    def angle(self) -> float:
        """Angle of the rotation [rad]."""
        matrix = self.rotation
        vector = np.array(
            [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
        )
        return float(np.arctan2(0.5 * np.linalg.norm(vector), 0.5 * (np.trace(matrix) - 1.0)))


def small_motion(step: Floats, centre: Points) -> RigidMotion:
    """Return the motion of ``[tx, ty, tz, rx, ry, rz]`` [mm, rad] about ``centre`` (3,)."""
    turn = rotation(np.asarray(step[3:], dtype=np.float64))
    return RigidMotion(turn, centre - turn @ centre + step[:3])


def best_motion(source: ArrayLike, target: ArrayLike, weights: ArrayLike | None = None) -> RigidMotion:
    """Return the rigid motion of least squares between paired points.

    Parameters
    ----------
    source, target : (n, 3) array_like of float
        [mm]; pairs with NaN are left out.
    weights : (n,) array_like of float, optional

    Raises
    ------
    StatisticsError
        Fewer than three pairs.

    References
    ----------
    Kabsch, Acta Cryst. A 34 (1978), doi:10.1107/S0567739478001680.
    """
    a, b = np.asarray(source, dtype=np.float64), np.asarray(target, dtype=np.float64)
    w = np.ones(len(a)) if weights is None else np.asarray(weights, dtype=np.float64)
    seen = np.isfinite(a).all(axis=1) & np.isfinite(b).all(axis=1) & (w > 0)
    if seen.sum() < 3:
        raise StatisticsError(f"a rigid motion needs three pairs of points, there are {int(seen.sum())}")
    a, b, w = a[seen], b[seen], w[seen] / w[seen].sum()
    mean_a, mean_b = w @ a, w @ b
    left, _, right = np.linalg.svd((a - mean_a).T @ ((b - mean_b) * w[:, None]))
    proper = np.diag([1.0, 1.0, np.sign(np.linalg.det(right.T @ left.T))])
    turn = right.T @ proper @ left.T
    return RigidMotion(turn, mean_b - turn @ mean_a)
