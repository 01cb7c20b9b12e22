"""Start points inside a face: rows of equilateral triangles, bent to the metric of the surface."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from cadskin._typing import Floats, Ints
from cadskin.cad.meshing.kernel import Metric

__all__ = ["start_points"]

ROW_HEIGHT = math.sqrt(3.0) / 2.0
CLEARANCE = 0.58  # of the wanted edge length, to the boundary
MOST_POINTS = 6_000_000


def start_points(position: Floats, sizes: Floats, segments: Ints, *, metric: Metric, target: float) -> Floats:
    """Return points inside the box of a boundary polygon, clear of its nodes and of its segments' middles.

    Parameters
    ----------
    position, sizes, segments
        The boundary polygon in the scaled parameter plane.
    metric : Metric
    target : float
        Wanted edge length [mm].

    Returns
    -------
    (k, 2) float
        Empty where the lattice would be absurdly large; the kernel then splits its way to the target.
    """
    low, high = position.min(axis=0), position.max(axis=0)
    if len(metric.grid) == 1:
        rows = _flat_rows(position, segments, target)
    else:
        rows = _bent_rows(high - low, metric.grid, target) + low
    if not len(rows):
        return rows
    return np.ascontiguousarray(rows[_clear(rows, position, sizes, segments, metric, target)])


def _flat_rows(position: Floats, segments: Ints, target: float) -> Floats:
    """Rows along the longest straight direction of the boundary, so that they fit the points on it."""
    angle = _straight_direction(position, segments)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    turned = position @ turn
    low, width = turned.min(axis=0), np.ptp(turned, axis=0)
    n_rows = max(1, round(width[1] / (target * ROW_HEIGHT)))
    n_columns = max(1, round(width[0] / target))
    if n_rows * n_columns > MOST_POINTS:
        return np.zeros((0, 2))
    row = np.arange(1, n_rows)[:, None]
    column = np.arange(n_columns + 1)[None, :] + _stagger(row, n_rows)
    lattice = np.zeros((n_rows - 1, n_columns + 1, 2))
    lattice[..., 0] = low[0] + column * (width[0] / n_columns)
    lattice[..., 1] = low[1] + row * (width[1] / n_rows)
    return np.asarray(lattice.reshape(-1, 2) @ turn.T)


def _stagger(row: Any, n_rows: int) -> Any:
    """Shift of a row in columns: about half a column per row, and whole columns from border to border.

    Both borders begin at a vertex, so that an odd number of rows at exactly half a column would end with
    right triangles; three rows at a third give a quality of 0.98.
    """
    return row * ((n_rows + 1) // 2 / n_rows) % 1.0


def _straight_direction(position: Floats, segments: Ints) -> float:
    """Return the direction [rad] in which most boundary length lies, by degrees."""
    along = position[segments[:, 1]] - position[segments[:, 0]]
    angle = np.arctan2(along[:, 1], along[:, 0]) % math.pi
    degree = np.minimum((np.degrees(angle) + 0.5).astype(np.int64) % 180, 179)
    best = np.bincount(degree, weights=np.hypot(along[:, 0], along[:, 1]), minlength=180).argmax()
    chosen = along[degree == best]
    chosen = (
        chosen
        * np.sign(chosen @ np.array([math.cos(math.radians(best)), math.sin(math.radians(best))]))[:, None]
    )
    total = chosen.sum(axis=0)
    return math.atan2(total[1], total[0])


def _bent_rows(width: Floats, grid: Floats, target: float) -> Floats:
    """Rows at equal arc length; each row has its own point count, so that its spacing is the target."""
    speed_u, speed_v = np.sqrt(grid[:, :, 0]), np.sqrt(grid[:, :, 2])
    swap = _unevenness(speed_v, 0) > _unevenness(speed_u, 1)
    if swap:
        speed_u, speed_v, width = speed_v.T, speed_u.T, width[::-1]
    across = speed_v.mean(axis=0)
    arc = _cumulative(across) * width[1] / (len(across) - 1)
    n_rows = max(1, round(arc[-1] / (target * ROW_HEIGHT)))
    if n_rows * float(np.median(speed_u)) * width[0] / target > MOST_POINTS:
        return np.zeros((0, 2))
    heights = np.interp(np.arange(1, n_rows) * arc[-1] / n_rows, arc, np.linspace(0.0, width[1], len(arc)))
    columns = np.linspace(0.0, width[0], len(speed_u))
    rows = [np.zeros((0, 2))]
    for index, height in enumerate(heights):
        place = height / width[1] * (speed_u.shape[1] - 1)
        j = min(int(place), speed_u.shape[1] - 2)
        speed = speed_u[:, j] + (place - j) * (speed_u[:, j + 1] - speed_u[:, j])
        along = _cumulative(speed) * width[0] / (len(speed) - 1)
        count = max(1, round(along[-1] / target))
        steps = (np.arange(count + 1) + _stagger(index + 1, n_rows)) * along[-1] / count
        steps = steps[steps <= along[-1]]
        rows.append(np.stack([np.interp(steps, along, columns), np.full(len(steps), height)], axis=1))
    lattice = np.concatenate(rows)
    return lattice[:, ::-1] if swap else lattice


def _unevenness(speed: Floats, axis: int) -> float:
    mean = speed.mean(axis=axis)
    return float((speed.std(axis=axis) / np.maximum(mean, 1e-300)).max())


def _cumulative(speed: Floats) -> Floats:
    return np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]))])


def _clear(
    rows: Floats, position: Floats, sizes: Floats, segments: Ints, metric: Metric, target: float
) -> Floats:
    """Say which points keep their distance from the boundary (a point on a segment would be a T-junction)."""
    a, b = segments[:, 0], segments[:, 1]
    boundary = np.concatenate([position, 0.5 * (position[a] + position[b])])
    if len(metric.grid) == 1:
        distance, _ = cKDTree(boundary).query(rows, distance_upper_bound=CLEARANCE * target)
        return np.asarray(distance > CLEARANCE * target)
    wanted = np.minimum(np.concatenate([sizes, 0.5 * (sizes[a] + sizes[b])]), target)
    _, nearest = cKDTree(boundary).query(rows, k=min(6, len(boundary)))
    grid, placing = metric.grid, metric.placing
    cell = ((rows - placing[:2]) * placing[2:]).astype(np.int64)
    local = grid[np.clip(cell[:, 0], 0, grid.shape[0] - 1), np.clip(cell[:, 1], 0, grid.shape[1] - 1)]
    offset = boundary[nearest] - rows[:, None]
    squared = (
        local[:, 0, None] * offset[..., 0] ** 2
        + 2.0 * local[:, 1, None] * offset[..., 0] * offset[..., 1]
        + local[:, 2, None] * offset[..., 1] ** 2
    )
    limit = CLEARANCE * np.maximum(wanted[nearest], 0.3 * target)
    return np.asarray((squared > limit**2).all(axis=1))
