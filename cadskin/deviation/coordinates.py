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

A face that closes is cut half a turn from the zero; a whole sphere is singular opposite of its pole, where
only round forms are continuous; a freeform face that turns back under itself has the same coordinates on both
sides. `form_coordinates` measures them from any point, along any direction of space.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from cadskin.errors import DeviationError
from cadskin.shape.discrete import triangle_normals
from cadskin.shape.ideal import Cone, Cylinder, Sphere, Torus

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Triangles, Vectors
    from cadskin.shape import Feature

__all__ = ["AreaFrame", "Vector3", "area_frame", "around", "form_coordinates", "surface_coordinates"]

Vector3: TypeAlias = tuple[float, float, float]

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
    return _chart(feature)(feature.points)


def form_coordinates(
    feature: Feature,
    *,
    centre: tuple[float, float] = (0.0, 0.0),
    rotation: float = 0.0,
    origin: Vector3 | None = None,
    direction: Vector3 | None = None,
) -> tuple[Floats, Floats]:
    """Return the coordinates x, y (k,) [mm] of the samples of a feature in the frame of a form.

    A face that closes around (a whole cylinder, cone or torus) has no jump but half a turn from the apex.

    Parameters
    ----------
    feature : Feature
    centre : (2,) float
        Apex from ``origin``, along the axes of the frame [mm].
    rotation : float
        Angle of the form's first axis from that of the frame [rad].
    origin : (3,) float, optional
        The point of space whose foot on the surface is the origin of the frame [mm]; by default the centroid
        of the feature's area.
    direction : (3,) float, optional
        Direction of space of the frame's first axis, seen along the normal at the origin; by default the
        feature's own.

    Raises
    ------
    DeviationError
        ``direction`` is normal to the feature at the origin.
    """
    chart = _chart(feature)
    coordinates = chart(feature.points)
    periods = _periods(feature, coordinates)
    zero = np.zeros(2) if origin is None else chart(np.array(origin, dtype=np.float64)[None])[0]
    relative = _wrapped(coordinates - zero, periods)
    turn = 0.0 if direction is None else _axis_angle(feature, chart, relative, np.array(direction))
    cosine, sine = np.cos(turn), np.sin(turn)
    apex = zero + np.array(centre) @ np.array([[cosine, sine], [-sine, cosine]])
    x, y = _wrapped(coordinates - apex, periods).T
    cosine, sine = np.cos(turn + rotation), np.sin(turn + rotation)
    return x * cosine + y * sine, y * cosine - x * sine


def _axis_angle(
    feature: Feature, chart: Callable[[Points], Floats], relative: Floats, direction: Vectors
) -> float:
    """Angle from the feature's first axis to a direction of space, at the sample next to the origin."""
    nearest = int(np.argmin((relative**2).sum(axis=1)))
    normal = feature.normals[nearest]
    along = direction - (direction @ normal) * normal
    length = float(np.linalg.norm(along))
    if length < 1e-6 * float(np.linalg.norm(direction)):
        raise DeviationError(
            f"direction {tuple(direction.tolist())} is normal to {feature.name} at the origin of the form; "
            "give one along the surface"
        )
    step = 1e-5 * float(np.ptp(feature.points, axis=0).max()) * along / length
    ahead, behind = chart(feature.points[nearest] + np.stack([step, -step]))
    difference = _wrapped((ahead - behind)[None], _turns(feature))[0]
    return float(np.arctan2(difference[1], difference[0]))


def around(feature: Feature, arc: Floats) -> Floats:
    """Return the angle (k,) [rad] about the axis of a cylinder, cone or torus of arc lengths (k,) [mm]."""
    return np.asarray(2 * np.pi / _turns(feature)[0] * arc)


