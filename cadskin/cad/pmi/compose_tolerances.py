"""Datums and geometric tolerances as AP242 instances."""

from __future__ import annotations

from dataclasses import replace

from cadskin.cad.pmi.compose import Composer
from cadskin.cad.pmi.derived import inferred_derived
from cadskin.cad.pmi.graph import AFFECTED_PLANE
from cadskin.cad.pmi.indicators import AFFECTED_PLANES
from cadskin.cad.pmi.tokens import Enumeration, Reference, Typed, Value
from cadskin.errors import ExportError
from cadskin.spec.datums import Datum, DatumModifier, DatumReference, DatumSystem, DatumTarget
from cadskin.spec.indicators import Indicator
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.tolerance import Tolerance
from cadskin.spec.zone import ToleranceZone

__all__ = ["compose_datums", "compose_tolerances"]

_TRUE, _FALSE = Enumeration("T"), Enumeration("F")
_WITH_DATUM = (
    "angularity",
    "circular_runout",
    "coaxiality",
    "concentricity",
    "parallelism",
    "perpendicularity",
    "symmetry",
    "total_runout",
)
_ASPECTS = {"all_around": "ALL_AROUND_SHAPE_ASPECT", "between": "BETWEEN_SHAPE_ASPECT"}
_FORMS = {"width": "", "diameter": "cylindrical or circular", "spherical_diameter": "spherical"}
_MATERIAL = {"MMR": "MAXIMUM_MATERIAL_REQUIREMENT", "LMR": "LEAST_MATERIAL_REQUIREMENT"}
_TARGET_KINDS = {"circular_curve": "circular curve"}


# -- datums --------------------


def compose_datums(composer: Composer, datums: tuple[Datum, ...]) -> dict[str, Reference]:
    """Add the datums and return their numbers by letter."""
    found = {}
    for datum in datums:
        out, product = composer.out, composer.product
        found[datum.letter] = number = out.add("DATUM", "", "", product, _FALSE, datum.letter)
        if datum.feature.derived != "none":
            composer.lost.append(f"datum {datum.letter}: derived feature {datum.feature.derived}")
        if datum.feature.faces:
            aspect = composer.aspect(datum.feature, kind="DATUM_FEATURE", name=datum.letter)
            out.add("SHAPE_ASPECT_RELATIONSHIP", "", "", aspect, number)
        for target in datum.targets:
            out.add("SHAPE_ASPECT_RELATIONSHIP", "", "", _target(composer, datum.letter, target), number)
    return found


def _target(composer: Composer, letter: str, target: DatumTarget) -> Reference:
    out = composer.out
    label = target.label.removeprefix(letter)
    if label == target.label:
        composer.lost.append(f"datum target {target.label}: its label does not begin with {letter}")
    kind = _TARGET_KINDS.get(target.kind, target.kind)
    values: tuple[Value, ...] = ("", kind, composer.product, _TRUE, label)
    if target.movable:
        number = out.add("MOVABLE_DATUM_TARGET", *values, None)
    elif target.kind == "area":
        number = out.add("DATUM_TARGET", *values)
    else:
        number = out.add("PLACED_DATUM_TARGET_FEATURE", *values)
    if target.feature.faces:
        aspect = composer.aspect(target.feature)
        out.add("FEATURE_FOR_DATUM_TARGET_RELATIONSHIP", "", "", aspect, number)
    items = _target_items(composer, target)
    if items:
        definition = out.add("PROPERTY_DEFINITION", "", "", number)
        shape = out.add("SHAPE_REPRESENTATION_WITH_PARAMETERS", "", items, composer.context)
        out.add("SHAPE_DEFINITION_REPRESENTATION", definition, shape)
    return number


def _target_items(composer: Composer, target: DatumTarget) -> tuple[Value, ...]:
    out = composer.out
    items: list[Value] = []
    if target.origin is not None:
        point = out.add("CARTESIAN_POINT", "", target.origin)
        axes = [None if d is None else out.add("DIRECTION", "", d) for d in (target.axis, target.direction)]
        items.append(out.add("AXIS2_PLACEMENT_3D", "orientation", point, *axes))
    for key in ("length", "width", "diameter"):
        value = getattr(target, key)
        if value is not None:
            items.append(composer.item(value, f"target {key}"))
    return tuple(items)


def _system(composer: Composer, system: DatumSystem, datums: dict[str, Reference], label: str) -> Reference:
    compartments = tuple(_compartment(composer, item, datums, label) for item in system.references)
    return composer.out.add("DATUM_SYSTEM", "", "", composer.product, _FALSE, compartments)


