"""Points sorted into cubic cells that a hash table finds: the neighbourhoods of dense clouds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import kernel

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points

__all__ = ["PointCells", "cell_bounds", "find_cell", "point_cells"]

_MOST = 2_000_000  # cells along an axis: three of them fit into one number


@dataclass(frozen=True, eq=False)
class PointCells:
    """A cloud whose points follow each other cell by cell.

    Parameters
    ----------
    points : (k, 3) float
        In the order of the cells.
    grid : (4,) float
        Lower corner of the box, and the size of a cell.
    counts : (3,) int
        Cells along the axes.
    starts : (c + 1,) int
        First point of each cell that has some.
    keys, cells : (t,) int
        The hash table: number in the box, and which of the cells that have points; -1 where it is empty.
    """

    points: Points
    grid: Floats
    counts: Ints
    starts: Ints
    keys: Ints
    cells: Ints


def point_cells(points: Points, size: float) -> PointCells:
    """Sort points (k, 3) into cells of a size; larger ones where the box would have too many."""
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    size = max(size, float(extent.max()) / _MOST, 1e-9)
    counts = np.floor(extent / size).astype(np.int64) + 1
    places = np.floor((points - low) / size).astype(np.int64)
    numbers = (places[:, 0] * counts[1] + places[:, 1]) * counts[2] + places[:, 2]
    order = np.argsort(numbers, kind="stable")
    ordered = numbers[order]
    first = np.flatnonzero(np.diff(ordered, prepend=-1))
    table = 1 << (2 * len(first)).bit_length()
    keys, cells = (np.full(table, -1, dtype=np.int64) for _ in range(2))
    _fill_table(ordered[first], keys, cells)
    return PointCells(
        np.ascontiguousarray(points[order]),
        np.array([*low, size]),
        counts,
        np.append(first, len(points)),
        keys,
        cells,
    )


@kernel
def _slot(number: int, table: int) -> Any:
    mixed = np.uint64(number) * np.uint64(0x9E3779B97F4A7C15)
    return np.int64((mixed >> np.uint64(20)) & np.uint64(table - 1))


@kernel
def _fill_table(numbers: Any, keys: Any, cells: Any) -> None:
    for c in range(numbers.size):
        at = _slot(numbers[c], keys.size)
        while keys[at] >= 0:
            at = (at + 1) & (keys.size - 1)
        keys[at] = numbers[c]
        cells[at] = c


@kernel
def find_cell(number: int, keys: Any, cells: Any) -> Any:
    """Which of the cells that have points is number ``number`` of the box, or -1."""
    at = _slot(number, keys.size)
    while keys[at] >= 0:
        if keys[at] == number:
            return cells[at]
        at = (at + 1) & (keys.size - 1)
    return -1


@kernel
def cell_bounds(low: float, high: float, axis: int, grid: Any, counts: Any) -> Any:
    """First cell and end of the cells along an axis that lie between two coordinates."""
    first = max(0, math.floor((low - grid[axis]) / grid[3]))
    last = min(counts[axis] - 1, math.floor((high - grid[axis]) / grid[3]))
    return first, last + 1
