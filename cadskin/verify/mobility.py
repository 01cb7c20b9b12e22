"""Datums with a material requirement: the frame may move while the datum features keep their boundaries.

A datum feature at maximum material (ISO 2692, ISO 5459 Ⓜ) is no association: its virtual boundary, at the
exact place, must not be violated, and within that the frame is free. The value of a tolerance is then the
least width of its zone over all allowed frames: the root in ``w`` of the smallest worst excess

    g(w) = min over the motions of max(boundary violation, distance - w / 2),

which is one minimax per ``w`` and does not increase with it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.ideal import Cylinder
from cadskin.verify.boundary import Boundary, Requirement, boundary_patch, material_size, virtual_size
from cadskin.verify.evaluation import Evaluation, active_of
from cadskin.verify.location import target_patch
from cadskin.verify.part_datums import mobile_references, requirement_of
from cadskin.verify.part_zones import profile_parts, targets
from cadskin.verify.zones import FREEDOMS, free_columns, solve

if TYPE_CHECKING:
    from cadskin._typing import Points
    from cadskin.shape import Feature
    from cadskin.shape.association import Minimax, Patch, Pose
    from cadskin.spec import DatumReference, Specification, Tolerance
    from cadskin.verify.extraction import MadePart
    from cadskin.verify.part_datums import Placement

__all__ = ["datum_boundaries", "with_mobility"]


def datum_boundaries(
    tolerance: Tolerance, part: MadePart, spec: Specification, place: Placement
) -> list[Boundary]:
    """Return the virtual boundaries of the datum features that have a material requirement.

    Raises
    ------
    SpecificationError
        A datum feature that is no cylinder, or whose size has no limits.
    """
    out = []
    for index, reference in enumerate(tolerance.datums.references):
        requirement = requirement_of(reference)
        if requirement is None:
            continue
        before = tolerance.datums.references[:index]
        for letter in reference.letters:
            for feature in part.features(spec.datum(letter).feature.faces):
                out.append(_boundary(tolerance, part, spec, place, feature, requirement, before))
    return out


def _boundary(
    tolerance: Tolerance,
    part: MadePart,
    spec: Specification,
    place: Placement,
    feature: Feature,
    requirement: Requirement,
    before: tuple[DatumReference, ...],
) -> Boundary:
    if not isinstance(feature.ideal, Cylinder):
        raise SpecificationError(
            f"tolerance {tolerance.id}: a datum with {requirement} on a {feature.kind} is not supported; "
            "on a cylinder it is"
        )
    size = material_size(spec, feature, requirement, tolerance.id)
    own = _own_tolerance(spec, feature, requirement, before)
    return Boundary(
        part.points(feature.face_indices),
        place.in_frame(feature.ideal.origin),
        place.turned(feature.ideal.axis),
        virtual_size(size, own, internal=feature.internal, requirement=requirement),
        keeps_out=feature.internal == (requirement == "MMR"),
    )


def _own_tolerance(
    spec: Specification, feature: Feature, requirement: Requirement, before: tuple[DatumReference, ...]
) -> float:
    """Return the datum feature's own tolerance with the same requirement that enters its virtual size.

    ISO 2692, rules on datums: the location or orientation whose datums are those before it in the datum
    system, else a form; without one the virtual size is the material size.
    """
    faces, letters = set(feature.face_indices), tuple(reference.label for reference in before)
    order = {"location": 0, "orientation": 1, "form": 2}
    found = [
        (order[item.characteristic.group], item.value)
        for item in spec
        if item.material == requirement
        and item.value is not None
        and faces & set(item.feature.faces)
        and item.characteristic.group in order
        and item.datums.labels == (() if item.characteristic.group == "form" else letters)
    ]
    return min(found)[1] if found else 0.0


def with_mobility(
    tolerance: Tolerance,
    part: MadePart,
    spec: Specification,
    members: tuple[tuple[int, ...], ...],
    place: Placement,
    sections: int,
) -> Evaluation:
    """Evaluate a location or profile whose datums have material requirements.

    Raises
    ------
    SpecificationError
        Another kind of tolerance.
    AssociationError
        A datum feature violates its virtual boundary: the datum system does not exist on this part.
    """
    group = tolerance.characteristic.group
    if group == "location":
        found = targets(tolerance, part, members, place, sections)
        pieces = [(target_patch(target), np.asarray(target.points)) for target in found]
        two_sided = [target.shape == "plane" for target in found]
    elif group == "profile":
        pieces = profile_parts(tolerance, part, members, place, sections)
        two_sided = [True] * len(pieces)
    else:
        raise SpecificationError(
            f"tolerance {tolerance.id}: {tolerance.type} to a datum with a material requirement is not "
            "supported"
        )
    boundaries = datum_boundaries(tolerance, part, spec, place)
    held = [(boundary_patch(boundary), np.asarray(boundary.points)) for boundary in boundaries]
    columns = free_columns(name for name in FREEDOMS if name in place.free)
    width, last = _least_width(pieces, two_sided, held, place.frame, columns, tolerance.id)
    count = sum(len(points) for _, points in pieces)
    letters = ", ".join(reference.symbols() for reference in mobile_references(tolerance))
    return Evaluation(
        characteristic=tolerance.type,
        value=width,
        quantity="least width of the zone while the datum features keep their virtual boundaries",
        certified=last.certified and place.certified,
        n_points=count,
        zone={"width": width, "origin": last.pose.origin, "axes": last.pose.axes},
        active=tuple(index for index in active_of(last) if index < count),
        operations=(
            *place.operations(),
            f"datum {letters}: virtual boundaries {', '.join(f'{b.diameter:.9g}' for b in boundaries)} mm",
            "extraction: the given points",
            "filtration: none",
        ),
    )


def _least_width(
    pieces: list[tuple[Patch, Points]],
    two_sided: list[bool],
    held: list[tuple[Patch, Points]],
    frame: Pose,
    columns: tuple[int, ...],
    name: str,
) -> tuple[float, Minimax]:
    """Return the root of ``g`` and the minimax there."""
    from scipy.optimize import brentq

    alone = solve(held, frame, columns, "upper", what=f"datums of tolerance {name}")
    if alone.value > 1e-9:
        raise AssociationError(
            f"tolerance {name}: a datum feature violates its virtual boundary by {alone.value:.6g} mm; "
            "its datum system does not exist on this part"
        )
    last = alone

    def excess(width: float) -> float:
        nonlocal last
        parts = [*_widened(pieces, two_sided, width), *held]
        last = solve(parts, last.pose, columns, "upper", what=f"tolerance {name}")
        return float(last.value)

    if excess(0.0) <= 0:
        return 0.0, last
    # At the frame with the most room in the boundaries this width is enough.
    high = (
        max(
            float(patch_distances(patch, points, alone.pose).max())
            for patch, points in _widened(pieces, two_sided, 0.0)
        )
        * 2.0
    )
    while excess(high) > 0:  # only by rounding
        high *= 1.0 + 1e-9
        high += 1e-12
    root = cast("float", brentq(excess, 0.0, high, xtol=1e-13, rtol=1e-15))
    excess(root)
    return root, last


def patch_distances(patch: Patch, points: Points, pose: Pose) -> Points:
    """Return the distances (n,) of points to a patch of a frame at ``pose``."""
    from cadskin.shape.association import concatenate

    return concatenate([(patch, points)]).distances(pose)


def _widened(
    pieces: list[tuple[Patch, Points]], two_sided: list[bool], width: float
) -> list[tuple[Patch, Points]]:
    """Return patches whose largest distance is the excess over a zone of this width."""
    out = []
    for (patch, points), both in zip(pieces, two_sided, strict=True):
        out.append((replace(patch, offset=patch.offset + 0.5 * width), points))
        if both:
            back = replace(patch, sign=-patch.sign, offset=0.5 * width - patch.offset)
            out.append((back, points))
    return out
