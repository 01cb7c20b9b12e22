"""Form of features of a made part, and the derived features (median lines and surfaces) behind it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import Pose, associate, frame_about
from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere, Torus
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.extraction import axial_sections, meridian_sections, plane_cuts, plane_lines
from cadskin.verify.form import form
from cadskin.verify.median import heights_at, opposite_triangles, section_centres
from cadskin.verify.per_area import flatness_per_area
from cadskin.verify.supported import form_parameter

if TYPE_CHECKING:
    from cadskin._typing import Ints, Points, Vectors
    from cadskin.shape import Feature
    from cadskin.spec import Tolerance
    from cadskin.verify.extraction import MadePart

__all__ = ["axis_pose", "median_line_of", "median_surface_points", "part_form", "refusal", "worst"]


def refusal(tolerance: Tolerance, feature: Feature) -> SpecificationError:
    """Return the error for a characteristic that a feature of this kind does not have here."""
    derived = "" if tolerance.feature.derived == "none" else f" ({tolerance.feature.derived})"
    return SpecificationError(
        f"tolerance {tolerance.id}: {tolerance.type} of a {feature.kind}{derived} is not supported"
    )


def worst(found: list[Evaluation]) -> Evaluation:
    """Return the evaluation of the largest value, certified where all are."""
    largest = max(found, key=lambda evaluation: evaluation.value)
    return replace(
        largest,
        certified=all(evaluation.certified for evaluation in found),
        n_points=sum(evaluation.n_points for evaluation in found),
    )


def part_form(
    tolerance: Tolerance,
    part: MadePart,
    faces: tuple[int, ...],
    sections: int,
    *,
    section_normal: Vectors | None = None,
) -> Evaluation:
    """Evaluate a form tolerance on one feature of a made part.

    Parameters
    ----------
    tolerance : Tolerance
        Of group ``form``.
    part : MadePart
    faces : tuple of int
    sections : int
    section_normal : (3,) float, optional
        Normal of the sections of a plane, from its intersection plane; else they lie along its longer side.

    Raises
    ------
    SpecificationError
        The feature has no such form, or its derived feature is not supported.
    """
    feature, kind = part.features(faces)[0], tolerance.type
    if tolerance.feature.derived not in ("none", "line_element") or tolerance.zone.shape == "diameter":
        return _derived_form(tolerance, part, faces, sections)
    parameter = form_parameter(tolerance)
    if kind == "straightness":
        return _straightness(tolerance, part, faces, sections, section_normal)
    points = part.points(faces)
    if kind == "flatness" and isinstance(feature.ideal, Plane):
        if tolerance.zone.per_area is not None:
            if parameter != "t":
                raise SpecificationError(
                    f"tolerance {tolerance.id}: parameter {parameter} per area is not supported"
                )
            return flatness_per_area(tolerance, part, faces)
        return form(points, "flatness", axis=feature.faces[0].normal, parameter=parameter)
    if kind == "cylindricity" and isinstance(feature.ideal, Cylinder):
        return form(points, "cylindricity", axis=feature.ideal.axis, parameter=parameter)
    if kind == "roundness" and isinstance(feature.ideal, Cylinder | Cone | Torus | Sphere):
        pose = axis_pose(feature, points)
        rings = axial_sections(part, faces, pose, sections)
        return worst(
            [form(ring, "roundness", section_normal=pose.axis, parameter=parameter) for ring in rings]
        )
    raise refusal(tolerance, feature)


def _derived_form(tolerance: Tolerance, part: MadePart, faces: tuple[int, ...], sections: int) -> Evaluation:
    """Straightness of a median line, flatness of the median surface of two opposite planes."""
    features, kind = part.features(faces), tolerance.type
    feature = features[0]
    if tolerance.zone.per_length is not None:
        raise SpecificationError(
            f"tolerance {tolerance.id}: a value per length of a derived feature is not supported"
        )
    if kind == "straightness" and isinstance(feature.ideal, Cylinder | Cone):
        line = median_line_of(part, faces, feature, sections)
        return form(line, "straightness", median=True, parameter=form_parameter(tolerance))
    if kind == "flatness" and len(features) == 2 and isinstance(feature.ideal, Plane):
        found = form(
            median_surface_points(part, features),
            "flatness",
            axis=feature.faces[0].normal,
            parameter=form_parameter(tolerance),
        )
        return replace(found, operations=("construction: middle between two faces", *found.operations))
    raise refusal(tolerance, feature)


def _straightness(
    tolerance: Tolerance,
    part: MadePart,
    faces: tuple[int, ...],
    sections: int,
    section_normal: Vectors | None,
) -> Evaluation:
    """Straightness of the surface lines of a round feature or of a plane."""
    feature, points = part.features(faces)[0], part.points(faces)
    notes: tuple[str, ...] = ()
    if isinstance(feature.ideal, Cylinder | Cone):
        lines = meridian_sections(part, faces, axis_pose(feature, points), sections)
    elif isinstance(feature.ideal, Plane) and section_normal is not None:
        lines = plane_cuts(part, faces, section_normal, sections)
    elif isinstance(feature.ideal, Plane):
        plane = associate(points, "plane", "least squares", axis=feature.faces[0].normal)
        along = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][0]
        lines = plane_lines(part, faces, plane.pose, along, sections)
        notes = ("lines along the longer side; no intersection plane is given",)
    else:
        raise refusal(tolerance, feature)
    parameter = form_parameter(tolerance)
    length = tolerance.zone.per_length
    if length is not None:
        if parameter != "t":
            raise SpecificationError(
                f"tolerance {tolerance.id}: parameter {parameter} per length is not supported"
            )
        found = worst([_per_length(line, normal, length) for line, normal in lines])
        notes = (*notes, f"the worst length of {length:g} mm")
    else:
        found = worst(
            [form(line, "straightness", section_normal=normal, parameter=parameter) for line, normal in lines]
        )
    return replace(found, notes=(*found.notes, *notes))


def _per_length(line: Points, normal: Vectors, length: float) -> Evaluation:
    """Return the worst straightness over all stretches of ``length`` that begin at a point of the line.

    Stretches are tried in the order of their range about a fitted line, which bounds their straightness from
    above, until no other can be worse.
    """
    along = np.linalg.svd(line - line.mean(axis=0), full_matrices=False)[2][0]
    place = line @ along
    order = np.argsort(place, kind="stable")
    ordered, place = line[order], place[order]
    height = ordered @ np.cross(along, normal)
    ends = np.searchsorted(place, place + length * (1 + 1e-12), side="right")
    stretches = []
    for start, end in enumerate(ends):
        if end - start >= 3:
            rows = slice(start, int(end))
            slope = np.polynomial.polynomial.polyfit(place[rows] - place[start], height[rows], 1)
            rest = height[rows] - np.polynomial.polynomial.polyval(place[rows] - place[start], slope)
            stretches.append((float(np.ptp(rest)), rows))
    if not stretches:
        raise AssociationError(f"no {length:g} mm of the line hold three points; mesh it finer")
    best: Evaluation | None = None
    for bound, rows in sorted(stretches, key=lambda item: -item[0]):
        if best is not None and bound <= best.value:
            break
        found = form(ordered[rows], "straightness", section_normal=normal)
        if best is None or found.value > best.value:
            best = replace(found, active=tuple(int(order[rows][i]) for i in found.active))
    assert best is not None
    return best


def axis_pose(feature: Feature, points: Points) -> Pose:
    """Return a frame with the axis of a round feature, from least squares."""
    axis = getattr(feature.ideal, "axis", None)
    if isinstance(feature.ideal, Cylinder):
        return associate(points, "cylinder", "least squares", axis=axis).pose
    if isinstance(feature.ideal, Cone):
        return associate(points, "cone", "least squares", axis=axis).pose
    if isinstance(feature.ideal, Sphere):
        centre = associate(points, "sphere", "least squares").pose.origin
        return Pose(centre, np.eye(3), np.zeros(2))
    centre = feature.ideal.centre  # type: ignore[union-attr]
    return Pose(np.asarray(centre), frame_about(np.asarray(axis)), np.zeros(2))


def median_line_of(part: MadePart, faces: tuple[int, ...], feature: Feature, sections: int) -> Points:
    """Return the centres (k, 3) of Gaussian circles in sections across the axis of the Gaussian cylinder."""
    points = part.points(faces)

    def centres() -> Points:
        pose = axis_pose(feature, points)
        return section_centres(axial_sections(part, faces, pose, sections), pose)

    return part.memory.recall(("median line", faces, sections), (points,), centres)


def median_surface_points(part: MadePart, features: tuple[Feature, ...]) -> Points:
    """Return the median points (n, 3) of two opposite planes: each vertex against the face beyond it.

    Vertices and triangles of the opposite face are paired on the nominal part, so that a population shares
    the pairs; on any other mesh they are paired as made.
    """
    faces = tuple(feature.face_indices for feature in features)
    first, second = (part.points(one) for one in faces)

    def median() -> Points:
        normal = _between_normal(first, second)
        axes = frame_about(normal)[:, :2]
        if part.same_vertices:
            pairs = part.geometry.of_nominal(("opposite", *faces), lambda: _nominal_pairs(part, faces))
        else:
            pairs = opposite_triangles(first @ axes, second @ axes)
        beyond = heights_at(first @ axes, second @ axes, second @ normal, pairs)
        return np.asarray(first + (0.5 * (beyond - first @ normal))[:, None] * normal)

    return part.memory.recall(("median surface", *faces), (first, second), median)


def _nominal_pairs(part: MadePart, faces: tuple[tuple[int, ...], ...]) -> Ints:
    first, second = (part.nominal_points(one) for one in faces)
    axes = frame_about(_between_normal(first, second))[:, :2]
    return opposite_triangles(first @ axes, second @ axes)


def _between_normal(first: Points, second: Points) -> Vectors:
    """Return the mean normal of the least-squares planes of two opposite faces as made."""
    normals = [associate(points, "plane", "least squares").pose.axis for points in (first, second)]
    mean = normals[0] + np.sign(normals[0] @ normals[1]) * normals[1]
    return np.asarray(mean / np.linalg.norm(mean))
