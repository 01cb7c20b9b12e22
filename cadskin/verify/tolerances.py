"""Evaluate one tolerance on a made part: which points, which zone, which datums."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Patch, Pose, associate, frame_about
from cadskin.shape.association._kernels import CONE, CYLINDER, PLANE, SPHERE, TORUS
from cadskin.shape.association.models import FREEFORM
from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere, Torus
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.extraction import axial_sections, meridian_sections, plane_lines, ring_sections
from cadskin.verify.form import form
from cadskin.verify.location import Target, position
from cadskin.verify.orientation import orientation
from cadskin.verify.part_datums import Placement, placement
from cadskin.verify.part_material import with_material
from cadskin.verify.profile import profile
from cadskin.verify.runout import runout
from cadskin.verify.sampled import sampled_closest

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.shape import Feature
    from cadskin.spec import Specification, Tolerance
    from cadskin.verify.datums import Standard
    from cadskin.verify.extraction import MadePart

__all__ = ["evaluate"]

_SECTIONS = 15  # sections, surface lines or circles of a feature


def evaluate(
    tolerance: Tolerance,
    part: MadePart,
    spec: Specification,
    *,
    standard: Standard = "ISO 5459:2011",
    sections: int = _SECTIONS,
) -> Evaluation:
    """Evaluate a tolerance on a made part.

    Parameters
    ----------
    tolerance : Tolerance
        Bound to faces of the part.
    part : MadePart
    spec : Specification
        Holds the datums.
    standard : str
        Of the datum associations.
    sections : int
        Number of sections, surface lines or circles where a characteristic is one of lines.

    Raises
    ------
    SpecificationError
        A tolerance without faces, or a combination that is not supported.
    """
    members = tolerance.feature.members
    if not members:
        raise SpecificationError(
            f"tolerance {tolerance.id}: no faces; bind the specification to the part first"
        )
    group = tolerance.characteristic.group
    if group == "form":
        found = _worst([_form(tolerance, part, faces, sections) for faces in members])
    else:
        place = placement(part, tolerance, spec, standard)
        if group == "location" and len(members) > 1 and tolerance.zone.combined is not False:
            found = _location(tolerance, part, members, place, sections)
        else:
            function = _GROUPS[group]
            found = _worst([function(tolerance, part, (faces,), place, sections) for faces in members])
    found = replace(found, characteristic=tolerance.type, limit=tolerance.value)
    if tolerance.material != "RFS" and group == "location":
        return with_material(found, tolerance, part, spec, place)
    return found


def _worst(found: list[Evaluation]) -> Evaluation:
    worst = max(found, key=lambda evaluation: evaluation.value)
    return replace(
        worst,
        certified=all(evaluation.certified for evaluation in found),
        n_points=sum(evaluation.n_points for evaluation in found),
    )


def _feature(part: MadePart, faces: tuple[int, ...]) -> Feature:
    return part.features(faces)[0]


def _refuse(tolerance: Tolerance, feature: Feature) -> SpecificationError:
    derived = "" if tolerance.feature.derived == "none" else f" ({tolerance.feature.derived})"
    return SpecificationError(
        f"tolerance {tolerance.id}: {tolerance.type} of a {feature.kind}{derived} is not supported"
    )


def _form(tolerance: Tolerance, part: MadePart, faces: tuple[int, ...], sections: int) -> Evaluation:
    feature, kind = _feature(part, faces), tolerance.type
    if tolerance.feature.derived == "axis" and kind == "straightness":
        return form(_median_line(part, faces, feature, sections), "straightness", median=True)
    if tolerance.feature.derived not in ("none", "line_element"):
        raise _refuse(tolerance, feature)
    points = part.points(faces)
    if kind == "flatness" and isinstance(feature.ideal, Plane):
        return form(points, "flatness", axis=feature.faces[0].normal)
    if kind == "cylindricity" and isinstance(feature.ideal, Cylinder):
        return form(points, "cylindricity", axis=feature.ideal.axis)
    axis = getattr(feature.ideal, "axis", None)
    if kind == "roundness" and isinstance(feature.ideal, Cylinder | Cone | Torus | Sphere):
        pose = _axis_pose(feature, points, axis)
        rings = axial_sections(part, faces, pose, sections)
        return _worst([form(ring, "roundness", section_normal=pose.axis) for ring in rings])
    if kind == "straightness" and isinstance(feature.ideal, Cylinder | Cone):
        lines = meridian_sections(part, faces, _axis_pose(feature, points, axis), sections)
        return _worst([form(line, "straightness", section_normal=normal) for line, normal in lines])
    if kind == "straightness" and isinstance(feature.ideal, Plane):
        plane = associate(points, "plane", "least squares", axis=feature.faces[0].normal)
        along = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]
        lines = plane_lines(part, faces, plane.pose, along, sections)
        found = _worst([form(line, "straightness", section_normal=normal) for line, normal in lines])
        return replace(
            found, notes=(*found.notes, "lines along the longer side; no intersection plane is given")
        )
    raise _refuse(tolerance, feature)


def _axis_pose(feature: Feature, points: Points, axis: Vectors | None) -> Pose:
    """Return a frame with the axis of a round feature, from least squares."""
    if isinstance(feature.ideal, Cylinder):
        return associate(points, "cylinder", "least squares", axis=axis).pose
    if isinstance(feature.ideal, Cone):
        found = associate(points, "cone", "least squares", axis=axis)
        return found.pose
    if isinstance(feature.ideal, Sphere):
        centre = associate(points, "sphere", "least squares").pose.origin
        return Pose(centre, np.eye(3), np.zeros(2))
    centre = feature.ideal.centre  # type: ignore[union-attr]
    return Pose(np.asarray(centre), frame_about(np.asarray(axis)), np.zeros(2))


def _median_line(part: MadePart, faces: tuple[int, ...], feature: Feature, sections: int) -> Points:
    """Return the centres (k, 3) of Gaussian circles in sections across the axis of the Gaussian cylinder."""
    pose = _axis_pose(feature, part.points(faces), getattr(feature.ideal, "axis", None))
    centres = []
    for ring in axial_sections(part, faces, pose, sections):
        centre = associate(ring, "circle", "least squares", section_normal=pose.axis).pose.origin
        height = float(((ring - centre) @ pose.axis).mean())
        centres.append(centre + height * pose.axis)
    return np.array(centres)


def _orientation(
    tolerance: Tolerance,
    part: MadePart,
    members: tuple[tuple[int, ...], ...],
    place: Placement,
    sections: int,
) -> Evaluation:
    faces = members[0]
    feature = _feature(part, faces)
    if place.actual is None or place.nominal is None:
        raise SpecificationError(f"tolerance {tolerance.id}: {tolerance.type} needs a datum")
    datum = place.nominal.axes[:, 2]
    is_axis = tolerance.feature.derived == "axis" or tolerance.zone.shape == "diameter"
    if is_axis or isinstance(feature.ideal, Cylinder):
        line = _median_line(part, faces, feature, sections)
        angle = _angle(feature.ideal.axis, datum)  # type: ignore[union-attr]
        if tolerance.zone.shape == "diameter":
            return orientation(
                line, _name(tolerance), place.actual, feature="line", zone="cylinder", normal_angle=angle
            )
        exact = angle if place.nominal.datums[0].kind == "cylinder" else 0.5 * np.pi - angle
        return orientation(line, _name(tolerance), place.actual, feature="line", angle=abs(exact))
    if isinstance(feature.ideal, Plane):
        angle = _angle(feature.ideal.normal, datum)
        return orientation(part.points(faces), _name(tolerance), place.actual, normal_angle=angle)
    raise _refuse(tolerance, feature)


def _name(tolerance: Tolerance) -> Any:
    return tolerance.type


def _angle(direction: Vectors, datum: Vectors) -> float:
    """Return the angle between two lines [rad], exactly 0 or a right angle where it is nearly that."""
    cosine = abs(float(np.asarray(direction) @ datum))
    if cosine > 1 - 1e-12:
        return 0.0
    return 0.5 * np.pi if cosine < 1e-9 else float(np.arccos(cosine))


def _location(
    tolerance: Tolerance,
    part: MadePart,
    members: tuple[tuple[int, ...], ...],
    place: Placement,
    sections: int,
) -> Evaluation:
    targets = [_target(tolerance, part, faces, place, sections) for faces in members]
    return position(
        targets,
        place.frame,
        free=place.free,
        certified=place.certified,
        characteristic=tolerance.type,
        operations=place.operations(),
    )


def _target(
    tolerance: Tolerance, part: MadePart, faces: tuple[int, ...], place: Placement, sections: int
) -> Target:
    feature = _feature(part, faces)
    features = part.features(faces)
    if isinstance(feature.ideal, Cylinder | Cone):
        line = _median_line(part, faces, feature, sections)
        origin = feature.ideal.origin if isinstance(feature.ideal, Cylinder) else feature.ideal.apex
        return Target(line, place.in_frame(origin), place.turned(feature.ideal.axis), "line")
    if isinstance(feature.ideal, Sphere):
        centre = associate(part.points(faces), "sphere", "least squares").pose.origin[None, :]
        return Target(centre, place.in_frame(feature.ideal.centre), np.zeros(3), "point")
    if isinstance(feature.ideal, Plane) and len(features) == 2:
        return _median_surface(part, features, place)
    if isinstance(feature.ideal, Plane) and tolerance.feature.derived == "none":
        points = part.points(faces)
        return Target(
            points, place.in_frame(feature.ideal.origin), place.turned(feature.ideal.normal), "plane"
        )
    raise _refuse(tolerance, feature)


def _median_surface(part: MadePart, features: tuple[Feature, ...], place: Placement) -> Target:
    """Return the median points of two opposite planes: each vertex against the face beyond it."""
    from scipy.interpolate import LinearNDInterpolator, NearestNDInterpolator

    first, second = (part.points(feature.face_indices) for feature in features)
    normal = np.asarray(features[0].faces[0].normal)
    axes = frame_about(normal)
    flat, height = second @ axes[:, :2], second @ normal
    own = first @ axes[:, :2]
    beyond = LinearNDInterpolator(flat, height)(own)
    beyond = np.where(np.isfinite(beyond), beyond, NearestNDInterpolator(flat, height)(own))
    median = first + (0.5 * (beyond - first @ normal))[:, None] * normal
    middle = 0.5 * (features[0].ideal.origin + features[1].ideal.origin)  # type: ignore[union-attr]
    return Target(median, place.in_frame(middle), place.turned(normal), "plane")


def _runout(
    tolerance: Tolerance,
    part: MadePart,
    members: tuple[tuple[int, ...], ...],
    place: Placement,
    sections: int,
) -> Evaluation:
    faces = members[0]
    feature = _feature(part, faces)
    if place.actual is None:
        raise SpecificationError(f"tolerance {tolerance.id}: run-out needs a datum axis")
    datum = place.actual.datums[0]
    total, points = tolerance.type == "total_runout", part.points(faces)
    pose = Pose(datum.point, frame_about(datum.direction), np.zeros(2))
    if isinstance(feature.ideal, Plane):
        rings = None if total else ring_sections(part, faces, pose, sections)
        return runout(points, place.actual, direction="axial", total=total, circles=rings)
    if isinstance(feature.ideal, Cylinder | Cone | Torus | Sphere):
        rings = None if total else axial_sections(part, faces, pose, sections)
        return runout(points, place.actual, direction="radial", total=total, circles=rings)
    raise _refuse(tolerance, feature)


def _profile(
    tolerance: Tolerance,
    part: MadePart,
    members: tuple[tuple[int, ...], ...],
    place: Placement,
    sections: int,  # noqa: ARG001
) -> Evaluation:
    if tolerance.type == "line_profile":
        raise SpecificationError(
            f"tolerance {tolerance.id}: a line profile needs an intersection plane, which "
            "specifications do not hold yet"
        )
    offset = 0.0 if tolerance.value is None else tolerance.zone.offset(tolerance.value)
    parts = []
    for faces in members:
        for feature in part.features(faces):
            parts.append((_patch(feature, place, offset), part.points(feature.face_indices)))
    return profile(
        parts, place.frame, free=place.free, certified=place.certified, operations=place.operations()
    )


def _patch(feature: Feature, place: Placement, offset: float) -> Patch:
    """Return the nominal surface of a feature in the datum frame, positive out of the material."""
    ideal, sign = feature.ideal, -1.0 if feature.internal else 1.0

    def placed(origin: Points, axis: Vectors, s0: float, s1: float = 0.0) -> Pose:
        return Pose(place.in_frame(origin), frame_about(place.turned(axis)), np.array([s0, s1]))

    if isinstance(ideal, Plane):
        return Patch(PLANE, placed(ideal.origin, feature.faces[0].normal, 0.0), 1.0, offset)
    if isinstance(ideal, Cylinder):
        return Patch(CYLINDER, placed(ideal.origin, ideal.axis, ideal.radius), sign, offset)
    if isinstance(ideal, Sphere):
        return Patch(SPHERE, placed(ideal.centre, np.array([0.0, 0, 1]), ideal.radius), sign, offset)
    if isinstance(ideal, Cone):
        height = float(((feature.points - ideal.apex) @ ideal.axis).mean())
        radius = height * float(np.tan(ideal.half_angle))
        place_ = placed(ideal.apex + height * ideal.axis, ideal.axis, radius, ideal.half_angle)
        return Patch(CONE, place_, sign, offset)
    if isinstance(ideal, Torus):
        place_ = placed(ideal.centre, ideal.axis, ideal.minor_radius, ideal.major_radius)
        return Patch(TORUS, place_, sign, offset)
    axes = place.nominal_frame.axes
    local = (feature.points - place.nominal_frame.origin) @ axes
    closest = sampled_closest(local, feature.normals @ axes, feature.curvatures, feature.directions @ axes)
    return Patch(FREEFORM, Pose(np.zeros(3), np.eye(3), np.zeros(2)), 1.0, offset, closest)


_GROUPS: dict[str, Callable[..., Evaluation]] = {
    "orientation": _orientation,
    "location": _location,
    "runout": _runout,
    "profile": _profile,
}
