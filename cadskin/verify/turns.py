"""Two parallel planes that may turn about a datum direction: the turn at which they are closest together.

At the turn phi the normal of the planes is ``(sin a cos phi, sin a sin phi, cos a)``, so that the distance of
two planes around points is the largest of sinusoids, one per pair of points. Each sinusoid bounds the
distance from below on a whole interval of turns; intervals that cannot hold the least distance are left, the
others are halved. Seen along the datum a median line is a speck: the distance has many local minima.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points

__all__ = ["closest_turn"]

_INTERVALS, _POINTS = 256, 2000


def closest_turn(local: Points, angle: float, *, tolerance: float = 1e-13) -> tuple[float, float]:
    """Return the turn of least distance, and a distance that no turn can be below.

    Parameters
    ----------
    local : (n, 3) float
        Points in a frame whose third axis is the datum direction [mm].
    angle : float
        Between the normal of the planes and the third axis [rad].
    tolerance : float
        By which the bound may be below the least distance, relative to the size of the points.

    Returns
    -------
    turn : float
        [rad]
    bound : float
        [mm]

    Examples
    --------
    >>> flat = np.array([[0, 0, 0], [9, 9, 1], [2, 2, 3.0], [7, 7, 0]])
    >>> turn, bound = closest_turn(flat, np.pi / 2)
    >>> round(np.tan(turn)), abs(bound) < 1e-12
    (-1, True)
    """
    cloud = np.asarray(local, dtype=np.float64)
    cloud = cloud[:: max(1, len(cloud) // _POINTS)]
    cloud = cloud - cloud.mean(axis=0)
    floor = tolerance * max(float(np.abs(cloud).max()), 1e-300)
    whole = np.pi if abs(np.cos(angle)) < 1e-12 else 2.0 * np.pi  # half a turn is the same pair of planes
    half = 0.5 * whole / _INTERVALS
    middle: Floats = np.asarray(half * (2.0 * np.arange(_INTERVALS) + 1.0))
    best, turn, left = np.inf, 0.0, np.inf
    for _ in range(60):
        width, pair = _widths(cloud, angle, middle)
        k = int(np.argmin(width))
        if width[k] < best:
            best, turn = float(width[k]), float(middle[k])
        low = _lowest(pair, angle, middle, half)
        open_ones = low < best - floor
        left = min(left, float(low[~open_ones].min(initial=np.inf)))
        if not open_ones.any():
            return turn, min(left, best)
        kept = middle[open_ones]
        middle = np.concatenate([kept - 0.5 * half, kept + 0.5 * half])
        half *= 0.5
    return turn, min(left, float(low.min()))


def _widths(cloud: Points, angle: float, turns: Floats) -> tuple[Floats, Points]:
    """Return the distance of the planes at each turn (k,), and the difference of their contacts (k, 3)."""
    normals = np.stack(
        [np.sin(angle) * np.cos(turns), np.sin(angle) * np.sin(turns), np.full(len(turns), np.cos(angle))]
    )
    heights = cloud @ normals
    high, low = heights.argmax(axis=0), heights.argmin(axis=0)
    columns = np.arange(len(turns))
    return heights[high, columns] - heights[low, columns], cloud[high] - cloud[low]


def _lowest(pair: Points, angle: float, middle: Floats, half: float) -> Floats:
    """Return the least distance (k,) that pairs of points leave within ``half`` of the turns ``middle``."""
    amplitude = np.sin(angle) * np.hypot(pair[:, 0], pair[:, 1])
    phase, level = np.arctan2(pair[:, 1], pair[:, 0]), np.cos(angle) * pair[:, 2]
    away = np.abs(np.mod(middle - phase + np.pi, 2.0 * np.pi) - np.pi)  # from the crest of the sinusoid
    return np.asarray(level + amplitude * np.cos(np.minimum(away + half, np.pi)))
