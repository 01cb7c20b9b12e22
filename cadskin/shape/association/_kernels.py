"""Compiled loops: distances of points to an ideal surface in its own frame, and their derivatives.

A surface stands in a frame (origin, axes) and has two shape numbers ``(s0, s1)``;
``q = axes.T @ (p - origin)``:

========  ==========================================  ================================
kind      distance of q, with r = hypot(q1, q2)       s0, s1
========  ==========================================  ================================
plane     q3 - s0                                     offset, unused
cylinder  r - s0                                      radius, unused
sphere    norm(q) - s0                                radius, unused
cone      (r - s0) cos(s1) - q3 sin(s1)               radius at the origin, half angle
torus     hypot(r - s1, q3) - s0                      minor radius, major radius
========  ==========================================  ================================

The columns of every Jacobian are the small motion of the surface in its own frame (three translations, three
rotations) and the two shape numbers: ``[tx, ty, tz, rx, ry, rz, s0, s1]``. With the unit normal ``n`` in the
surface's frame they are ``-n``, ``-q x n`` and the partial derivatives.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cadskin._jit import kernel

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints

PLANE, CYLINDER, SPHERE, CONE, TORUS = range(5)
N_COLUMNS = 8
_BLOCK = 2048


@kernel
def _distance(kind: int, x: float, y: float, z: float, s0: float, s1: float) -> float:
    if kind == 0:
        return z - s0
    if kind == 2:
        return math.sqrt(x * x + y * y + z * z) - s0
    radius = math.sqrt(x * x + y * y)
    if kind == 1:
        return radius - s0
    if kind == 3:
        return (radius - s0) * math.cos(s1) - z * math.sin(s1)
    gap = radius - s1
    return math.sqrt(gap * gap + z * z) - s0


@kernel
def _gradient(kind: int, x: float, y: float, z: float, s0: float, s1: float, row: Floats) -> float:
    """Fill ``row`` (8,) and return the distance."""
    nx, ny, nz = 0.0, 0.0, 0.0
    radius = np.sqrt(x * x + y * y)
    row[6], row[7] = -1.0, 0.0
    if kind == 0:
        nz = 1.0
        distance = z - s0
    elif kind == 2:
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            nx, ny, nz = x / length, y / length, z / length
        distance = length - s0
    else:
        cx, cy = 0.0, 0.0
        if radius > 0.0:
            cx, cy = x / radius, y / radius
        if kind == 1:
            nx, ny = cx, cy
            distance = radius - s0
        elif kind == 3:
            cosine, sine = np.cos(s1), np.sin(s1)
            nx, ny, nz = cx * cosine, cy * cosine, -sine
            distance = (radius - s0) * cosine - z * sine
            row[6] = -cosine
            row[7] = -(radius - s0) * sine - z * cosine
        else:
            gap = radius - s1
            length = np.sqrt(gap * gap + z * z)
            if length > 0.0:
                nx, ny, nz = cx * gap / length, cy * gap / length, z / length
                row[7] = -gap / length
            distance = length - s0
    row[0], row[1], row[2] = -nx, -ny, -nz
    row[3] = -(y * nz - z * ny)
    row[4] = -(z * nx - x * nz)
    row[5] = -(x * ny - y * nx)
    return distance


@kernel
def distances(points: Floats, kind: int, origin: Floats, axes: Floats, shape: Floats) -> Floats:
    """Return the signed distances (n,) of points (n, 3)."""
    out = np.zeros(points.shape[0])
    for i in range(points.shape[0]):
        px, py, pz = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
        x = axes[0, 0] * px + axes[1, 0] * py + axes[2, 0] * pz
        y = axes[0, 1] * px + axes[1, 1] * py + axes[2, 1] * pz
        z = axes[0, 2] * px + axes[1, 2] * py + axes[2, 2] * pz
        out[i] = _distance(kind, x, y, z, shape[0], shape[1])
    return out


@kernel
def rows(points: Floats, kind: int, origin: Floats, axes: Floats, shape: Floats) -> tuple[Floats, Floats]:
    """Return the signed distances (n,) and the Jacobian (n, 8)."""
    n = points.shape[0]
    out, jacobian = np.zeros(n), np.zeros((n, 8))
    for i in range(n):
        px, py, pz = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
        x = axes[0, 0] * px + axes[1, 0] * py + axes[2, 0] * pz
        y = axes[0, 1] * px + axes[1, 1] * py + axes[2, 1] * pz
        z = axes[0, 2] * px + axes[1, 2] * py + axes[2, 2] * pz
        out[i] = _gradient(kind, x, y, z, shape[0], shape[1], jacobian[i])
    return out, jacobian


@kernel
def normal_equations(
    points: Floats, kind: int, origin: Floats, axes: Floats, shape: Floats
) -> tuple[Floats, Floats, float]:
    """Return ``J.T @ J`` (8, 8), ``J.T @ d`` (8,) and ``d @ d``, summed in blocks against rounding."""
    square, right, total = np.zeros((8, 8)), np.zeros(8), 0.0
    row = np.zeros(8)
    for start in range(0, points.shape[0], _BLOCK):
        block, side, part = np.zeros((8, 8)), np.zeros(8), 0.0
        for i in range(start, min(start + _BLOCK, points.shape[0])):
            px, py, pz = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
            x = axes[0, 0] * px + axes[1, 0] * py + axes[2, 0] * pz
            y = axes[0, 1] * px + axes[1, 1] * py + axes[2, 1] * pz
            z = axes[0, 2] * px + axes[1, 2] * py + axes[2, 2] * pz
            d = _gradient(kind, x, y, z, shape[0], shape[1], row)
            part += d * d
            for a in range(8):
                side[a] += row[a] * d
                for b in range(a, 8):
                    block[a, b] += row[a] * row[b]
        square += block
        right += side
        total += part
    for a in range(8):
        for b in range(a):
            square[a, b] = square[b, a]
    return square, right, total


@kernel
def farthest(points: Floats, origin: Floats) -> float:
    """Return the largest distance of points (n, 3) from ``origin``."""
    largest = 0.0
    for i in range(points.shape[0]):
        x, y, z = points[i, 0] - origin[0], points[i, 1] - origin[1], points[i, 2] - origin[2]
        largest = max(largest, x * x + y * y + z * z)
    return np.sqrt(largest)  # type: ignore[no-any-return]


@kernel
def moments(points: Floats, centre: Floats) -> tuple[Floats, Floats]:
    """Return the sum (3,) and the second moments (3, 3) of points about ``centre``, summed in blocks."""
    first, second = np.zeros(3), np.zeros((3, 3))
    for start in range(0, points.shape[0], _BLOCK):
        part, block = np.zeros(3), np.zeros((3, 3))
        for i in range(start, min(start + _BLOCK, points.shape[0])):
            x, y, z = points[i, 0] - centre[0], points[i, 1] - centre[1], points[i, 2] - centre[2]
            part[0] += x
            part[1] += y
            part[2] += z
            block[0, 0] += x * x
            block[0, 1] += x * y
            block[0, 2] += x * z
            block[1, 1] += y * y
            block[1, 2] += y * z
            block[2, 2] += z * z
        first += part
        second += block
    second[1, 0], second[2, 0], second[2, 1] = second[0, 1], second[0, 2], second[1, 2]
    return first, second


@kernel
def linear_program(
    matrix: Floats, right: Floats, cost: Floats, box: Floats, floor: float
) -> tuple[Floats, Ints, Floats, int]:
    """Solve ``min cost @ z, matrix @ z <= right, |z_j| <= box_j`` by the dual simplex method.

    Few unknowns, any number of rows: the basis is a set of as many rows as unknowns; the most violated row
    enters.

    Parameters
    ----------
    matrix : (m, k) float
    right : (m,) float
    cost : (k,) float
    box : (k,) float
        Bounds, so that a first basis exists.
    floor : float
        A violation that counts as none.

    Returns
    -------
    z : (k,) float
    basis : (k,) int
        Row numbers; ``m + j`` is the upper bound of unknown j, ``m + k + j`` the lower bound.
    multipliers : (k,) float
        Of the basis rows, all >= 0.
    status : int
        0 solved, 1 iteration limit, 2 the rows contradict each other.
    """
    m, k = matrix.shape
    basis = np.zeros(k, np.int64)
    active, side = np.zeros((k, k)), np.zeros(k)
    for j in range(k):
        sign = -1.0 if cost[j] > 0 else 1.0
        basis[j] = m + j if sign > 0 else m + k + j
        active[j, j] = sign
        side[j] = box[j]
    entering = np.zeros(k)
    z, multipliers = np.zeros(k), np.zeros(k)
    for iteration in range(400 + 40 * k):
        inverse = np.linalg.inv(active)
        z = inverse @ side
        multipliers = -(inverse.T @ cost)
        for j in range(k):
            multipliers[j] = max(multipliers[j], 0.0)
        worst, enter = floor, -1
        for i in range(m):
            excess = -right[i]
            for j in range(k):
                excess += matrix[i, j] * z[j]
            if excess > worst:
                worst, enter = excess, i
        for j in range(k):
            if z[j] - box[j] > worst:
                worst, enter = z[j] - box[j], m + j
            if -z[j] - box[j] > worst:
                worst, enter = -z[j] - box[j], m + k + j
        if enter < 0:
            return z, basis, multipliers, 0
        entering[:] = 0.0
        if enter < m:
            entering[:] = matrix[enter]
            bound = right[enter]
        elif enter < m + k:
            entering[enter - m] = 1.0
            bound = box[enter - m]
        else:
            entering[enter - m - k] = -1.0
            bound = box[enter - m - k]
        weights = inverse.T @ entering
        largest = np.max(np.abs(weights))
        best, leave = np.inf, -1
        for j in range(k):
            if weights[j] > 1e-11 * largest:
                # The small bonus breaks ties for the larger pivot and, over the iterations, cycles.
                ratio = (multipliers[j] + 1e-14 * ((iteration * 7 + j * 3) % 11)) / weights[j]
                if ratio < best or (ratio == best and weights[j] > weights[leave]):
                    best, leave = ratio, j
        if leave < 0:
            return z, basis, multipliers, 2
        basis[leave] = enter
        active[leave] = entering
        side[leave] = bound
    return z, basis, multipliers, 1
