"""Smoothing: free nodes move, their wanted sizes grow slowly."""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.
# ruff: noqa: PLR0913

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin.cad.meshing._adjacency import RING_SIZE, STILL, ring_of, wake_if_moved
from cadskin.cad.meshing._metric import metric_at, metric_length, orientation, shape_quality


@kernel
def target_point(
    position: Any, size: Any, v: int, ring: Any, n: int, grid: Any, placing: Any, circumcentres: bool
) -> tuple[float, float, float]:
    """Return the weighted mean of the centres of the triangles round node v, and the sum of the weights.

    The weight is area over the cube of the wanted size: a triangle's area goes with its size squared and the
    distance of its centre with its size, so that a node between a fine and a coarse side rests where each has
    its size. Circumcentres give the optimal Delaunay triangulation (L. Chen, J. Xu, J. Comput. Math. 22
    (2004) 299-308), centroids a slower, smoother step as Lloyd's.
    """
    pu = position[v, 0]
    pv = position[v, 1]
    sum_u = 0.0
    sum_v = 0.0
    weights = 0.0
    for q in range(n):
        x = ring[q]
        y = ring[(q + 1) % n]
        x1 = position[x, 0] - pu
        y1 = position[x, 1] - pv
        x2 = position[y, 0] - pu
        y2 = position[y, 1] - pv
        du = (x1 + x2) / 3.0
        dv = (y1 + y2) / 3.0
        e, f, g = metric_at(grid, placing, pu + du, pv + dv)
        determinant = e * g - f * f
        cross = x1 * y2 - y1 * x2
        if determinant <= 1e-300 or cross <= 0.0:
            continue
        if circumcentres:
            l1 = e * x1 * x1 + 2.0 * f * x1 * y1 + g * y1 * y1
            l2 = e * x2 * x2 + 2.0 * f * x2 * y2 + g * y2 * y2
            g1 = (l1 * y2 - l2 * y1) / (2.0 * cross)
            g2 = (l2 * x1 - l1 * x2) / (2.0 * cross)
            du = (g * g1 - f * g2) / determinant
            dv = (e * g2 - f * g1) / determinant
        wanted = (size[v] + size[x] + size[y]) / 3.0
        weight = math.sqrt(determinant) * cross / (wanted * wanted * wanted)
        sum_u += weight * (pu + du)
        sum_v += weight * (pv + dv)
        weights += weight
    return sum_u, sum_v, weights


@kernel
def worst_quality(position: Any, v: int, ring: Any, n: int, grid: Any, placing: Any) -> float:
    """Return the lowest quality of the triangles round node v, -1 where one is turned over."""
    e, f, g = metric_at(grid, placing, position[v, 0], position[v, 1])
    density = math.sqrt(max(e * g - f * f, 1e-300))
    worst = 2.0
    for q in range(n):
        x = ring[q]
        y = ring[(q + 1) % n]
        if orientation(position, v, x, y) <= 0.0:
            return -1.0
        worst = min(worst, shape_quality(position, v, x, y, e, f, g, density))
    return worst


@kernel
def smooth(
    position: Any,
    size: Any,
    fixed: Any,
    triangles: Any,
    neighbours: Any,
    triangle_of: Any,
    n_nodes: int,
    grid: Any,
    placing: Any,
    awake: Any,
    circumcentres: bool,
) -> None:
    """Move each free node that is awake towards its target, at most as far as its triangles stay good."""
    ring_triangles = np.zeros(RING_SIZE, np.int64)
    ring = np.zeros(RING_SIZE, np.int64)
    for v in range(n_nodes):
        if fixed[v] or triangle_of[v] < 0 or not awake[v]:
            continue
        n = ring_of(triangles, neighbours, triangle_of, v, ring_triangles, ring)
        if n < 3:
            continue
        sum_u, sum_v, weights = target_point(position, size, v, ring, n, grid, placing, circumcentres)
        if weights <= 0.0:
            continue
        before = worst_quality(position, v, ring, n, grid, placing)
        pu = position[v, 0]
        pv = position[v, 1]
        step = 1.0
        moved = False
        for _ in range(4):
            position[v, 0] = pu + step * (sum_u / weights - pu)
            position[v, 1] = pv + step * (sum_v / weights - pv)
            after = worst_quality(position, v, ring, n, grid, placing)
            if after > 0.0 and (after >= before or after > 0.6):
                moved = True
                break
            step *= 0.5
        if not moved:
            position[v, 0] = pu
            position[v, 1] = pv
        metric = metric_at(grid, placing, pu, pv)
        wake_if_moved(position, v, pu, pv, ring, n, metric, STILL * size[v], awake)


@kernel
def grade(
    position: Any,
    size: Any,
    fixed: Any,
    triangles: Any,
    n_triangles: int,
    grid: Any,
    placing: Any,
    grading: float,
    rounds: int,
) -> None:
    """Let the wanted size of free nodes grow by at most ``grading`` per length."""
    for _ in range(rounds):
        changed = False
        for t in range(n_triangles):
            if triangles[t, 0] < 0:
                continue
            for i in range(3):
                a = triangles[t, i]
                c = triangles[t, (i + 1) % 3]
                if size[a] == size[c]:
                    continue
                step = grading * metric_length(grid, placing, position, a, c)
                if not fixed[a] and size[a] > size[c] + step:
                    size[a] = size[c] + step
                    changed = True
                elif not fixed[c] and size[c] > size[a] + step:
                    size[c] = size[a] + step
                    changed = True
        if not changed:
            break
