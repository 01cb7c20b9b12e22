"""Nearest points on a triangle mesh: a box tree over the triangles in Z-order, walked nearest child first.

References
----------
Closest point of a triangle by regions: Ericson, Real-Time Collision Detection (2005), section 5.1.5.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Triangles

__all__ = ["Feet", "TriangleTree", "box_tree", "closest_on_mesh", "closest_on_triangles"]

_LEAF = 4  # triangles per leaf


@dataclass(frozen=True, eq=False)
class TriangleTree:
    """A complete binary tree of boxes over triangles; node i has children 2i + 1 and 2i + 2.

    Parameters
    ----------
    corners : (m, 9) float
        Corners of the triangles in the order of the tree [mm].
    order : (m,) int
        Their numbers in the mesh.
    boxes : (nodes, 6) float
        Lowest and highest corner of each node.
    """

    corners: Floats
    order: Ints
    boxes: Floats


@dataclass(frozen=True, eq=False)
class Feet:
    """Nearest points of a mesh.

    Parameters
    ----------
    triangles : (n,) int
    weights : (n, 3) float
        Barycentric coordinates of the foot; a zero says that it lies on the opposite side.
    distances : (n,) float
        Unsigned [mm]; infinite where none is within the limit.
    """

    triangles: Ints
    weights: Floats
    distances: Floats


def box_tree(points: Points, triangles: Triangles) -> TriangleTree:
    """Return the tree of a mesh (m, 3) with vertices (n, 3) [mm]."""
    corners = np.asarray(points, dtype=np.float64)[triangles]
    order = np.argsort(z_order(corners.mean(axis=1)), kind="stable")
    corners = corners[order]
    leaves = 1 << max(0, int(np.ceil(np.log2(len(order) / _LEAF))))
    missing = leaves * _LEAF - len(order)
    low = np.concatenate([corners.min(axis=1), np.full((missing, 3), np.inf)])
    high = np.concatenate([corners.max(axis=1), np.full((missing, 3), -np.inf)])
    lows = [low.reshape(leaves, _LEAF, 3).min(axis=1)]
    highs = [high.reshape(leaves, _LEAF, 3).max(axis=1)]
    while len(lows[0]) > 1:
        lows.insert(0, lows[0].reshape(-1, 2, 3).min(axis=1))
        highs.insert(0, highs[0].reshape(-1, 2, 3).max(axis=1))
    boxes = np.concatenate([np.concatenate(lows), np.concatenate(highs)], axis=1)
    return TriangleTree(corners.reshape(-1, 9), order.astype(np.int64), boxes)


def z_order(centres: Points) -> Ints:
    """Return the position of points (m, 3) along a Z-order curve of 2^20 cells per axis."""
    low, size = centres.min(axis=0), float(np.ptp(centres, axis=0).max())
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


def closest_on_mesh(tree: TriangleTree, points: Points, *, limit: float = np.inf) -> Feet:
    """Return the nearest point of the mesh for each point (n, 3) [mm].

    Parameters
    ----------
    tree : TriangleTree
    points : (n, 3) float
        Neighbours in the array should be neighbours in space (`z_order`): then it is fastest.
    limit : float
        Look no further than this [mm].
    """
    given = np.ascontiguousarray(points, dtype=np.float64)
    triangles, weights, squared = _closest(tree.corners, tree.order, tree.boxes, given, float(limit) ** 2)
    return Feet(triangles, weights, np.sqrt(squared))


def closest_on_triangles(corners: Floats, points: Points) -> Floats:
    """Return the barycentric coordinates (n, 3) of the nearest point of triangle i (n, 3, 3) to point i."""
    flat = np.ascontiguousarray(corners, dtype=np.float64).reshape(-1, 9)
    return np.asarray(_each(flat, np.ascontiguousarray(points, dtype=np.float64)))


@njit(cache=True)
def _each(corners, points):  # type: ignore[no-untyped-def]
    weights = np.zeros((len(points), 3))
    for i in range(len(points)):
        _, v, w = _on_triangle(corners, i, points[i, 0], points[i, 1], points[i, 2])
        weights[i, 0], weights[i, 1], weights[i, 2] = 1.0 - v - w, v, w
    return weights


@njit(cache=True)
def _closest(corners, order, boxes, points, limit2):  # type: ignore[no-untyped-def]
    n = len(points)
    triangles = np.full(n, -1, dtype=np.int64)
    weights = np.zeros((n, 3))
    squared = np.full(n, np.inf)
    first_leaf = (len(boxes) + 1) // 2 - 1
    stack = np.zeros(128, dtype=np.int64)
    gaps = np.zeros(128)
    last = 0
    for i in range(n):
        x, y, z = points[i, 0], points[i, 1], points[i, 2]
        best, bv, bw = _on_triangle(corners, last, x, y, z)  # the neighbour's triangle bounds the search
        found = last
        if best >= limit2:
            best, found = limit2, -1
        top = 1
        stack[0], gaps[0] = 0, 0.0
        while top > 0:
            top -= 1
            node = stack[top]
            if gaps[top] >= best:
                continue
            if node < first_leaf:
                one, two = 2 * node + 1, 2 * node + 2
                gap_one, gap_two = _to_box(boxes, one, x, y, z), _to_box(boxes, two, x, y, z)
                if gap_one > gap_two:
                    one, two = two, one
                    gap_one, gap_two = gap_two, gap_one
                if gap_two < best:
                    stack[top], gaps[top] = two, gap_two
                    top += 1
                if gap_one < best:
                    stack[top], gaps[top] = one, gap_one
                    top += 1
                continue
            start = (node - first_leaf) * 4
            for k in range(start, min(start + 4, len(order))):
                distance, v, w = _on_triangle(corners, k, x, y, z)
                if distance < best:
                    best, bv, bw, found = distance, v, w, k
        if found >= 0:
            last = found
            triangles[i] = order[found]
            squared[i] = best
            weights[i, 0], weights[i, 1], weights[i, 2] = 1.0 - bv - bw, bv, bw
    return triangles, weights, squared


@njit(cache=True)
def _to_box(boxes, node, x, y, z):  # type: ignore[no-untyped-def]
    dx = max(boxes[node, 0] - x, 0.0, x - boxes[node, 3])
    dy = max(boxes[node, 1] - y, 0.0, y - boxes[node, 4])
    dz = max(boxes[node, 2] - z, 0.0, z - boxes[node, 5])
    return dx * dx + dy * dy + dz * dz


@njit(cache=True)
def _on_triangle(corners, k, x, y, z):  # type: ignore[no-untyped-def]
    """Return squared distance and the weights of the second and third corner of the foot."""
    ax, ay, az = corners[k, 0], corners[k, 1], corners[k, 2]
    abx, aby, abz = corners[k, 3] - ax, corners[k, 4] - ay, corners[k, 5] - az
    acx, acy, acz = corners[k, 6] - ax, corners[k, 7] - ay, corners[k, 8] - az
    apx, apy, apz = x - ax, y - ay, z - az
    d1 = abx * apx + aby * apy + abz * apz
    d2 = acx * apx + acy * apy + acz * apz
    bb = abx * abx + aby * aby + abz * abz
    bc = abx * acx + aby * acy + abz * acz
    cc = acx * acx + acy * acy + acz * acz
    d3, d4 = d1 - bb, d2 - bc
    d5, d6 = d1 - bc, d2 - cc
    vc = d1 * d4 - d3 * d2
    vb = d5 * d2 - d1 * d6
    va = d3 * d6 - d5 * d4
    if d1 <= 0.0 and d2 <= 0.0:
        v, w = 0.0, 0.0
    elif d3 >= 0.0 and d4 <= d3:
        v, w = 1.0, 0.0
    elif vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v, w = d1 / (d1 - d3), 0.0
    elif d6 >= 0.0 and d5 <= d6:
        v, w = 0.0, 1.0
    elif vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        v, w = 0.0, d2 / (d2 - d6)
    elif va <= 0.0 and (d4 - d3) >= 0.0 and (d5 - d6) >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        v = 1.0 - w
    else:
        total = va + vb + vc
        v, w = (vb / total, vc / total) if total > 0.0 else (0.0, 0.0)
    rx, ry, rz = apx - v * abx - w * acx, apy - v * aby - w * acy, apz - v * abz - w * acz
    return rx * rx + ry * ry + rz * rz, v, w
