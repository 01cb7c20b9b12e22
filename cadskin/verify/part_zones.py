"""Zones fixed to datums on made parts: orientation, location, run-out and profile."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Pose, associate, frame_about
from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere, Torus
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.extraction import axial_sections, ring_sections
from cadskin.verify.location import Target, position
from cadskin.verify.orientation import orientation
from cadskin.verify.part_form import median_line_of, median_surface_points, refusal
from cadskin.verify.part_patches import nominal_patch
from cadskin.verify.profile import profile
from cadskin.verify.runout import datum_axis, runout
from cadskin.verify.supported import is_tangent

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.shape import Feature
    from cadskin.shape.association import Patch
    from cadskin.spec import Tolerance
    from cadskin.verify.extraction import MadePart
    from cadskin.verify.part_datums import Placement

__all__ = ["part_location", "part_orientation", "part_profile", "part_runout", "profile_parts", "targets"]

Members = tuple[tuple[int, ...], ...]


def part_orientation(
    tolerance: Tolerance, part: MadePart, members: Members, place: Placement, sections: int
) -> Evaluation:
    """Evaluate an orientation tolerance on one feature of a made part."""
    faces = members[0]
    feature = part.features(faces)[0]
    if place.actual is None or place.nominal is None:
        raise SpecificationError(f"tolerance {tolerance.id}: {tolerance.type} needs a datum")
    datum = place.nominal.axes[:, 2]
    name: Any = tolerance.type
    is_axis = tolerance.feature.derived == "axis" or tolerance.zone.shape == "diameter"
    if is_axis or isinstance(feature.ideal, Cylinder):
        if is_tangent(tolerance):
            raise refusal(tolerance, feature)
        line = derived_line(tolerance, part, faces, place, sections)
        angle = _angle(feature.ideal.axis, datum)  # type: ignore[union-attr]
        across = place.zone_normal(feature.ideal.axis)  # type: ignore[union-attr]
        if across is not None:
            return _between_planes(line, name, place, across)
        if tolerance.zone.shape == "diameter":
            return orientation(line, name, place.actual, feature="line", zone="cylinder", normal_angle=angle)
        exact = angle if place.nominal.datums[0].kind == "cylinder" else 0.5 * np.pi - angle
        return orientation(line, name, place.actual, feature="line", angle=abs(exact))
    _refuse_projected(tolerance, feature)
    if isinstance(feature.ideal, Plane):
        angle = _angle(feature.ideal.normal, datum)
        points = _plane_points(tolerance, part, faces)
        found = orientation(points, name, place.actual, normal_angle=angle)
        if is_tangent(tolerance):
            words = ("association: tangent plane, constrained least squares", *found.operations)
            return replace(found, operations=words)
        return found
    raise refusal(tolerance, feature)


def _between_planes(line: Points, name: str, place: Placement, across: Vectors) -> Evaluation:
    """Return the distance of two planes of a stated direction around a line."""
    normal = place.frame.axes @ place.turned(across)
    heights = line @ normal
    high, low = int(np.argmax(heights)), int(np.argmin(heights))
    width = float(heights[high] - heights[low])
    return Evaluation(
        characteristic=name,
        value=width,
        quantity=f"{name}, distance of the zone",
        certified=place.certified,
        n_points=len(line),
        zone={"kind": "two parallel planes", "width": width, "direction": normal, "point": line[low]},
        active=(high, low),
        operations=(*place.operations(), "extraction: the given points", "filtration: none"),
    )


def derived_line(
    tolerance: Tolerance, part: MadePart, faces: tuple[int, ...], place: Placement, sections: int
) -> Points:
    """Return the median line of a round feature, or the two ends of its projected axis.

    A projected zone (ISO 1101, circled P) begins where the feature leaves the material: at the end on the
    side of a primary datum plane across the axis, else at either end. The axis is the line of least squares
    through the median line.
    """
    feature = part.features(faces)[0]
    line = median_line_of(part, faces, feature, sections)
    length = tolerance.zone.projected
    if length is None:
        return line
    axis = associate(line, "line", "least squares", axis=feature.ideal.axis).pose  # type: ignore[union-attr]
    along = (part.points(faces) - axis.origin) @ axis.axis
    start = tolerance.zone.projected_offset or 0.0
    ends = [(float(along.max()), 1.0), (float(along.min()), -1.0)]
    datum = None if place.actual is None else place.actual.datums[0]
    if datum is not None and datum.kind == "plane" and abs(float(datum.direction @ axis.axis)) > 0.7:
        ends = [ends[0] if datum.direction @ axis.axis > 0 else ends[1]]
    heights = [end + sign * beyond for end, sign in ends for beyond in (start, start + length)]
    return np.asarray(axis.origin + np.outer(heights, axis.axis))


def _plane_points(tolerance: Tolerance, part: MadePart, faces: tuple[int, ...]) -> Points:
    """Return the points of the extracted plane, or of its tangent plane over the same extent."""
    features = part.features(faces)
    if tolerance.feature.derived == "median_plane":
        if len(features) != 2:
            raise refusal(tolerance, features[0])
        return median_surface_points(part, features)
    points = part.points(faces)
    if not is_tangent(tolerance):
        return points
    tangent = associate(points, "plane", "GE", axis=features[0].faces[0].normal)
    return np.asarray(points - tangent.residuals[:, None] * tangent.pose.axis)


def _refuse_projected(tolerance: Tolerance, feature: Feature) -> None:
    if tolerance.zone.projected is not None:
        raise SpecificationError(
            f"tolerance {tolerance.id}: a projected zone of a {feature.kind} is not supported; of an axis "
            "it is"
        )


def _angle(direction: Vectors, datum: Vectors) -> float:
    """Return the angle between two lines [rad], exactly 0 or a right angle where it is nearly that."""
    cosine = abs(float(np.asarray(direction) @ datum))
    if cosine > 1 - 1e-12:
        return 0.0
    return 0.5 * np.pi if cosine < 1e-9 else float(np.arccos(cosine))


def part_location(
    tolerance: Tolerance, part: MadePart, members: Members, place: Placement, sections: int
) -> Evaluation:
    """Evaluate a location tolerance on features of a made part that move together."""
    return position(
        targets(tolerance, part, members, place, sections),
        place.frame,
        free=place.free,
        certified=place.certified,
        characteristic=tolerance.type,
        operations=place.operations(),
    )


def targets(
    tolerance: Tolerance, part: MadePart, members: Members, place: Placement, sections: int
) -> list[Target]:
    """Return the derived features of members with their exact places."""
    return [_target(tolerance, part, faces, place, sections) for faces in members]


def _target(
    tolerance: Tolerance, part: MadePart, faces: tuple[int, ...], place: Placement, sections: int
) -> Target:
    features = part.features(faces)
    feature = features[0]
    if isinstance(feature.ideal, Cylinder | Cone):
        line = derived_line(tolerance, part, faces, place, sections)
        origin = feature.ideal.origin if isinstance(feature.ideal, Cylinder) else feature.ideal.apex
        across = place.zone_normal(feature.ideal.axis)
        if across is not None:
            return Target(line, place.in_frame(origin), place.turned(across), "plane")
        return Target(line, place.in_frame(origin), place.turned(feature.ideal.axis), "line")
    _refuse_projected(tolerance, feature)
    if isinstance(feature.ideal, Sphere):
        centre = associate(part.points(faces), "sphere", "least squares").pose.origin[None, :]
        return Target(centre, place.in_frame(feature.ideal.centre), np.zeros(3), "point")
    if isinstance(feature.ideal, Plane) and len(features) == 2:
        median, normal = median_surface_points(part, features), features[0].faces[0].normal
        middle = 0.5 * (feature.ideal.origin + features[1].ideal.origin)  # type: ignore[union-attr]
        return Target(median, place.in_frame(middle), place.turned(normal), "plane")
    if isinstance(feature.ideal, Plane) and tolerance.feature.derived == "none":
        points = part.points(faces)
        return Target(
            points, place.in_frame(feature.ideal.origin), place.turned(feature.ideal.normal), "plane"
        )
    raise refusal(tolerance, feature)


def part_runout(
    tolerance: Tolerance, part: MadePart, members: Members, place: Placement, sections: int
) -> Evaluation:
    """Evaluate a run-out tolerance on one feature of a made part."""
    faces = members[0]
    feature = part.features(faces)[0]
    if place.actual is None:
        raise SpecificationError(f"tolerance {tolerance.id}: run-out needs a datum axis")
    datum = datum_axis(place.actual)
    total, points = tolerance.type == "total_runout", part.points(faces)
    pose = Pose(datum.point, frame_about(datum.direction), np.zeros(2))
    if isinstance(feature.ideal, Plane):
        rings = None if total else ring_sections(part, faces, pose, sections)
        return runout(points, place.actual, direction="axial", total=total, circles=rings)
    if isinstance(feature.ideal, Cylinder | Cone | Torus | Sphere):
        rings = None if total else axial_sections(part, faces, pose, sections)
        return runout(points, place.actual, direction="radial", total=total, circles=rings)
    raise refusal(tolerance, feature)


def part_profile(
    tolerance: Tolerance, part: MadePart, members: Members, place: Placement, sections: int
) -> Evaluation:
    """Evaluate a profile tolerance on features of a made part that move together."""
    return profile(
        profile_parts(tolerance, part, members, place, sections),
        place.frame,
        free=place.free,
        certified=place.certified,
        operations=place.operations(),
    )


def within_rounding(found: Evaluation, tolerance: Tolerance, part: MadePart) -> Evaluation:
    """Return the verdict of an unequally disposed zone: its limit may be that of the nominal part itself.

    With Ⓤ 0 or the full value the nominal surface is a boundary of the zone, and a perfect part reaches the
    limit exactly; it is kept to the rounding of the coordinates.
    """
    if tolerance.zone.outside is None or tolerance.value is None:
        return found
    rounding = 256 * np.finfo(np.float64).eps * float(np.abs(part.surface.points).max(initial=1.0))
    return replace(found, verdict=bool(found.value <= tolerance.value + rounding))


def profile_parts(
    tolerance: Tolerance,
    part: MadePart,
    members: Members,
    place: Placement,
    sections: int,  # noqa: ARG001
) -> list[tuple[Patch, Points]]:
    """Return the nominal surfaces in the datum frame, each with its points."""
    if tolerance.type == "line_profile":
        raise SpecificationError(
            f"tolerance {tolerance.id}: a line profile is not supported on parts "
            "yet; evaluate its points as a case"
        )
    offset = 0.0 if tolerance.value is None else tolerance.zone.offset(tolerance.value)
    parts = []
    for faces in members:
        for feature in part.features(faces):
            parts.append(
                (
                    nominal_patch(part, feature, place.nominal_frame, offset=offset),
                    part.points(feature.face_indices),
                )
            )
    return parts
