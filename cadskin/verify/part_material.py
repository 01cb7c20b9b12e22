"""Material requirements on made parts: the verdict comes from the virtual boundary (ISO 2692)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from cadskin.errors import SpecificationError
from cadskin.shape.ideal import Cylinder
from cadskin.verify.boundary import Boundary, Requirement, boundary_violation, virtual_size

if TYPE_CHECKING:
    from cadskin.shape import Feature
    from cadskin.spec import Specification, Tolerance
    from cadskin.verify.evaluation import Evaluation
    from cadskin.verify.extraction import MadePart
    from cadskin.verify.part_datums import Placement

__all__ = ["with_material"]


def with_material(
    found: Evaluation, tolerance: Tolerance, part: MadePart, spec: Specification, place: Placement
) -> Evaluation:
    """Return a position with the verdict of its material requirement.

    Parameters
    ----------
    found : Evaluation
        The position regardless of feature size.
    tolerance : Tolerance
        With MMR or LMR; the maximum or least material size comes from the size dimension of the same faces.
    part : MadePart
    spec : Specification
    place : Placement

    Raises
    ------
    SpecificationError
        No size with limits on the same faces, or a feature that is no cylinder.
    """
    requirement: Requirement = "MMR" if tolerance.material == "MMR" else "LMR"
    boundaries = []
    for faces in tolerance.feature.members:
        feature = part.features(faces)[0]
        if not isinstance(feature.ideal, Cylinder) or tolerance.value is None:
            raise SpecificationError(
                f"tolerance {tolerance.id}: {requirement} of a {feature.kind} is not supported; "
                "of a cylinder it is"
            )
        size = material_size(spec, feature, requirement, tolerance.id)
        virtual = virtual_size(size, tolerance.value, internal=feature.internal, requirement=requirement)
        boundaries.append(
            Boundary(
                part.points(faces),
                place.in_frame(feature.ideal.origin),
                place.turned(feature.ideal.axis),
                virtual,
                keeps_out=feature.internal == (requirement == "MMR"),
            )
        )
    checked = boundary_violation(
        boundaries, place.frame, free=place.free, certified=place.certified, operations=place.operations()
    )
    details = {**found.details, "virtual_boundary_violation": checked.value, "requirement": requirement}
    return replace(
        found,
        verdict=checked.ok,
        certified=found.certified and checked.certified,
        details=details,
        notes=(*found.notes, f"{requirement}: decided at the virtual boundary, not by the value"),
    )


def material_size(spec: Specification, feature: Feature, requirement: Requirement, name: str) -> float:
    """Return the maximum or least material size of a feature, a diameter [mm]."""
    faces = set(feature.face_indices)
    for dimension in spec.dimensions:
        if dimension.kind != "size" or not faces & set(dimension.feature.faces):
            continue
        # The most material: the largest shaft, the smallest hole.
        limit = dimension.lower if feature.internal == (requirement == "MMR") else dimension.upper
        if limit is not None:
            return 2.0 * limit if dimension.name == "radius" else limit
    raise SpecificationError(
        f"tolerance {name}: {requirement} needs a size with limits on {feature.name}; the "
        "specification has none"
    )
