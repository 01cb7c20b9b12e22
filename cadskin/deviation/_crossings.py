"""Where the normals of a face meet another ideal surface."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.shape.ideal import Cylinder, Plane, Sphere

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["distance_along_normals"]


def distance_along_normals(points: Points, normals: Vectors, surface: Any) -> Floats:
    """Return the signed distance along the normals to the nearest crossing of a surface.

    In closed form for planes, spheres and cylinders, without a difference of large numbers where the normals
    point to the centre; for cones and tori Newton's iteration on the distance function, to either side. A
    normal that does not meet the surface gives NaN.

    Parameters
    ----------
    points, normals : (k, 3) float
        [mm].
    surface : Plane, Cylinder, Cone, Sphere or Torus

    Returns
    -------
    (k,) float
        [mm].

    Examples
    --------
    >>> from cadskin.shape import Sphere
    >>> point, normal = np.array([[0.0, 0, 0.5]]), np.array([[0.0, 0, 1]])
    >>> distance_along_normals(point, normal, Sphere([0, 0, 0], 2.0)).round(9)
    array([1.5])
    """
    if isinstance(surface, Plane):
        slope = normals @ surface.normal
        height = (surface.origin - points) @ surface.normal
        return np.asarray(height / np.where(np.abs(slope) > 1e-9, slope, np.nan))
    if isinstance(surface, Sphere):
        return _round_crossing(points - surface.centre, normals, surface.radius)
    if isinstance(surface, Cylinder):
        across = np.eye(3) - np.outer(surface.axis, surface.axis)
        return _round_crossing((points - surface.origin) @ across, normals @ across, surface.radius)
    gap = np.abs(surface.distance(points))
    ways = np.stack([_newton(points, normals, surface, start) for start in (gap, -gap)])
    lengths = np.where(np.isnan(ways), np.inf, np.abs(ways))
    return np.asarray(ways[lengths.argmin(axis=0), np.arange(len(points))])


def _round_crossing(relative: Points, normals: Vectors, radius: float) -> Floats:
    """Return the smaller root t (k,) of |q + t n| = R, from the parts of q along and aside of n."""
    length = np.linalg.norm(normals, axis=1)
    unit = normals / np.where(length > 1e-9, length, np.nan)[:, None]
    along = np.einsum("ij,ij->i", relative, unit)
    aside = np.linalg.norm(np.cross(relative, unit), axis=1)
    under_root = (radius - aside) * (radius + aside)
    root = np.sqrt(np.where(under_root >= 0, under_root, np.nan))
    excess = aside**2 + (along - radius) * (along + radius)
    return np.asarray(-excess / (along + np.where(along < 0, -root, root)) / length)


def _newton(points: Points, normals: Vectors, surface: Any, start: Floats) -> Floats:
    """Signed distance (k,) along the normals to the crossing that Newton finds from ``start``, or NaN."""
    found = start
    for _ in range(60):
        value = surface.distance(points + found[:, None] * normals)
        slope = _slope(points, normals, surface, found)
        step = value / np.where(np.abs(slope) > 1e-9, slope, np.nan)
        found = found - step
        if not (np.abs(step) > 1e-13 * (1.0 + np.abs(found))).any():
            break
    missed = ~(np.abs(surface.distance(points + found[:, None] * normals)) < 1e-9 * (1.0 + np.abs(found)))
    return np.where(missed, np.nan, found)


def _slope(points: Points, normals: Vectors, surface: Any, at: Any) -> Floats:
    """Change of the distance along the normal, by central differences."""
    step = 1e-6 * (1.0 + float(np.abs(points).max(initial=0.0)))
    here = points + np.broadcast_to(at, len(points))[:, None] * normals
    ahead, behind = surface.distance(here + step * normals), surface.distance(here - step * normals)
    return np.asarray((ahead - behind) / (2 * step))
