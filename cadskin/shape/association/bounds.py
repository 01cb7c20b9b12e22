"""Global certificates of enclosing cylinders, and what an open arc rules out."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points

__all__ = ["enclosing_line_bound", "is_arc_open", "widest_weights"]


def enclosing_line_bound(points: Points, weights: Floats) -> float:
    """Return a lower bound of the radius of every cylinder that encloses the points [mm].

    For weights w >= 0 of sum 1 and every line, ``max dist² >= sum w dist² >= trace(M) - lambda_max(M)`` with
    M the weighted second moments about the weighted mean.
    """
    weights = weights / weights.sum()
    centred = points - weights @ points
    moments = (centred * weights[:, None]).T @ centred
    eigenvalues = np.linalg.eigvalsh(moments)
    return float(np.sqrt(max(eigenvalues[0] + eigenvalues[1], 0.0)))


def widest_weights(jacobian: Floats, height: Floats) -> Floats | None:
    """Return the Kuhn-Tucker multipliers (n,) of tied points whose heights along the axis spread most.

    Where more points touch an enclosing cylinder than it has freedoms, the multipliers are not unique; the
    dual bound needs those for which the axis is the direction of the largest moment.
    """
    from scipy.optimize import linprog

    matrix = np.concatenate([jacobian.T, np.ones((1, len(height)))])
    right = np.zeros(len(matrix))
    right[-1] = 1.0
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    size = float(np.ptp(height))
    if size < 1e-9:
        return None  # all contacts at one height: the bound is that of their circle
    weights, mean = np.zeros(0), 0.5 * float(height.min() + height.max())
    for _ in range(20):  # Frank and Wolfe on the variance of the heights, exact line search
        cost = -((height - mean) ** 2) / size**2
        found = linprog(cost, A_eq=matrix, b_eq=right, bounds=(0, None), method="highs", options=options)
        if found.x is None:
            return None
        if not len(weights):
            weights = found.x
        else:
            ahead = found.x - weights
            rise, bend = (
                float(-cost @ ahead),
                float(height @ ahead / size) ** 2,
            )
            if rise <= 1e-12:
                break
            weights = weights + min(1.0, rise / (2.0 * bend) if bend > 0 else 1.0) * ahead
        mean = float(weights @ height)
    used = weights > 1e-9
    left = right - matrix @ weights
    weights[used] += np.linalg.lstsq(matrix[:, used], left, rcond=None)[0]
    return np.asarray(np.maximum(weights, 0.0))


def is_arc_open(across: Floats) -> tuple[bool, float]:
    """Tell whether points (n, 2) around a centre leave a gap of 180 degrees or more.

    Returns
    -------
    open : bool
    gap : float
        The largest angle without a point [rad].
    """
    angles = np.sort(np.arctan2(across[:, 1], across[:, 0]))
    gap = float(np.diff(angles, append=angles[0] + 2 * np.pi).max())
    return gap >= np.pi * (1 - 1e-12), gap
