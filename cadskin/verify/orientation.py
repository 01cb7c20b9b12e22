"""Orientation: parallelism, perpendicularity, angularity (ISO 1101): zones fixed in angle to a datum."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Minimax, Pose, associate, frame_about
from cadskin.verify.evaluation import Evaluation, active_of
from cadskin.verify.turns import closest_turn
from cadskin.verify.zones import (
    line_patch,
    plane_patch,
    solve,
    tilted_direction,
    turned_about,
    turned_towards,
)

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.verify.datums import DatumFrame

__all__ = ["OrientationCharacteristic", "OrientationZone", "orientation"]

OrientationCharacteristic: TypeAlias = Literal["parallelism", "perpendicularity", "angularity"]
OrientationZone: TypeAlias = Literal["planes", "cylinder"]
FeatureShape: TypeAlias = Literal["plane", "line"]


def orientation(
    points: Points,
    characteristic: OrientationCharacteristic,
    datums: DatumFrame,
    *,
    feature: FeatureShape = "plane",
    zone: OrientationZone = "planes",
    angle: float | None = None,
    normal_angle: float | None = None,
    limit: float | None = None,
) -> Evaluation:
    """Evaluate an orientation tolerance.

    Parameters
    ----------
    points : (n, 3) float
        The extracted plane, or the extracted median line.
    characteristic : {"parallelism", "perpendicularity", "angularity"}
    datums : DatumFrame
        Its z axis is the direction of the primary datum (normal of a plane, axis of a cylinder).
    feature : {"plane", "line"}
    zone : {"planes", "cylinder"}
        Two parallel planes (value: their distance) or a cylinder (value: its diameter).
    angle : float, optional
        The theoretically exact angle between feature and datum [rad]; needed for angularity.
    normal_angle : float, optional
        Instead of ``angle``: between the zone's normal (or axis) and the datum's normal (or axis) [rad].
    limit : float, optional

    Raises
    ------
    SpecificationError, AssociationError
    """
    if normal_angle is None:
        normal_angle = _normal_angle(characteristic, datums.datums[0].kind, feature, zone, angle)
    if zone == "cylinder" and feature != "line":
        raise SpecificationError("a cylindrical zone needs a line (an axis or a median line), not a plane")
    if feature == "plane":
        direction = associate(points, "plane", "least squares").pose.axis
    else:
        along = associate(points, "line", "least squares").pose.axis
        # The normal of two planes around a line is any direction across it; the datum decides which.
        direction = along if zone == "cylinder" else _across(along, datums.axes[:, 2], normal_angle)
    found, axis = _smallest(points, datums.axes, direction, normal_angle, zone, characteristic, datums.free)
    value = 2.0 * found.value if zone == "cylinder" else found.value
    return Evaluation(
        characteristic=characteristic,
        value=value,
        quantity=f"{characteristic}, {'diameter' if zone == 'cylinder' else 'distance'} of the zone",
        certified=found.certified and datums.certified,
        n_points=len(points),
        limit=limit,
        zone={
            "kind": "cylinder" if zone == "cylinder" else "two parallel planes",
            "width": value,
            "direction": axis,
            "point": found.pose.origin,
        },
        active=active_of(found),
        operations=(*datums.operations(), "extraction: the given points", "filtration: none"),
    )


def _normal_angle(
    characteristic: str, datum: str, feature: FeatureShape, zone: OrientationZone, angle: float | None
) -> float:
    """Return the angle between the zone's direction and the datum's direction [rad]."""
    if characteristic == "angularity":
        if angle is None:
            raise SpecificationError("angularity needs the theoretically exact angle")
    else:
        angle = 0.0 if characteristic == "parallelism" else 0.5 * np.pi
    datum_is_plane = datum in ("plane", "width")
    zone_is_axis = zone == "cylinder"
    # The direction of a plane is its normal: one of the two turns by 90 degrees when their natures differ.
    feature_is_plane = feature == "plane" or not zone_is_axis
    if datum_is_plane == feature_is_plane:
        return angle
    return abs(0.5 * np.pi - angle)


def _across(along: Vectors, axis: Vectors, normal_angle: float) -> Vectors:
    """Return a start for the normal of two planes around a line."""
    if normal_angle < 1e-9:
        return axis
    best, out = -1.0, axis
    side = np.cross(axis, along)
    if np.linalg.norm(side) < 1e-6:
        side = np.eye(3)[int(np.argmin(np.abs(axis)))]
    for candidate in (side, np.cross(along, side)):
        unit = candidate / np.linalg.norm(candidate)
        match = -abs(abs(float(unit @ axis)) - np.cos(normal_angle))
        if match > best:
            best, out = match, unit
    return out


def _smallest(
    points: Points,
    axes: Vectors,
    direction: Vectors,
    normal_angle: float,
    zone: OrientationZone,
    what: str,
    datum_free: tuple[str, ...],
) -> tuple[Minimax, Vectors]:
    """Return the smallest zone at a fixed angle to the third axis, and its direction."""
    centre = np.asarray(points).mean(axis=0)
    turned, _ = turned_towards(axes[:, 2], direction, normal_angle)
    tilted = normal_angle > 1e-12
    may_turn = "rz" in datum_free
    if tilted and not may_turn:
        turned = _held_turn(axes, turned)
    local = tilted_direction(normal_angle)
    if zone == "planes":
        free: tuple[int, ...] = (5,) if tilted and may_turn else ()
        part = [(plane_patch(local), points)]
        if free:
            turn, _ = closest_turn((np.asarray(points) - centre) @ turned, normal_angle)
            turned = turned_about(turned, turn)
        found = solve(part, Pose(centre, turned, np.zeros(2)), free, "zone", what=what)
        return found, found.pose.axes @ local
    moves = (0, 1) if np.cos(normal_angle) > 0.5 else (1, 2)
    free = (*moves, 5) if tilted and may_turn else moves
    found = solve([(line_patch(local), points)], Pose(centre, turned, np.zeros(2)), free, "upper", what=what)
    return found, found.pose.axes @ local


def _held_turn(axes: Vectors, turned: Vectors) -> Vectors:
    """Return the zone's frame (3, 3) turned to the exact place that a further datum holds.

    A drawing says by its picture how the zone stands to the secondary datum: the next multiple of 15 degrees.
    A feature that is 3 degrees and more off all of them keeps its own turn.
    """
    step = np.radians(15.0)
    turn = float(np.arctan2(turned[:, 0] @ axes[:, 1], turned[:, 0] @ axes[:, 0]))
    exact = step * round(turn / step)
    if abs(turn - exact) > np.radians(3.0):
        return turned
    return frame_about(axes[:, 2], np.cos(exact) * axes[:, 0] + np.sin(exact) * axes[:, 1])
