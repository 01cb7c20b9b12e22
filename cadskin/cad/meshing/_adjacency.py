"""Planar triangulations in arrays: which triangle lies where.

``triangles`` (cap, 3) counter-clockwise, -1 in column 0 of a free row; ``neighbours`` (cap, 3), column i
across the side (i, i + 1), -1 outside; ``locked`` (cap, 3), 1 where that side must stay; ``triangle_of``
(n,), one triangle of each node, -1 for a removed node. The boundary never moves, and every change keeps all
parameter areas positive, so that the mesh stays a triangulation of the face.
"""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.

from __future__ import annotations

from typing import Any

from cadskin._jit import kernel

RING_SIZE = 64
STILL = 0.01  # of the wanted size: a node that moves less sleeps until a neighbour moves


@kernel
def side_of(triangles: Any, t: int, a: int, b: int) -> int:
    """Return the column of the directed side (a, b) in triangle t, -1 when it is none of its sides."""
    for i in range(3):
        if triangles[t, i] == a and triangles[t, (i + 1) % 3] == b:
            return i
    return -1


@kernel
def relink(triangles: Any, neighbours: Any, t: int, a: int, b: int, new: int) -> None:
    """Make ``new`` the neighbour of triangle t across its side (a, b)."""
    if t >= 0:
        i = side_of(triangles, t, a, b)
        if i >= 0:
            neighbours[t, i] = new


@kernel
def set_row(table: Any, row: int, a: int, b: int, c: int) -> None:
    """Write three numbers into a row."""
    table[row, 0] = a
    table[row, 1] = b
    table[row, 2] = c


@kernel
def ring_of(triangles: Any, neighbours: Any, triangle_of: Any, v: int, ring_triangles: Any, ring: Any) -> int:
    """Write the triangles and nodes round the interior node v, counter-clockwise; return how many, or -1."""
    start = triangle_of[v]
    t = start
    n = 0
    while n < RING_SIZE:
        i = -1
        for k in range(3):
            if triangles[t, k] == v:
                i = k
        if i < 0:
            return -1
        ring_triangles[n] = t
        ring[n] = triangles[t, (i + 1) % 3]
        n += 1
        t = neighbours[t, (i + 2) % 3]
        if t < 0:
            return -1
        if t == start:
            return n
    return -1


@kernel
def wake_if_moved(
    position: Any, v: int, pu: float, pv: float, ring: Any, n: int, metric: Any, least: float, awake: Any
) -> None:
    """Wake a node that has moved from (pu, pv) by more than ``least``, and its ring; let others sleep."""
    du = position[v, 0] - pu
    dv = position[v, 1] - pv
    moved = metric[0] * du * du + 2.0 * metric[1] * du * dv + metric[2] * dv * dv > least * least
    awake[v] = 1 if moved else 0
    if moved:
        for q in range(n):
            awake[ring[q]] = 1
