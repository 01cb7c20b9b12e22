"""Dimensions of a STEP file: sizes, distances and angles with their limits."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

from cadskin.cad.pmi.aspects import SIZES, Aspects
from cadskin.cad.pmi.graph import LOCATIONS, Measure, references
from cadskin.cad.pmi.selections import FaceMap, selection
from cadskin.cad.pmi.tokens import Reference
from cadskin.errors import SpecificationError
from cadskin.spec.dimension import Dimension, DimensionKind, clean_sum
from cadskin.spec.fits import fit_deviations
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.specification import Unresolved

__all__ = ["DimensionReader"]

_QUALIFIERS: dict[str, Literal["basic", "reference"]] = {"theoretical": "basic", "auxiliary": "reference"}
_FORMAT = "NR"


@dataclass
class _Numbers:
    """What the representation of a dimension holds, while it is read."""

    nominal: Measure | None = None
    lower: float | None = None
    upper: float | None = None
    fit: str | None = None
    words: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


class DimensionReader:
    """Reads the dimensions.

    Parameters
    ----------
    aspects : Aspects
    face_map : FaceMap or None
    """

    def __init__(self, aspects: Aspects, face_map: FaceMap | None) -> None:
        self.aspects = aspects
        self.graph = aspects.graph
        self.file = aspects.file
        self.face_map = face_map
        self.unresolved: list[Unresolved] = []

    def dimensions(self) -> tuple[Dimension, ...]:
        """Return all dimensions, in the order of the file."""
        found = []
        for number in self.file.of_type(*SIZES, *LOCATIONS):
            try:
                found.append(self._dimension(number))
            except SpecificationError as error:
                self._leave(number, f"its data have no meaning: {error}")
        return tuple(found)

    def _leave(self, number: int, reason: str) -> None:
        self.unresolved.append(Unresolved(f"#{number}", "dimension", reason))

    def _dimension(self, number: int) -> Dimension:
        numbers = self._numbers(number)
        features, missing, remarks = self._features(number)
        qualifier: Literal["none", "basic", "reference"] = "none"
        modifiers = []
        for word in numbers.words:
            if word in _QUALIFIERS:
                qualifier = _QUALIFIERS[word]
            else:
                modifiers.append(word)
        if numbers.nominal is None and numbers.lower is None and numbers.upper is None:
            numbers.notes.append("it has no value in the file")
        if missing:
            self._leave(number, missing)
        nominal = numbers.nominal
        return Dimension(
            id=f"#{number}",
            kind=self._kind(number),
            name=self._name(number),
            nominal=None if nominal is None else nominal.value,
            lower=numbers.lower,
            upper=numbers.upper,
            feature=features[0],
            second=features[1],
            fit=numbers.fit,
            qualifier=qualifier,
            modifiers=tuple(dict.fromkeys(modifiers)),
            raw_unit=None if nominal is None else nominal.unit.name,
            source=f"{self.file.name} #{number}",
            notes=(*remarks, *numbers.notes),
        )

    def _kind(self, number: int) -> DimensionKind:
        types = self.file.types(number)
        angular = any("ANGULAR" in name for name in types)
        if any(name in LOCATIONS for name in types):
            return "angular_location" if angular else "location"
        return "angular_size" if angular else "size"

    def _name(self, number: int) -> str:
        if self.file.is_a(number, *LOCATIONS):
            return self.graph.label(number, "SHAPE_ASPECT_RELATIONSHIP")
        own = self.file.values(number, "DIMENSIONAL_SIZE") or self.file.values(number)
        return next((str(x) for x in reversed(own) if type(x) is str), "")

    def _features(
        self, number: int
    ) -> tuple[tuple[FeatureSelection, FeatureSelection], str, tuple[str, ...]]:
        if self.file.is_a(number, *LOCATIONS):
            targets = list(self.aspects.location_targets(number))
        else:
            targets = [self.aspects.size_target(number)]
        found: list[FeatureSelection] = []
        missing, remarks = "", list[str]()
        for target in targets:
            if target is None or target not in self.file:
                missing = "it refers to nothing" if target is None else f"#{target} is not in the file"
                found.append(FeatureSelection())
                continue
            resolved = self.aspects.resolve(target, prefer="either")
            feature, notes = selection(resolved, self.face_map, self.aspects.topology)
            if not feature:
                words = ", ".join(resolved.missing[:3])
                missing = (
                    f"no face found for {words}" if words else f"aspect #{target} has no geometry in the file"
                )
            found.append(feature)
            remarks += notes
        second = found[1] if len(found) > 1 else FeatureSelection()
        return (found[0], second), missing, tuple(dict.fromkeys(remarks))

    # -- numbers --------------------

    @cached_property
    def _representations(self) -> dict[int, list[int]]:
        found: defaultdict[int, list[int]] = defaultdict(list)
        for number in self.file.of_type("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION"):
            values = self.file.values(number)
            dimension, representation = (next(references(values[i : i + 1]), None) for i in (0, 1))
            if dimension is not None and representation is not None:
                found[dimension].append(representation)
        return dict(found)

    @cached_property
    def _ranges(self) -> dict[int, list[int]]:
        found: defaultdict[int, list[int]] = defaultdict(list)
        for number in self.file.of_type("PLUS_MINUS_TOLERANCE"):
            values = self.file.values(number)
            bounds, dimension = (next(references(values[i : i + 1]), None) for i in (0, 1))
            if dimension is not None and bounds is not None:
                found[dimension].append(bounds)
        return dict(found)

    def _numbers(self, number: int) -> _Numbers:
        found = _Numbers()
        for representation in self._representations.get(number, []):
            for item in references(self.graph.inherited(representation, "REPRESENTATION")[1:2]):
                self._item(item, found)
        for bounds in self._ranges.get(number, []):
            self._range(bounds, found)
        return found

    def _item(self, item: int, found: _Numbers) -> None:
        file = self.file
        if file.is_a(item, "DESCRIPTIVE_REPRESENTATION_ITEM"):
            values = file.values(item)
            if len(values) > 1 and isinstance(values[1], str) and values[0] != "equivalent unicode string":
                found.words.append(values[1].strip())
            return
        if file.is_a(item, "COMPOUND_REPRESENTATION_ITEM"):
            for inner in references(file.values(item)):
                if inner != item and not file.is_a(inner, "COMPOUND_REPRESENTATION_ITEM"):
                    self._item(inner, found)
            return
        measure = self.graph.measure(Reference(item))
        if measure is None:
            return
        words = self._type_qualifiers(item)
        name = measure.name.lower()
        if "upper" in name or words & {"maximum", "max"}:
            found.upper = measure.value
        elif "lower" in name or words & {"minimum", "min"}:
            found.lower = measure.value
        elif found.nominal is None or "nominal" in name:
            found.nominal = measure
        found.words += sorted(words - {"maximum", "minimum", "max", "min", "designed", "nominal"})

    def _type_qualifiers(self, item: int) -> set[str]:
        names = set()
        for number in references(self.file.values(item, "QUALIFIED_REPRESENTATION_ITEM")):
            if self.file.is_a(number, "TYPE_QUALIFIER"):
                word = self.graph.label(number, "TYPE_QUALIFIER").strip().lower()
                if word and not word.upper().startswith(_FORMAT):
                    names.add(word)
        return names

    def _range(self, bounds: int, found: _Numbers) -> None:
        file = self.file
        if file.is_a(bounds, "TOLERANCE_VALUE"):
            low, high = (self.graph.measure(x) for x in (*file.values(bounds), None, None)[:2])
            if low is None or high is None or found.nominal is None:
                found.notes.append(f"the deviations #{bounds} have no number or no nominal")
                return
            found.lower, found.upper = (clean_sum(found.nominal.value, bound.value) for bound in (low, high))
        elif file.is_a(bounds, "LIMITS_AND_FITS"):
            self._fit(bounds, found)
        else:
            found.notes.append(f"the limits #{bounds} are not understood")

    def _fit(self, bounds: int, found: _Numbers) -> None:
        variance, _, grade = (
            *(str(x).strip() if isinstance(x, str) else "" for x in self.file.values(bounds)),
            "",
            "",
            "",
        )[:3]
        # NX writes ('G6', 'hole', '', ''), others ('G', 'hole', 'IT6' or '6', '').
        grade = grade.upper().removeprefix("IT")
        found.fit = variance if any(c.isdigit() for c in variance) else variance + grade
        if found.nominal is None or found.nominal.unit.kind != "length":
            found.notes.append(f"fit {found.fit} without a nominal size")
            return
        try:
            low, high = fit_deviations(found.nominal.value, found.fit)
        except SpecificationError as error:
            found.notes.append(str(error))
            return
        found.lower, found.upper = clean_sum(found.nominal.value, low), clean_sum(found.nominal.value, high)