def _compartment(
    composer: Composer, reference: DatumReference, datums: dict[str, Reference], label: str
) -> Reference:
    missing = [letter for letter in reference.letters if letter not in datums]
    if missing:
        raise ExportError(f"{label} refers to datum {missing[0]}, which is not defined")
    out, product = composer.out, composer.product
    modifiers = _modifiers(composer, reference.modifiers)
    if len(reference.letters) == 1 and not reference.element_modifiers:
        base: Value = datums[reference.letters[0]]
    else:
        nested = reference.element_modifiers or ((),) * len(reference.letters)
        elements = tuple(
            out.add(
                "DATUM_REFERENCE_ELEMENT", "", "", product, _FALSE, datums[letter], _modifiers(composer, mods)
            )
            for letter, mods in zip(reference.letters, nested, strict=True)
        )
        base = Typed("COMMON_DATUM_LIST", (elements,))
    return out.add("DATUM_REFERENCE_COMPARTMENT", "", "", product, _FALSE, base, modifiers)


def _modifiers(composer: Composer, modifiers: tuple[DatumModifier, ...]) -> Value:
    found: list[Value] = []
    for modifier in modifiers:
        name = Enumeration(modifier.name)
        if modifier.value is None:
            found.append(Typed("SIMPLE_DATUM_REFERENCE_MODIFIER", (name,)))
        else:
            length = composer.length(modifier.value)
            found.append(composer.out.add("DATUM_REFERENCE_MODIFIER_WITH_VALUE", name, length))
    return tuple(found) or None


# -- tolerances --------------------


def compose_tolerances(
    composer: Composer, tolerances: tuple[Tolerance, ...], datums: dict[str, Reference]
) -> None:
    """Add the tolerances, their zones and composite relations."""
    numbers = {item.id: _tolerance(composer, item, datums) for item in tolerances}
    for item in tolerances:
        if item.parent is not None:
            if item.parent not in numbers:
                raise ExportError(f"tolerance {item.id} has the parent {item.parent!r}, which is not there")
            composer.out.add(
                "GEOMETRIC_TOLERANCE_RELATIONSHIP",
                "composite tolerance",
                "",
                numbers[item.parent],
                numbers[item.id],
            )


def _tolerance(composer: Composer, item: Tolerance, datums: dict[str, Reference]) -> Reference:
    label = f"tolerance {item.id} ({item.type})"
    for key in ("model", "standard"):
        if getattr(item, key) is not None:
            composer.lost.append(f"{label}: {key}")
    composer.lost += [f"{label}: {x.kind.replace('_', ' ')} by datum" for x in item.indicators if x.datums]
    records = _records(composer, item)
    target = _toleranced(composer, item, label)
    magnitude: Value = None
    if item.value is not None:
        magnitude = composer.length(item.value, raw=item.raw_value, unit=item.raw_unit)
    base: tuple[Value, ...] = (item.name, "", magnitude, target)
    leaf = f"{item.type.upper()}_TOLERANCE"
    system: tuple[Value, ...] = ()
    if item.datums:
        system = ((_system(composer, item.datums, datums, label),),)
        records.append(("GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE", system))
    if not records:
        number = composer.out.add(leaf, *base)
    elif len(records) == 1 and item.datums and item.type in _WITH_DATUM:
        number = composer.out.add(leaf, *base, *system)
    else:
        number = composer.out.add_complex(("GEOMETRIC_TOLERANCE", base), (leaf, ()), *records)
    own_planes = [indicator for indicator in item.indicators if indicator.direction is not None]
    zone = _zone(composer, number, item.zone, target, wanted=bool(own_planes))
    for indicator in own_planes:
        _affected_plane(composer, indicator, target if zone is None else zone, label)
    return number


def _affected_plane(composer: Composer, indicator: Indicator, anchor: Reference, label: str) -> None:
    """Add an intersection or orientation plane with geometry of its own."""
    if indicator.kind not in AFFECTED_PLANES or indicator.relation != "parallel":
        composer.lost.append(f"{label}: {indicator.kind.replace('_', ' ')} by direction")
        return
    out = composer.out
    aspect = out.add("SHAPE_ASPECT", AFFECTED_PLANES[indicator.kind], "", composer.product, _FALSE)
    out.add("SHAPE_ASPECT_RELATIONSHIP", AFFECTED_PLANE, "", anchor, aspect)
    point = out.add("CARTESIAN_POINT", "", (0.0, 0.0, 0.0))
    axis = out.add("DIRECTION", "", indicator.direction)
    placed = out.add("AXIS2_PLACEMENT_3D", "orientation", point, axis, None)
    definition = out.add("PROPERTY_DEFINITION", "", "", aspect)
    shape = out.add("SHAPE_REPRESENTATION", "", (placed,), composer.context)
    out.add("SHAPE_DEFINITION_REPRESENTATION", definition, shape)


