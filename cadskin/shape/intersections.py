"""Self-intersections of a triangle mesh: a box tree finds the pairs, separating axes decide.

Two triangles are apart when they are so along one of 17 axes: the two normals, the nine products of their
edges, and the six edge normals in their planes (Gottschalk, Lin, Manocha: "OBBTree", SIGGRAPH 1996,
doi:10.1145/237170.237244, gives the theorem for convex bodies). Neighbours touch by construction; of them
only the part away from the common vertex or edge is compared.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import kernel
from cadskin.shape.discrete import triangle_normals

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Points, Triangles

__all__ = ["facing_pairs", "near_pairs", "pairs_intersect", "self_intersections", "triangles_intersect"]

_LEAF = 4  # triangles per leaf of the box tree
_TOUCH = 1e-12  # of the bounding box: what is closer counts as touching


def self_intersections(points: Points, triangles: Triangles, *, limit: int = 1_000_000) -> Ints:
    """Return the pairs of triangles that intersect or touch where they should not.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int
    limit : int
        Stop after this many pairs.

    Returns
    -------
    (k, 2) int
        Pairs i < j, sorted. Triangles that share a vertex count when they meet elsewhere too, triangles that
        share an edge when they lie on each other.

    Examples
    --------
    >>> points = np.array([[0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [3, 3, 1.0]])
    >>> self_intersections(points, np.array([[0, 1, 2], [3, 4, 5]])).tolist()
    [[0, 1]]
    """
    touch = _touch(points, triangles)
    return _pairs(points, triangles, (touch, touch, -1.0), limit)


def near_pairs(
    points: Points, triangles: Triangles, *, reach: float, relative_reach: float, limit: int = 10_000_000
) -> Ints:
    """Return the pairs of triangles that a move of the vertices could bring to intersect; all others cannot.

    Parameters
    ----------
    points : (n, 3) float
        Before the move [mm].
    triangles : (m, 3) int
    reach : float
        Largest move of a vertex [mm].
    relative_reach : float
        Largest difference of the moves of the two ends of an edge [mm].
    limit : int
        Stop after this many pairs.

    Returns
    -------
    (k, 2) int
        Pairs i < j, sorted; to be tested after the move by `pairs_intersect`.
    """
    touch = _touch(points, triangles)
    near = 2.0 * relative_reach + touch
    return _pairs(points, triangles, (2.0 * reach + touch, near, near), limit)


def facing_pairs(points: Points, triangles: Triangles, *, reach: float, limit: int = 10_000_000) -> Ints:
    """Return the pairs of triangles on the sides of a wall or a gap that moves of ``reach`` [mm] can close.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int
    reach : float
        Largest move of a vertex [mm].
    limit : int
        Stop after this many pairs.

    Returns
    -------
    (k, 2) int
        Pairs i < j, sorted, without a common vertex, whose normals differ by more than 120°.
    """
    return _pairs(
        points, triangles, (2.0 * reach + _touch(points, triangles), -1.0, -1.0), limit, facing=True
    )


def pairs_intersect(points: Points, triangles: Triangles, pairs: Ints) -> Bools:
    """Return which of the given pairs (k, 2) of triangles intersect; the rules of `self_intersections`."""
    wanted = np.ascontiguousarray(pairs, dtype=np.int64).reshape(-1, 2)
    if not len(wanted):
        return np.zeros(0, dtype=np.bool_)
    corners = np.ascontiguousarray(points[triangles], dtype=np.float64)
    touch = _touch(points, triangles)
    met = _check_pairs(corners, np.array(triangles, dtype=np.int64), wanted, (touch, touch, -1.0))
    return np.asarray(met, dtype=np.bool_)


def triangles_intersect(first: Points, second: Points, *, tol: float = 0.0) -> bool:
    """Return whether two triangles (3, 3) have a point in common, or come closer than ``tol`` [mm]."""
    a, b = (np.ascontiguousarray(t, dtype=np.float64) for t in (first, second))
    return bool(not _apart(_points(a), _points(b), tol))


def _touch(points: Points, triangles: Triangles) -> float:
    if not triangles.size:
        return 0.0
    places = np.ascontiguousarray(points, dtype=np.float64)
    return _TOUCH * float(_extent(places, np.array(triangles, dtype=np.int64)))


@kernel
def _extent(points: Any, triangles: Any) -> float:
    """Return the diagonal of the box about the vertices of triangles."""
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for t in range(triangles.shape[0]):
        for corner in range(3):
            for axis in range(3):
                value = points[triangles[t, corner], axis]
                low[axis] = min(low[axis], value)
                high[axis] = max(high[axis], value)
    return float(np.sqrt(((high - low) ** 2).sum()))


def _pairs(
    points: Points,
    triangles: Triangles,
    gaps: tuple[float, float, float],
    limit: int,
    *,
    facing: bool = False,
) -> Ints:
    """Pairs of triangles that are no further apart than the gap for 0, 1 and 2 shared vertices."""
    if len(triangles) < 2:
        return np.zeros((0, 2), dtype=np.int64)
    corners = np.ascontiguousarray(points[triangles], dtype=np.float64)
    low, high = corners.min(axis=1) - 0.5 * max(gaps), corners.max(axis=1) + 0.5 * max(gaps)
    order = np.argsort(_morton(0.5 * (low + high)), kind="stable")
    tree = _box_tree(low[order], high[order])
    normals = triangle_normals(points, triangles) if facing else np.zeros((0, 3))
    found = _tree_pairs(
        corners, np.array(triangles, dtype=np.int64), normals, low, high, order, *tree, gaps, limit
    )
    return np.asarray(found[np.lexsort((found[:, 1], found[:, 0]))], dtype=np.int64)


def _morton(centres: Points) -> Ints:
    """Position of each point (m,) along a Z-order curve of 2^20 cells per axis."""
    low, size = centres.min(axis=0), np.ptp(centres, axis=0).max()
    cells = ((centres - low) / (size if size > 0 else 1.0) * (2**20 - 1)).astype(np.uint64)
    for shift, mask in (
        (32, 0x1F00000000FFFF),
        (16, 0x1F0000FF0000FF),
        (8, 0x100F00F00F00F00F),
        (4, 0x10C30C30C30C30C3),
        (2, 0x1249249249249249),
    ):
        cells = (cells | (cells << np.uint64(shift))) & np.uint64(mask)
    codes = cells[:, 0] | (cells[:, 1] << np.uint64(1)) | (cells[:, 2] << np.uint64(2))
    return np.asarray(codes, dtype=np.int64)


def _box_tree(low: Floats, high: Floats) -> tuple[Floats, Floats, Ints]:
    """Boxes of a complete binary tree over sorted boxes, `_LEAF` to a leaf; node i has children 2i+1, 2i+2.

    The third array holds the number of the box behind the last one of each node.
    """
    n_leaves = 1 << max(0, int(np.ceil(np.log2(len(low) / _LEAF))))
    missing = n_leaves * _LEAF - len(low)
    low = np.concatenate([low, np.full((missing, 3), np.inf)])
    high = np.concatenate([high, np.full((missing, 3), -np.inf)])
    lows, highs = (
        [low.reshape(n_leaves, _LEAF, 3).min(axis=1)],
        [high.reshape(n_leaves, _LEAF, 3).max(axis=1)],
    )
    ends = [_LEAF * np.arange(1, n_leaves + 1)]
    while len(lows[0]) > 1:
        lows.insert(0, lows[0].reshape(-1, 2, 3).min(axis=1))
        highs.insert(0, highs[0].reshape(-1, 2, 3).max(axis=1))
        ends.insert(0, ends[0][1::2])
    return np.concatenate(lows), np.concatenate(highs), np.concatenate(ends)


@kernel
def _tree_pairs(  # noqa: PLR0913
    corners: Any,
    triangles: Any,
    normals: Any,
    low: Any,
    high: Any,
    order: Any,
    tree_low: Any,
    tree_high: Any,
    tree_end: Any,
    gaps: Any,
    limit: Any,
) -> Any:
    """Walk the tree once per leaf; of two leaves the one that stands first in the order asks."""
    n_leaves = (len(tree_end) + 1) // 2
    first_leaf = n_leaves - 1
    found = np.zeros((64, 2), dtype=np.int64)
    n_found = 0
    stack = np.zeros(128, dtype=np.int64)
    for leaf in range(n_leaves):
        top = 1
        stack[0] = 0
        while top > 0:
            top -= 1
            node = stack[top]
            if tree_end[node] <= leaf * _LEAF or not _boxes_meet(
                tree_low, tree_high, first_leaf + leaf, tree_low, tree_high, node
            ):
                continue
            if node < first_leaf:
                stack[top] = 2 * node + 1
                stack[top + 1] = 2 * node + 2
                top += 2
                continue
            for one in range(leaf * _LEAF, min((leaf + 1) * _LEAF, len(order))):
                i = order[one]
                for two in range(max(tree_end[node] - _LEAF, one + 1), min(tree_end[node], len(order))):
                    j = order[two]
                    if not _boxes_meet(low, high, i, low, high, j):
                        continue
                    if len(normals) and not _face_each_other(triangles, normals, i, j):
                        continue
                    if not _pair_meets(corners, triangles, i, j, gaps):
                        continue
                    if n_found == len(found):
                        grown = np.zeros((2 * n_found, 2), dtype=np.int64)
                        grown[:n_found] = found
                        found = grown
                    found[n_found, 0], found[n_found, 1] = min(i, j), max(i, j)
                    n_found += 1
                    if n_found >= limit:
                        return found[:n_found]
    return found[:n_found]


@kernel
def _check_pairs(corners: Any, triangles: Any, pairs: Any, gaps: Any) -> Any:
    result = np.zeros(len(pairs), dtype=np.bool_)
    for k in range(len(pairs)):
        result[k] = _pair_meets(corners, triangles, pairs[k, 0], pairs[k, 1], gaps)
    return result


@kernel
def _boxes_meet(low: Any, high: Any, i: Any, other_low: Any, other_high: Any, j: Any) -> Any:
    return (
        low[i, 0] <= other_high[j, 0]
        and other_low[j, 0] <= high[i, 0]
        and low[i, 1] <= other_high[j, 1]
        and other_low[j, 1] <= high[i, 1]
        and low[i, 2] <= other_high[j, 2]
        and other_low[j, 2] <= high[i, 2]
    )


@kernel
def _face_each_other(triangles: Any, normals: Any, i: Any, j: Any) -> Any:
    """Whether two triangles have no common vertex and normals more than 120° apart."""
    for a in range(3):
        for b in range(3):
            if triangles[i, a] == triangles[j, b]:
                return False
    return (
        normals[i, 0] * normals[j, 0] + normals[i, 1] * normals[j, 1] + normals[i, 2] * normals[j, 2] < -0.5
    )


@kernel
def _pair_meets(corners: Any, triangles: Any, i: Any, j: Any, gaps: Any) -> Any:
    """Whether two triangles of a mesh come close outside of the vertices they share.

    ``gaps`` are for triangles with 0, 1 and 2 shared vertices; the last one negative asks for a fold.
    """
    n_shared = 0
    sum_i = 0
    sum_j = 0
    for a in range(3):
        for b in range(3):
            if triangles[i, a] == triangles[j, b]:
                n_shared += 1
                sum_i += a
                sum_j += b
    if n_shared > 2:
        return True
    one, two = _points(corners[i]), _points(corners[j])
    if n_shared == 0:
        return not _apart(one, two, gaps[0])
    if n_shared == 1:
        return not (_apart(_side(one, sum_i), two, gaps[1]) and _apart(_side(two, sum_j), one, gaps[1]))
    if gaps[2] >= 0.0:
        tip_one, tip_two = one[3 - sum_i], two[3 - sum_j]
        return not (
            _apart((tip_one, tip_one, tip_one), two, gaps[2])
            and _apart((tip_two, tip_two, tip_two), one, gaps[2])
        )
    return _folded_on(one, 3 - sum_i, two, 3 - sum_j)


@kernel
def _points(corners: Any) -> Any:
    """Corners (3, 3) as tuples: nothing is allocated on them."""
    return (
        (corners[0, 0], corners[0, 1], corners[0, 2]),
        (corners[1, 0], corners[1, 1], corners[1, 2]),
        (corners[2, 0], corners[2, 1], corners[2, 2]),
    )


@kernel
def _side(triangle: Any, corner: Any) -> Any:
    """Return the side opposite ``corner``, a triangle without area."""
    start, end = triangle[(corner + 1) % 3], triangle[(corner + 2) % 3]
    return (start, end, end)


@kernel
def _folded_on(one: Any, tip_one: Any, two: Any, tip_two: Any) -> Any:
    """Whether two triangles with a common side lie on each other: the angle between them is below 1e-6."""
    start = one[(tip_one + 1) % 3]
    axis = _minus(one[(tip_one + 2) % 3], start)
    a, b = _cross(axis, _minus(one[tip_one], start)), _cross(axis, _minus(two[tip_two], start))
    sine = _cross(a, b)
    cosine = _dot(a, b)
    return cosine > 0.0 and _dot(sine, sine) < 1e-12 * cosine * cosine


@kernel
def _minus(a: Any, b: Any) -> Any:
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


@kernel
def _dot(a: Any, b: Any) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@kernel
def _cross(a: Any, b: Any) -> Any:
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@kernel
def _parts(axis: Any, one: Any, two: Any, tolerance: Any) -> Any:
    """Whether the planes across ``axis`` keep two triangles more than ``tolerance`` apart."""
    p, q, r = _dot(axis, one[0]), _dot(axis, one[1]), _dot(axis, one[2])
    s, t, u = _dot(axis, two[0]), _dot(axis, two[1]), _dot(axis, two[2])
    gap = max(min(p, q, r) - max(s, t, u), min(s, t, u) - max(p, q, r))
    return gap > 0.0 and gap * gap > tolerance * tolerance * _dot(axis, axis)


@kernel
def _apart(first: Any, second: Any, tolerance: Any) -> Any:
    """Whether a separating axis exists; a triangle may be a segment (its last two corners equal)."""
    origin = first[0]  # near the origin the products keep their digits
    a = (_minus(first[0], origin), _minus(first[1], origin), _minus(first[2], origin))
    b = (_minus(second[0], origin), _minus(second[1], origin), _minus(second[2], origin))
    sides_a = (_minus(a[1], a[0]), _minus(a[2], a[1]), _minus(a[0], a[2]))
    sides_b = (_minus(b[1], b[0]), _minus(b[2], b[1]), _minus(b[0], b[2]))
    normal_a, normal_b = _cross(sides_a[0], sides_a[1]), _cross(sides_b[0], sides_b[1])
    if _parts(normal_a, a, b, tolerance) or _parts(normal_b, a, b, tolerance):
        return True
    for side in sides_a:
        if _parts(_cross(normal_a, side), a, b, tolerance) or _parts(_cross(normal_b, side), a, b, tolerance):
            return True
    for side in sides_b:
        if _parts(_cross(normal_b, side), a, b, tolerance) or _parts(_cross(normal_a, side), a, b, tolerance):
            return True
    for side in sides_a:
        for other in sides_b:
            if _parts(_cross(side, other), a, b, tolerance):
                return True
    return False
