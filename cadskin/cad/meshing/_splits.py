"""Splits: nodes are added on sides that are too long."""

# Kernels take their arrays one by one: a structure of arrays would be one more type to compile.
# ruff: noqa: PLR0913

from __future__ import annotations

from typing import Any

from cadskin._jit import kernel
from cadskin.cad.meshing._adjacency import relink, set_row, side_of
from cadskin.cad.meshing._flips import flip_if_better
from cadskin.cad.meshing._metric import metric_length


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
