"""Supernodes of a sparse Cholesky factor: columns next to each other that share their rows below.

A separator of a nested dissection is full once both sides are eliminated, as far as it hangs together through
them; so are, nearly, the few vertices of a leaf. The zeros in between are kept as numbers.

References
----------
Liu: The role of elimination trees in sparse factorization, SIAM J. Matrix Anal. Appl. 11 (1990),
doi:10.1137/0611010; Ng, Peyton: Block sparse Cholesky algorithms on advanced uniprocessor computers, SIAM J.
Sci. Comput. 14 (1993), doi:10.1137/0914063.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cadskin._jit import kernel
from cadskin.deviation._dissection import dissect

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin.deviation._dissection import Halves, SymmetricMatrix

__all__ = ["Supernodes", "find_supernodes"]


class Supernodes(NamedTuple):
    """Columns of a factor in runs that share their rows, children before parents (a tuple: kernels take it).

    Parameters
    ----------
    order : (n,) int32
        Row of the matrix that stands at each place of the factor.
    begin : (k + 1,) int32
        Places of the first columns.
    parent : (k,) int32
        Supernode of the first row below, -1 where there is none.
    depth : (k,) int32
        Number of supernodes above.
    first : (k + 1,) int64
        Where the rows of each begin.
    rows : (first[-1],) int32
        Places of the rows below, in order.
    """

    order: NDArray[np.int32]
    begin: NDArray[np.int32]
    parent: NDArray[np.int32]
    depth: NDArray[np.int32]
    first: NDArray[np.int64]
    rows: NDArray[np.int32]


def find_supernodes(matrix: SymmetricMatrix, halves: Halves) -> Supernodes:
    """Order a matrix, its rows in the order of halves, by dissection; find the structure of its factor."""
    order, parts = dissect(matrix, halves)
    before = _earlier_neighbours(matrix.starts, matrix.columns, order)
    members, begin, parent = _connected_parts(before, parts)
    number, depth = _tree_order(parent)
    places, begin, parent, depth = _arranged(members, begin, parent, number, depth)
    first, rows = _rows_below(before, places, begin, parent)
    return Supernodes(order[places], begin, parent, depth, first, rows)


@kernel
def _earlier_neighbours(starts: Any, columns: Any, order: Any) -> Any:
    """Neighbours before each vertex of an order, all numbered by it."""
    n = order.size
    place = np.zeros(n, dtype=np.int32)
    for i in range(n):
        place[order[i]] = i
    begin = np.zeros(n + 1, dtype=np.int32)
    neighbours = np.zeros(columns.size // 2 + 1, dtype=np.int32)
    q = 0
    for i in range(n):
        for p in range(starts[order[i]], starts[order[i] + 1]):
            neighbours[q] = place[columns[p]]
            q += neighbours[q] < i
        begin[i + 1] = q
    return begin, neighbours


@kernel
def _root(ancestor: Any, i: int, last: int) -> int:
    """Climb to the last vertex of a component, shortening the way, and set ``last`` above it."""
    while True:
        above = ancestor[i]
        if above == last:
            return last
        ancestor[i] = last
        if above < 0:
            return i
        i = above


@kernel
def _connected_parts(before: Any, parts: Any) -> Any:
    """Split the parts into those that hang together through earlier vertices.

    Returns the vertices part by part, where each part begins, and its parent: the next one it hangs together
    with.
    """
    starts, columns = before
    n = starts.size - 1
    ancestor = np.full(n, -1, dtype=np.int32)
    part_of = np.full(n, -1, dtype=np.int32)
    members = np.arange(n).astype(np.int32)
    begin = np.zeros(n + 1, dtype=np.int32)
    above = np.full(n, -1, dtype=np.int32)
    count: Any = np.int64(0)  # no literal: it would compile the kernel twice
    for part in range(parts.size - 1):
        low, high = parts[part], parts[part + 1]
        components = high - low
        for i in range(low, high):
            for p in range(starts[i], starts[i + 1]):
                root = _root(ancestor, columns[p], i)
                if root >= low:
                    components -= root != i
                else:
                    above[part_of[root]] = i
        if components > 1:
            _group(ancestor, low, high, count, part_of, members, begin)
            count += components
        else:
            for i in range(low, high):
                part_of[i] = count
            count += 1
        begin[count] = high
    parent = np.full(count, -1, dtype=np.int32)
    for part in range(count):
        if above[part] >= 0:
            parent[part] = part_of[above[part]]
    return members, begin[: count + 1].copy(), parent


@kernel
def _group(ancestor: Any, low: int, high: int, count: int, part_of: Any, members: Any, begin: Any) -> None:
    """Sort the vertices low to high by component; parts are numbered from ``count`` on."""
    place = low
    for last in range(low, high):
        if ancestor[last] >= 0:
            continue
        begin[count] = place
        for i in range(low, last + 1):
            root = i
            while ancestor[root] >= 0:
                root = ancestor[root]
            if root == last:
                part_of[i] = count
                members[place] = i
                place += 1
        count += 1


@kernel
def _tree_order(parent: Any) -> Any:
    """Return the place of each node in a postorder of the forest, and its depth."""
    count = parent.size
    head = np.full(count, -1, dtype=np.int32)
    following = np.full(count, -1, dtype=np.int32)
    for node in range(count - 1, -1, -1):
        if parent[node] >= 0:
            following[node] = head[parent[node]]
            head[parent[node]] = node
    number = np.zeros(count, dtype=np.int32)
    depth = np.zeros(count, dtype=np.int32)
    stack = np.zeros(count, dtype=np.int32)
    done = 0
    for root in range(count):
        if parent[root] >= 0:
            continue
        top = 0
        stack[0] = root
        while top >= 0:
            node = stack[top]
            child = head[node]
            if child < 0:
                number[node] = done
                depth[node] = top
                done += 1
                top -= 1
            else:
                head[node] = following[child]
                top += 1
                stack[top] = child
    return number, depth


@kernel
def _arranged(members: Any, begin: Any, parent: Any, number: Any, depth: Any) -> Any:
    """Put the supernodes, each with its members, in the order of their numbers."""
    count = number.size
    starts = np.zeros(count + 1, dtype=np.int32)
    above = np.full(count, -1, dtype=np.int32)
    level = np.zeros(count, dtype=np.int32)
    for s in range(count):
        starts[number[s] + 1] = begin[s + 1] - begin[s]
        level[number[s]] = depth[s]
        if parent[s] >= 0:
            above[number[s]] = number[parent[s]]
    for s in range(count):
        starts[s + 1] += starts[s]
    places = np.zeros(members.size, dtype=np.int32)
    for s in range(count):
        low = starts[number[s]]
        for i in range(begin[s + 1] - begin[s]):
            places[low + i] = members[begin[s] + i]
    return places, starts, above, level


@kernel
def _longer(numbers: Any, size: int) -> Any:
    longer = np.zeros(size, dtype=np.int32)
    for i in range(numbers.size):
        longer[i] = numbers[i]
    return longer


@kernel
def _rows_below(before: Any, places: Any, begin: Any, parent: Any) -> Any:
    """Rows below each supernode: row i is in those on the ways up the tree from its earlier neighbours."""
    starts, columns = before
    count = parent.size
    owner = np.zeros(places.size, dtype=np.int32)
    for s in range(count):
        for i in range(begin[s], begin[s + 1]):
            owner[places[i]] = s
    first = np.zeros(count + 1, dtype=np.int64)
    mark = np.full(count, -1, dtype=np.int32)
    found = np.zeros(4 * places.size, dtype=np.int32)  # supernodes of each row
    stops = np.zeros(places.size + 1, dtype=np.int64)
    q = 0
    for s in range(count):
        for i in range(begin[s], begin[s + 1]):
            if q + count > found.size:
                found = _longer(found, 2 * found.size + count)
            for p in range(starts[places[i]], starts[places[i] + 1]):
                t = owner[columns[p]]
                while t != s and mark[t] != i:
                    mark[t] = i
                    found[q] = t
                    first[t + 1] += 1
                    q += 1
                    t = parent[t]
            stops[i + 1] = q
    for s in range(count):
        first[s + 1] += first[s]
    rows = np.zeros(first[count], dtype=np.int32)
    fill = first[:count].copy()
    for i in range(places.size):
        for k in range(stops[i], stops[i + 1]):
            rows[fill[found[k]]] = i
            fill[found[k]] += 1
    return first, rows
