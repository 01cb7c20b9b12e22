"""Lengths, angles and quality of triangles in the metric of a surface (its first fundamental form).

The metric (E, F, G) stands on a regular grid over the parameter box of a face, ``grid`` (nu, nv, 3), and is
interpolated bilinearly; ``placing`` (4,) holds the corner of the box and the inverse spacings. A grid of one
point is a face whose metric is constant (a plane, an unrolled cylinder).
"""

from __future__ import annotations

import math
from typing import Any

from cadskin._jit import kernel

__all__ = ["cotangent", "metric_at", "metric_length", "orientation", "shape_quality"]

_TWO_SQRT_3 = 3.4641016151377544


@kernel
def metric_at(grid: Any, placing: Any, u: float, v: float) -> tuple[float, float, float]:
    """Return E, F, G at (u, v)."""
    n_u = grid.shape[0]
    n_v = grid.shape[1]
    if n_u == 1:
        return grid[0, 0, 0], grid[0, 0, 1], grid[0, 0, 2]
    x = min(max((u - placing[0]) * placing[2], 0.0), n_u - 1.000001)
    y = min(max((v - placing[1]) * placing[3], 0.0), n_v - 1.000001)
    i = int(x)
    j = int(y)
    x -= i
    y -= j
    w00 = (1.0 - x) * (1.0 - y)
    w10 = x * (1.0 - y)
    w01 = (1.0 - x) * y
    w11 = x * y
    a = grid[i, j]
    b = grid[i + 1, j]
    c = grid[i, j + 1]
    d = grid[i + 1, j + 1]
    e = w00 * a[0] + w10 * b[0] + w01 * c[0] + w11 * d[0]
    f = w00 * a[1] + w10 * b[1] + w01 * c[1] + w11 * d[1]
    g = w00 * a[2] + w10 * b[2] + w01 * c[2] + w11 * d[2]
    return e, f, g


@kernel
def metric_length(grid: Any, placing: Any, position: Any, a: int, b: int) -> float:
    """Return the length of the straight parameter segment between two nodes, metric at its middle."""
    du = position[b, 0] - position[a, 0]
    dv = position[b, 1] - position[a, 1]
    u = 0.5 * (position[a, 0] + position[b, 0])
    v = 0.5 * (position[a, 1] + position[b, 1])
    e, f, g = metric_at(grid, placing, u, v)
    return math.sqrt(max(e * du * du + 2.0 * f * du * dv + g * dv * dv, 0.0))


@kernel
def orientation(position: Any, a: int, b: int, c: int) -> Any:
    """Return twice the signed parameter area of a triangle."""
    return (position[b, 0] - position[a, 0]) * (position[c, 1] - position[a, 1]) - (
        position[b, 1] - position[a, 1]
    ) * (position[c, 0] - position[a, 0])


@kernel
def cotangent(position: Any, apex: int, a: int, b: int, e: float, f: float, g: float, density: float) -> Any:
    """Return the cotangent of the angle at ``apex`` between ``a`` and ``b``; density is sqrt(EG - F²)."""
    x1 = position[a, 0] - position[apex, 0]
    y1 = position[a, 1] - position[apex, 1]
    x2 = position[b, 0] - position[apex, 0]
    y2 = position[b, 1] - position[apex, 1]
    cross = density * (x1 * y2 - y1 * x2)
    return (e * x1 * x2 + f * (x1 * y2 + x2 * y1) + g * y1 * y2) / max(cross, 1e-300)


@kernel
def shape_quality(position: Any, a: int, b: int, c: int, e: float, f: float, g: float, density: float) -> Any:
    """Return 4 sqrt(3) area / (sum of squared sides): 1 for an equilateral triangle."""
    x1 = position[b, 0] - position[a, 0]
    y1 = position[b, 1] - position[a, 1]
    x2 = position[c, 0] - position[a, 0]
    y2 = position[c, 1] - position[a, 1]
    x3 = x2 - x1
    y3 = y2 - y1
    area = density * (x1 * y2 - y1 * x2)
    sides = (
        e * (x1 * x1 + x2 * x2 + x3 * x3)
        + 2.0 * f * (x1 * y1 + x2 * y2 + x3 * y3)
        + g * (y1 * y1 + y2 * y2 + y3 * y3)
    )
    if sides <= 0.0:
        return -1.0
    return _TWO_SQRT_3 * area / sides
