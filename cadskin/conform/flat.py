"""The flatness of heights over fixed places: exact, with bounds that decide against a limit early.

The narrowest band about ``a + b x + c y`` is a linear Chebyshev approximation. Four points in alternation
bound it from below, the largest residual bounds it from above; the point of the largest residual enters
the reference until the bounds meet. At many points a subset is asked first: its flatness is a lower bound,
and its plane mostly gives the upper one.

References
----------
.. [1] E. L. Stiefel, Note on Jordan elimination, linear programming and Tchebycheff approximation, Numer.
   Math. 2 (1960) 1-17, doi:10.1007/BF01386203.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.conform._bands import CLOSED, exchange, first_reference
from cadskin.conform._subset import spread_subset
from cadskin.errors import AssociationError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points

__all__ = ["FlatPlaces", "flat_places", "flatness_bounds"]

_MANY = 1500  # points from which on a subset goes first
_FEW = 300  # points of it


class FlatPlaces:
    """Places of points in their nominal plane, with a first reference of four of them.

    Parameters
    ----------
    places : (n, 2) float
        Centred, of unit size.
    reference : (4,) int
    extent : float
        Length that is the unit of the places [mm].
    """

    def __init__(self, places: Floats, reference: Ints, extent: float = 1.0) -> None:
        self.places, self.reference, self.extent = places, reference, extent
        self.columns = np.ascontiguousarray(places.T)
        self.subset = spread_subset(places, _FEW, keep=reference) if len(places) > _MANY else None
        if self.subset is not None:
            self._few = np.ascontiguousarray(self.columns[:, self.subset])
            self._start = np.searchsorted(self.subset, reference)

    def bounds(self, heights: Floats, limit: float = 0.0) -> tuple[float, float]:
        """Return a lower and an upper bound of the flatness of ``heights`` (n,) [mm].

        They are equal to a part in 1e9 unless ``limit`` > 0 could be decided on earlier.
        """
        lower, upper, _ = self.band(heights, limit)
        return lower, upper

    def band(self, heights: Floats, limit: float = 0.0) -> tuple[float, float, Floats]:
        """Return the bounds and the middle plane (3,) of the upper one: level and slopes per unit place."""
        weights, plane = np.zeros(4), np.zeros(3)
        reference = self.reference.copy()
        if self.subset is not None:
            start = self._start.copy()
            least, _ = exchange(self._few, heights[self.subset], limit, start, weights, plane)
            if limit > 0.0 and least > limit:
                return float(least), np.inf, plane
            reference = self.subset[start]
        lower, upper = exchange(self.columns, heights, limit, reference, weights, plane)
        decided = limit > 0.0 and (lower > limit or upper <= limit)
        if not decided and upper - lower > 2 * CLOSED * upper:  # three of a reference on one line
            lower = upper = _by_linear_program(self.places, heights)
        return float(lower), float(upper), plane


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
    extent = max(float(np.abs(flat).max()), 1e-300)
    flat /= extent
    reference = first_reference(flat)
    if reference[0] < 0:
        raise AssociationError("the points of a plane lie on one line; mesh it finer")
    return FlatPlaces(np.ascontiguousarray(flat), reference, extent)


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
