"""Generalised Procrustes alignment of landmark configurations, without scale.

References
----------
Gower: Generalized Procrustes analysis, Psychometrika 40 (1975), doi:10.1007/BF02291478.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import StatisticsError
from cadskin.stats.rigid import RigidMotion, best_motion

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cadskin._typing import Floats, Points

__all__ = ["Procrustes", "generalised_procrustes"]


@dataclass(frozen=True, eq=False)
class Procrustes:
    """Configurations brought onto their common mean.

    Parameters
    ----------
    aligned : (n, d, 3) float
        [mm]; NaN stays NaN.
    mean : (d, 3) float
        [mm].
    motions : tuple of RigidMotion
        What each configuration was moved by.
    """

    aligned: Floats
    mean: Points
    motions: tuple[RigidMotion, ...]

    def __post_init__(self) -> None:
        """Freeze."""
        for key in ("aligned", "mean"):
            object.__setattr__(self, key, frozen(getattr(self, key), name=key, finite=False))


def generalised_procrustes(
    configurations: ArrayLike,
    *,
    weights: ArrayLike | None = None,
    tol: float = 1e-10,
    limit: int = 1000,
) -> Procrustes:
    """Move configurations rigidly so that they lie as close as they can to their mean.

    Scale is never touched: a part that is 0.1 % too large stays so. Rotation and translation are taken off,
    and with them what an orientation or position tolerance is about; the mean keeps the pose of the first.

    Parameters
    ----------
    configurations : (n, d, 3) array_like of float
        Landmarks in correspondence [mm]; NaN for a missing one.
    weights : (d,) array_like of float, optional
        Of the landmarks, for example their areas.
    tol : float
        Stop when the mean moves by less [mm].
    limit : int

    Raises
    ------
    StatisticsError
        Wrong shape, a landmark that no part has, or no convergence.
    """
    shapes = np.array(configurations, dtype=np.float64)
    if shapes.ndim != 3 or shapes.shape[2] != 3 or len(shapes) < 2:
        raise StatisticsError(f"configurations must be (n, d, 3) with n of at least 2, got {shapes.shape}")
    seen = np.asarray(np.isfinite(shapes).all(axis=2))
    if not seen.any(axis=0).all():
        raise StatisticsError(f"landmark {int(np.argmin(seen.any(axis=0)))} is missing in every part")
    motions = [RigidMotion() for _ in shapes]
    mean = _mean(shapes, seen)
    for _ in range(limit):
        for i, shape in enumerate(shapes):
            step = best_motion(shape, mean, weights)
            shapes[i] = step.apply(shape)
            motions[i] = step.after(motions[i])
        new = _mean(shapes, seen)
        moved = float(np.abs(new - mean).max())
        mean = new
        if moved < tol:
            return _in_frame_of_first(shapes, mean, motions)
    raise StatisticsError(
        f"no convergence of the Procrustes alignment in {limit} rounds (last change {moved:.3g} mm)"
    )


def _mean(shapes: Floats, seen: np.ndarray) -> Points:
    filled = np.where(seen[..., None], shapes, 0.0)
    return np.asarray(filled.sum(axis=0) / seen.sum(axis=0)[:, None])


def _in_frame_of_first(shapes: Floats, mean: Points, motions: list[RigidMotion]) -> Procrustes:
    back = motions[0].inverse
    return Procrustes(
        np.stack([back.apply(shape) for shape in shapes]),
        back.apply(mean),
        tuple(back.after(motion) for motion in motions),
    )
