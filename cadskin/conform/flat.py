"""The flatness of heights over fixed places: exact, with bounds that decide against a limit early.

The narrowest band about ``a + b x + c y`` is a linear Chebyshev approximation. Four points in alternation
bound it from below, the largest residual bounds it from above; the point of the largest residual enters
the reference until the bounds meet.

References
----------
.. [1] E. L. Stiefel, Note on Jordan elimination, linear programming and Tchebycheff approximation, Numer.
   Math. 2 (1960) 1-17, doi:10.1007/BF01386203.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

from cadskin.errors import AssociationError

if TYPE_CHECKING:
    from typing import Any

    from cadskin._typing import Floats, Ints, Points

__all__ = ["FlatPlaces", "flat_places", "flatness_bounds"]

_SLACK = 1e-9  # relative gap at which the bounds count as equal


class FlatPlaces:
    """Places of points in their nominal plane, with a first reference of four of them.

    Parameters
    ----------
    places : (n, 2) float
        Centred, of unit size.
    reference : (4,) int
    """

    def __init__(self, places: Floats, reference: Ints) -> None:
        self.places, self.reference = places, reference

    def bounds(self, heights: Floats, limit: float = 0.0) -> tuple[float, float]:
        """Return a lower and an upper bound of the flatness of ``heights`` (n,) [mm].

        They are equal to a part in 1e9 unless ``limit`` > 0 could be decided on earlier.
        """
        lower, upper = _exchange(self.places, heights, self.reference, limit)
        decided = limit > 0.0 and (lower > limit or upper <= limit)
        if not decided and upper - lower > 2 * _SLACK * upper:  # three of a reference on one line
            lower = upper = _by_linear_program(self.places, heights)
        return float(lower), float(upper)


def flat_places(points: Points, normal: Floats) -> FlatPlaces:
    """Return the places of points (n, 3) of a plane with a unit normal (3,).

    Raises
    ------
    AssociationError
        The points lie on one line.
    """
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    first = np.cross(normal, helper)
    first /= np.linalg.norm(first)
    flat = points @ np.stack([first, np.cross(normal, first)], axis=1)
    flat = flat - flat.mean(axis=0)
    flat /= max(float(np.abs(flat).max()), 1e-300)
    return FlatPlaces(np.ascontiguousarray(flat), _first_reference(flat))


def flatness_bounds(points: Points, normal: Floats, heights: Floats) -> tuple[float, float]:
    """Return the bounds of the flatness of heights (n,) over points (n, 3) of a plane [mm].

    Examples
    --------
    >>> square = np.array([[0.0, 0, 0], [10, 0, 0], [10, 10, 0], [0, 10, 0]])
    >>> low, high = flatness_bounds(square, np.array([0.0, 0, 1]), np.array([0.0, 0.1, 0.0, 0.1]))
    >>> round(low, 12), round(high, 12)
    (0.1, 0.1)
    """
    return flat_places(points, normal).bounds(np.asarray(heights, dtype=np.float64))


def _first_reference(flat: Floats) -> Ints:
    """Return four different places that span the plane."""
    one = int(np.argmin(flat.sum(axis=1)))
    two = int(np.argmax(((flat - flat[one]) ** 2).sum(axis=1)))
    along = flat[two] - flat[one]
    across = along[0] * (flat[:, 1] - flat[one, 1]) - along[1] * (flat[:, 0] - flat[one, 0])
    three = int(np.argmax(np.abs(across)))
    if abs(across[three]) <= 1e-12:
        raise AssociationError("the points of a plane lie on one line; mesh it finer")
    opposite = -np.sign(across[three]) * across
    opposite[[one, two, three]] = -np.inf
    return np.array([one, two, three, int(np.argmax(opposite))], dtype=np.int64)


def _by_linear_program(places: Floats, heights: Floats) -> float:
    """Return the flatness by a linear program over all points."""
    from scipy.optimize import linprog

    size = float(np.ptp(heights)) or 1.0
    plane = np.column_stack([np.ones(len(places)), places])
    tall = np.ones((len(places), 1))
    found = linprog(
        [0.0, 0.0, 0.0, 1.0],
        A_ub=np.block([[plane, -tall], [-plane, -tall]]),
        b_ub=np.concatenate([heights, -heights]) / size,
        bounds=[(None, None)] * 4,
        method="highs",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if found.x is None:
        raise AssociationError(f"the flatness of {len(places)} points was not found: {found.message}")
    return float(2.0 * found.fun * size)


@njit(cache=True)
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


@njit(cache=True)
def _multipliers(places: Any, reference: Any, matrix: Any, right: Any) -> Any:
    """Return the weights (4,), of absolute sum 1, whose moments 1, x, y of the reference vanish."""
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
        right[k] = 1.0 if k == 3 else 0.0
    weights = _solve(matrix, right).copy()
    total = 0.0
    for k in range(4):
        total += abs(weights[k])
    return weights / total


@njit(cache=True)
def _worst(places: Any, heights: Any, level: float, slope_x: float, slope_y: float) -> Any:
    largest, at = -1.0, 0
    for i in range(heights.size):
        residual = abs(heights[i] - slope_x * places[i, 0] - slope_y * places[i, 1] - level)
        if residual > largest:
            largest, at = residual, i
    return at, largest


@njit(cache=True)
def _exchange(places: Any, heights: Any, start: Any, limit: float) -> Any:
    """Return the lower and the upper bound of the flatness."""
    reference = start.copy()
    matrix, right, signs = np.zeros((4, 4)), np.zeros(4), np.zeros(4)
    lower, upper = 0.0, np.inf
    for _ in range(500):
        weights = _multipliers(places, reference, matrix, right)
        level = 0.0
        for k in range(4):
            level += weights[k] * heights[reference[k]]
        if level < 0:
            weights = -weights
        for k in range(4):
            signs[k] = 1.0 if weights[k] >= 0 else -1.0
            matrix[k, 0] = 1.0
            matrix[k, 1] = places[reference[k], 0]
            matrix[k, 2] = places[reference[k], 1]
            matrix[k, 3] = signs[k]
            right[k] = heights[reference[k]]
        plane = _solve(matrix, right)
        middle, slope_x, slope_y = plane[0], plane[1], plane[2]
        lower = max(lower, 2.0 * abs(level))
        at, largest = _worst(places, heights, middle, slope_x, slope_y)
        upper = min(upper, 2.0 * largest)
        if upper - lower <= _SLACK * upper or (limit > 0.0 and (lower > limit or upper <= limit)):
            break
        beyond = heights[at] - slope_x * places[at, 0] - slope_y * places[at, 1] - middle
        entering = 1.0 if beyond > 0 else -1.0
        for k in range(4):
            matrix[0, k] = signs[k]
            matrix[1, k] = signs[k] * places[reference[k], 0]
            matrix[2, k] = signs[k] * places[reference[k], 1]
            matrix[3, k] = 1.0
        right[0], right[1] = entering, entering * places[at, 0]
        right[2], right[3] = entering * places[at, 1], 1.0
        shares = _solve(matrix, right)
        ratio, leaving = np.inf, -1
        for k in range(4):
            if shares[k] > 1e-14 and abs(weights[k]) / shares[k] < ratio:
                ratio, leaving = abs(weights[k]) / shares[k], k
        if leaving < 0:
            break
        reference[leaving] = at
    return min(lower, upper), upper  # rounding may cross them
