"""Arc-length coordinates on a feature: where x and y of a systematic form are measured.

=========  ==============================================================================
surface    coordinates (x, y) [mm], zero at the area centroid of the feature
=========  ==============================================================================
plane      along the principal axes of its area, the longer one first
cylinder   radius times angle; height along the axis
cone       mean radius times angle; length along the generator
sphere     azimuthal equidistant about the mean normal: geodesic distance times direction
torus      major radius times angle; minor radius times tube angle
freeform   orthogonal projection to the plane of the two larger principal axes
=========  ==============================================================================
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin.shape.discrete import triangle_normals
from cadskin.shape.ideal import Cone, Cylinder, Sphere, Torus

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Triangles, Vectors
    from cadskin.shape import Feature

__all__ = ["AreaFrame", "area_frame", "surface_coordinates"]

_ROUND = 1e-6  # relative difference of the second moments below which an outline has no longer axis


@dataclass(frozen=True, eq=False)
class AreaFrame:
    """Centroid (3,) [mm], axes (3, 3) as rows (longer, shorter, normal) and area [mm²] of a patch."""

    centroid: Points
    axes: Vectors
    area: float


def area_frame(points: Points, triangles: Triangles, normal: Vectors) -> AreaFrame:
    """Return the principal frame of a surface, by integrals over its area.

    Integrals, not sums over the vertices: a mesh that is finer around a hole shifts the mean of its vertices.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int
    normal : (3,) float
        Side the third axis points to.

    References
    ----------
    Zhang et al. 2013, doi:10.1177/0954405412466987, equations (2) and (3), with area weights.
    """
    corners = points[triangles]
    areas = 0.5 * np.linalg.norm(triangle_normals(points, triangles, unit=False), axis=1)
    total = float(areas.sum())
    weights = areas if total > 0 else np.ones(len(areas))
    centroid = np.average(corners.mean(axis=1), axis=0, weights=weights)
    relative = corners - centroid
    middle = relative.sum(axis=1)
    moments = (
        np.einsum("t,tij,tik->jk", weights, relative, relative)
        + np.einsum("t,tj,tk->jk", weights, middle, middle)
    ) / 12.0
    values, vectors = np.linalg.eigh(moments)
    third = vectors[:, 0]
    if third @ normal < 0:
        third = -third
    first = vectors[:, 2]
    if values[2] - values[1] <= _ROUND * values[2]:
        first = _reference_direction(third)
    first = first * np.sign(first[np.argmax(np.abs(first) > np.abs(first).max() * (1 - 1e-9))])
    return AreaFrame(centroid, np.stack([first, np.cross(third, first), third]), total)


def _reference_direction(normal: Vectors) -> Vectors:
    """Return the first global axis that is not close to the normal, projected across it; unit length."""
    axis = np.eye(3)[int(np.argmax(np.abs(normal) < 0.8))]
    across = axis - (axis @ normal) * normal
    return np.asarray(across / np.linalg.norm(across))


def surface_coordinates(feature: Feature) -> Floats:
    """Return arc-length coordinates (k, 2) [mm] of the samples of a feature; see the table of this module."""
    ideal = feature.ideal
    points, normals = feature.points, feature.normals
    frame = area_frame(points, feature.triangles, normals.mean(axis=0))
    if isinstance(ideal, Cylinder):
        angle = _angles(points - ideal.origin, ideal.axis, frame.centroid - ideal.origin, ideal.radius)
        return np.stack([ideal.radius * angle, (points - frame.centroid) @ ideal.axis], axis=1)
    if isinstance(ideal, Cone):
        height = (points - ideal.apex) @ ideal.axis
        middle = float((frame.centroid - ideal.apex) @ ideal.axis)
        radius = middle * np.tan(ideal.half_angle)
        angle = _angles(points - ideal.apex, ideal.axis, frame.centroid - ideal.apex, radius)
        return np.stack([radius * angle, (height - middle) / np.cos(ideal.half_angle)], axis=1)
    if isinstance(ideal, Sphere):
        return _azimuthal((points - ideal.centre) / ideal.radius, frame.centroid - ideal.centre, ideal.radius)
    if isinstance(ideal, Torus):
        return _torus(points - ideal.centre, ideal, frame.centroid - ideal.centre)
    return np.asarray((points - frame.centroid) @ frame.axes[:2].T)


def _angles(relative: Points, axis: Vectors, middle: Vectors, radius: float) -> Floats:
    """Angle about ``axis`` from the direction of ``middle``, or from a global axis for a full turn."""
    across = middle - (middle @ axis) * axis
    length = float(np.linalg.norm(across))
    zero = across / length if length > 1e-3 * radius else _reference_direction(axis)
    angle: Floats = np.arctan2(relative @ np.cross(axis, zero), relative @ zero)
    return angle


def _azimuthal(directions: Vectors, middle: Vectors, radius: float) -> Floats:
    length = float(np.linalg.norm(middle))
    pole = middle / length if length > 1e-3 * radius else np.array([0.0, 0.0, 1.0])
    first = _reference_direction(pole)
    x, y, z = directions @ first, directions @ np.cross(pole, first), directions @ pole
    across = np.hypot(x, y)
    scale = radius * np.arctan2(across, z) / np.where(across > 0, across, 1.0)
    return np.stack([scale * x, scale * y], axis=1)


def _torus(relative: Points, torus: Torus, middle: Vectors) -> Floats:
    angle = _angles(relative, torus.axis, middle, torus.major_radius)
    height = relative @ torus.axis
    outward = np.linalg.norm(relative - height[:, None] * torus.axis, axis=1) - torus.major_radius
    tube = np.arctan2(height, outward)
    mean = np.angle(np.exp(1j * tube).mean()) if abs(np.exp(1j * tube).mean()) > 1e-3 else 0.0
    return np.stack(
        [
            torus.major_radius * angle,
            torus.minor_radius * np.angle(np.exp(1j * (tube - mean))),
        ],
        axis=1,
    )
