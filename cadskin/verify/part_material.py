"""Material requirements on made parts: the verdict comes from the virtual boundary (ISO 2692)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cadskin.errors import SpecificationError
from cadskin.shape.ideal import Cylinder
from cadskin.verify.boundary import Boundary, Requirement, boundary_violation, material_size, virtual_size
from cadskin.verify.mobility import datum_boundaries

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin.spec import Specification, Tolerance
    from cadskin.verify.evaluation import Evaluation
    from cadskin.verify.extraction import MadePart
    from cadskin.verify.part_datums import Placement

__all__ = ["with_material"]

Members = tuple[tuple[int, ...], ...]


def with_material(
    found: Evaluation,
    tolerance: Tolerance,
    part: MadePart,
    spec: Specification,
    place: Placement,
    together: Sequence[Members],
) -> Evaluation:
    """Return an evaluation with the verdict of its material requirement.

    Parameters
    ----------
    found : Evaluation
        The value regardless of feature size.
    tolerance : Tolerance
        With MMR or LMR; the maximum or least material size comes from the size dimension of the same faces.
    part : MadePart
    spec : Specification
    place : Placement
        Its free motions are those of the boundaries.
    together : sequence of members
        Members that move together.

    Raises
    ------
    SpecificationError
        No size with limits on the same faces, or a feature that is no cylinder.
    """
    requirement: Requirement = "MMR" if tolerance.material == "MMR" else "LMR"
    checked = [
        boundary_violation(
            [
                *(_boundary(tolerance, part, spec, place, faces, requirement) for faces in members),
                *datum_boundaries(tolerance, part, spec, place),
            ],
            place.frame,
            free=place.free,
            certified=place.certified,
            operations=place.operations(),
        )
        for members in together
    ]
    violation = max(one.value for one in checked)
    details = {**found.details, "virtual_boundary_violation": violation, "requirement": requirement}
    return replace(
        found,
        verdict=all(bool(one.ok) for one in checked),
        certified=found.certified and all(one.certified for one in checked),
        details=details,
        notes=(*found.notes, f"{requirement}: decided at the virtual boundary, not by the value"),
    )


def _boundary(
    tolerance: Tolerance,
    part: MadePart,
    spec: Specification,
    place: Placement,
    faces: tuple[int, ...],
    requirement: Requirement,
) -> Boundary:
    feature = part.features(faces)[0]
    if not isinstance(feature.ideal, Cylinder) or tolerance.value is None:
        raise SpecificationError(
            f"tolerance {tolerance.id}: {requirement} of a {feature.kind} is not supported; "
            "of a cylinder it is"
        )
    size = material_size(spec, feature, requirement, tolerance.id)
    return Boundary(
        part.points(faces),
        place.in_frame(feature.ideal.origin),
        place.turned(feature.ideal.axis),
        virtual_size(size, tolerance.value, internal=feature.internal, requirement=requirement),
        keeps_out=feature.internal == (requirement == "MMR"),
    )
