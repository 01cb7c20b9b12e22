"""Geometric tolerances of a STEP file."""

from __future__ import annotations

import re
from collections import defaultdict
from dataclasses import replace
from functools import cached_property
from typing import Any, get_args

from cadskin.cad.pmi.aspects import SIZES, Aspects, Resolved
from cadskin.cad.pmi.datums import DatumReader
from cadskin.cad.pmi.derived import inferred_derived
from cadskin.cad.pmi.graph import references
from cadskin.cad.pmi.indicators import IndicatorReader
from cadskin.cad.pmi.selections import FaceMap, selection
from cadskin.cad.pmi.tokens import Enumeration, Value
from cadskin.errors import SpecificationError
from cadskin.spec.characteristics import CHARACTERISTICS
from cadskin.spec.indicators import Indicator
from cadskin.spec.modifiers import MATERIAL_MODIFIERS
from cadskin.spec.selection import Derived, FeatureSelection
from cadskin.spec.specification import Unresolved
from cadskin.spec.tolerance import Material, Scope, Tolerance
from cadskin.spec.zone import AreaShape, AreaUnit, ToleranceZone, ZoneShape

__all__ = ["LEAVES", "ToleranceReader"]

LEAVES = {f"{name.upper()}_TOLERANCE": name for name in CHARACTERISTICS}
_SUPERTYPES = (
    "GEOMETRIC_TOLERANCE",
    "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE",
    "GEOMETRIC_TOLERANCE_WITH_MODIFIERS",
    "GEOMETRIC_TOLERANCE_WITH_DEFINED_UNIT",
    "GEOMETRIC_TOLERANCE_WITH_DEFINED_AREA_UNIT",
    "GEOMETRIC_TOLERANCE_WITH_MAXIMUM_TOLERANCE",
    "UNEQUALLY_DISPOSED_GEOMETRIC_TOLERANCE",
    "MODIFIED_GEOMETRIC_TOLERANCE",
)
_FORMS: dict[str, ZoneShape] = {
    "cylindrical or circular": "diameter",
    "within a cylinder": "diameter",
    "within a circle": "diameter",
    "spherical": "spherical_diameter",
    "within a sphere": "spherical_diameter",
}
_STANDARDS = {
    "ASME": re.compile(r"\bY\s?14\.5", re.IGNORECASE),
    "ISO": re.compile(r"\bISO[ _-]?(?:1101|8015|5459|5458|1660|2692)\b|\bISO GPS\b", re.IGNORECASE),
}
_USUAL_FORMS = ("cylindrical or circular", "spherical")
_PROJECTED = ("PROJECTED_ZONE_DEFINITION", "PROJECTED_ZONE_DEFINITION_WITH_OFFSET")
_WHOLE_PART = ("PRODUCT_DEFINITION_SHAPE", "PRODUCT_DEFINITION")
_SCOPES: tuple[tuple[str, Scope], ...] = (
    ("ALL_AROUND_SHAPE_ASPECT", "all_around"),
    ("ALL_OVER_SHAPE_ASPECT", "all_over"),
    ("BETWEEN_SHAPE_ASPECT", "between"),
)


