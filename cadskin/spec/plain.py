"""A specification as plain data, for JSON."""

from __future__ import annotations

from math import degrees
from typing import Any

from cadskin.spec.datums import Datum, DatumSystem, DatumTarget
from cadskin.spec.dimension import Dimension
from cadskin.spec.frames import frame
from cadskin.spec.indicators import Indicator
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.specification import Specification
from cadskin.spec.tolerance import Tolerance
from cadskin.spec.zone import ToleranceZone

__all__ = ["to_dict"]


def to_dict(spec: Specification) -> dict[str, Any]:
    """Return a specification as dicts, lists, numbers and texts.

    Returns
    -------
    dict
        ``tolerances``, ``datums``, ``dimensions``, ``default``, ``unresolved``, ``notes``. Lengths are in mm,
        angles in degrees (``unit`` says which).

    Examples
    --------
    >>> from cadskin.spec import Specification, flatness
    >>> to_dict(Specification(flatness(3, 0.02)))["tolerances"][0]["value_mm"]
    0.02
    """
    return {
        "tolerances": [_tolerance(tolerance) for tolerance in spec.tolerances],
        "datums": [_datum(datum) for datum in spec.datums],
        "dimensions": [_dimension(dimension) for dimension in spec.dimensions],
        "default": None if spec.default is None else _tolerance(spec.default),
        "unresolved": [
            {"entity": item.entity, "kind": item.kind, "reason": item.reason} for item in spec.unresolved
        ],
        "notes": list(spec.notes),
    }


def _selection(feature: FeatureSelection) -> dict[str, Any]:
    return {
        "faces": list(feature.faces),
        "step_faces": sorted(feature.step_faces),
        "selectors": list(feature.selectors),
        "groups": [list(group) for group in feature.groups],
        "derived": feature.derived,
        "part": feature.part,
    }


def _tolerance(tolerance: Tolerance) -> dict[str, Any]:
    return {
        "id": tolerance.id,
        "type": tolerance.type,
        "value_mm": tolerance.value,
        "raw_value": tolerance.raw_value if tolerance.raw_unit else tolerance.value,
        "raw_unit": tolerance.raw_unit or "mm",
        "frame": frame(tolerance),
        "datums": list(tolerance.datums.labels),
        "datum_modifiers": _datum_modifiers(tolerance.datums),
        "modifiers": list(tolerance.modifiers),
        "material": tolerance.material,
        "scope": tolerance.scope,
        **_selection(tolerance.feature),
        "zone": _zone(tolerance.zone),
        "indicators": [_indicator(indicator) for indicator in tolerance.indicators],
        "parent": tolerance.parent,
        "name": tolerance.name,
        "standard": tolerance.standard,
        "model": None if tolerance.model is None else dict(tolerance.model),
        "policy": tolerance.policy,
        "notes": list(tolerance.notes),
        "source": tolerance.source,
    }


def _datum_modifiers(system: DatumSystem) -> list[list[dict[str, Any]]]:
    found = []
    for reference in system.references:
        elements = reference.element_modifiers or ((),) * len(reference.letters)
        found.append(
            [{"letter": None, "name": mod.name, "value_mm": mod.value} for mod in reference.modifiers]
            + [
                {"letter": letter, "name": mod.name, "value_mm": mod.value}
                for letter, mods in zip(reference.letters, elements, strict=True)
                for mod in mods
            ]
        )
    return found


def _zone(zone: ToleranceZone) -> dict[str, Any]:
    area = zone.per_area
    return {
        "shape": zone.shape,
        "form": zone.form,
        "projected_mm": zone.projected,
        "projected_offset_mm": zone.projected_offset,
        "outside_mm": zone.outside,
        "maximum_mm": zone.maximum,
        "per_length_mm": zone.per_length,
        "per_area": None
        if area is None
        else {"shape": area.shape, "size_mm": area.size, "second_mm": area.second},
        "combined": zone.combined,
        "angle_deg": None if zone.angle is None else degrees(zone.angle),
    }


def _indicator(indicator: Indicator) -> dict[str, Any]:
    return {
        "kind": indicator.kind,
        "relation": indicator.relation,
        "datums": list(indicator.datums.labels),
        "angle_deg": None if indicator.angle is None else degrees(indicator.angle),
        "direction": None if indicator.direction is None else list(indicator.direction),
    }


def _datum(datum: Datum) -> dict[str, Any]:
    return {
        "letter": datum.letter,
        **_selection(datum.feature),
        "targets": [_target(target) for target in datum.targets],
        "source": datum.source,
    }


def _target(target: DatumTarget) -> dict[str, Any]:
    return {
        "label": target.label,
        "kind": target.kind,
        "origin_mm": None if target.origin is None else list(target.origin),
        "axis": None if target.axis is None else list(target.axis),
        "direction": None if target.direction is None else list(target.direction),
        "length_mm": target.length,
        "width_mm": target.width,
        "diameter_mm": target.diameter,
        "movable": target.movable,
        **_selection(target.feature),
    }


def _dimension(dimension: Dimension) -> dict[str, Any]:
    def out(value: float | None) -> float | None:
        return degrees(value) if value is not None and dimension.angular else value

    low, high = dimension.deviations
    second = _selection(dimension.second)
    return {
        "id": dimension.id,
        "kind": dimension.kind,
        "name": dimension.name,
        "unit": "deg" if dimension.angular else "mm",
        "nominal": out(dimension.nominal),
        "lower_deviation": out(low),
        "upper_deviation": out(high),
        "lower_limit": out(dimension.lower),
        "upper_limit": out(dimension.upper),
        "fit": dimension.fit,
        "qualifier": dimension.qualifier,
        "modifiers": list(dimension.modifiers),
        "raw_unit": dimension.raw_unit,
        **_selection(dimension.feature),
        "second_faces": second["faces"],
        "second_step_faces": second["step_faces"],
        "second_selectors": second["selectors"],
        "notes": list(dimension.notes),
        "source": dimension.source,
    }
