"""Collapses: nodes go where sides are too short."""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.
# ruff: noqa: PLR0913

from __future__ import annotations

from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin.cad.meshing._adjacency import RING_SIZE, relink, ring_of, side_of
from cadskin.cad.meshing._metric import metric_length, orientation


@kernel
def collapse(
    triangles: Any,
    neighbours: Any,
    locked: Any,
    triangle_of: Any,
    v: int,
    ring_triangles: Any,
    ring: Any,
    n: int,
    best: int,
) -> None:
    """Move node v into its neighbour ring[best]; the two triangles between them vanish."""
    w = ring[best]
    x = ring[(best + 1) % n]
    y = ring[(best - 1) % n]
    left = ring_triangles[best]  # (v, w, x)
    right = ring_triangles[(best - 1) % n]  # (v, y, w)
    side = side_of(triangles, left, w, x)
    outer_left = neighbours[left, side]
    lock_left = locked[left, side]
    inner_left = neighbours[left, side_of(triangles, left, x, v)]
    side = side_of(triangles, right, y, w)
    outer_right = neighbours[right, side]
    lock_right = locked[right, side]
    inner_right = neighbours[right, side_of(triangles, right, v, y)]
    for q in range(n):
        t = ring_triangles[q]
        if t in (left, right):
            continue
        for k in range(3):
            if triangles[t, k] == v:
                triangles[t, k] = w
        for k in range(3):
            triangle_of[triangles[t, k]] = t
    side = side_of(triangles, inner_left, w, x)
    neighbours[inner_left, side] = outer_left
    locked[inner_left, side] = lock_left
    relink(triangles, neighbours, outer_left, x, w, inner_left)
    side = side_of(triangles, inner_right, y, w)
    neighbours[inner_right, side] = outer_right
    locked[inner_right, side] = lock_right
    relink(triangles, neighbours, outer_right, w, y, inner_right)
    triangles[left, 0] = -1
    triangles[right, 0] = -1
    triangle_of[v] = -1


@kernel
def collapse_short(
    position: Any,
    size: Any,
    fixed: Any,
    triangles: Any,
    neighbours: Any,
    locked: Any,
    triangle_of: Any,
    n_nodes: int,
    grid: Any,
    placing: Any,
    short: float,
    limit: float,
) -> int:
    """Collapse free nodes with a side below ``short`` sizes, where no side grows beyond ``limit`` sizes.

    The fan of the target node must be positive: then it fills the star of the removed node exactly, and no
    side can appear twice.
    """
    ring_triangles = np.zeros(RING_SIZE, np.int64)
    ring = np.zeros(RING_SIZE, np.int64)
    done = 0
    for v in range(n_nodes):
        if fixed[v] or triangle_of[v] < 0:
            continue
        n = ring_of(triangles, neighbours, triangle_of, v, ring_triangles, ring)
        if n < 3:
            continue
        best = -1
        smallest = short
        for q in range(n):
            w = ring[q]
            ratio = metric_length(grid, placing, position, v, w) / (0.5 * (size[v] + size[w]))
            if ratio < smallest:
                smallest = ratio
                best = q
        if best < 0:
            continue
        w = ring[best]
        allowed = True
        for q in range(n):
            x = ring[q]
            y = ring[(q + 1) % n]
            if x == w or y == w:
                continue
            if orientation(position, w, x, y) <= 1e-3 * orientation(position, v, x, y) or metric_length(
                grid, placing, position, w, x
            ) > limit * 0.5 * (size[w] + size[x]):
                allowed = False
                break
        if allowed:
            collapse(triangles, neighbours, locked, triangle_of, v, ring_triangles, ring, n, best)
            done += 1
    return done
