"""Evaluate one tolerance on a made part: which points, which zone, which datums."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from cadskin.errors import SpecificationError
from cadskin.shape.association import associate
from cadskin.shape.ideal import Plane
from cadskin.spec.indicators import section_normal
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.members import Members, members_of
from cadskin.verify.mobility import with_mobility
from cadskin.verify.part_datums import Placement, mobile_references, oriented_placement, placement
from cadskin.verify.part_form import part_form, worst
from cadskin.verify.part_lines import part_line_profile
from cadskin.verify.part_material import with_material
from cadskin.verify.part_zones import (
    part_location,
    part_orientation,
    part_profile,
    part_runout,
    within_rounding,
)
from cadskin.verify.supported import is_lower_segment, refuse_unknown

if TYPE_CHECKING:
    from cadskin._typing import Vectors
    from cadskin.spec import Specification, Tolerance
    from cadskin.verify.datums import Standard
    from cadskin.verify.extraction import MadePart

__all__ = ["evaluate"]

_SECTIONS = 15  # sections, surface lines or circles of a feature
_GROUPS: dict[str, Callable[..., Evaluation]] = {
    "orientation": part_orientation,
    "location": part_location,
    "runout": part_runout,
    "profile": part_profile,
}


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
    members, notes = members_of(tolerance, part)
    if not members:
        raise SpecificationError(
            f"tolerance {tolerance.id}: no faces; bind the specification to the part first"
        )
    refuse_unknown(tolerance)
    group = tolerance.characteristic.group
    is_median = tolerance.feature.derived == "axis" or tolerance.zone.shape == "diameter"
    if group == "form":
        normals = [_section_normal(tolerance, faces, part, spec, standard) for faces in members]
        found = worst(
            [
                part_form(tolerance, part, faces, sections, section_normal=normal)
                for faces, normal in zip(members, normals, strict=True)
            ]
        )
        place = Placement.everywhere()
        each: list[Members] = [(faces,) for faces in members]
    else:
        found, place, each = _against_datums(tolerance, members, part, spec, standard, sections)
    if "STATISTICAL_TOLERANCE" in tolerance.modifiers:
        notes = (*notes, "a statistical tolerance: this is the value of one part, its process is not judged")
    found = replace(found, characteristic=tolerance.type, limit=tolerance.value, notes=(*found.notes, *notes))
    if tolerance.material == "RFS":
        return within_rounding(found, tolerance, part)
    if group in ("profile", "runout") or (group == "form" and not is_median):
        raise SpecificationError(
            f"tolerance {tolerance.id}: {tolerance.material} of {tolerance.type} is not supported; of a "
            "derived feature of a cylinder it is"
        )
    return with_material(found, tolerance, part, spec, place, each, standard)


def _section_normal(
    tolerance: Tolerance,
    faces: tuple[int, ...],
    part: MadePart,
    spec: Specification,
    standard: Standard,
) -> Vectors | None:
    """Return the normal of the sections that the intersection plane of a surface asks for."""
    feature, cutting = part.features(faces)[0], tolerance.indicator("intersection_plane")
    is_plane = isinstance(feature.ideal, Plane)
    if cutting is None or not (is_plane or tolerance.type == "line_profile"):
        return None
    if is_plane:
        normal = associate(
            part.points(faces), "plane", "least squares", axis=feature.faces[0].normal
        ).pose.axis
    else:
        normal = feature.normals.sum(axis=0)
    if cutting.direction is not None:
        return section_normal(cutting, normal)
    datum = placement(part, replace(tolerance, datums=cutting.datums), spec, standard).actual
    if datum is None:
        return None
    first = datum.datums[0]
    return section_normal(cutting, normal, first.direction, is_axis=first.kind == "cylinder")


def _line_profile(
    tolerance: Tolerance,
    members: Members,
    part: MadePart,
    spec: Specification,
    standard: Standard,
    place: Placement,
    sections: int,
) -> Evaluation:
    """Evaluate a profile of any line in the sections of its intersection plane, or in the usual ones."""
    features = [feature for faces in members for feature in part.features(faces)]
    stated = {
        feature.id: _section_normal(tolerance, feature.face_indices, part, spec, standard)
        for feature in features
    }
    normals = {key: normal for key, normal in stated.items() if normal is not None}
    return part_line_profile(tolerance, part, members, place, sections, normals=normals)


def _against_datums(
    tolerance: Tolerance,
    members: Members,
    part: MadePart,
    spec: Specification,
    standard: Standard,
    sections: int,
) -> tuple[Evaluation, Placement, list[Members]]:
    """Evaluate a tolerance with datums, each member by itself or all together."""
    group = tolerance.characteristic.group
    place = oriented_placement(part, tolerance, spec, standard)
    if is_lower_segment(tolerance, _parent(tolerance, spec)):
        place = place.with_translations()
    one_zone = tolerance.zone.combined is not False if group == "location" else tolerance.zone.combined
    together = bool(one_zone) and group in ("location", "profile")
    each: list[Members] = [members] if together else [(faces,) for faces in members]
    if tolerance.type == "line_profile" and not mobile_references(tolerance):
        found = _line_profile(tolerance, members, part, spec, standard, place, sections)
    elif mobile_references(tolerance):
        found = worst([with_mobility(tolerance, part, spec, some, place, sections) for some in each])
    else:
        found = worst([_GROUPS[group](tolerance, part, some, place, sections) for some in each])
    return found, place.with_translations() if group == "orientation" else place, each


def _parent(tolerance: Tolerance, spec: Specification) -> Tolerance | None:
    if tolerance.parent is None:
        return None
    return next((item for item in spec if item.id == tolerance.parent), None)
