"""Kriging on neighbours: two-level fields (coarse field + prolongation) and Vecchia's sequential sampler.

References
----------
Vecchia: Estimation and model identification for continuous spatial processes, J. R. Stat. Soc. B 50 (1988).
Katzfuss, Guinness: A general framework for Vecchia approximations of Gaussian processes, Statist. Sci. 36
(2021), doi:10.1214/19-STS755.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from cadskin._jit import fast_kernel, kernel
from cadskin.deviation._linear import COLUMNS, STRIP, columns_of, write_columns
from cadskin.deviation._patch_fields import DenseField, PatchField, SampledPlaces
from cadskin.deviation.kernels import correlation_of, kernel_code, squared_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints, Points

__all__ = ["VECCHIA_NEIGHBOURS", "TwoLevelField", "VecchiaField", "coarse_points"]

# Predecessors that keep the correlation error near 6e-3, measured.
VECCHIA_NEIGHBOURS = {
    "squared_exponential": 128,
    "matern52": 64,
    "matern32": 64,
    "whittle": 48,
    "exponential": 48,
}
_NUGGET = 1e-7
_VECCHIA_NUGGET = 1e-5  # smaller ones make the squared exponential worse
_STENCIL = 16  # coarse points each value is predicted from
_DENSE_COARSE = 3000  # largest coarse field that is sampled exactly


class TwoLevelField(PatchField):
    """A field on a coarse subset, carried to all points by kriging from the nearest coarse points.

    Parameters
    ----------
    points : (n, d) float
        Divided by the correlation length.
    kernel : str
    spacing : float
        Distance of the coarse points in correlation lengths.

    Attributes
    ----------
    certificate : float
        Largest kriging variance: the share of the variance that the coarse field does not determine. The
        rows are scaled to unit variance.
    """

    def __init__(self, points: Points, kernel: str, *, spacing: float = 0.25) -> None:
        scaled = np.ascontiguousarray(points, dtype=np.float64)
        chosen = coarse_points(scaled, spacing)
        coarse = scaled[chosen]
        ids = _nearest(coarse, scaled, _STENCIL)
        weights, variance = _kriging_weights(coarse, scaled, ids, kernel_code(kernel), _NUGGET)
        self.coarse = _coarse_field(coarse, kernel)
        self.latent = self.coarse.latent
        self.neighbours = self.coarse.place_of_point[np.maximum(ids, 0)]
        self.weights = weights / np.sqrt(np.maximum(1.0 - variance, 1e-9))[:, None].astype(np.float32)
        self.certificate = float(variance.max())
        self.note = (
            f"two levels, {len(coarse)} coarse points for {len(scaled)}, largest kriging variance "
            f"{self.certificate:.2g}; coarse: {self.coarse.note}"
        )

    def write(
        self, noise: NDArray[np.float32], scratch: NDArray[np.float32], places: SampledPlaces, out: Floats
    ) -> None:
        """Sample the coarse field and carry it over."""
        del scratch
        placed = (places.points, places.scale, places.samples)
        _prolong(self.neighbours, self.weights, self.coarse.columns(noise), *placed, out)


def _nearest(coarse: Points, points: Points, count: int) -> NDArray[np.int32]:
    """Return the nearest coarse points (n, count), -1 where there are fewer."""
    found = np.full((len(points), count), -1, dtype=np.int32)
    available = min(count, len(coarse))
    found[:, :available] = cKDTree(coarse).query(points, k=[*range(1, available + 1)])[1]
    return found


def kriging_interpolation(places: Points, values: Floats, points: Points) -> Floats:
    """Return values (n,) at points (n, d), kriged from those at places (k, d); smooth data of mean zero."""
    ids = _nearest(np.ascontiguousarray(places / 2), points / 2, 16)
    weights, _ = _kriging_weights(
        np.ascontiguousarray(places / 2),
        np.ascontiguousarray(points / 2),
        ids,
        kernel_code("matern52"),
        1e-6,
    )
    return np.asarray(np.einsum("ik,ik->i", weights, values[np.maximum(ids, 0)]), dtype=np.float64)


def _coarse_field(points: Points, kernel: str) -> DenseField | VecchiaField:
    if len(points) <= _DENSE_COARSE:
        return DenseField(points, kernel)
    return VecchiaField(points, kernel, neighbours=VECCHIA_NEIGHBOURS[kernel])


def coarse_points(points: Points, spacing: float) -> Ints:
    """Return one point per occupied cell of a grid, nearest to the mean of the cell (sorted indices)."""
    cells = np.floor((points - points.min(axis=0)) / spacing).astype(np.int64)
    _, cell = np.unique(cells, axis=0, return_inverse=True) if len(points) < 1000 else _cell_ids(cells)
    count = np.bincount(cell)
    centre = np.stack([np.bincount(cell, weights=column) / count for column in points.T], axis=1)
    distance = ((points - centre[cell]) ** 2).sum(axis=1)
    order = np.lexsort((np.arange(len(points)), np.round(distance, 9), cell))
    first = order[np.flatnonzero(np.diff(cell[order], prepend=-1))]
    return np.sort(first)


def _cell_ids(cells: Ints) -> tuple[Ints, Ints]:
    extent = cells.max(axis=0) + 1
    key = cells[:, 0].copy()
    for k in range(1, cells.shape[1]):
        key = key * extent[k] + cells[:, k]
    unique, inverse = np.unique(key, return_inverse=True)
    return unique, inverse


class VecchiaField(PatchField):
    """Sequential sampling: each value given its nearest predecessors, coarse points first.

    Parameters
    ----------
    points : (n, d) float
        Divided by the correlation length.
    kernel : str
    neighbours : int
        Predecessors each value is conditioned on.
    """

    def __init__(self, points: Points, kernel: str, *, neighbours: int = 48) -> None:
        scaled = np.ascontiguousarray(points, dtype=np.float64)
        self.order = coarse_to_fine_order(scaled)
        self.place_of_point = np.argsort(self.order).astype(np.uint32)
        ordered = np.ascontiguousarray(scaled[self.order])
        self.neighbours = previous_neighbours(ordered, neighbours)
        weights, variance = _kriging_weights(
            ordered, ordered, self.neighbours, kernel_code(kernel), _VECCHIA_NUGGET
        )
        self.weights = weights
        self.neighbours = np.maximum(self.neighbours, 0).astype(
            np.uint32
        )  # those that are missing have weight zero
        self.deviation = np.sqrt(np.maximum(variance, 0.0)).astype(np.float32)
        self.latent = len(scaled)
        self.note = f"Vecchia with {neighbours} neighbours for {len(scaled)} points"

    def columns(self, noise: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the fields (n, COLUMNS) in the order of the sampler."""
        values: NDArray[np.float32] = columns_of(noise)
        _sequential(self.neighbours, self.weights, self.deviation, values)
        return values

    def write(
        self, noise: NDArray[np.float32], scratch: NDArray[np.float32], places: SampledPlaces, out: Floats
    ) -> None:
        """Go through the points in their order."""
        del scratch
        write_columns(
            self.columns(noise), self.place_of_point[places.points], places.scale, places.samples, out
        )


