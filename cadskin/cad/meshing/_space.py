"""Triangles of a face in space: their quality, their area, and flips that the parameter plane cannot see.

At a pole or apex the parameter plane says little: a triangle of two points of a seam and the apex is good
there and has no area in space. Nodes with one ``name`` are one vertex; triangles with two corners of one name
vanish when the mesh is welded and count for nothing here.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin.cad.meshing._metric import orientation

__all__ = ["flip_in_space", "measure", "node_normals"]

_TWO_SQRT_3 = 3.4641016151377544
REGULAR = 1e-6  # of the largest |Su x Sv|: below, the surface has no normal to compare with
POOR = 0.4
BETTER = 0.05


@kernel
def cross_product(a: Any, b: Any, out: Any) -> None:
    """Write a x b into ``out``."""
    out[0] = a[1] * b[2] - a[2] * b[1]
    out[1] = a[2] * b[0] - a[0] * b[2]
    out[2] = a[0] * b[1] - a[1] * b[0]


@kernel
def node_normals(derivatives: Any) -> Any:
    """Return unit normals Su x Sv, zero where the surface has none."""
    n = derivatives.shape[0]
    normals = np.zeros((n, 3))
    largest = 0.0
    for node in range(n):
        cross_product(derivatives[node, 1], derivatives[node, 2], normals[node])
        largest = max(largest, np.sqrt((normals[node] ** 2).sum()))
    for node in range(n):
        length = np.sqrt((normals[node] ** 2).sum())
        normals[node] *= 1.0 / length if length > REGULAR * largest else 0.0
    return normals


@kernel
def space_quality(
    points: Any, normals: Any, names: Any, a: int, b: int, c: int
) -> tuple[float, float, float]:
    """Return quality, cosine to the surface normal (1 where that is unknown) and area of a triangle."""
    if names[a] == names[b] or names[b] == names[c] or names[c] == names[a]:
        return 1.0, 1.0, 0.0
    x1 = points[b, 0] - points[a, 0]
    y1 = points[b, 1] - points[a, 1]
    z1 = points[b, 2] - points[a, 2]
    x2 = points[c, 0] - points[a, 0]
    y2 = points[c, 1] - points[a, 1]
    z2 = points[c, 2] - points[a, 2]
    nx = y1 * z2 - z1 * y2
    ny = z1 * x2 - x1 * z2
    nz = x1 * y2 - y1 * x2
    length = np.sqrt(nx * nx + ny * ny + nz * nz)
    sides = x1 * x1 + y1 * y1 + z1 * z1 + x2 * x2 + y2 * y2 + z2 * z2
    sides += (x2 - x1) ** 2 + (y2 - y1) ** 2 + (z2 - z1) ** 2
    if not (length > 0.0 and sides > 0.0):
        return 0.0, 1.0, 0.0
    wx = normals[a, 0] + normals[b, 0] + normals[c, 0]
    wy = normals[a, 1] + normals[b, 1] + normals[c, 1]
    wz = normals[a, 2] + normals[b, 2] + normals[c, 2]
    wanted = np.sqrt(wx * wx + wy * wy + wz * wz)
    cosine = 1.0
    if wanted > 0.5:
        cosine = (nx * wx + ny * wy + nz * wz) / (length * wanted)
    return _TWO_SQRT_3 * length / sides, cosine, 0.5 * length


@kernel
def signed_quality(points: Any, normals: Any, names: Any, a: int, b: int, c: int) -> float:
    """Return quality times the cosine to the surface normal."""
    quality, cosine, _ = space_quality(points, normals, names, a, b, c)
    return quality * cosine


@kernel
def flip_in_space(points: Any, normals: Any, names: Any, position: Any, triangles: Any, twin: Any) -> int:
    """Flip sides of poor triangles where the worse of the two becomes better in space; return the number.

    A flip keeps both parameter areas positive, so the mesh stays a triangulation of the face.
    """
    total = 0
    for _ in range(4):
        done = 0
        for t in range(triangles.shape[0]):
            here = signed_quality(points, normals, names, triangles[t, 0], triangles[t, 1], triangles[t, 2])
            if here >= POOR:
                continue
            best = -1
            gain = BETTER
            for i in range(3):
                h = 3 * t + i
                if twin[h] < 0:
                    continue
                s = twin[h] // 3
                a = triangles[t, i]
                c = triangles[t, (i + 1) % 3]
                d = triangles[t, (i + 2) % 3]
                e = triangles[s, (twin[h] % 3 + 2) % 3]
                if orientation(position, a, e, d) <= 0.0 or orientation(position, e, c, d) <= 0.0:
                    continue
                there = signed_quality(points, normals, names, c, a, e)
                one = signed_quality(points, normals, names, a, e, d)
                other = signed_quality(points, normals, names, e, c, d)
                change = min(one, other) - min(here, there)
                if change > gain:
                    gain = change
                    best = i
            if best >= 0:
                flip_half_edge(triangles, twin, 3 * t + best)
                done += 1
        total += done
        if done == 0:
            break
    return total


@kernel
def flip_half_edge(triangles: Any, twin: Any, h: int) -> None:
    """Replace side h of its two triangles by the other diagonal, in place."""
    g = twin[h]
    t = h // 3
    s = g // 3
    i = h % 3
    j = g % 3
    a = triangles[t, i]
    c = triangles[t, (i + 1) % 3]
    d = triangles[t, (i + 2) % 3]
    e = triangles[s, (j + 2) % 3]
    over_cd = twin[3 * t + (i + 1) % 3]
    over_da = twin[3 * t + (i + 2) % 3]
    over_ae = twin[3 * s + (j + 1) % 3]
    over_ec = twin[3 * s + (j + 2) % 3]
    triangles[t, 0] = a
    triangles[t, 1] = e
    triangles[t, 2] = d
    triangles[s, 0] = e
    triangles[s, 1] = c
    triangles[s, 2] = d
    join(twin, 3 * t, over_ae)
    join(twin, 3 * t + 1, 3 * s + 2)
    join(twin, 3 * t + 2, over_da)
    join(twin, 3 * s, over_ec)
    join(twin, 3 * s + 1, over_cd)


@kernel
def join(twin: Any, h: int, g: int) -> None:
    """Make two half-edges opposite; a negative one is the boundary."""
    twin[h] = g
    if g >= 0:
        twin[g] = h


@kernel
def measure(points: Any, normals: Any, names: Any, triangles: Any, smallest: float, at_fold: Any) -> float:
    """Return the area of the triangles; mark the nodes of those that turn away from the surface normal.

    Only triangles larger than ``smallest`` [mm²] count as folds: finer edges do not help the others.
    """
    total = 0.0
    for t in range(triangles.shape[0]):
        _, cosine, area = space_quality(
            points, normals, names, triangles[t, 0], triangles[t, 1], triangles[t, 2]
        )
        total += area
        if cosine < 0.5 and area > smallest:
            for i in range(3):
                at_fold[triangles[t, i]] = 1
    return total
