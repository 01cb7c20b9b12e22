"""Multifrontal Cholesky factorisation on supernodes.

Every supernode has a front: the dense matrix of its own columns and of the rows below. It gets the entries
of the matrix and what its children leave, eliminates its columns, and leaves the rest to its parent. One
front is open at each depth of the tree at a time.

References
----------
Duff, Reid: The multifrontal solution of indefinite sparse symmetric linear equations, ACM Trans. Math. Softw.
9 (1983), doi:10.1145/356044.356047; Liu: The multifrontal method for sparse matrix solution, SIAM Review 34
(1992), doi:10.1137/1034004.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cadskin._jit import kernel
from cadskin.deviation._blocks import LINES, WIDTH, eliminate, keep_lines, subtract_products

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin.deviation._dissection import SymmetricMatrix
    from cadskin.deviation._supernodes import Supernodes

__all__ = ["Panels", "factorised"]

_PANEL = 32  # columns of the factor that are used together
_BLOCK = WIDTH * WIDTH


class Panels(NamedTuple):
    """A factor L cut into runs of columns, in single precision (a tuple: kernels take it).

    A panel holds the inverse D^-1 of its block D on the diagonal, then the rows below, negative. Both are
    groups of LINES rows, the last one filled up with zeros; in a group column follows column.

    Parameters
    ----------
    start : (p + 1,) int64
        First column of each panel.
    line : (p + 1,) int64
        Where the rows of each panel begin; those of the diagonal are the first ones.
    rows : (line[-1],) uint32
    place : (p + 1,) int64
        Where the values of each panel begin.
    values : (place[-1] + LINES²,) float32
    """

    start: NDArray[np.int64]
    line: NDArray[np.int64]
    rows: NDArray[np.uint32]
    place: NDArray[np.int64]
    values: NDArray[np.float32]


def factorised(matrix: SymmetricMatrix, nodes: Supernodes) -> Panels | None:
    """Return the factor of a matrix, None where it is not positive definite."""
    panels = Panels(*_panels(nodes))
    return panels if _factor(matrix, nodes, panels, _room(nodes)) else None


@kernel
def _up(count: int, step: int) -> int:
    """Return the next multiple of a step."""
    return (count + step - 1) // step * step


@kernel
def _shape(nodes: Any, s: int) -> Any:
    """Own columns of a front, where the rows below begin in it, and its side."""
    size = nodes.begin[s + 1] - nodes.begin[s]
    below = _up(size, LINES)
    return size, below, below + nodes.first[s + 1] - nodes.first[s]


@kernel
def _room(nodes: Any) -> Any:
    """Where the front of each depth begins; beyond the last one there is room for the inverse of a panel."""
    room = np.zeros(nodes.begin.size + 1, dtype=np.int64)
    deepest = 0
    for s in range(nodes.parent.size):
        depth = nodes.depth[s]
        side = _up(_shape(nodes, s)[2], WIDTH)
        room[depth + 1] = max(room[depth + 1], side * side)
        deepest = max(deepest, depth)
    for depth in range(deepest + 1):
        room[depth + 1] += room[depth]
    return room[: deepest + 2].copy()


@kernel
def _panels(nodes: Any) -> Any:
    """Parts of `Panels`, the values still zero."""
    count = 0
    for s in range(nodes.parent.size):
        count += _up(_shape(nodes, s)[0], _PANEL) // _PANEL
    start = np.zeros(count + 1, dtype=np.int64)
    line = np.zeros(count + 1, dtype=np.int64)
    place = np.zeros(count + 1, dtype=np.int64)
    p = 0
    for s in range(nodes.parent.size):
        size, _, side = _shape(nodes, s)
        for c in range(0, size, _PANEL):
            width = min(_PANEL, size - c)
            start[p + 1] = start[p] + width
            line[p + 1] = line[p] + _up(side - c, LINES)
            place[p + 1] = place[p] + _up(side - c, LINES) * width
            p += 1
    rows = np.zeros(line[count], dtype=np.uint32)
    p = 0
    for s in range(nodes.parent.size):
        size, below, side = _shape(nodes, s)
        for c in range(0, size, _PANEL):
            q = line[p] - c
            for j in range(c, below):
                rows[q + j] = nodes.begin[s] + min(j, size - 1)
            q -= below
            for j in range(below, _up(side, LINES)):
                rows[q + below + j] = nodes.rows[nodes.first[s] + min(j, side - 1) - below]
            p += 1
    return start, line, rows, place, np.zeros(place[count] + LINES * LINES, dtype=np.float32)


@kernel
def _factor(matrix: Any, nodes: Any, panels: Any, room: Any) -> bool:
    n, last = nodes.order.size, room[room.size - 1]
    place = np.zeros(n, dtype=np.int32)
    for i in range(n):
        place[nodes.order[i]] = i
    fronts = np.zeros(last + _PANEL * _PANEL)
    local = np.zeros(n + 1, dtype=np.int32)
    inverse = np.zeros(n + WIDTH)
    opened = np.zeros(nodes.parent.size, dtype=np.bool_)
    panel = 0
    for s in range(nodes.parent.size):
        at = room[nodes.depth[s]]
        size, below, side = _shape(nodes, s)
        if not opened[s]:
            _open(fronts, at, side)
        _add_entries(matrix, nodes, s, place, local, fronts, at)
        if not _eliminated(fronts, at, size, side, inverse):
            return False
        for c in range(0, size, _PANEL):
            _keep(
                fronts,
                at,
                (c, min(_PANEL, size - c), side),
                inverse,
                last,
                panels.values,
                panels.place[panel],
            )
            panel += 1
        if side > below:
            parent: Any = np.int64(nodes.parent[s])  # of one type with s: `_shape` is compiled once
            target = room[nodes.depth[parent]]
            if not opened[parent]:
                opened[parent] = True
                _open(fronts, target, _shape(nodes, parent)[2])
            _pass_on(nodes, s, local, fronts, at, target)
    return True


@kernel
def _open(fronts: Any, at: int, side: int) -> None:
    """Set the upper half of a front to zero."""
    blocks = _up(side, WIDTH) // WIDTH
    for j in range(blocks):
        begin = at + j * blocks * _BLOCK
        fronts[begin : begin + (j + 1) * _BLOCK] = 0.0


@kernel
def _add_entries(matrix: Any, nodes: Any, s: int, place: Any, local: Any, fronts: Any, at: int) -> None:
    """Add the entries of the matrix to a front, on and above the diagonal of its own rows."""
    starts, columns, data = matrix
    size, below, side = _shape(nodes, s)
    strip = _up(side, WIDTH) * WIDTH
    low = nodes.begin[s]
    for i in range(size):
        local[low + i] = i
    for i in range(side - below):
        local[nodes.rows[nodes.first[s] + i]] = below + i
    for i in range(size):
        row = nodes.order[low + i]
        for p in range(starts[row], starts[row + 1]):
            other = place[columns[p]]
            if other >= low + i:
                j = local[other]
                fronts[at + j // WIDTH * strip + i * WIDTH + j % WIDTH] += data[p]


@kernel
def _eliminated(fronts: Any, at: int, size: int, side: int, inverse: Any) -> bool:
    """Eliminate the first columns of a front; False where a pivot is not positive."""
    blocks = _up(side, WIDTH) // WIDTH
    strip = blocks * _BLOCK
    for i in range(blocks):
        done = min(size, WIDTH * i)
        for j in range(i, blocks):
            begin = at + j * strip
            subtract_products(fronts, at + i * strip, begin, begin + i * _BLOCK, done)
        if done < size:
            count = min(WIDTH, size - done)
            diagonal = at + i * strip + i * _BLOCK
            if not _eliminated_block(fronts, diagonal, count, inverse, done):
                return False
            for j in range(i + 1, blocks):
                eliminate(fronts, diagonal, inverse, done, at + j * strip + i * _BLOCK, count)
    return True


@kernel
def _eliminated_block(fronts: Any, at: int, count: int, inverse: Any, first: int) -> bool:
    """Eliminate the first columns of a block on the diagonal; ``inverse`` gets 1 / that of the factor."""
    for k in range(count):
        row = at + WIDTH * k
        pivot = fronts[row + k]
        if not pivot > 0.0:
            return False
        root = math.sqrt(pivot)
        scale = 1.0 / root
        inverse[first + k] = scale
        fronts[row + k] = root
        for j in range(k + 1, WIDTH):
            fronts[row + j] *= scale
        for i in range(k + 1, WIDTH):
            for j in range(i, WIDTH):
                fronts[at + WIDTH * i + j] -= fronts[row + i] * fronts[row + j]
    return True


@kernel
def _keep(fronts: Any, at: int, part: Any, inverse: Any, room: int, values: Any, place: int) -> None:
    """Keep columns c to c + width of a front; ``part`` is c, width and the side of the front.

    The same eliminations turn the identity into the inverse of the block on the diagonal; ``room`` is the
    place for it.
    """
    c, width, side = part
    strip = _up(side, WIDTH) * WIDTH
    blocks = _up(width, WIDTH) // WIDTH
    own = at + c // WIDTH * strip + c * WIDTH  # of the first block on the diagonal
    for j in range(blocks):
        begin = room + j * _PANEL * WIDTH
        for i in range(j, blocks):
            block = begin + i * _BLOCK
            fronts[block : block + _BLOCK] = 0.0
            if i == j:
                for k in range(WIDTH):
                    fronts[block + (WIDTH + 1) * k] = 1.0
            else:
                left = own + i * strip + j * _BLOCK
                subtract_products(fronts, left, begin + j * _BLOCK, block, (i - j) * WIDTH)
            diagonal = own + i * strip + i * _BLOCK
            eliminate(fronts, diagonal, inverse, c + i * WIDTH, block, min(WIDTH, width - i * WIDTH))
    for i in range(width):
        for k in range(i + 1):
            source = room + k // WIDTH * _PANEL * WIDTH + i * WIDTH + k % WIDTH
            values[place + (i // LINES * width + k) * LINES + i % LINES] = fronts[source]
    for j in range(c + _up(width, LINES), side, LINES):
        source = at + j // WIDTH * strip + c * WIDTH + j % WIDTH
        keep_lines(fronts, source, values, place + (j - c) * width, width)


@kernel
def _pass_on(nodes: Any, s: int, steps: Any, fronts: Any, at: int, target: int) -> None:
    """Add what a front leaves below its own columns to that of its parent; ``steps`` is scratch."""
    _, below, side = _shape(nodes, s)
    parent: Any = np.int64(nodes.parent[s])
    size, begin, wide = _shape(nodes, parent)
    own, low = nodes.first[s], nodes.begin[parent]
    k = nodes.first[parent]
    for i in range(side - below):
        row = nodes.rows[own + i]
        if row < low + size:
            steps[i] = row - low
        else:
            while nodes.rows[k] < row:
                k += 1
            steps[i] = begin + k - nodes.first[parent]
    for j in range(side - below):
        c = below + j
        source = at + c // WIDTH * _up(side, WIDTH) * WIDTH + c % WIDTH + below * WIDTH
        column = target + steps[j] // WIDTH * _up(wide, WIDTH) * WIDTH + steps[j] % WIDTH
        for i in range(j + 1):
            fronts[column + steps[i] * WIDTH] += fronts[source + i * WIDTH]
