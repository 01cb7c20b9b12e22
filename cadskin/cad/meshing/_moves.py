"""Local moves of a planar triangulation: flip, split, collapse, smooth. The boundary never moves.

A triangulation is held in arrays: ``triangles`` (cap, 3) counter-clockwise, -1 in column 0 of a free row;
``neighbours`` (cap, 3), column i across the side (i, i + 1), -1 outside; ``locked`` (cap, 3), 1 where that
side must stay; ``triangle_of`` (n,), one triangle of each node, -1 for a removed node. Every move keeps all
parameter areas positive, so that the mesh stays a triangulation of the face.
"""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.
# ruff: noqa: PLR0913

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin.cad._jit import kernel
from cadskin.cad.meshing._metric import cotangent, metric_at, metric_length, orientation

RING_SIZE = 64


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
    rounds: int,
) -> int:
    """Flip until every side is Delaunay or the rounds are spent; return the number of flips."""
    total = 0
    for _ in range(rounds):
        count = 0
        for t in range(n_triangles):
            if triangles[t, 0] < 0:
                continue
            for i in range(3):
                if flip_if_better(position, triangles, neighbours, locked, triangle_of, t, i, grid, placing):
                    count += 1
                    break
        total += count
        if count == 0:
            break
    return total


@kernel
def split(
    triangles: Any, neighbours: Any, locked: Any, triangle_of: Any, t: int, i: int, m: int, t2: int
) -> None:
    """Put node m on side i of triangle t; its two new triangles are rows t2 and t2 + 1."""
    s2 = t2 + 1
    i1 = (i + 1) % 3
    i2 = (i + 2) % 3
    s = neighbours[t, i]
    a = triangles[t, i]
    c = triangles[t, i1]
    d = triangles[t, i2]
    j = side_of(triangles, s, c, a)
    j1 = (j + 1) % 3
    j2 = (j + 2) % 3
    e = triangles[s, j2]
    n_cd = neighbours[t, i1]
    n_da = neighbours[t, i2]
    n_ae = neighbours[s, j1]
    n_ec = neighbours[s, j2]
    l_cd = locked[t, i1]
    l_da = locked[t, i2]
    l_ae = locked[s, j1]
    l_ec = locked[s, j2]
    set_row(triangles, t, a, m, d)
    set_row(neighbours, t, s, t2, n_da)
    set_row(locked, t, 0, 0, l_da)
    set_row(triangles, t2, m, c, d)
    set_row(neighbours, t2, s2, n_cd, t)
    set_row(locked, t2, 0, l_cd, 0)
    set_row(triangles, s, m, a, e)
    set_row(neighbours, s, t, n_ae, s2)
    set_row(locked, s, 0, l_ae, 0)
    set_row(triangles, s2, c, m, e)
    set_row(neighbours, s2, t2, s, n_ec)
    set_row(locked, s2, 0, 0, l_ec)
    relink(triangles, neighbours, n_cd, d, c, t2)
    relink(triangles, neighbours, n_ec, c, e, s2)
    triangle_of[m] = t
    triangle_of[a] = t
    triangle_of[c] = t2
    triangle_of[d] = t
    triangle_of[e] = s


@kernel
def longest_side(
    position: Any,
    size: Any,
    triangles: Any,
    neighbours: Any,
    locked: Any,
    t: int,
    grid: Any,
    placing: Any,
    limit: float,
) -> int:
    """Return the free side of t that exceeds its wanted size most, by more than ``limit``; -1 for none."""
    best = -1
    worst = limit
    for i in range(3):
        if neighbours[t, i] < 0 or locked[t, i]:
            continue
        a = triangles[t, i]
        c = triangles[t, (i + 1) % 3]
        ratio = metric_length(grid, placing, position, a, c) / (0.5 * (size[a] + size[c]))
        if ratio > worst:
            worst = ratio
            best = i
    return best


@kernel
def split_long(
    position: Any,
    size: Any,
    fixed: Any,
    triangles: Any,
    neighbours: Any,
    locked: Any,
    triangle_of: Any,
    counts: Any,
    grid: Any,
    placing: Any,
    target: float,
    grading: float,
    limit: float,
) -> int:
    """Split sides longer than ``limit`` sizes, flipping around each; counts[2] tells that room ran out."""
    done = 0
    for t in range(counts[1]):  # not the new ones: the caller comes again, so the work of a call is bounded
        if triangles[t, 0] < 0:
            continue
        i = longest_side(position, size, triangles, neighbours, locked, t, grid, placing, limit)
        if i < 0:
            continue
        if counts[0] >= position.shape[0] or counts[1] + 2 > triangles.shape[0]:
            counts[2] = 1
            break
        m = counts[0]
        t2 = counts[1]
        a = triangles[t, i]
        c = triangles[t, (i + 1) % 3]
        s = neighbours[t, i]
        if side_of(triangles, s, c, a) < 0:
            continue
        position[m, 0] = 0.5 * (position[a, 0] + position[c, 0])
        position[m, 1] = 0.5 * (position[a, 1] + position[c, 1])
        fixed[m] = 0
        half = 0.5 * metric_length(grid, placing, position, a, c)
        size[m] = min(target, min(size[a], size[c]) + grading * half)
        split(triangles, neighbours, locked, triangle_of, t, i, m, t2)
        counts[0] += 1
        counts[1] += 2
        done += 1
        for q in (t, t2, s, t2 + 1):
            for k in range(3):
                if flip_if_better(position, triangles, neighbours, locked, triangle_of, q, k, grid, placing):
                    break
    return done


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