class ToleranceReader:
    """Reads the geometric tolerances.

    Parameters
    ----------
    aspects : Aspects
    datums : DatumReader
    face_map : FaceMap or None
    """

    def __init__(self, aspects: Aspects, datums: DatumReader, face_map: FaceMap | None) -> None:
        self.aspects = aspects
        self.graph = aspects.graph
        self.file = aspects.file
        self.datums = datums
        self.face_map = face_map
        self.indicators = IndicatorReader(aspects, datums)
        self.unresolved: list[Unresolved] = []

    def tolerances(self) -> tuple[Tolerance, ...]:
        """Return all tolerances, in the order of the file."""
        found = []
        for number in self.file.of_type(*LEAVES, *_SUPERTYPES):
            leaf = next((LEAVES[name] for name in self.file.types(number) if name in LEAVES), None)
            if leaf is None:
                self._leave(number, "it has no characteristic (no leaf entity)")
                continue
            try:
                found.append(self._tolerance(number, leaf))
            except SpecificationError as error:
                self._leave(number, f"its data have no meaning: {error}")
        return tuple(found)

    def _leave(self, number: int, reason: str) -> None:
        self.unresolved.append(Unresolved(f"#{number}", "tolerance", reason))

    def _tolerance(self, number: int, leaf: str) -> Tolerance:
        name, _, magnitude, target_value = (
            *self.graph.inherited(number, "GEOMETRIC_TOLERANCE"),
            *(None,) * 4,
        )[:4]
        target = next(references(target_value), None)
        measure = self.graph.measure(magnitude)
        zone, zone_notes = self._zone(number)
        datums = self.datums.system(self._datum_value(number))
        material, modifiers = self._modifiers(number)
        feature, scope, notes = self._feature(number, leaf, target, zone)
        indicators, plane_notes = self._indicators(number, target, feature)
        if measure is None and magnitude is not None:
            zone_notes.append(f"its magnitude {magnitude!r} is not understood")
        return Tolerance(
            id=f"#{number}",
            type=CHARACTERISTICS[leaf].name,
            value=None if measure is None else measure.value,
            feature=feature,
            scope=scope,
            datums=datums,
            material=material,
            modifiers=modifiers,
            zone=zone,
            indicators=indicators,
            parent=self._parents.get(number),
            name=str(name) if isinstance(name, str) else "",
            raw_value=None if measure is None else measure.raw,
            raw_unit=None if measure is None else measure.unit.name,
            standard=self._standard,
            notes=(*notes, *zone_notes, *plane_notes),
            source=f"{self.file.name} #{number}",
        )

    def _indicators(
        self, number: int, target: int | None, feature: FeatureSelection
    ) -> tuple[tuple[Indicator, ...], tuple[str, ...]]:
        known = target is not None and target in self.file and bool(feature)
        return self.indicators.indicators(
            self._zones.get(number, []),
            target,
            on_derived=feature.derived in ("axis", "median_plane", "centre_point"),
            resolved=self.aspects.resolve(target) if known and target is not None else None,
        )

    @cached_property
    def _standard(self) -> str | None:
        """ISO or ASME, where the file refers to a document of one of them and not of the other."""
        numbers = self.file.of_type("DOCUMENT", "DOCUMENT_FILE", "PRODUCT")
        words = " ".join(str(x) for n in numbers for x in self.file.values(n)[:3] if isinstance(x, str))
        found = [name for name, pattern in _STANDARDS.items() if pattern.search(words)]
        return found[0] if len(found) == 1 else None

    def _datum_value(self, number: int) -> Value:
        own = self.file.values(number, "GEOMETRIC_TOLERANCE_WITH_DATUM_REFERENCE")
        if own:
            return own[-1]
        values = self.file.values(number)
        if len(self.file.records(number)) == 1 and len(values) > 4 and isinstance(values[4], tuple):
            return values[4]
        return None

    def _modifiers(self, number: int) -> tuple[Material, tuple[str, ...]]:
        words: list[str] = []
        for record in ("GEOMETRIC_TOLERANCE_WITH_MODIFIERS", "MODIFIED_GEOMETRIC_TOLERANCE"):
            values = self.file.values(number, record)
            last = values[-1] if values else None
            words += [
                str(x) for x in (last if isinstance(last, tuple) else (last,)) if isinstance(x, Enumeration)
            ]
        material: Material = "RFS"
        for word in words:
            if word in MATERIAL_MODIFIERS:
                material = "MMR" if MATERIAL_MODIFIERS[word] == "MMR" else "LMR"
        others = (
            word for word in words if word not in MATERIAL_MODIFIERS and word != "REGARDLESS_OF_FEATURE_SIZE"
        )
        return material, tuple(dict.fromkeys(others))

    # -- what it is on --------------------

    def _feature(
        self, number: int, leaf: str, target: int | None, zone: ToleranceZone
    ) -> tuple[FeatureSelection, Scope, tuple[str, ...]]:
        file = self.file
        if target is None or target not in file:
            self._leave(number, "it refers to nothing" if target is None else f"#{target} is not in the file")
            return FeatureSelection(), "feature", ("no feature",)
        auxiliary = self._auxiliary(number)
        if file.is_a(target, *_WHOLE_PART):
            scope: Scope = "all_over" if "ALL_OVER" in auxiliary else "general"
            return FeatureSelection(), scope, ("on the whole part",)
        is_axis = zone.shape != "width" or self._is_centre(target)
        resolved = self.aspects.resolve(target, prefer="axis" if is_axis else "surface")
        feature, notes = selection(resolved, self.face_map, self.aspects.topology)
        feature = _with_derived(feature, self._derived(leaf, target, zone, feature, resolved))
        if feature:
            return feature, self._scope(target, feature, auxiliary), notes
        if resolved.empty and (auxiliary or CHARACTERISTICS[leaf].group == "profile"):
            return feature, "general", (*notes, "its aspect has no geometry: a general tolerance")
        reason = (
            "its aspect has no geometry in the file"
            if resolved.empty
            else f"no face found for {', '.join(resolved.missing[:5])}"
        )
        self._leave(number, reason)
        return feature, "feature", (*notes, reason)

    def _auxiliary(self, number: int) -> tuple[str, ...]:
        values = self.file.values(number, "GEOMETRIC_TOLERANCE_AUXILIARY_CLASSIFICATION")
        pending = [*values, *(x for value in values if isinstance(value, tuple) for x in value)]
        return tuple(str(x) for x in pending if isinstance(x, Enumeration))

    def _scope(self, target: int, feature: FeatureSelection, auxiliary: tuple[str, ...]) -> Scope:
        if "ALL_OVER" in auxiliary:
            return "all_over"
        for kind, scope in _SCOPES:
            if self.file.is_a(target, kind):
                return scope
        return "pattern" if len(feature.groups) > 1 else "feature"

    def _derived(
        self, leaf: str, target: int, zone: ToleranceZone, feature: FeatureSelection, resolved: Resolved
    ) -> Derived:
        if zone.shape == "width" and "line in face" in resolved.via:
            return "line_element"
        return inferred_derived(leaf, zone.shape, feature.kinds, feature, centre=self._is_centre(target))

    def _is_centre(self, target: int) -> bool:
        parts = self.graph.parts_of(target)
        kinds = ("CENTRE_OF_SYMMETRY", *SIZES)
        return self.file.is_a(target, *kinds) or any(self.file.is_a(part, kinds[0]) for part in parts)

    # -- zones and composites --------------------

    @cached_property
    def _zones(self) -> dict[int, list[int]]:
        found: defaultdict[int, list[int]] = defaultdict(list)
        kinds = [
            name
            for name in self.file.type_names()
            if "TOLERANCE_ZONE" in name and not name.endswith(("_FORM", "_DEFINITION"))
        ]
        for zone in self.file.of_type(*kinds):
            for value in self.graph.inherited(zone, "TOLERANCE_ZONE"):
                if isinstance(value, tuple):
                    for tolerance in references(value):
                        found[tolerance].append(zone)
        return dict(found)

    @cached_property
    def _definitions(self) -> dict[int, list[int]]:
        found: defaultdict[int, list[int]] = defaultdict(list)
        for number in self.file.of_type(*_PROJECTED, "RUNOUT_ZONE_DEFINITION", "NON_UNIFORM_ZONE_DEFINITION"):
            zone = self.graph.reference(number, 0, "TOLERANCE_ZONE_DEFINITION")
            if zone is not None:
                found[zone].append(number)
        return dict(found)

    @cached_property
    def _parents(self) -> dict[int, str]:
        found: dict[int, str] = {}
        for number in self.file.of_type("GEOMETRIC_TOLERANCE_RELATIONSHIP"):
            upper, lower = self.graph.reference(number, 2), self.graph.reference(number, 3)
            name = self.graph.label(number, "GEOMETRIC_TOLERANCE_RELATIONSHIP").strip().lower()
            # The other relations, precedence and simultaneity, leave the frames side by side.
            if (
                upper is not None
                and lower is not None
                and upper != lower
                and (not name or "composite" in name)
            ):
                found[lower] = f"#{upper}"
        return found

    def _length(self, number: int, record: str, position: int = -1) -> float | None:
        values = self.file.values(number, record)
        measure = self.graph.measure(values[position]) if values else None
        return None if measure is None else measure.value

    def _zone(self, number: int) -> tuple[ToleranceZone, list[str]]:
        given: dict[str, Any] = {
            "outside": self._length(number, "UNEQUALLY_DISPOSED_GEOMETRIC_TOLERANCE"),
            "maximum": self._length(number, "GEOMETRIC_TOLERANCE_WITH_MAXIMUM_TOLERANCE"),
        }
        notes: list[str] = []
        self._per_unit(number, given)
        modifiers = self.file.values(number, "GEOMETRIC_TOLERANCE_WITH_MODIFIERS")
        words = {str(x) for value in modifiers if isinstance(value, tuple) for x in value}
        if "COMMON_ZONE" in words or "SEPARATE_ZONE" in words:
            given["combined"] = "COMMON_ZONE" in words
        for zone in self._zones.get(number, []):
            form = next(
                (x for x in references(self.graph.inherited(zone, "TOLERANCE_ZONE")[5:]) if x in self.file),
                None,
            )
            word = self.graph.label(form, "TOLERANCE_ZONE_FORM").strip() if form is not None else ""
            given["shape"] = _FORMS.get(word.lower(), "width")
            if word and word.lower() not in _USUAL_FORMS:
                given["form"] = word
            for definition in self._definitions.get(zone, []):
                self._zone_definition(definition, given, notes)
        return ToleranceZone(**given), notes

    def _per_unit(self, number: int, given: dict[str, Any]) -> None:
        unit = self._length(number, "GEOMETRIC_TOLERANCE_WITH_DEFINED_UNIT")
        area = self.file.values(number, "GEOMETRIC_TOLERANCE_WITH_DEFINED_AREA_UNIT")
        if not area:
            given["per_length"] = unit
            return
        word = str(area[0]).lower() if isinstance(area[0], Enumeration) else "square"
        shape: AreaShape = next((kind for kind in get_args(AreaShape) if kind == word), "square")
        second = self.graph.measure(area[1]) if len(area) > 1 else None
        given["per_area"] = AreaUnit(shape, unit, None if second is None else second.value)

    def _zone_definition(self, number: int, given: dict[str, Any], notes: list[str]) -> None:
        file = self.file
        measures = [m for m in (self.graph.measure(x) for x in file.values(number)[1:]) if m is not None]
        if file.is_a(number, *_PROJECTED):
            lengths = [m.value for m in measures if m.unit.kind == "length"]
            if lengths and given.get("projected") not in (None, lengths[0]):
                notes.append(
                    f"projected lengths {given['projected']:g} and {lengths[0]:g} mm; the longer one is used"
                )
                lengths[0] = max(lengths[0], given["projected"])
            if lengths:
                given["projected"] = lengths[0]
            if len(lengths) > 1:
                given["projected_offset"] = lengths[1]
        elif file.is_a(number, "RUNOUT_ZONE_DEFINITION"):
            given["angle"] = self._runout_angle(number)
        else:
            given["form"] = "non uniform"

    def _runout_angle(self, number: int) -> float | None:
        for orientation in references(self.file.values(number)[2:]):
            for value in self.file.values(orientation):
                measure = self.graph.measure(value)
                if measure is not None and measure.unit.kind == "angle":
                    return measure.value
        return None


def _with_derived(feature: FeatureSelection, derived: Derived) -> FeatureSelection:
    if derived == "median_plane" and all(len(group) == 1 for group in feature.groups):
        return replace(feature, derived=derived, groups=())
    return feature if derived == "none" else replace(feature, derived=derived)
