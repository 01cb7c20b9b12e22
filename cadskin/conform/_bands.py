"""Compiled kernels of bands: how wide a band must be to hold heights, and which points say so.

Three kinds of band, by the number of its free parameters: ``0`` a fixed one about zero (position), ``1`` one
of fixed direction and free level (orientation), ``3`` a free one (flatness). The width is a seminorm of the
heights, the largest of linear functionals of at most four points: `facet` returns the one that counts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cadskin._jit import fast_kernel, kernel

__all__ = ["CLOSED", "Bands", "exchange", "facet", "first_reference", "widest"]

CLOSED = 1e-9  # relative gap at which the bounds count as equal
_CHUNK = 256  # points whose largest residual is found before the point itself


class Bands(NamedTuple):
    """Several bands over one row of points, for compiled code.

    Parameters
    ----------
    centre : (m,) float
        Mean of the heights.
    kinds : (c, 3) int
        Kind, first and last row of each band.
    limits, offsets : (c,) float
        Widest allowed, and width of the mean.
    places : (2, m) float
    references : (c, 4) int
        Where the exchange of each band starts.
    """

    centre: Any
    kinds: Any
    limits: Any
    offsets: Any
    places: Any
    references: Any


@kernel
def _solve(matrix: Any, right: Any) -> Any:
    """Solve a system of four equations by elimination with pivots, in place."""
    for k in range(4):
        pivot = k
        for i in range(k + 1, 4):
            if abs(matrix[i, k]) > abs(matrix[pivot, k]):
                pivot = i
        if abs(matrix[pivot, k]) < 1e-300:
            matrix[pivot, k] = 1e-300
        for j in range(4):
            matrix[k, j], matrix[pivot, j] = matrix[pivot, j], matrix[k, j]
        right[k], right[pivot] = right[pivot], right[k]
        for i in range(k + 1, 4):
            factor = matrix[i, k] / matrix[k, k]
            for j in range(k, 4):
                matrix[i, j] -= factor * matrix[k, j]
            right[i] -= factor * right[k]
    for k in range(3, -1, -1):
        for j in range(k + 1, 4):
            right[k] -= matrix[k, j] * right[j]
        right[k] /= matrix[k, k]
    return right


@kernel
def _multipliers(places: Any, reference: Any, matrix: Any, weights: Any) -> None:
    """Find the weights (4,), of absolute sum 1, whose moments 1, x, y of the reference vanish."""
    largest, fixed = -1.0, 0
    for k in range(4):
        a, b, c = reference[(k + 1) % 4], reference[(k + 2) % 4], reference[(k + 3) % 4]
        area = abs(
            (places[b, 0] - places[a, 0]) * (places[c, 1] - places[a, 1])
            - (places[b, 1] - places[a, 1]) * (places[c, 0] - places[a, 0])
        )
        if area > largest:
            largest, fixed = area, k
    for k in range(4):
        matrix[0, k] = 1.0
        matrix[1, k] = places[reference[k], 0]
        matrix[2, k] = places[reference[k], 1]
        matrix[3, k] = 1.0 if k == fixed else 0.0
        weights[k] = 1.0 if k == 3 else 0.0
    _solve(matrix, weights)
    total = 0.0
    for k in range(4):
        total += abs(weights[k])
    for k in range(4):
        weights[k] /= total


@fast_kernel
def _largest_residual(x: Any, y: Any, heights: Any, level: float, slope_x: float, slope_y: float) -> Any:
    """Return the point of the largest residual about a plane, and that residual."""
    largest, at_chunk = -1.0, 0
    for start in range(0, heights.size, _CHUNK):
        stop = min(start + _CHUNK, heights.size)
        here = 0.0
        for i in range(start, stop):
            here = max(here, abs(heights[i] - slope_x * x[i] - slope_y * y[i] - level))
        if here > largest:
            largest, at_chunk = here, start
    at, found = at_chunk, -1.0
    for i in range(at_chunk, min(at_chunk + _CHUNK, heights.size)):
        residual = abs(heights[i] - slope_x * x[i] - slope_y * y[i] - level)
        if residual > found:
            found, at = residual, i
    return at, found


@kernel
def exchange(places: Any, heights: Any, limit: float, reference: Any, weights: Any, plane: Any) -> Any:
    """Return the lower and the upper bound of the flatness of heights (n,) over places (2, n).

    They are equal unless ``limit`` > 0 could be decided on earlier. ``reference`` (4,) is where the exchange
    starts and ends; ``weights`` (4,) returns the functional that gives the lower bound, ``plane`` (3,) the
    level and the slopes of the plane of the last reference.
    """
    x, y = places[0], places[1]
    corners = places.T
    matrix, right, signs, shares = np.zeros((4, 4)), np.zeros(4), np.zeros(4), np.zeros(4)
    best, kept = reference.copy(), weights.copy()
    lower, upper = 0.0, np.inf
    for _ in range(500):
        _multipliers(corners, reference, matrix, weights)
        level = 0.0
        for k in range(4):
            level += weights[k] * heights[reference[k]]
        if level < 0:
            for k in range(4):
                weights[k] = -weights[k]
        for k in range(4):
            signs[k] = 1.0 if weights[k] >= 0 else -1.0
            matrix[k, 0] = 1.0
            matrix[k, 1] = x[reference[k]]
            matrix[k, 2] = y[reference[k]]
            matrix[k, 3] = signs[k]
            right[k] = heights[reference[k]]
        _solve(matrix, right)
        middle, slope_x, slope_y = right[0], right[1], right[2]
        if 2.0 * abs(level) >= lower:
            lower = 2.0 * abs(level)
            best[:] = reference
            kept[:] = weights
        at, largest = _largest_residual(x, y, heights, middle, slope_x, slope_y)
        if 2.0 * largest < upper:
            upper = 2.0 * largest
            plane[0], plane[1], plane[2] = middle, slope_x, slope_y
        if upper - lower <= CLOSED * upper or (limit > 0.0 and (lower > limit or upper <= limit)):
            break
        entering = 1.0 if heights[at] - slope_x * x[at] - slope_y * y[at] - middle > 0 else -1.0
        for k in range(4):
            matrix[0, k] = signs[k]
            matrix[1, k] = signs[k] * x[reference[k]]
            matrix[2, k] = signs[k] * y[reference[k]]
            matrix[3, k] = 1.0
        shares[0], shares[1] = entering, entering * x[at]
        shares[2], shares[3] = entering * y[at], 1.0
        _solve(matrix, shares)
        ratio, leaving = np.inf, -1
        for k in range(4):
            if shares[k] > 1e-14 and abs(weights[k]) / shares[k] < ratio:
                ratio, leaving = abs(weights[k]) / shares[k], k
        if leaving < 0:
            break
        reference[leaving] = at
    reference[:] = best
    weights[:] = kept
    return min(lower, upper), upper  # rounding may cross them


@kernel
def facet(
    kind: int, places: Any, heights: Any, limit: float, reference: Any, weights: Any, plane: Any
) -> Any:
    """Return bounds of the width of a band of heights (n,), and the functional of the lower one.

    Its points go to ``reference`` (4,), its weights to ``weights`` (4,): their sum over the heights is the
    lower bound. With ``limit`` > 0 the bounds may stay apart where they decide.
    """
    if kind == 3:
        lower, upper = exchange(places, heights, limit, reference, weights, plane)
        for k in range(4):
            weights[k] *= 2.0
        return lower, upper
    low, high = 0, 0
    for i in range(heights.size):
        if heights[i] < heights[low]:
            low = i
        if heights[i] > heights[high]:
            high = i
    reference[:] = high
    weights[:] = 0.0
    reference[1] = low
    if kind == 1:
        weights[0], weights[1] = 1.0, -1.0
        width = heights[high] - heights[low]
    elif heights[high] >= -heights[low]:
        weights[0] = 2.0
        width = 2.0 * heights[high]
    else:
        weights[1] = -2.0
        width = -2.0 * heights[low]
    return width, width


@kernel
def widest(here: Any, bands: Any, buffer: Any) -> Any:
    """Return the largest width over its limit of heights ``centre + here`` (m,).

    It ends at the first band that is too wide.
    """
    worst = 0.0
    weights, plane, reference = np.zeros(4), np.zeros(3), np.zeros(4, dtype=np.int64)
    for c in range(bands.kinds.shape[0]):
        kind, start, stop = bands.kinds[c, 0], bands.kinds[c, 1], bands.kinds[c, 2]
        for i in range(start, stop):
            buffer[i - start] = bands.centre[i] + here[i]
        reference[:] = bands.references[c]
        limit = bands.limits[c]
        lower, upper = facet(
            kind, bands.places[:, start:stop], buffer[: stop - start], limit, reference, weights, plane
        )
        worst = max(worst, lower / limit if lower > limit else upper / limit)
        if worst > 1.0:
            break
    return worst


def first_reference(flat: Any) -> Any:
    """Return four places (4,) of ``flat`` (n, 2) that span the plane; -1 where all are on one line."""
    one = int(np.argmin(flat.sum(axis=1)))
    two = int(np.argmax(((flat - flat[one]) ** 2).sum(axis=1)))
    along = flat[two] - flat[one]
    across = along[0] * (flat[:, 1] - flat[one, 1]) - along[1] * (flat[:, 0] - flat[one, 0])
    three = int(np.argmax(np.abs(across)))
    if abs(across[three]) <= 1e-12:
        return np.full(4, -1, dtype=np.int64)
    opposite = -np.sign(across[three]) * across
    opposite[[one, two, three]] = -np.inf
    return np.array([one, two, three, int(np.argmax(opposite))], dtype=np.int64)