def _records(composer: Composer, item: Tolerance) -> list[tuple[str, tuple[Value, ...]]]:
    zone = item.zone
    words = [_MATERIAL[item.material]] if item.material in _MATERIAL else []
    words += item.modifiers
    records: list[tuple[str, tuple[Value, ...]]] = []
    if words or zone.maximum is not None:
        listed = tuple(Enumeration(word) for word in words)
        records.append(("GEOMETRIC_TOLERANCE_WITH_MODIFIERS", (listed,)))
    if zone.maximum is not None:
        maximum = composer.length(zone.maximum)
        records.append(("GEOMETRIC_TOLERANCE_WITH_MAXIMUM_TOLERANCE", (maximum,)))
    if zone.outside is not None:
        records.append(("UNEQUALLY_DISPOSED_GEOMETRIC_TOLERANCE", (composer.length(zone.outside),)))
    if zone.per_area is not None:
        area = zone.per_area
        size = None if area.size is None else composer.length(area.size)
        second = None if area.second is None else composer.length(area.second)
        shape = Enumeration(area.shape.upper())
        records.append(("GEOMETRIC_TOLERANCE_WITH_DEFINED_UNIT", (size,)))
        records.append(("GEOMETRIC_TOLERANCE_WITH_DEFINED_AREA_UNIT", (shape, second)))
    elif zone.per_length is not None:
        records.append(("GEOMETRIC_TOLERANCE_WITH_DEFINED_UNIT", (composer.length(zone.per_length),)))
    if zone.per_area is not None and zone.per_length is not None:
        composer.lost.append(f"tolerance {item.id}: per_length beside per_area")
    if item.scope == "all_over":
        listed = (Enumeration("ALL_OVER"),)
        records.append(("GEOMETRIC_TOLERANCE_AUXILIARY_CLASSIFICATION", (listed,)))
    return records


def _toleranced(composer: Composer, item: Tolerance, label: str) -> Reference:
    feature = item.feature
    if not feature.faces:
        if feature:
            raise ExportError(f"{label} is on {feature.text()}, which is not tied to faces: bind() it first")
        return composer.product
    centre = _needs_centre(item, feature)
    if feature.derived == "line_element":
        composer.lost.append(f"{label}: line element")
    return composer.aspect(feature, kind=_ASPECTS.get(item.scope, "SHAPE_ASPECT"), centre=centre)


def _needs_centre(item: Tolerance, feature: FeatureSelection) -> bool:
    """Tell whether the derived feature must be written: the reader would not infer it."""
    kinds = feature.kinds
    plain = inferred_derived(item.type, item.zone.shape, kinds, feature, centre=False)
    return feature.derived not in ("none", "line_element", plain)


def _zone(
    composer: Composer, tolerance: Reference, zone: ToleranceZone, target: Reference, *, wanted: bool
) -> Reference | None:
    plain = replace(ToleranceZone(), outside=zone.outside, maximum=zone.maximum, combined=zone.combined)
    if replace(zone, per_length=None, per_area=None) == plain and not wanted:
        return None
    out, product = composer.out, composer.product
    form = out.add("TOLERANCE_ZONE_FORM", zone.form or _FORMS[zone.shape])
    number = out.add("TOLERANCE_ZONE", "", "", product, _FALSE, (tolerance,), form)
    if zone.projected is not None:
        length = composer.length(zone.projected)
        if zone.projected_offset is None:
            out.add("PROJECTED_ZONE_DEFINITION", number, (), target, length)
        else:
            offset = composer.length(zone.projected_offset)
            out.add("PROJECTED_ZONE_DEFINITION_WITH_OFFSET", number, (), target, length, offset)
    if zone.angle is not None:
        orientation = out.add("RUNOUT_ZONE_ORIENTATION", composer.angle(zone.angle))
        out.add("RUNOUT_ZONE_DEFINITION", number, (), orientation)
    return number
