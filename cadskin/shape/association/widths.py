"""Widths of convex hulls, exact: over all directions, and over those of a plane."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin._jit import kernel

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Vectors

__all__ = ["hull_width", "width_in_plane"]

_MOST = 5e7  # pairs of edges that are asked, and products of a face and a corner
_ROUNDING = 1e-13  # of sines: two arcs that miss each other by less count as crossing


def hull_width(
    points: Points, *, about: Vectors | None = None, angle: float = 0.5 * np.pi
) -> tuple[float, Vectors | None] | None:
    """Return the width of a point set over all directions, and the direction (3,).

    The narrowest slab touches a face and a vertex, or two edges, of the convex hull. Two edges count where
    their arcs on the sphere of normals are opposite each other: only there nothing lies beyond the slab.

    Parameters
    ----------
    points : (n, 3) float
    about : (3,) float, optional
        Only directions within ``angle`` of this one.
    angle : float
        [rad]

    Returns
    -------
    width : float
        Infinite where no candidate has such a direction [mm].
    direction : (3,) float or None
        None for an infinite width; for the whole return value where the points are flat, or the hull has too
        many edges.

    References
    ----------
    .. [1] M. E. Houle, G. T. Toussaint, Computing the width of a set, IEEE PAMI 10 (1988),
       doi:10.1109/34.6790.

    Examples
    --------
    >>> cube = [[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    >>> round(hull_width(np.array(cube, dtype=float))[0], 12)
    1.0
    """
    narrow = about is not None and angle < 0.5 * np.pi
    hull = _hull(_within_reach(points, about, angle)) if about is not None and narrow else None
    hull = hull or _hull(points)
    if hull is None:
        return None
    above, below, normals = np.arange(len(hull.ends)), np.arange(len(hull.ends)), hull.normals
    if about is not None and narrow:
        above, below = hull.edges_near(about, angle), hull.edges_near(-about, angle)
        normals = normals[np.abs(normals @ about) >= np.cos(angle)]
    if max(len(above) * len(below), len(normals) * len(hull.vertices)) > _MOST:
        return None
    best, direction = _over_faces(normals, hull.vertices)
    width, crossed = _over_edges(hull.ends, hull.arcs, hull.vertices, above, below, best, not narrow)
    if width < best:
        best, direction = float(width), crossed
    return best, direction


@dataclass(frozen=True, eq=False)
class _Hull:
    """A convex hull in arrays.

    Parameters
    ----------
    vertices : (v, 3) float
    normals : (f, 3) float
        Of the faces, outward.
    ends : (e, 2, 3) float
        Of the edges [mm].
    arcs : (e, 2, 3) float
        Normals of the two faces of each edge.
    """

    vertices: Points
    normals: Vectors
    ends: Points
    arcs: Vectors

    def edges_near(self, axis: Vectors, angle: float) -> Ints:
        """Return the edges whose arc may come within ``angle`` of an axis."""
        from_axis = np.arccos(np.clip(self.arcs @ axis, -1.0, 1.0)).min(axis=1)
        length = np.arccos(np.clip((self.arcs[:, 0] * self.arcs[:, 1]).sum(axis=1), -1.0, 1.0))
        return np.flatnonzero(from_axis <= angle + length + 1e-7)


def _within_reach(points: Points, axis: Vectors, angle: float) -> Points:
    """Return the points that can be extreme along a direction within ``angle`` of an axis."""
    heights = points @ axis
    reach = 1.01 * float(np.linalg.norm(np.ptp(points, axis=0)) * np.tan(angle)) + 1e-12 * float(
        np.ptp(heights)
    )
    near = (heights >= heights.max() - reach) | (heights <= heights.min() + reach)
    return np.asarray(points[near])


def _hull(points: Points) -> _Hull | None:
    """Return the hull, None where the points are flat."""
    from scipy.spatial import ConvexHull, QhullError

    centred = points - points.mean(axis=0)
    _, spread, right = np.linalg.svd(centred[:: max(1, len(points) // 10_000)], full_matrices=False)
    if len(spread) < 3 or spread[2] <= 1e-13 * spread[0]:
        return None
    unit = spread / spread[0]
    try:
        hull = ConvexHull((centred @ right.T) / unit)  # a thin slab is hulled as a fat one
    except QhullError:
        return None
    normals = (hull.equations[:, :3] / unit) @ right
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    face, corner = np.nonzero(hull.neighbors > np.arange(len(hull.neighbors))[:, None])
    ends = hull.simplices[face[:, None], (corner[:, None] + [1, 2]) % 3]
    arcs = normals[np.stack([face, hull.neighbors[face, corner]], axis=1)]
    bent = (arcs[:, 0] != arcs[:, 1]).any(axis=1)  # a face of more than three corners has no edges inside
    return _Hull(
        vertices=np.ascontiguousarray(centred[hull.vertices]),
        normals=normals,
        ends=np.ascontiguousarray(centred[ends[bent]]),
        arcs=np.ascontiguousarray(arcs[bent]),
    )


def _over_faces(normals: Vectors, vertices: Points) -> tuple[float, Vectors | None]:
    """Return the least width across a face, and the normal."""
    best, direction = np.inf, None
    for start in range(0, len(normals), 512):
        block = normals[start : start + 512]
        heights = vertices @ block.T
        width = heights.max(axis=0) - heights.min(axis=0)
        k = int(np.argmin(width))
        if width[k] < best:
            best, direction = float(width[k]), block[k]
    return best, direction


@kernel
def _apart(direction: Floats, one: Floats, other: Floats) -> bool:
    """Tell whether two normals (3,) lie on both sides of the plane across ``direction``, or in it."""
    a = direction[0] * one[0] + direction[1] * one[1] + direction[2] * one[2]
    b = direction[0] * other[0] + direction[1] * other[1] + direction[2] * other[2]
    return not ((a > _ROUNDING and b > _ROUNDING) or (a < -_ROUNDING and b < -_ROUNDING))


@kernel
def _over_edges(
    ends: Floats, arcs: Floats, vertices: Floats, above: Ints, below: Ints, best: float, once: bool
) -> tuple[float, Floats]:
    """Return the least width, below ``best``, across two edges of the hull, and the direction (3,).

    With ``once`` both lists are the same, and a pair is asked once.
    """
    direction, normal = np.zeros(3), np.zeros(3)
    along = ends[:, 1] - ends[:, 0]
    for i in range(along.shape[0]):
        along[i] /= np.sqrt(along[i, 0] ** 2 + along[i, 1] ** 2 + along[i, 2] ** 2)
    for a in range(above.size):
        i = above[a]
        u, p = along[i], ends[i, 0]
        for b in range(a + 1 if once else 0, below.size):
            j = below[b]
            if not _apart(u, arcs[j, 0], arcs[j, 1]) or not _apart(along[j], arcs[i, 0], arcs[i, 1]):
                continue
            v, q = along[j], ends[j, 0]
            normal[0] = u[1] * v[2] - u[2] * v[1]
            normal[1] = u[2] * v[0] - u[0] * v[2]
            normal[2] = u[0] * v[1] - u[1] * v[0]
            length = np.sqrt(normal[0] ** 2 + normal[1] ** 2 + normal[2] ** 2)
            if length <= 1e-12:
                continue
            normal /= length
            gap = (q[0] - p[0]) * normal[0] + (q[1] - p[1]) * normal[1] + (q[2] - p[2]) * normal[2]
            if abs(gap) >= best * (1 - 1e-12):
                continue
            low, high = np.inf, -np.inf  # a pair that only rounding lets pass has points beyond it
            for k in range(vertices.shape[0]):
                height = vertices[k, 0] * normal[0] + vertices[k, 1] * normal[1] + vertices[k, 2] * normal[2]
                low, high = min(low, height), max(high, height)
                if high - low >= best:
                    break
            if high - low < best:
                best = high - low
                direction[:] = normal
    return best, direction


def width_in_plane(points: Points, section: Vectors) -> float | None:
    """Return the least distance of two parallel lines that hold the points, seen along ``section`` [mm]."""
    from scipy.spatial import ConvexHull, QhullError

    helper = np.eye(3)[int(np.argmin(np.abs(section)))]
    first = np.cross(section, helper)
    first /= np.linalg.norm(first)
    flat = (points - points.mean(axis=0)) @ np.stack([first, np.cross(section, first)], axis=1)
    _, spread, right = np.linalg.svd(flat[:: max(1, len(flat) // 10_000)], full_matrices=False)
    if spread[1] <= 1e-13 * spread[0]:
        return None
    try:
        hull = ConvexHull((flat @ right.T) / (spread / spread[0]))  # a thin strip is hulled as a wide one
    except QhullError:
        return None
    corners = flat[hull.vertices]
    sides = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(sides, axis=1)
    normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1)[length > 0] / length[length > 0][:, None]
    return float(np.ptp(corners @ normals.T, axis=0).min())
