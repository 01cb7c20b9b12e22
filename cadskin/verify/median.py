"""Derived features: median lines from sections, median surfaces from opposite points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association import associate

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["median_line", "median_points", "split_sections"]


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
