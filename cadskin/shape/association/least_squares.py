"""Orthogonal-distance least squares (Gaussian association): Levenberg-Marquardt on all points.

References
----------
.. [1] A. B. Forbes, Least-squares best-fit geometric elements, NPL Report DITC 140/89 (1989).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association import _kernels
from cadskin.shape.association._kernels import CONE, N_COLUMNS

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors
    from cadskin.shape.association.pose import Pose

__all__ = ["fit", "principal_axes"]

_ACCELERATED = 20_000  # points up to which a second-order correction is worth its price
_EPS = float(np.finfo(np.float64).eps)


def principal_axes(points: Points) -> tuple[Points, Vectors, Floats]:
    """Return centroid (3,), principal directions as columns (3, 3), standard deviations (3,)."""
    base = np.zeros(3) if len(points) > 10_000 else points[0]
    first, second = _kernels.moments(points, base)
    centre = base + first / len(points)
    if len(points) <= 10_000:  # the eigenvalues of the squares lose half of the digits of a thin cloud
        triangle = np.linalg.qr(points - centre, mode="r")
        _, singular, right = np.linalg.svd(triangle, full_matrices=True)
        spread = np.zeros(3)
        spread[: len(singular)] = singular / np.sqrt(len(points))
        return centre, _right_handed(right.T), spread
    shift = centre - base
    values, vectors = np.linalg.eigh(second / len(points) - np.outer(shift, shift))
    spread = np.sqrt(np.maximum(values[::-1], 0.0))
    return centre, _right_handed(vectors[:, ::-1]), np.where(spread > 1e-7 * spread[0], spread, 0.0)


def _right_handed(vectors: Vectors) -> Vectors:
    out = np.ascontiguousarray(vectors, dtype=np.float64)
    if np.linalg.det(out) < 0:
        out[:, 2] *= -1
    return out


def fit(
    points: Points,
    kind: int,
    start: Pose,
    free: tuple[int, ...],
    *,
    max_iterations: int = 300,
    must_converge: bool = True,
) -> Pose:
    """Return the pose of least squared distances, from ``start``, over the ``free`` columns.

    Levenberg-Marquardt with blocked normal equations; the gradient is exact, so the solution is not limited
    by the condition of the squares.

    Raises
    ------
    AssociationError
        No convergence.
    """
    if not free:
        return start
    columns = list(free)
    pose = start
    length = max(_kernels.farthest(points, pose.origin), _EPS)
    scale = _scales(kind, length)[columns]
    square, right, total = _kernels.normal_equations(points, kind, pose.origin, pose.axes, pose.shape)
    damping, last, stalled = 0.0, np.inf, 0
    for _ in range(max_iterations):
        matrix = square[np.ix_(columns, columns)] * np.outer(scale, scale)
        side = right[columns] * scale
        step = _damped_step(matrix, side, damping)
        if damping > 0.0 and len(points) <= _ACCELERATED:
            step = step + _acceleration(points, kind, pose, columns, scale, step, matrix, damping)
        full = np.zeros(N_COLUMNS)
        full[columns] = step * scale
        trial = pose.moved(full)
        new = _kernels.normal_equations(points, kind, trial.origin, trial.axes, trial.shape)
        size = float(np.abs(step).max())
        if new[2] > total * (1 + 1e-12) + (_EPS * length) ** 2 * len(points) or not np.isfinite(new[2]):
            damping = max(10.0 * damping, 1e-4)
            if damping > 1e12:
                return pose.tidy()
            continue
        pose, (square, right, total) = trial, new
        damping = damping * 0.1 if damping > 1e-9 else 0.0
        if size <= 4 * _EPS * length or (size <= 1e-11 * length and size >= 0.5 * last and damping == 0.0):
            return pose.tidy()
        # An ill-conditioned fit ends in steps of rounding that no longer shrink nor gain anything.
        stalled = stalled + 1 if size >= 0.9 * last and -float(side @ step) <= 1e-13 * total else 0
        if stalled >= 3:
            return pose.tidy()
        last = size
    if not must_converge:
        return pose.tidy()
    raise AssociationError(
        f"the least-squares fit did not converge in {max_iterations} steps; check that the points belong to "
        "this kind of surface, or give a start"
    )


def _acceleration(
    points: Points,
    kind: int,
    pose: Pose,
    columns: list[int],
    scale: Floats,
    step: Floats,
    matrix: Floats,
    damping: float,
) -> Floats:
    """Return the second-order correction of a damped step along a curved valley, zero where it is too large.

    References
    ----------
    .. [1] M. K. Transtrum, J. P. Sethna, Improvements to the Levenberg-Marquardt algorithm for nonlinear
       least-squares minimization, arXiv:1201.5885 (geodesic acceleration).
    """
    h = 0.1
    ahead = np.zeros(N_COLUMNS)
    ahead[columns] = h * step * scale
    moved = pose.moved(ahead)
    values, jacobian = _kernels.rows(points, kind, pose.origin, pose.axes, pose.shape)
    slopes = jacobian[:, columns] * scale
    later = _kernels.distances(points, kind, moved.origin, moved.axes, moved.shape)
    bend = 2.0 / h * ((later - values) / h - slopes @ step)
    correction = 0.5 * _damped_step(matrix, slopes.T @ bend, damping)
    if not np.linalg.norm(correction) < 0.75 * np.linalg.norm(step):
        return np.zeros(len(step))
    return correction


def _damped_step(matrix: Floats, side: Floats, damping: float) -> Floats:
    diagonal = np.diag(matrix).copy()
    damped = matrix + damping * np.diag(np.maximum(diagonal, 1e-12 * diagonal.max(initial=1.0)))
    try:
        return np.asarray(-np.linalg.solve(damped, side))
    except np.linalg.LinAlgError:
        return np.asarray(-np.linalg.lstsq(damped, side, rcond=1e-13)[0])


def _scales(kind: int, length: float) -> Floats:
    scale = np.ones(N_COLUMNS)
    scale[3:6] = 1.0 / length
    if kind == CONE:
        scale[7] = 1.0 / length
    return scale
