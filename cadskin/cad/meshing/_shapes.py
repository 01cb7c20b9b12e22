"""Shapes: free nodes move to where their triangles are most nearly equilateral, whatever their size."""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.
# ruff: noqa: PLR0913

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin.cad.meshing._adjacency import RING_SIZE, STILL, ring_of, wake_if_moved
from cadskin.cad.meshing._metric import metric_at, metric_length, shape_quality

POINT = 1e-3  # of the distance to it: length of a side that is one point
EQUILATERAL = 1.002  # mean of 1 / quality below which a node stays


@kernel
def shape_energy(position: Any, v: int, ring: Any, n: int, grid: Any, placing: Any) -> float:
    """Return the sum of 1 / quality of the triangles round node v; infinite where one is turned over."""
    total = 0.0
    for q in range(n):
        x = ring[q]
        y = ring[(q + 1) % n]
        middle_u = (position[v, 0] + position[x, 0] + position[y, 0]) / 3.0
        middle_v = (position[v, 1] + position[x, 1] + position[y, 1]) / 3.0
        e, f, g = metric_at(grid, placing, middle_u, middle_v)
        density = math.sqrt(max(e * g - f * f, 1e-300))
        quality = shape_quality(position, v, x, y, e, f, g, density)
        if quality <= 0.0:
            return math.inf
        total += 1.0 / quality
    return total


@kernel
def shape_step(position: Any, v: int, ring: Any, n: int, grid: Any, placing: Any) -> tuple[float, float]:
    """Return Newton's step of node v for the sum of 1 / quality.

    Each term is the sum of the squared sides over the area, quadratic over linear in the place of v: convex
    as long as no triangle turns over.
    """
    pu = position[v, 0]
    pv = position[v, 1]
    gu = 0.0
    gv = 0.0
    huu = 0.0
    huv = 0.0
    hvv = 0.0
    for q in range(n):
        x = ring[q]
        y = ring[(q + 1) % n]
        x1 = position[x, 0] - pu
        y1 = position[x, 1] - pv
        x2 = position[y, 0] - pu
        y2 = position[y, 1] - pv
        x3 = x2 - x1
        y3 = y2 - y1
        e, f, g = metric_at(grid, placing, pu + (x1 + x2) / 3.0, pv + (y1 + y2) / 3.0)
        density = math.sqrt(max(e * g - f * f, 1e-300))
        double = density * (x1 * y2 - y1 * x2)
        sides = (
            e * (x1 * x1 + x2 * x2 + x3 * x3)
            + 2.0 * f * (x1 * y1 + x2 * y2 + x3 * y3)
            + g * (y1 * y1 + y2 * y2 + y3 * y3)
        )
        nu = -2.0 * (e * (x1 + x2) + f * (y1 + y2))
        nv = -2.0 * (f * (x1 + x2) + g * (y1 + y2))
        du = -density * y3
        dv = density * x3
        inverse = 1.0 / double
        ratio = sides * inverse
        gu += inverse * (nu - ratio * du)
        gv += inverse * (nv - ratio * dv)
        huu += inverse * (4.0 * e + inverse * (2.0 * ratio * du * du - 2.0 * nu * du))
        huv += inverse * (4.0 * f + inverse * (2.0 * ratio * du * dv - nu * dv - nv * du))
        hvv += inverse * (4.0 * g + inverse * (2.0 * ratio * dv * dv - 2.0 * nv * dv))
    determinant = huu * hvv - huv * huv
    if not determinant > 0.0:
        return 0.0, 0.0
    return (huv * gv - hvv * gu) / determinant, (huv * gu - huu * gv) / determinant


@kernel
def touches_pole(position: Any, fixed: Any, v: int, ring: Any, n: int, grid: Any, placing: Any) -> bool:
    """Say whether a side across from node v has no length: its triangle vanishes in space."""
    for q in range(n):
        x = ring[q]
        y = ring[(q + 1) % n]
        if fixed[x] and fixed[y]:
            side = metric_length(grid, placing, position, x, y)
            if side < POINT * metric_length(grid, placing, position, v, x):
                return True
    return False


@kernel
def improve_shape(
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
) -> int:
    """Move awake free nodes whose triangles are not yet equilateral to better shapes; return how many."""
    ring_triangles = np.zeros(RING_SIZE, np.int64)
    ring = np.zeros(RING_SIZE, np.int64)
    moved = 0
    for v in range(n_nodes):
        if fixed[v] or triangle_of[v] < 0 or not awake[v]:
            continue
        n = ring_of(triangles, neighbours, triangle_of, v, ring_triangles, ring)
        if n < 3 or touches_pole(position, fixed, v, ring, n, grid, placing):
            continue
        before = shape_energy(position, v, ring, n, grid, placing)
        if before < EQUILATERAL * n or before == math.inf:
            awake[v] = 0
            continue
        du, dv = shape_step(position, v, ring, n, grid, placing)
        pu = position[v, 0]
        pv = position[v, 1]
        step = 1.0
        for _ in range(4):
            position[v, 0] = pu + step * du
            position[v, 1] = pv + step * dv
            if shape_energy(position, v, ring, n, grid, placing) < before:
                moved += 1
                break
            step *= 0.5
        else:
            position[v, 0] = pu
            position[v, 1] = pv
        metric = metric_at(grid, placing, pu, pv)
        wake_if_moved(position, v, pu, pv, ring, n, metric, STILL * size[v], awake)
    return moved
