"""Fields on some nodes whose covariance is a matrix: low rank, and sequential (Vecchia).

References
----------
Katzfuss, Guinness: A general framework for Vecchia approximations of Gaussian processes, Statist. Sci. 36
(2021), doi:10.1214/19-STS755.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg.lapack import dpstrf

from cadskin._jit import fast_kernel, kernel
from cadskin.deviation._kriging import coarse_to_fine_order
from cadskin.deviation._lanes import COLUMNS, add_rows
from cadskin.deviation._linear import fill_columns
from cadskin.deviation._patch_fields import FactorField, WholeField

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Points

__all__ = ["SequentialField", "conditional", "low_rank_field"]

_NUGGET = 1e-6  # of the variance, against rounding


def low_rank_field(covariance: Floats, *, tolerance: float = 1e-4) -> FactorField:
    """Return the field of a pivoted Cholesky factor, its rows scaled to the variances of the matrix (m, m).

    It is cut where every variance that is left is below ``tolerance`` of the largest.
    """
    limit = tolerance * float(np.diag(covariance).max())
    factor, pivots, rank, _ = dpstrf(covariance, lower=1, tol=limit)
    rows = np.tril(factor)[:, :rank]
    placed = np.zeros_like(rows)
    placed[pivots - 1] = rows
    placed *= np.sqrt(np.diag(covariance) / np.einsum("ij,ij->i", placed, placed))[:, None]
    return FactorField(placed, f"{rank} terms")


class SequentialField(WholeField):
    """Each value given those before it that it is most correlated with, coarse nodes first.

    Parameters
    ----------
    covariance : (m, m) float
        The field has its variances exactly.
    points : (m, d) float
        Places of the nodes, for their order.
    neighbours : int
        A multiple of four.
    """

    def __init__(self, covariance: Floats, points: Points, *, neighbours: int) -> None:
        order = coarse_to_fine_order(points)
        self.place_of_point = np.argsort(order).astype(np.uint32)
        deviation = np.sqrt(np.diag(covariance)[order])
        correlation = covariance[np.ix_(order, order)] / deviation / deviation[:, None]
        self.latent = len(order)
        self.neighbours = _most_correlated(correlation, neighbours)
        self.weights, variance = _conditionals(correlation, self.neighbours, _NUGGET)
        self.deviation = np.sqrt(variance).astype(np.float32)
        self.note = f"each given {neighbours} others"
        rescale = deviation / np.sqrt(self._variance())
        self.weights *= (rescale[:, None] / rescale[self.neighbours]).astype(np.float32)
        self.deviation *= rescale.astype(np.float32)

    def columns(self, noise: NDArray[np.float32], scratch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Go through the nodes in their order."""
        fill_columns(noise, scratch)
        _sequential(self.neighbours, self.weights, self.deviation, scratch)
        return scratch

    def _variance(self) -> Floats:
        """Variance of the values (m,)."""
        total = np.zeros(self.latent)
        for first in range(0, self.latent, COLUMNS):
            values = np.zeros((self.latent, COLUMNS), dtype=np.float32)
            mine = np.arange(first, min(first + COLUMNS, self.latent))
            values[mine, mine - first] = 1.0
            _sequential(self.neighbours, self.weights, self.deviation, values)
            total += np.einsum("ij,ij->i", values, values)
        return total


@kernel
def _most_correlated(correlation: Any, count: int) -> Any:
    """Return the predecessors (n, count) of each entry with the largest correlation; 0 where they lack."""
    n = correlation.shape[0]
    found = np.zeros((n, count), dtype=np.uint32)
    for i in range(n):
        if i <= count:
            for k in range(i):
                found[i, k] = k
            continue
        row = -np.abs(correlation[i, :i])
        limit = np.partition(row, count - 1)[count - 1]
        at = 0
        for k in range(i):
            if row[k] < limit:
                found[i, at] = k
                at += 1
        for k in range(i):
            if row[k] == limit and at < count:
                found[i, at] = k
                at += 1
    return found


@kernel
def _conditionals(correlation: Any, neighbours: Any, nugget: float) -> Any:
    """Weights (n, m) of the conditional means, those that lack zero, and conditional variances (n,)."""
    n, width = neighbours.shape
    weights = np.zeros((n, width), dtype=np.float32)
    variance = np.ones(n)
    matrix = np.zeros((width, width))
    right = np.zeros(width)
    for i in range(1, n):
        count = min(i, width)
        ids = neighbours[i]
        for a in range(count):
            right[a] = correlation[i, ids[a]]
            for b in range(a + 1):
                matrix[a, b] = correlation[ids[a], ids[b]]
            matrix[a, a] = 1.0 + nugget
        variance[i] = max(1.0 - conditional(matrix, right, count), nugget)
        for a in range(count):
            weights[i, a] = right[a]
    return weights, variance


@fast_kernel
def conditional(matrix: Any, right: Any, count: int) -> float:
    """Turn covariances with ``count`` known values into the weights of the conditional mean.

    ``matrix``, of which the lower triangle is read, is lost. Returns the variance that they explain.
    """
    for a in range(count):
        for b in range(a):
            total = matrix[a, b]
            for c in range(b):
                total -= matrix[a, c] * matrix[b, c]
            matrix[a, b] = total / matrix[b, b]
        total = matrix[a, a]
        for c in range(a):
            total -= matrix[a, c] * matrix[a, c]
        matrix[a, a] = np.sqrt(max(total, 1e-14))
    explained = 0.0
    for a in range(count):
        total = right[a]
        for c in range(a):
            total -= matrix[a, c] * right[c]
        right[a] = total / matrix[a, a]
        explained += right[a] * right[a]
    for a in range(count - 1, -1, -1):
        total = right[a]
        for c in range(a + 1, count):
            total -= matrix[c, a] * right[c]
        right[a] = total / matrix[a, a]
    return explained


@fast_kernel
def _sequential(neighbours: Any, weights: Any, deviation: Any, values: Any) -> None:
    """Turn noise (m, COLUMNS) in place into values, each given its predecessors."""
    for i in range(values.shape[0]):
        add_rows(values, neighbours, weights, i, deviation[i], values, i)
