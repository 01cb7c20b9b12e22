"""Moves of the free nodes, their sizes and their valence."""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.
# ruff: noqa: PLR0913

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin.cad._jit import kernel
from cadskin.cad.meshing._metric import metric_at, metric_length, orientation, shape_quality
from cadskin.cad.meshing._moves import RING_SIZE, flip, ring_of, side_of

POINT = 1e-3  # of the distance to it: length of a side that is one point
EQUILATERAL = 1.002  # mean of 1 / quality below which a node stays


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
    circumcentres: bool,
) -> None:
    """Move each free node towards its target, at most as far as its triangles stay good."""
    ring_triangles = np.zeros(RING_SIZE, np.int64)
    ring = np.zeros(RING_SIZE, np.int64)
    for v in range(n_nodes):
        if fixed[v] or triangle_of[v] < 0:
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
    fixed: Any,
    triangles: Any,
    neighbours: Any,
    triangle_of: Any,
    n_nodes: int,
    grid: Any,
    placing: Any,
) -> int:
    """Move free nodes with triangles that are not yet equilateral to better shapes; return how many."""
    ring_triangles = np.zeros(RING_SIZE, np.int64)
    ring = np.zeros(RING_SIZE, np.int64)
    moved = 0
    for v in range(n_nodes):
        if fixed[v] or triangle_of[v] < 0:
            continue
        n = ring_of(triangles, neighbours, triangle_of, v, ring_triangles, ring)
        if n < 3 or touches_pole(position, fixed, v, ring, n, grid, placing):
            continue
        before = shape_energy(position, v, ring, n, grid, placing)
        if before < EQUILATERAL * n or before == math.inf:
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
    return moved


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


@kernel
def even_valence(
    position: Any,
    fixed: Any,
    triangles: Any,
    neighbours: Any,
    locked: Any,
    triangle_of: Any,
    n_nodes: int,
    n_triangles: int,
    grid: Any,
    placing: Any,
) -> int:
    """Flip sides between free nodes where that brings their valences nearer to six."""
    valence = np.zeros(n_nodes, np.int64)
    done = 0
    for t in range(n_triangles):
        if triangles[t, 0] >= 0:
            for i in range(3):
                valence[triangles[t, i]] += 1
    for t in range(n_triangles):
        if triangles[t, 0] < 0:
            continue
        for i in range(3):
            s = neighbours[t, i]
            if s < 0 or locked[t, i]:
                continue
            a = triangles[t, i]
            c = triangles[t, (i + 1) % 3]
            d = triangles[t, (i + 2) % 3]
            j = side_of(triangles, s, c, a)
            if j < 0:
                continue
            e = triangles[s, (j + 2) % 3]
            if fixed[a] or fixed[c] or fixed[d] or fixed[e]:
                continue
            # (k - 1 - 6)² summed over the losers and (k + 1 - 6)² over the winners, against (k - 6)²
            gain = (valence[a] + valence[c]) - (valence[d] + valence[e])
            if gain <= 2:
                continue
            u = 0.25 * (position[a, 0] + position[c, 0] + position[d, 0] + position[e, 0])
            v = 0.25 * (position[a, 1] + position[c, 1] + position[d, 1] + position[e, 1])
            m_e, m_f, m_g = metric_at(grid, placing, u, v)
            density = math.sqrt(max(m_e * m_g - m_f * m_f, 1e-300))
            if orientation(position, a, e, d) <= 0.0 or orientation(position, e, c, d) <= 0.0:
                continue
            quality = min(
                shape_quality(position, a, e, d, m_e, m_f, m_g, density),
                shape_quality(position, e, c, d, m_e, m_f, m_g, density),
            )
            if quality < 0.5:
                continue
            flip(triangles, neighbours, locked, triangle_of, t, i, s, j)
            valence[a] -= 1
            valence[c] -= 1
            valence[d] += 1
            valence[e] += 1
            done += 1
            break
    return done
