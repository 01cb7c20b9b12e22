"""Sparse Cholesky for meshes: geometric nested dissection, up-looking, many right sides at once.

References
----------
Davis: Direct Methods for Sparse Linear Systems, SIAM 2006, chapters 4 (elimination tree, up-looking
Cholesky) and 7 (fill-reducing orderings); George: Nested dissection of a regular finite element mesh, SIAM J.
Numer. Anal. 10 (1973), doi:10.1137/0710032.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import fast_kernel, kernel
from cadskin.deviation._linear import COLUMNS
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csr_array

    from cadskin._typing import Ints, Points

__all__ = ["SparseCholesky", "nested_dissection"]

_LEAF = 8  # vertices below which a part of the mesh is not dissected further


class SparseCholesky:
    """The factor L of a symmetric positive definite matrix, P A P^T = L L^T.

    Parameters
    ----------
    matrix : (n, n) csr_array
        Symmetric, with all its entries.
    points : (n, d) float
        Positions of the unknowns; they steer the ordering.

    Attributes
    ----------
    order : (n,) int
        Row of the matrix that stands at each place of the factor.

    Raises
    ------
    DeviationError
        The matrix is not positive definite.
    """

    def __init__(self, matrix: csr_array, points: Points) -> None:
        first = nested_dissection(matrix, points)
        tree = _elimination_tree(*_structure(_permuted(matrix, first)))
        self.order: Ints = first[_postorder(tree)]
        permuted = _permuted(matrix, self.order)
        starts, columns = _structure(permuted)
        tree = _elimination_tree(starts, columns)
        counts = _column_counts(starts, columns, tree)
        self.starts: Ints = np.concatenate([[0], np.cumsum(counts)])
        self.rows, self.values, ok = _factor(starts, columns, permuted.data, tree, self.starts)
        if not ok:
            raise DeviationError("the matrix is not positive definite: the mesh has degenerate triangles")
        self._single = self.values.astype(np.float32)
        self._by_row = _by_rows(self.starts, self.rows, self._single)

    def solve_columns(self, columns: NDArray[np.float32]) -> None:
        """Solve in place for right sides (n, COLUMNS) in the order of the factor, in single precision."""
        begin, places, values = self._by_row
        _forward(begin, places, values, columns)
        _backward(self.starts, self.rows, self._single, columns)


def nested_dissection(matrix: csr_array, points: Points) -> Ints:
    """Return an order that cuts the mesh in halves again and again, separators last."""
    extent = np.ptp(points, axis=0)
    used = points[:, extent > 1e-9 * extent.max(initial=0.0)] if len(points) else points
    starts, columns = _structure(matrix)
    return np.asarray(_dissect(np.ascontiguousarray(used), starts, columns), dtype=np.int64)


def _structure(matrix: csr_array) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    return matrix.indptr.astype(np.int32), matrix.indices.astype(np.int32)


def _permuted(matrix: csr_array, order: Ints) -> csr_array:
    permuted = matrix[order][:, order].tocsr()
    permuted.sort_indices()
    return permuted


@kernel
def _widest_axis(points: Any, ids: Any) -> int:
    best, width = 0, -1.0
    for axis in range(points.shape[1]):
        low, high = np.inf, -np.inf
        for i in ids:
            low = min(low, points[i, axis])
            high = max(high, points[i, axis])
        if high - low > width:
            best, width = axis, high - low
    return best


@kernel
def _count_touching(ids: Any, mark: Any, own: int, other: int, starts: Any, columns: Any) -> int:
    """How many of the vertices marked ``own`` have a neighbour marked ``other``."""
    count = 0
    for i in ids:
        if mark[i] == own:
            for p in range(starts[i], starts[i + 1]):
                if mark[columns[p]] == other:
                    count += 1
                    break
    return count


@kernel
def _split(ids: Any, points: Any, mark: Any, tag: int, starts: Any, columns: Any) -> Any:
    """Side of each vertex: 0 and 1 the halves, 2 the separator; marks are tag and tag + 1 on return."""
    axis = _widest_axis(points, ids)
    middle = np.median(points[ids, axis])
    below = 0
    for i in ids:
        low = points[i, axis] < middle
        below += low
        mark[i] = tag if low else tag + 1
    side = np.zeros(ids.size, dtype=np.int8)
    if below == 0 or below == ids.size:
        return side, False
    left = _count_touching(ids, mark, tag, tag + 1, starts, columns)
    right = _count_touching(ids, mark, tag + 1, tag, starts, columns)
    own, other = (tag, tag + 1) if left <= right else (tag + 1, tag)
    for k in range(ids.size):
        i = ids[k]
        side[k] = mark[i] - tag
        if mark[i] == own:
            for p in range(starts[i], starts[i + 1]):
                if mark[columns[p]] == other:
                    side[k] = 2
                    break
    return side, True


@kernel
def _dissect(points: Any, starts: Any, columns: Any) -> Any:
    n = points.shape[0]
    ids = np.arange(n)
    order = np.zeros(n, dtype=np.int64)
    mark = np.full(n, -1, dtype=np.int64)
    stack = [(0, n, n)]  # a range of ids, and where its last vertex goes in the order
    tag = 0
    while len(stack) > 0:
        low, high, end = stack.pop()
        count = high - low
        if count <= _LEAF:
            order[end - count : end] = ids[low:high]
            continue
        part = ids[low:high].copy()
        side, cut = _split(part, points, mark, tag, starts, columns)
        tag += 2
        if not cut:
            order[end - count : end] = part
            continue
        left, right, separator = part[side == 0], part[side == 1], part[side == 2]
        mark[separator] = -1
        order[end - separator.size : end] = separator
        ids[low : low + left.size] = left
        ids[low + left.size : low + left.size + right.size] = right
        stack.append((low, low + left.size, end - separator.size - right.size))
        stack.append((low + left.size, low + left.size + right.size, end - separator.size))
    return order


@kernel
def _elimination_tree(starts: Any, columns: Any) -> Any:
    n = starts.size - 1
    parent = np.full(n, -1, dtype=np.int64)
    ancestor = np.full(n, -1, dtype=np.int64)
    for k in range(n):
        for p in range(starts[k], starts[k + 1]):
            i = np.int64(columns[p])
            while i != -1 and i < k:
                following = ancestor[i]
                ancestor[i] = k
                if following == -1:
                    parent[i] = k
                i = following
    return parent


@kernel
def _postorder(parent: Any) -> Any:
    n = parent.size
    head = np.full(n, -1, dtype=np.int64)
    following = np.full(n, -1, dtype=np.int64)
    for j in range(n - 1, -1, -1):
        if parent[j] != -1:
            following[j] = head[parent[j]]
            head[parent[j]] = j
    order = np.zeros(n, dtype=np.int64)
    stack = np.zeros(n, dtype=np.int64)
    k = 0
    for root in range(n):
        if parent[root] != -1:
            continue
        top = 0
        stack[0] = root
        while top >= 0:
            child = head[stack[top]]
            if child == -1:
                order[k] = stack[top]
                k += 1
                top -= 1
            else:
                head[stack[top]] = following[child]
                top += 1
                stack[top] = child
    return order


@kernel
def _column_counts(starts: Any, columns: Any, parent: Any) -> Any:
    n = parent.size
    counts = np.ones(n, dtype=np.int64)
    mark = np.full(n, -1, dtype=np.int64)
    for k in range(n):
        mark[k] = k
        for p in range(starts[k], starts[k + 1]):
            i = np.int64(columns[p])
            while i < k and mark[i] != k:
                mark[i] = k
                counts[i] += 1
                i = parent[i]
    return counts


@fast_kernel
def _factor(starts: Any, columns: Any, data: Any, parent: Any, ends: Any) -> Any:
    """Up-looking factorisation: row k of L by a sparse triangular solve (Davis 2006, section 4.7)."""
    n = parent.size
    rows = np.zeros(ends[n], dtype=np.uint32)  # unsigned: no check for negative places in the loops
    values = np.zeros(ends[n])
    fill = ends[:n].copy()
    work = np.zeros(n)
    mark = np.full(n, -1, dtype=np.int64)
    path = np.zeros(n, dtype=np.int64)
    for k in range(n):
        top = n
        mark[k] = k
        pivot = 0.0
        for p in range(starts[k], starts[k + 1]):
            i = np.int64(columns[p])
            if i > k:
                continue
            if i == k:
                pivot = data[p]
                continue
            work[i] = data[p]
            length = 0
            while mark[i] != k:
                path[length] = i
                length += 1
                mark[i] = k
                i = parent[i]
            while length > 0:
                length -= 1
                top -= 1
                path[top] = path[length]
        for t in range(top, n):
            i = path[t]
            begin = ends[i]
            entry = work[i] / values[begin]
            work[i] = 0.0
            for p in range(begin + 1, fill[i]):
                work[rows[p]] -= values[p] * entry
            pivot -= entry * entry
            rows[fill[i]] = k
            values[fill[i]] = entry
            fill[i] += 1
        if not pivot > 0.0:
            return rows, values, False
        rows[fill[k]] = k
        values[fill[k]] = math.sqrt(pivot)
        fill[k] += 1
    return rows, values, True


@kernel
def _by_rows(starts: Any, rows: Any, values: Any) -> Any:
    """Return the factor row by row, the diagonal last in each row."""
    n = starts.size - 1
    begin = np.zeros(n + 1, dtype=np.int64)
    for p in range(starts[n]):
        begin[rows[p] + 1] += 1
    for i in range(n):
        begin[i + 1] += begin[i]
    fill = begin[:n].copy()
    columns = np.zeros(starts[n], dtype=np.uint32)
    entries = np.zeros(starts[n], dtype=values.dtype)
    for j in range(n):
        for p in range(starts[j], starts[j + 1]):
            q = fill[rows[p]]
            columns[q] = j
            entries[q] = values[p]
            fill[rows[p]] += 1
    return begin, columns, entries


@fast_kernel
def _gather(x: Any, i: int, ids: Any, values: Any, begin: int, end: int) -> None:
    """x[i] -= sum of values[p] x[ids[p]], four at a time."""
    p = begin
    while p + 4 <= end:
        v0, v1, v2, v3 = values[p], values[p + 1], values[p + 2], values[p + 3]
        a, b, c, d = ids[p], ids[p + 1], ids[p + 2], ids[p + 3]
        for r in range(COLUMNS):
            x[i, r] -= v0 * x[a, r] + v1 * x[b, r] + v2 * x[c, r] + v3 * x[d, r]
        p += 4
    while p < end:
        v0, a = values[p], ids[p]
        for r in range(COLUMNS):
            x[i, r] -= v0 * x[a, r]
        p += 1


@fast_kernel
def _forward(begin: Any, columns: Any, values: Any, x: Any) -> None:
    for i in range(begin.size - 1):
        last = begin[i + 1] - 1
        _gather(x, i, columns, values, begin[i], last)
        inverse = np.float32(1.0) / values[last]
        for r in range(COLUMNS):
            x[i, r] *= inverse


@fast_kernel
def _backward(starts: Any, rows: Any, values: Any, x: Any) -> None:
    for j in range(starts.size - 2, -1, -1):
        first = starts[j]
        _gather(x, j, rows, values, first + 1, starts[j + 1])
        inverse = np.float32(1.0) / values[first]
        for r in range(COLUMNS):
            x[j, r] *= inverse
