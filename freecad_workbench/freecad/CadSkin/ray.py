"""Where a ray meets a mesh. numpy only: it works in every display mode, and for exaggerated surfaces."""

from __future__ import annotations

import numpy as np

__all__ = ["first_hit"]

_EDGE_SLACK = 1e-9


def first_hit(
    origin: np.ndarray, direction: np.ndarray, points: np.ndarray, triangles: np.ndarray
) -> tuple[int, np.ndarray] | None:
    """Return the first triangle that a ray meets and the barycentric coordinates (3,) there; None for none.

    Parameters
    ----------
    origin, direction : (3,) float
    points : (n, 3) float
    triangles : (m, 3) int

    References
    ----------
    .. [1] T. Möller, B. Trumbore, "Fast, minimum storage ray-triangle intersection", J. Graphics Tools 2
       (1997), 21-28, doi:10.1080/10867651.1997.10487468.
    """
    if not len(triangles):
        return None
    near = _near_ray(origin, direction, points, triangles)
    corner, second, third = (points[triangles[near, k]] for k in range(3))
    edge1, edge2 = second - corner, third - corner
    p = np.cross(direction, edge2)
    determinant = (edge1 * p).sum(axis=1)
    usable = np.abs(determinant) > 1e-300
    inverse = np.divide(1.0, determinant, out=np.zeros_like(determinant), where=usable)
    s = origin - corner
    u = (s * p).sum(axis=1) * inverse
    q = np.cross(s, edge1)
    v = (q @ direction) * inverse
    distance = (edge2 * q).sum(axis=1) * inverse
    slack = -_EDGE_SLACK
    hit = np.flatnonzero(usable & (u >= slack) & (v >= slack) & (u + v <= 1.0 + _EDGE_SLACK))
    if not hit.size:
        return None
    first = hit[distance[hit].argmin()]
    return int(near[first]), np.array([1.0 - u[first] - v[first], u[first], v[first]])


def _near_ray(
    origin: np.ndarray, direction: np.ndarray, points: np.ndarray, triangles: np.ndarray
) -> np.ndarray:
    """Return the triangles whose corners are not all on one side of two planes through the ray."""
    helper = np.eye(3)[np.abs(direction).argmin()]
    across = np.cross(direction, helper)
    up = np.cross(direction, across)
    kept = np.ones(len(triangles), dtype=bool)
    for axis in (across, up):
        side = ((points - origin) @ axis)[triangles]
        kept &= (side.min(axis=1) <= 0.0) & (side.max(axis=1) >= 0.0)
    return np.flatnonzero(kept)
