"""Material requirements on made parts: the verdict comes from the virtual boundary (ISO 2692)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import associate
from cadskin.shape.ideal import Cylinder
from cadskin.verify.boundary import Boundary, Requirement, boundary_violation, material_size, virtual_size
from cadskin.verify.mobility import datum_boundaries

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin.spec import Specification, Tolerance
    from cadskin.verify.datums import Standard
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
    standard: Standard = "ISO 5459:2011",
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
    standard : str
        Of ASME: the bonus method stands in the details.

    Raises
    ------
    SpecificationError
        No size with limits on the same faces, or a feature that is no cylinder.
    """
    requirement: Requirement = "MMR" if tolerance.material == "MMR" else "LMR"
    sizes, unsized = _sizes(tolerance, part, spec, together, requirement)
    checked = []
    for members in together:
        boundaries = [
            _boundary(tolerance, part, place, faces, sizes[faces], requirement)
            for faces in members
            if faces in sizes
        ]
        if boundaries:
            boundaries += datum_boundaries(tolerance, part, spec, place)
            checked.append(
                boundary_violation(
                    boundaries,
                    place.frame,
                    free=place.free,
                    certified=place.certified,
                    operations=place.operations(),
                )
            )
    violation = max(one.value for one in checked)
    details = {**found.details, "virtual_boundary_violation": violation, "requirement": requirement}
    if standard.startswith("ASME"):
        details |= _bonus(found, tolerance, part, sizes, requirement)
    kept = all(bool(one.ok) for one in checked)
    notes = (*found.notes, f"{requirement}: decided at the virtual boundary, not by the value")
    if unsized:
        limit = tolerance.value or 0.0
        kept = kept and found.value <= limit
        notes = (
            *notes,
            f"{', '.join(unsized)}: no size with limits, so the value too must be within the tolerance",
        )
    most = tolerance.zone.maximum
    if most is not None:
        kept = kept and found.value <= most
        notes = (*notes, f"MAX: the value must not exceed {most:g} mm however large the bonus")
    return replace(
        found,
        verdict=kept,
        certified=found.certified and all(one.certified for one in checked),
        details=details,
        notes=notes,
    )


def _bonus(
    found: Evaluation,
    tolerance: Tolerance,
    part: MadePart,
    sizes: dict[tuple[int, ...], float],
    requirement: Requirement,
) -> dict[str, Any]:
    """Return what the bonus method of ASME Y14.5 says: value against tolerance and departure of the size.

    The least departure of the members counts, from the unrelated mating size (MMR only). It is about the
    axis, the virtual boundary about the surface: the two can disagree, and the boundary decides.
    """
    if requirement != "MMR" or tolerance.value is None:
        return {}
    departures = []
    for faces, size in sizes.items():
        feature = part.features(faces)[0]
        criterion = "maximum inscribed" if feature.internal else "minimum circumscribed"
        axis = getattr(feature.ideal, "axis", None)
        try:
            mating = associate(part.points(faces), "cylinder", criterion, axis=axis)
        except AssociationError:
            return {"bonus": None, "bonus_method": None}
        departures.append(2.0 * mating.value - size if feature.internal else size - 2.0 * mating.value)
    bonus = max(0.0, min(departures))
    return {"bonus": bonus, "bonus_method": bool(found.value <= tolerance.value + bonus)}


def _sizes(
    tolerance: Tolerance,
    part: MadePart,
    spec: Specification,
    together: Sequence[Members],
    requirement: Requirement,
) -> tuple[dict[tuple[int, ...], float], tuple[str, ...]]:
    """Return the material size of each member, and the names of those that have none.

    Raises
    ------
    SpecificationError
        No member has one.
    """
    sizes: dict[tuple[int, ...], float] = {}
    unsized: dict[str, SpecificationError] = {}
    for faces in (faces for members in together for faces in members):
        feature = part.features(faces)[0]
        try:
            sizes[faces] = material_size(spec, feature, requirement, tolerance.id)
        except SpecificationError as error:
            unsized[feature.name] = error
    if not sizes:
        raise next(iter(unsized.values()))
    return sizes, tuple(unsized)


def _boundary(
    tolerance: Tolerance,
    part: MadePart,
    place: Placement,
    faces: tuple[int, ...],
    size: float,
    requirement: Requirement,
) -> Boundary:
    feature = part.features(faces)[0]
    if not isinstance(feature.ideal, Cylinder) or tolerance.value is None:
        raise SpecificationError(
            f"tolerance {tolerance.id}: {requirement} of a {feature.kind} is not supported; "
            "of a cylinder it is"
        )
    return Boundary(
        part.points(faces),
        place.in_frame(feature.ideal.origin),
        place.turned(feature.ideal.axis),
        virtual_size(size, tolerance.value, internal=feature.internal, requirement=requirement),
        keeps_out=feature.internal == (requirement == "MMR"),
    )
