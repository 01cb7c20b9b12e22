"""Profile of any line on made parts: sections of a surface, each against the nominal one (ISO 1101)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.shape.association import Pose, frame_about
from cadskin.shape.ideal import Plane
from cadskin.verify.extraction import plane_cuts
from cadskin.verify.part_form import worst
from cadskin.verify.part_patches import nominal_patch
from cadskin.verify.profile import profile

if TYPE_CHECKING:
    from cadskin._typing import Vectors
    from cadskin.shape import Feature
    from cadskin.spec import Tolerance
    from cadskin.verify.evaluation import Evaluation
    from cadskin.verify.extraction import MadePart
    from cadskin.verify.part_datums import Placement

__all__ = ["part_line_profile", "usual_section_normal"]

_IN_PLANE: tuple[str, ...] = ("tx", "ty", "rz")


def usual_section_normal(feature: Feature) -> Vectors:
    """Return the normal of the sections where no intersection plane is given.

    Across the direction along which the surface does not change (the axis of a cylinder, the direction of an
    extrusion); the lines of a plane lie along its longer side.
    """
    if isinstance(feature.ideal, Plane):
        centred = feature.points - feature.points.mean(axis=0)
        return np.asarray(np.linalg.svd(centred, full_matrices=False)[2][1])
    return np.asarray(np.linalg.svd(feature.normals, full_matrices=False)[2][2])


def part_line_profile(
    tolerance: Tolerance,
    part: MadePart,
    members: tuple[tuple[int, ...], ...],
    place: Placement,
    sections: int,
    *,
    normals: dict[int, Vectors] | None = None,
) -> Evaluation:
    """Evaluate a profile of any line: every section by itself, in the motions that the datums leave.

    Parameters
    ----------
    tolerance : Tolerance
    part : MadePart
    members : tuple of faces
    place : Placement
        Without datums each line may move in its section plane.
    sections : int
        Lines of each feature.
    normals : mapping of int to (3,) float, optional
        Normal of the sections of a feature, by its id, from the intersection plane.
    """
    found: list[Evaluation] = []
    stated = normals or {}
    offset = 0.0 if tolerance.value is None else tolerance.zone.offset(tolerance.value)
    for faces in members:
        for feature in part.features(faces):
            normal = stated.get(feature.id)
            if normal is None:
                normal = usual_section_normal(feature)
            found += _lines(part, feature, normal, place, sections, offset)
    result = worst(found)
    note = f"the worst of {len(found)} lines"
    if not stated:
        note += "; no intersection plane is given, sections are across the direction of least change"
    return replace(result, characteristic="profile of a line", notes=(*result.notes, note))


def _lines(
    part: MadePart, feature: Feature, normal: Vectors, place: Placement, count: int, offset: float
) -> list[Evaluation]:
    out = []
    for line, _ in plane_cuts(part, feature.face_indices, normal, count, feature=feature):
        if place.actual is None:
            frame = Pose(line.mean(axis=0), frame_about(normal), np.zeros(2))
            nominal, free = frame, _IN_PLANE
        else:
            frame, nominal, free = place.frame, place.nominal_frame, place.free
        patch = nominal_patch(part, feature, nominal, offset=offset)
        out.append(
            profile(
                [(patch, line)],
                frame,
                free=free,
                certified=place.certified,
                operations=place.operations(),
            )
        )
    return out
