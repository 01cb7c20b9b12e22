"""Derived features: median lines from sections, median surfaces from opposite points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association import associate
from cadskin.verify._circles import gaussian_circles

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Ints, Points, Vectors
    from cadskin.shape.association import Pose

__all__ = [
    "heights_at",
    "median_line",
    "median_points",
    "opposite_triangles",
    "section_centres",
    "split_sections",
]


def split_sections(points: Points, axis: Vectors, count: int | None = None) -> list[Points]:
    """Split points into sections across an axis at the largest gaps of their heights.

    Parameters
    ----------
    points : (n, 3) float
    axis : (3,) float
    count : int, optional
        Number of sections; by default the gaps that are far larger than the typical distance within.

    Raises
    ------
    AssociationError
        The points do not lie in sections.
    """
    heights = np.asarray(points) @ np.asarray(axis)
    order = np.argsort(heights, kind="stable")
    gaps = np.diff(heights[order])
    if count is None:
        count = _count_sections(gaps)
    if count < 1 or count > len(points):
        raise AssociationError(f"cannot split {len(points)} points into {count} sections")
    cuts = np.sort(np.argsort(gaps)[len(gaps) - (count - 1) :]) + 1
    return [np.asarray(points)[part] for part in np.split(order, cuts)]


def _count_sections(gaps: Floats) -> int:
    """Count the gaps that stand clear of the rest: at the largest ratio between neighbours in size."""
    ordered = np.sort(gaps)
    floor = 1e-9 * float(ordered[-1])
    ratio = np.maximum(ordered[1:], floor) / np.maximum(ordered[:-1], floor)
    cut = int(np.argmax(ratio))
    if ratio[cut] < 10.0:
        raise AssociationError(
            "the points of the cylinder do not lie in sections; give the median line or the "
            "number of sections"
        )
    return len(ordered) - cut


def median_line(points: Points, *, sections: int | None = None, axis: Vectors | None = None) -> Points:
    """Return the extracted median line (k, 3) of a cylinder.

    The centres of Gaussian circles in sections perpendicular to the axis of the Gaussian cylinder (ISO
    14660-2, now ISO 22432).

    Parameters
    ----------
    points : (n, 3) float
        Points in sections.
    sections : int, optional
    axis : (3,) float, optional
        A guess of the axis.

    Raises
    ------
    AssociationError
    """
    cylinder = associate(points, "cylinder", "least squares", axis=axis)
    direction = cylinder.pose.axis
    centres = []
    for part in split_sections(points, direction, sections):
        circle = associate(part, "circle", "least squares", section_normal=direction)
        height = float((part @ direction).mean())
        centre = circle.pose.origin
        centres.append(centre + (height - centre @ direction) * direction)
    return np.array(centres)


def median_points(first: Points, second: Points) -> Points:
    """Return the median points (n, 3) of opposite points, row by row.

    Raises
    ------
    AssociationError
        Different numbers of points.
    """
    if len(first) != len(second):
        raise AssociationError(
            f"opposite faces must be paired point by point, got {len(first)} and {len(second)} points"
        )
    return np.asarray(0.5 * (np.asarray(first) + np.asarray(second)))


def section_centres(rings: Sequence[Points], pose: Pose) -> Points:
    """Return the centres (k, 3) of the Gaussian circles of sections across the axis of a pose."""
    sizes = np.array([len(ring) for ring in rings], dtype=np.int64)
    local = pose.local(np.concatenate(rings))
    starts = np.concatenate([[0], np.cumsum(sizes)])
    circles, settled = gaussian_circles(np.ascontiguousarray(local[:, :2]), starts)
    if not settled.all():
        raise AssociationError("the Gaussian circle of a section does not exist; its points are on a line")
    heights = np.add.reduceat(local[:, 2], starts[:-1]) / sizes
    return np.asarray(pose.origin + np.column_stack([circles[:, :2], heights]) @ pose.axes.T)


def opposite_triangles(own: Floats, flat: Floats) -> Ints:
    """Return for places (n, 2) the three points (n, 3) of the Delaunay triangle around each.

    Beyond the hull of ``flat`` (m, 2) the nearest point is repeated.
    """
    from scipy.spatial import Delaunay, cKDTree

    triangulation = Delaunay(flat)
    found = triangulation.find_simplex(own)
    corners = np.asarray(triangulation.simplices[found], dtype=np.int64)
    beyond = found < 0
    if beyond.any():
        corners[beyond] = cKDTree(flat).query(own[beyond])[1][:, None]
    return corners


def heights_at(own: Floats, flat: Floats, height: Floats, corners: Ints) -> Floats:
    """Return the heights (n,) at places (n, 2), linear over triangles ``corners`` (n, 3) of ``flat``."""
    base = flat[corners[:, 0]]
    first, second, place = flat[corners[:, 1]] - base, flat[corners[:, 2]] - base, own - base
    area = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    area = np.where(area == 0.0, np.inf, area)  # a repeated point: its own height
    u = (place[:, 0] * second[:, 1] - place[:, 1] * second[:, 0]) / area
    v = (first[:, 0] * place[:, 1] - first[:, 1] * place[:, 0]) / area
    low = height[corners[:, 0]]
    return np.asarray(low + u * (height[corners[:, 1]] - low) + v * (height[corners[:, 2]] - low))