def coarse_to_fine_order(points: Points) -> Ints:
    """Return an order in which every prefix is spread over the whole: grids of shrinking cells."""
    n = len(points)
    extent = float(np.ptp(points, axis=0).max()) or 1.0
    left = np.arange(n)
    order: list[Ints] = []
    cell = extent
    while len(left):
        chosen = coarse_points(points[left], cell)
        picked = left[chosen]
        if order:
            near, _ = cKDTree(points[np.concatenate(order)]).query(points[picked])
            chosen = chosen[near > 0.5 * cell]
            picked = left[chosen]
        if len(picked):
            order.append(picked)
            left = np.delete(left, chosen)
        if len(left) < 0.5 * n or cell < 1e-6 * extent:
            order.append(left)
            break
        cell /= math.sqrt(2.0)
    return np.concatenate(order)


def previous_neighbours(points: Points, count: int) -> NDArray[np.int32]:
    """Return the ``count`` nearest predecessors of each point (n, count), -1 where there are fewer."""
    n = len(points)
    found = np.full((n, count), -1, dtype=np.int32)
    _brute_force(points, min(n, 4 * count), found)
    start = min(n, 4 * count)
    while start < n:
        stop = min(n, start + max(start // 4, 1), start + 20_000)
        tree = cKDTree(points[:start])
        within = cKDTree(points[start:stop])
        _, before = tree.query(points[start:stop], k=count)
        _, inside = within.query(points[start:stop], k=min(count, stop - start))
        candidates = np.concatenate(
            [np.atleast_2d(before), np.atleast_2d(inside).reshape(stop - start, -1) + start], axis=1
        )
        _nearest_candidates(points, start, candidates.astype(np.int32), found)
        start = stop
    return found


@kernel
def _brute_force(points: Any, stop: int, found: Any) -> None:
    for i in range(stop):
        distance = np.zeros(i)
        for j in range(i):
            distance[j] = squared_distance(points, i, points, j)
        best = np.argsort(distance)
        for k in range(min(i, found.shape[1])):
            found[i, k] = best[k]


@kernel
def _nearest_candidates(points: Any, start: int, candidates: Any, found: Any) -> None:
    """Keep the nearest candidates that come before the point itself."""
    for row in range(candidates.shape[0]):
        i = start + row
        distance = np.full(candidates.shape[1], np.inf)
        for k in range(candidates.shape[1]):
            j = candidates[row, k]
            if j < i:
                distance[k] = squared_distance(points, i, points, j)
        best = np.argsort(distance)
        for k in range(found.shape[1]):
            if distance[best[k]] < np.inf:
                found[i, k] = candidates[row, best[k]]


@fast_kernel
def _conditional(points: Any, ids: Any, count: int, code: int, nugget: float, matrix: Any, rhs: Any) -> float:
    """Turn cross correlations in ``rhs`` into the weights of the conditional mean; return its variance."""
    for a in range(count):
        for b in range(a):
            matrix[a, b] = correlation_of(squared_distance(points, ids[a], points, ids[b]), code)
        matrix[a, a] = 1.0 + nugget
    for a in range(count):
        for b in range(a):
            total = matrix[a, b]
            for c in range(b):
                total -= matrix[a, c] * matrix[b, c]
            matrix[a, b] = total / matrix[b, b]
        total = matrix[a, a]
        for c in range(a):
            total -= matrix[a, c] * matrix[a, c]
        matrix[a, a] = math.sqrt(max(total, 1e-14))
    variance = 1.0
    for a in range(count):
        total = rhs[a]
        for c in range(a):
            total -= matrix[a, c] * rhs[c]
        rhs[a] = total / matrix[a, a]
        variance -= rhs[a] * rhs[a]
    for a in range(count - 1, -1, -1):
        total = rhs[a]
        for c in range(a + 1, count):
            total -= matrix[c, a] * rhs[c]
        rhs[a] = total / matrix[a, a]
    return variance


@kernel
def _kriging_weights(sources: Any, targets: Any, neighbours: Any, code: int, nugget: float) -> Any:
    """Weights (n, m) float32 and conditional variances (n,) of targets given neighbours among sources."""
    n, m = neighbours.shape
    weights = np.zeros((n, m), dtype=np.float32)
    variance = np.zeros(n)
    matrix = np.zeros((m, m))
    rhs = np.zeros(m)
    for i in range(n):
        count = 0
        while count < m and neighbours[i, count] >= 0:
            rhs[count] = correlation_of(squared_distance(targets, i, sources, neighbours[i, count]), code)
            count += 1
        variance[i] = _conditional(sources, neighbours[i], count, code, nugget, matrix, rhs)
        for a in range(count):
            weights[i, a] = rhs[a]
    return weights, variance


@fast_kernel
def _prolong(
    neighbours: Any, weights: Any, coarse: Any, places: Any, scale: Any, samples: Any, out: Any
) -> None:
    """out[r, samples[s]] = scale[s] sum_k weights[i, k] coarse[neighbours[i, k], r], i = places[s]."""
    strip = np.zeros((STRIP, COLUMNS), dtype=np.float32)
    for first in range(0, places.size, STRIP):
        stop = min(first + STRIP, places.size)
        for s in range(first, stop):
            _eight_terms(neighbours, weights, places[s], 0, coarse, np.float32(0.0), strip, s - first)
            _eight_terms(neighbours, weights, places[s], 8, coarse, np.float32(1.0), strip, s - first)
        for r in range(out.shape[0]):
            for s in range(first, stop):
                out[r, samples[s]] = scale[s] * strip[s - first, r]


@fast_kernel
def _eight_terms(ids: Any, weights: Any, i: int, k: int, coarse: Any, kept: Any, out: Any, line: int) -> None:
    """Add eight weighted rows of ``coarse`` to ``kept`` times a line of ``out``."""
    w0, w1, w2, w3 = weights[i, k], weights[i, k + 1], weights[i, k + 2], weights[i, k + 3]
    w4, w5, w6, w7 = weights[i, k + 4], weights[i, k + 5], weights[i, k + 6], weights[i, k + 7]
    a, b, c, d = ids[i, k], ids[i, k + 1], ids[i, k + 2], ids[i, k + 3]
    e, f, g, h = ids[i, k + 4], ids[i, k + 5], ids[i, k + 6], ids[i, k + 7]
    for r in range(COLUMNS):
        out[line, r] = kept * out[line, r] + (
            w0 * coarse[a, r] + w1 * coarse[b, r] + w2 * coarse[c, r] + w3 * coarse[d, r]
            + w4 * coarse[e, r] + w5 * coarse[f, r] + w6 * coarse[g, r] + w7 * coarse[h, r]
        )  # fmt: skip


@fast_kernel
def _sequential(neighbours: Any, weights: Any, deviation: Any, values: Any) -> None:
    """Turn noise (n, k) in place into values, each given its predecessors."""
    n, m = neighbours.shape
    for i in range(n):
        row = values[i]
        scale = deviation[i]
        for r in range(COLUMNS):
            row[r] *= scale
        for k in range(0, m, 4):
            w0, w1, w2, w3 = weights[i, k], weights[i, k + 1], weights[i, k + 2], weights[i, k + 3]
            a, b, c, d = neighbours[i, k], neighbours[i, k + 1], neighbours[i, k + 2], neighbours[i, k + 3]
            for r in range(COLUMNS):
                row[r] += w0 * values[a, r] + w1 * values[b, r] + w2 * values[c, r] + w3 * values[d, r]
