"""Flips: the diagonal of two triangles changes, for the Delaunay property or for even valences."""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.
# ruff: noqa: PLR0913

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin.cad.meshing._adjacency import relink, set_row, side_of
from cadskin.cad.meshing._metric import cotangent, metric_at, orientation, shape_quality


@kernel
def flip(
    triangles: Any, neighbours: Any, locked: Any, triangle_of: Any, t: int, i: int, s: int, j: int
) -> None:
    """Replace the common side (a, c) of triangles t = (a, c, d) and s = (c, a, e) by (d, e)."""
    i1 = (i + 1) % 3
    i2 = (i + 2) % 3
    j1 = (j + 1) % 3
    j2 = (j + 2) % 3
    a = triangles[t, i]
    c = triangles[t, i1]
    d = triangles[t, i2]
    e = triangles[s, j2]
    n_cd = neighbours[t, i1]
    n_da = neighbours[t, i2]
    n_ae = neighbours[s, j1]
    n_ec = neighbours[s, j2]
    l_cd = locked[t, i1]
    l_da = locked[t, i2]
    l_ae = locked[s, j1]
    l_ec = locked[s, j2]
    set_row(triangles, t, a, e, d)
    set_row(neighbours, t, n_ae, s, n_da)
    set_row(locked, t, l_ae, 0, l_da)
    set_row(triangles, s, e, c, d)
    set_row(neighbours, s, n_ec, n_cd, t)
    set_row(locked, s, l_ec, l_cd, 0)
    relink(triangles, neighbours, n_ae, e, a, t)
    relink(triangles, neighbours, n_cd, d, c, s)
    triangle_of[a] = t
    triangle_of[e] = t
    triangle_of[d] = t
    triangle_of[c] = s


@kernel
def flip_if_better(
    position: Any,
    triangles: Any,
    neighbours: Any,
    locked: Any,
    triangle_of: Any,
    t: int,
    i: int,
    grid: Any,
    placing: Any,
) -> bool:
    """Flip side i of triangle t where it is not Delaunay in the metric at the middle of the two triangles."""
    s = neighbours[t, i]
    if s < 0 or locked[t, i]:
        return False
    a = triangles[t, i]
    c = triangles[t, (i + 1) % 3]
    d = triangles[t, (i + 2) % 3]
    j = side_of(triangles, s, c, a)
    if j < 0:
        return False
    e = triangles[s, (j + 2) % 3]
    u = 0.25 * (position[a, 0] + position[c, 0] + position[d, 0] + position[e, 0])
    v = 0.25 * (position[a, 1] + position[c, 1] + position[d, 1] + position[e, 1])
    m_e, m_f, m_g = metric_at(grid, placing, u, v)
    density = math.sqrt(max(m_e * m_g - m_f * m_f, 1e-300))
    at_d = cotangent(position, d, a, c, m_e, m_f, m_g, density)
    at_e = cotangent(position, e, c, a, m_e, m_f, m_g, density)
    if at_d + at_e >= -1e-9:  # the two angles sum to less than pi
        return False
    first = orientation(position, a, e, d)
    second = orientation(position, e, c, d)
    if min(first, second) <= 1e-7 * abs(first + second):
        return False
    flip(triangles, neighbours, locked, triangle_of, t, i, s, j)
    return True


@kernel
def delaunay_flips(
    position: Any,
    triangles: Any,
    neighbours: Any,
    locked: Any,
    triangle_of: Any,
    n_triangles: int,
    grid: Any,
    placing: Any,
    awake: Any,
    rounds: int,
) -> int:
    """Flip until every side is Delaunay or the rounds are spent; return the number of flips.

    Triangles of nodes that are not ``awake`` are passed over; a flip wakes its nodes.
    """
    total = 0
    for _ in range(rounds):
        count = 0
        for t in range(n_triangles):
            a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
            if a < 0 or not (awake[a] or awake[b] or awake[c]):
                continue
            for i in range(3):
                s = neighbours[t, i]
                if flip_if_better(position, triangles, neighbours, locked, triangle_of, t, i, grid, placing):
                    for k in range(3):
                        awake[triangles[t, k]] = 1
                        awake[triangles[s, k]] = 1
                    count += 1
                    break
        total += count
        if count == 0:
            break
    return total


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
