"""Kriging on neighbours: two-level fields (coarse field + prolongation) and Vecchia's sequential sampler.

References
----------
Vecchia: Estimation and model identification for continuous spatial processes, J. R. Stat. Soc. B 50 (1988).
Katzfuss, Guinness: A general framework for Vecchia approximations of Gaussian processes, Statist. Sci. 36
(2021), doi:10.1214/19-STS755.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from cadskin._jit import fast_kernel, kernel
from cadskin.deviation._lanes import COLUMNS, add_rows
from cadskin.deviation._linear import STRIP, fill_columns, write_columns
from cadskin.deviation._patch_fields import (
    DenseField,
    FactorField,
    PatchField,
    SampledPlaces,
    WholeField,
    low_rank_factor,
)
from cadskin.deviation.kernels import correlation_of, kernel_code, squared_distance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints, Points

__all__ = ["TwoLevelField", "VecchiaField", "coarse_points", "kriging_interpolation"]

# Predecessors (multiples of 4) of points whose level is spaced more than so many correlation lengths, the
# coarsest first. In brackets the error of the correlation, measured: docs/deviations.md.
VECCHIA_STAGES: dict[str, tuple[tuple[float, int], ...]] = {
    "squared_exponential": ((0.0, 128),),
    "matern52": ((0.3, 128), (0.15, 64), (0.0, 20)),  # 1e-3
    "matern32": ((0.25, 64), (0.12, 32), (0.0, 16)),  # 4e-3
    "whittle": ((0.1, 48), (0.0, 20)),  # 4e-3
    "exponential": ((0.03, 48), (0.0, 24)),  # 8e-3
}
_NUGGET = 1e-7
_VECCHIA_NUGGET = {"squared_exponential": 1e-5, "matern52": 1e-6}  # smaller ones make these worse
_STENCIL = 20  # coarse points each value is predicted from
_DENSE_COARSE = 3000  # largest coarse field that is sampled exactly
_DEFECT = 1e-5  # variance that a coarse field of low rank may lack


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

    def __init__(self, points: Points, kernel: str, *, spacing: float = 0.2) -> None:
        scaled = np.ascontiguousarray(points, dtype=np.float64)
        chosen = coarse_points(scaled, spacing)
        coarse = scaled[chosen]
        ids = _nearest(coarse, scaled, _STENCIL)
        weights, variance = _kriging_weights(coarse, scaled, ids, kernel_code(kernel), _NUGGET)
        self.coarse = _coarse_field(coarse, kernel)
        self.latent = self.coarse.latent
        self.neighbours = self.coarse.place_of_point[np.maximum(ids, 0)]  # missing ones have weight zero
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
        coarse = self.coarse.columns(noise, scratch[: len(self.coarse.place_of_point)])
        placed = (places.points, places.scale, places.samples)
        _prolong(self.neighbours, self.weights, coarse, *placed, out)


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


def _coarse_field(points: Points, kernel: str) -> WholeField:
    if kernel == "squared_exponential":
        factor, defect = low_rank_factor(points, kernel, tolerance=_DEFECT, max_rank=len(points) // 3)
        if defect <= _DEFECT:
            return FactorField(factor, f"{factor.shape[1]} Karhunen-Loeve terms")
    if len(points) <= _DENSE_COARSE:
        return DenseField(points, kernel)
    return VecchiaField(points, kernel)


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


class VecchiaField(WholeField):
    """Sequential sampling: each value given its nearest predecessors, coarse points first.

    The coarse points, whose values are far from determined by their predecessors, need many of them to keep
    the law; between close neighbours few are enough (`VECCHIA_STAGES`).

    Parameters
    ----------
    points : (n, d) float
        Divided by the correlation length.
    kernel : str
    """

    def __init__(self, points: Points, kernel: str) -> None:
        scaled = np.ascontiguousarray(points, dtype=np.float64)
        levels = coarse_to_fine_levels(scaled)
        order = np.concatenate([level.points for level in levels])
        ordered = np.ascontiguousarray(scaled[order])
        self.place_of_point = np.argsort(order).astype(np.uint32)
        self.stages = [
            _stage(ordered, kernel, *bounds) for bounds in _bounds_of_stages(levels, VECCHIA_STAGES[kernel])
        ]
        self.latent = len(scaled)
        mean = sum(stage.neighbours.size for stage in self.stages) / max(len(scaled), 1)
        self.note = f"Vecchia with {mean:.0f} neighbours on average for {len(scaled)} points"

    def columns(self, noise: NDArray[np.float32], scratch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Go through the points in the order of the sampler."""
        fill_columns(noise, scratch)
        for stage in self.stages:
            _sequential(stage.neighbours, stage.weights, stage.deviation, stage.start, scratch)
        return scratch


@dataclass(frozen=True, eq=False)
class _Stage:
    """Points from ``start`` on with their predecessors (k, m), weights (k, m) and conditional deviations."""

    start: int
    neighbours: NDArray[np.uint32]
    weights: NDArray[np.float32]
    deviation: NDArray[np.float32]


