"""Nested dissection of a mesh by its points: halves of halves, and the few vertices that part them.

The points are halved again and again across their widest extent. An edge of the graph is cut by one halving
only, so that the separators are found in one pass over the edges, as small vertex covers of the cut edges.

References
----------
George: Nested dissection of a regular finite element mesh, SIAM J. Numer. Anal. 10 (1973),
doi:10.1137/0710032; Karp, Sipser: Maximum matchings in sparse random graphs, FOCS 1981,
doi:10.1109/SFCS.1981.21 (covers from the leaves on, exact where the cut edges have no circles).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from cadskin._jit import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csr_array

    from cadskin._typing import Ints, Points

__all__ = ["Halves", "SymmetricMatrix", "dissect", "halves_of", "nested_dissection", "renumbered"]

_LEAF = 16  # vertices up to which a part of the mesh is not halved further
_SAMPLE = 15  # points looked at, or up to twice as many, to choose the place of a cut
_SLACK = 16  # parts of the points: a half may have one more or less of these


class Halves(NamedTuple):
    """Points in an order of halves of halves.

    Parameters
    ----------
    order : (n,) int32
    leaf : (n,) int32
        The last part that each place belongs to, in a complete binary tree, from left to right.
    depth : int
        Number of halvings.
    """

    order: NDArray[np.int32]
    leaf: NDArray[np.int32]
    depth: int


class SymmetricMatrix(NamedTuple):
    """All entries of a symmetric matrix, row by row.

    Parameters
    ----------
    starts : (n + 1,) int32
    columns : (starts[-1],) int32
    data : (starts[-1],) float64
    """

    starts: NDArray[np.int32]
    columns: NDArray[np.int32]
    data: NDArray[np.float64]


def nested_dissection(matrix: csr_array, points: Points) -> Ints:
    """Return an order that cuts the mesh in halves again and again, separators last."""
    halves = halves_of(points)
    return halves.order[dissect(renumbered(matrix, halves.order), halves)[0]].astype(np.int64)


def halves_of(points: Points) -> Halves:
    """Halve points (n, d) again and again."""
    depth = 0
    while len(points) >> depth > _LEAF:
        depth += 1
    order, leaf = _halve(np.array(points, dtype=np.float64, order="C"), depth)
    return Halves(order, leaf, depth)


def renumbered(matrix: csr_array, order: NDArray[np.int32]) -> SymmetricMatrix:
    """Return a matrix with rows and columns in another order; neighbours on the mesh are near in memory."""
    starts, columns = (np.asarray(part, dtype=np.int32) for part in (matrix.indptr, matrix.indices))
    return SymmetricMatrix(*_renumbered(starts, columns, np.asarray(matrix.data, dtype=np.float64), order))


def dissect(matrix: SymmetricMatrix, halves: Halves) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return the rows of a matrix, in the order of halves, in that of a nested dissection.

    Returns
    -------
    order : (n,) int32
    parts : (k + 1,) int32
        Where each leaf or separator begins that is not empty, in postorder of their tree; the last is n.
    """
    order, parts = _postorder(_tree_nodes(matrix, halves.leaf, halves.depth), halves.depth)
    return order, parts


@kernel
def _widest_axis(points: Any, low: int, high: int) -> int:
    """Axis along which some of the points low to high extend furthest."""
    step = (high - low + 2 * _SAMPLE) // (2 * _SAMPLE)
    best, width = 0, -1.0
    for axis in range(points.shape[1]):
        least, most = points[low, axis], points[low, axis]
        for i in range(low, high, step):
            least = min(least, points[i, axis])
            most = max(most, points[i, axis])
        if most - least > width:
            best, width = axis, most - least
    return best


