"""One small rigid step from linearised distances: least squares, minimax, and what stays undetermined."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import linprog

from cadskin.errors import StatisticsError

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats

__all__ = ["chebyshev_step", "free_directions", "least_squares_step", "tukey"]

_FREE = 1e-3  # share of the largest singular value (per point) below which a motion is not determined


def tukey(scaled: Floats) -> Floats:
    """Return the biweight ``(1 - u²)²``, zero beyond 1."""
    return np.asarray((1.0 - np.minimum(np.abs(np.nan_to_num(scaled, nan=1.0)), 1.0) ** 2) ** 2)


def least_squares_step(design: Floats, distances: Floats, weights: Floats) -> Floats:
    """Return the step (k,) that minimises ``sum w (distance + design step)²``; free motions stay at rest."""
    values, vectors = np.linalg.eigh(design.T @ (design * weights[:, None]))
    good = values > _FREE**2 * max(float(values[-1]), 1e-300)
    pull = vectors.T @ (design.T @ (weights * distances))
    return np.asarray(-vectors[:, good] @ (pull[good] / values[good]))


def free_directions(design: Floats) -> Floats:
    """Return unit vectors (k, f) of the motions that leave all distances as they are."""
    values, vectors = np.linalg.eigh(design.T @ design)
    return np.asarray(vectors[:, values <= _FREE**2 * max(float(values[-1]), 1e-300)])


def chebyshev_step(design: Floats, distances: Floats) -> Floats:
    """Return the step (k,) with the least largest ``|distance + design step|``.

    Linear programs on a growing set of the worst points; done when no other point is worse.
    """
    determined = _complement(free_directions(design))
    columns = design @ determined
    chosen: Bools = np.zeros(len(distances), dtype=bool)
    step = least_squares_step(columns, distances, np.ones(len(distances)))
    for _ in range(100):
        rest = np.abs(distances + columns @ step)
        worst = np.argsort(-rest, kind="stable")[:64]
        if chosen.any() and rest[worst[0]] <= rest[chosen].max() * (1.0 + 1e-9):
            return np.asarray(determined @ step)
        chosen[worst] = True
        step = _minimax(columns[chosen], distances[chosen])
    raise StatisticsError("the minimum-zone alignment did not converge in 100 exchanges")


def _minimax(columns: Floats, distances: Floats) -> Floats:
    size = max(float(np.abs(distances).max()), 1e-12)  # the solver's tolerances are absolute
    one = np.ones((len(distances), 1))
    found = linprog(
        np.append(np.zeros(columns.shape[1]), 1.0),
        A_ub=np.block([[columns, -one], [-columns, -one]]),
        b_ub=np.concatenate([-distances, distances]) / size,
        bounds=[(None, None)] * columns.shape[1] + [(0, None)],
        method="highs",
    )
    if found.x is None:
        raise StatisticsError(f"the minimum-zone alignment failed: {found.message}")
    return np.asarray(found.x[:-1] * size)


def _complement(free: Floats) -> Floats:
    """Orthonormal basis (k, k - f) of what is not free."""
    k, f = free.shape
    if not f:
        return np.eye(k)
    return np.asarray(np.linalg.svd(free, full_matrices=True)[0][:, f:])
