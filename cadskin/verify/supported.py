"""What of a tolerance an evaluation honours: everything else is refused by name, never passed over."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from cadskin.spec import Tolerance
    from cadskin.verify.form import Parameter

__all__ = ["form_parameter", "is_lower_segment", "is_tangent", "refuse_unknown"]

# AP242 modifiers with a meaning here. A mesh is evaluated as it lies: free state or not is not its matter.
_PARAMETERS = {
    "PEAK_HEIGHT": "p",
    "VALLEY_DEPTH": "v",
    "STANDARD_DEVIATION": "q",
    "TOTAL_RANGE_DEVIATION": "t",
}
_ANYWHERE = ("COMMON_ZONE", "SEPARATE_ZONE", "FREE_STATE", "UNITED_FEATURE", "STATISTICAL_TOLERANCE")
_TANGENT = ("TANGENT_PLANE", "ASSOCIATED_TANGENT_FEATURE")
_CUT = ("intersection_plane", "collection_plane")
_INDICATORS = {"straightness": _CUT, "line_profile": _CUT}
_TURNED = ("orientation_plane", "collection_plane")
_DATUM = ("MAXIMUM_MATERIAL_REQUIREMENT", "LEAST_MATERIAL_REQUIREMENT", "ORIENTATION", "FREE_STATE")


def refuse_unknown(tolerance: Tolerance) -> None:
    """Refuse a tolerance that states something the evaluation would pass over.

    Raises
    ------
    SpecificationError
        It names the modifier or the property of the zone.
    """
    group, zone = tolerance.characteristic.group, tolerance.zone
    known = (*_ANYWHERE, *(_PARAMETERS if group == "form" else ()), *_known_tangents(tolerance))
    found = [f"modifier {word}" for word in tolerance.modifiers if word not in known]
    if zone.projected is not None and group not in ("orientation", "location"):
        found.append("a projected zone")
    if zone.maximum is not None and tolerance.material == "RFS":
        found.append("a largest zone (MAX)")
    if zone.angle is not None:
        found.append("a zone in a stated direction")
    if zone.per_area is not None and (tolerance.type != "flatness" or tolerance.feature.derived != "none"):
        found.append("a value per area")
    if zone.per_length is not None and tolerance.type != "straightness":
        found.append("a value per length")
    if zone.outside is not None and group != "profile":
        found.append("an unequally disposed zone")
    if zone.shape == "spherical_diameter" and tolerance.type != "position":
        found.append("a spherical zone")
    found += [
        f"a {indicator.kind.replace('_', ' ')}"
        for indicator in tolerance.indicators
        if indicator.kind not in _INDICATORS.get(tolerance.type, _others(tolerance))
    ]
    for reference in tolerance.datums.references:
        words = [*reference.modifiers, *(word for one in reference.element_modifiers for word in one)]
        found += [
            f"modifier {word.name} of datum {reference.label}" for word in words if word.name not in _DATUM
        ]
    if found:
        raise SpecificationError(
            f"tolerance {tolerance.id} ({tolerance.type}): {', '.join(found)} is not supported"
        )


def _others(tolerance: Tolerance) -> tuple[str, ...]:
    """Return the indicators of a tolerance that is none of lines: an axis between planes can be turned."""
    group = tolerance.characteristic.group
    turned = group in ("orientation", "location") and tolerance.feature.derived == "axis"
    return _TURNED if turned and tolerance.zone.shape == "width" else ("collection_plane",)


def _known_tangents(tolerance: Tolerance) -> tuple[str, ...]:
    return _TANGENT if tolerance.characteristic.group == "orientation" else ()


def is_tangent(tolerance: Tolerance) -> bool:
    """Tell whether the tolerance is one of the tangent plane."""
    return any(word in _TANGENT for word in tolerance.modifiers)


def form_parameter(tolerance: Tolerance) -> Parameter:
    """Return the form parameter (t, p, v or q) that the modifiers choose."""
    chosen = [_PARAMETERS[word] for word in tolerance.modifiers if word in _PARAMETERS]
    return cast("Parameter", chosen[0] if chosen else "t")


def is_lower_segment(tolerance: Tolerance, parent: Tolerance | None) -> bool:
    """Tell whether a tolerance is the lower segment of a composite frame: its datums hold orientation only.

    References
    ----------
    ASME Y14.5-2018, 10.5.1 (position) and 11.6 (profile): the lower segment's datums constrain rotation.
    """
    return (
        parent is not None
        and parent.type == tolerance.type
        and tolerance.characteristic.group in ("location", "profile")
    )