def _turns(feature: Feature) -> Floats:
    """Length [mm] of a whole turn along x and along y; infinite where there is none."""
    ideal, turns = feature.ideal, np.full(2, np.inf)
    if isinstance(ideal, Cylinder):
        turns[0] = 2 * np.pi * ideal.radius
    elif isinstance(ideal, Cone):
        frame = area_frame(feature.points, feature.triangles, feature.normals.mean(axis=0))
        turns[0] = 2 * np.pi * float((frame.centroid - ideal.apex) @ ideal.axis) * np.tan(ideal.half_angle)
    elif isinstance(ideal, Torus):
        turns[:] = 2 * np.pi * ideal.major_radius, 2 * np.pi * ideal.minor_radius
    return turns


def _periods(feature: Feature, coordinates: Floats) -> Floats:
    """Return the turns (2,) [mm] that the feature closes: a triangle of it reaches over the cut."""
    turns = _turns(feature)
    if not np.isfinite(turns).any() or not len(feature.triangles):
        return np.full(2, np.inf)
    spans = np.ptp(coordinates[feature.triangles], axis=1).max(axis=0)
    return np.where(spans > 0.5 * turns, turns, np.inf)


def _wrapped(coordinates: Floats, periods: Floats) -> Floats:
    """Return coordinates (k, 2) brought to within half a period of zero."""
    finite = np.where(np.isfinite(periods), periods, 1.0)
    return np.where(np.isfinite(periods), coordinates - finite * np.round(coordinates / finite), coordinates)


def _chart(feature: Feature) -> Callable[[Points], Floats]:
    """Return the map from points (k, 3) at the surface of a feature to its coordinates (k, 2) [mm]."""
    ideal = feature.ideal
    frame = area_frame(feature.points, feature.triangles, feature.normals.mean(axis=0))
    if isinstance(ideal, Cylinder):
        cylinder = ideal
        return lambda points: _on_cylinder(points, cylinder, frame.centroid)
    if isinstance(ideal, Cone):
        cone = ideal
        return lambda points: _on_cone(points, cone, frame.centroid)
    if isinstance(ideal, Sphere):
        ball = ideal
        return lambda points: _azimuthal(
            (points - ball.centre) / ball.radius, frame.centroid - ball.centre, ball.radius
        )
    if isinstance(ideal, Torus):
        torus = ideal
        middle = _mean_tube_angle(feature.points - torus.centre, torus)
        return lambda points: _torus(points - torus.centre, torus, frame.centroid - torus.centre, middle)
    return lambda points: np.asarray((points - frame.centroid) @ frame.axes[:2].T)


def _on_cylinder(points: Points, cylinder: Cylinder, centroid: Points) -> Floats:
    angle = _angles(points - cylinder.origin, cylinder.axis, centroid - cylinder.origin, cylinder.radius)
    return np.stack([cylinder.radius * angle, (points - centroid) @ cylinder.axis], axis=1)


def _on_cone(points: Points, cone: Cone, centroid: Points) -> Floats:
    height = (points - cone.apex) @ cone.axis
    middle = float((centroid - cone.apex) @ cone.axis)
    radius = middle * np.tan(cone.half_angle)
    angle = _angles(points - cone.apex, cone.axis, centroid - cone.apex, radius)
    return np.stack([radius * angle, (height - middle) / np.cos(cone.half_angle)], axis=1)


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


def _tube(relative: Points, torus: Torus) -> tuple[Floats, Floats]:
    """Height over the plane of a torus and distance from its ring circle outward, (k,) [mm] each."""
    height = relative @ torus.axis
    outward = np.linalg.norm(relative - height[:, None] * torus.axis, axis=1) - torus.major_radius
    return height, outward


def _mean_tube_angle(relative: Points, torus: Torus) -> float:
    height, outward = _tube(relative, torus)
    mean = np.exp(1j * np.arctan2(height, outward)).mean()
    return float(np.angle(mean)) if abs(mean) > 1e-3 else 0.0


def _torus(relative: Points, torus: Torus, middle: Vectors, mean_tube: float) -> Floats:
    angle = _angles(relative, torus.axis, middle, torus.major_radius)
    tube = np.arctan2(*_tube(relative, torus)) - mean_tube
    return np.stack([torus.major_radius * angle, torus.minor_radius * np.angle(np.exp(1j * tube))], axis=1)