def _stage(ordered: Points, kernel: str, start: int, stop: int, count: int) -> _Stage:
    ids = previous_neighbours(ordered, start, stop, count)
    nugget = _VECCHIA_NUGGET.get(kernel, 1e-5)
    weights, variance = _kriging_weights(ordered, ordered[start:stop], ids, kernel_code(kernel), nugget)
    return _Stage(
        start,
        np.maximum(ids, 0).astype(np.uint32),  # those that are missing have weight zero
        weights,
        np.sqrt(np.maximum(variance, 0.0)).astype(np.float32),
    )


@dataclass(frozen=True, eq=False)
class Level:
    """Points (k,) that are added at a spacing."""

    spacing: float
    points: Ints


def _bounds_of_stages(
    levels: Sequence[Level], stages: Sequence[tuple[float, int]]
) -> list[tuple[int, int, int]]:
    """Return start, stop and number of predecessors of runs of levels."""
    bounds: list[tuple[int, int, int]] = []
    start = 0
    for level in levels:
        stop = start + len(level.points)
        count = next((count for spacing, count in stages if level.spacing > spacing), stages[-1][1])
        if bounds and bounds[-1][2] == count:
            bounds[-1] = (bounds[-1][0], stop, count)
        else:
            bounds.append((start, stop, count))
        start = stop
    return bounds


def coarse_to_fine_levels(points: Points) -> list[Level]:
    """Return the points in an order in which every prefix is spread over the whole: grids of shrinking cells.

    The last level holds what is left, half of the points or less.
    """
    n = len(points)
    extent = float(np.ptp(points, axis=0).max()) or 1.0
    left = np.arange(n)
    levels: list[Level] = []
    cell = extent
    while len(left):
        chosen = coarse_points(points[left], cell)
        if levels:
            before = points[np.concatenate([level.points for level in levels])]
            near, _ = cKDTree(before).query(points[left[chosen]])
            chosen = chosen[near > 0.5 * cell]
        if len(chosen):
            levels.append(Level(cell, left[chosen]))
            left = np.delete(left, chosen)
        cell /= math.sqrt(2.0)
        if len(left) < 0.5 * n or cell < 1e-6 * extent:
            levels.append(Level(cell, left))
            break
    return levels


def coarse_to_fine_order(points: Points) -> Ints:
    """Return the points of all levels, one level after the other."""
    return np.concatenate([level.points for level in coarse_to_fine_levels(points)])


def previous_neighbours(points: Points, start: int, stop: int, count: int) -> NDArray[np.int32]:
    """Return the ``count`` nearest predecessors of points start to stop, -1 where there are fewer."""
    found = np.full((stop - start, count), -1, dtype=np.int32)
    few = min(stop, 4 * count)
    if start < few:
        _brute_force(points, start, few, found)
    place = max(start, few)
    while place < stop:
        end = min(stop, place + max(place // 4, 1), place + 20_000)
        tree = cKDTree(points[:place])
        within = cKDTree(points[place:end])
        _, before = tree.query(points[place:end], k=count)
        _, inside = within.query(points[place:end], k=min(count, end - place))
        candidates = np.concatenate([before, inside.reshape(end - place, -1) + place], axis=1)
        _nearest_candidates(points, place, candidates.astype(np.int32), found[place - start : end - start])
        place = end
    return found


@kernel
def _brute_force(points: Any, start: int, stop: int, found: Any) -> None:
    for i in range(start, stop):
        distance = np.zeros(i)
        for j in range(i):
            distance[j] = squared_distance(points, i, points, j)
        best = np.argsort(distance)
        for k in range(min(i, found.shape[1])):
            found[i - start, k] = best[k]


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
                found[row, k] = candidates[row, best[k]]


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


@kernel
def _prolong(
    neighbours: Any, weights: Any, coarse: Any, places: Any, scale: Any, samples: Any, out: Any
) -> None:
    """out[r, samples[s]] = scale[s] sum_k weights[i, k] coarse[neighbours[i, k], r], i = places[s]."""
    strip = np.zeros((STRIP, COLUMNS), dtype=np.float32)
    lines = np.arange(STRIP).astype(np.uint32)
    for first in range(0, places.size, STRIP):
        stop = min(first + STRIP, places.size)
        for s in range(first, stop):
            add_rows(coarse, neighbours, weights, places[s], np.float32(0.0), strip, s - first)
        write_columns(strip, lines[: stop - first], scale[first:stop], samples[first:stop], out)


@kernel
def _sequential(neighbours: Any, weights: Any, deviation: Any, start: int, values: Any) -> None:
    """Turn noise (n, COLUMNS) from ``start`` on in place into values, each given its predecessors."""
    for i in range(neighbours.shape[0]):
        add_rows(values, neighbours, weights, i, deviation[i], values, start + i)