@kernel
def _middle_of_some(points: Any, low: int, high: int, axis: int, sample: Any) -> Any:
    """Return the median coordinate of some of the points low to high."""
    step = (high - low + _SAMPLE - 1) // _SAMPLE
    count = 0
    for i in range(low, high, step):
        value = points[i, axis]
        k = count
        while k > 0 and sample[k - 1] > value:
            sample[k] = sample[k - 1]
            k -= 1
        sample[k] = value
        count += 1
    return sample[count // 2]


@kernel
def _smaller_first(points: Any, ids: Any, low: int, high: int, axis: int, limit: float) -> int:
    """Bring the points below a limit to the front; returns where the others begin. No branches: faster."""
    place = low
    for i in range(low, high):
        below = points[i, axis] < limit
        for k in range(points.shape[1]):
            points[i, k], points[place, k] = points[place, k], points[i, k]
        ids[i], ids[place] = ids[place], ids[i]
        place += below
    return place


@kernel
def _cut(points: Any, ids: Any, low: int, high: int, sample: Any) -> int:
    """Part the points low to high in nearly equal halves; returns where the second begins."""
    if high - low < 2:
        return high
    axis = _widest_axis(points, low, high)
    middle, slack = (low + high) // 2, (high - low) // _SLACK
    first, last = low, high
    while last - first > 1:
        limit = _middle_of_some(points, first, last, axis, sample)
        place = _smaller_first(points, ids, first, last, axis, limit)
        if place == first:  # nothing is below: those equal to the limit go first
            place = _smaller_first(points, ids, first, last, axis, np.nextafter(limit, np.inf))
            if place == first:
                return middle  # no numbers
            if place > middle:  # the middle is among points of one coordinate: beside them, or through them
                nearest = place if place - middle < middle - first else first
                return nearest if abs(nearest - middle) <= (high - low) // 4 else middle
        if abs(place - middle) <= slack:
            return place
        if place < middle:
            first = place
        else:
            last = place
    return middle


@kernel
def _halve(points: Any, depth: int) -> Any:
    """Return the points in an order of halves of halves, and the leaf of each, counted from left to right.

    ``points`` are put into that order, too.
    """
    n = points.shape[0]
    ids = np.arange(n).astype(np.int32)
    leaf = np.zeros(n, dtype=np.int32)
    sample = np.zeros(_SAMPLE + 1)
    stops = np.zeros(depth + 1, dtype=np.int64)  # of the parts around the present one
    stops[0] = n
    low: Any = np.int64(0)  # no literal: it would compile the kernels twice
    path, level = 0, 0
    while True:
        while level < depth:
            level += 1
            path *= 2
            stops[level] = _cut(points, ids, low, stops[level - 1], sample)
        for i in range(low, stops[level]):
            leaf[i] = path
        while path % 2 == 1:
            path //= 2
            level -= 1
        if level == 0:
            return ids, leaf
        low = stops[level]
        stops[level] = stops[level - 1]
        path += 1


@kernel
def _renumbered(starts: Any, columns: Any, data: Any, order: Any) -> Any:
    """Return starts, columns and entries of a matrix with its rows and columns in another order."""
    n = order.size
    place = np.zeros(n, dtype=np.int32)
    for i in range(n):
        place[order[i]] = i
    begin = np.zeros(n + 1, dtype=np.int32)
    neighbours = np.zeros(columns.size, dtype=np.int32)
    entries = np.zeros(columns.size)
    q = 0
    for i in range(n):
        for p in range(starts[order[i]], starts[order[i] + 1]):
            neighbours[q] = place[columns[p]]
            entries[q] = data[p]
            q += 1
        begin[i + 1] = q
    return begin, neighbours, entries


@kernel
def _cutting(matrix: Any, leaf: Any, depth: int) -> Any:
    """Halvings that cut an edge of each vertex, as bits; the lowest bit is the last halving."""
    starts, columns, _ = matrix
    highest = np.zeros(1 << depth, dtype=np.int32)
    for apart in range(1, 1 << depth):
        highest[apart] = max(1, 2 * highest[apart >> 1])
    bits = np.zeros(leaf.size, dtype=np.int32)
    for i in range(leaf.size):
        cut = np.int32(0)
        for p in range(starts[i], starts[i + 1]):
            cut |= highest[leaf[i] ^ leaf[columns[p]]]
        bits[i] = cut
    return bits


@kernel
def _tree_nodes(matrix: Any, leaf: Any, depth: int) -> Any:
    """Node of the tree, numbered as in a heap, that each vertex belongs to: separators and leaves."""
    n = leaf.size
    bits = _cutting(matrix, leaf, depth)
    node = np.zeros(n, dtype=np.int32)
    degree = np.zeros(n, dtype=np.int32)
    edge = np.zeros(n + 1, dtype=np.int32)
    stack = np.zeros(n, dtype=np.int32)
    for bit in range(depth - 1, -1, -1):
        count: Any = np.int64(0)  # no literals: they would compile the kernel twice
        own: Any = np.int64(0)
        for i in range(n + 1):
            if i < n and ((bits[i] >> bit) & 1 == 0 or node[i] != 0):
                continue
            here = (1 << (depth - bit - 1)) + (leaf[i] >> (bit + 1)) if i < n else 0
            if here != own:
                _cover(matrix, leaf, bit, (edge, count), node, own, degree, stack)
                count, own = np.int64(0), here
            edge[count] = i
            count += 1
    for i in range(n):
        if node[i] == 0:
            node[i] = (1 << depth) + leaf[i]
    return node


@kernel
def _cover(matrix: Any, leaf: Any, bit: int, edge: Any, node: Any, own: int, degree: Any, stack: Any) -> None:
    """Put a small cover of the edges that a halving cuts into its node ``own``.

    ``edge`` holds the vertices of these edges and their number.

    The neighbour of a vertex with one edge left is taken, again and again, then all that is left of the side
    with fewer vertices. ``degree`` is zero before and after.
    """
    starts, columns, _ = matrix
    vertices, count = edge
    top = 0
    for v in range(count):
        i = vertices[v]
        for p in range(starts[i], starts[i + 1]):
            j = columns[p]
            degree[i] += (leaf[i] ^ leaf[j]) >> bit == 1 and node[j] == 0
        if degree[i] == 1:
            stack[top] = i
            top += 1
    while top > 0:
        top -= 1
        i = stack[top]
        if degree[i] != 1:
            continue
        j = i
        for p in range(starts[i], starts[i + 1]):
            if (leaf[i] ^ leaf[columns[p]]) >> bit == 1 and degree[columns[p]] > 0:
                j = columns[p]
        node[j] = own
        degree[j] = 0
        for p in range(starts[j], starts[j + 1]):
            k = columns[p]
            if (leaf[j] ^ leaf[k]) >> bit == 1 and degree[k] > 0:
                degree[k] -= 1
                if degree[k] == 1:
                    stack[top] = k
                    top += 1
    right = 0
    both = 0
    for v in range(count):
        i = vertices[v]
        both += degree[i] > 0
        right += degree[i] > 0 and (leaf[i] >> bit) & 1 == 1
    side = 1 if 2 * right < both else 0
    for v in range(count):
        i = vertices[v]
        if degree[i] > 0 and (leaf[i] >> bit) & 1 == side:
            node[i] = own
        degree[i] = 0


@kernel
def _postorder(node: Any, depth: int) -> Any:
    """Return the vertices in postorder of the tree, and where each part begins that is not empty."""
    total = 2 << depth
    size = np.zeros(total, dtype=np.int32)
    for i in range(node.size):
        size[node[i]] += 1
    begin = np.zeros(total, dtype=np.int32)
    parts = np.zeros(total + 1, dtype=np.int32)
    count, place = 0, 0
    for leaf in range(1 << depth):
        at = (1 << depth) + leaf
        while True:  # up from a leaf as long as the right half was the last one
            begin[at] = place
            place += size[at]
            parts[count + 1] = place
            count += size[at] > 0
            if at % 2 == 0 or at == 1:
                break
            at >>= 1
    order = np.zeros(node.size, dtype=np.int32)
    for i in range(node.size):
        order[begin[node[i]]] = i
        begin[node[i]] += 1
    return order, parts[: count + 1].copy()
