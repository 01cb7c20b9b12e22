"""The PMI entities of a STEP file as a graph: aspects with their geometry, measures with their units."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from math import isfinite

from cadskin.cad.pmi.part21 import Part21File
from cadskin.cad.pmi.tokens import Enumeration, Reference, Typed, Value

__all__ = ["AFFECTED_PLANE", "Measure", "PmiGraph", "Unit", "clean", "references"]

_PREFIXES = {
    "EXA": ("E", 1e18), "PETA": ("P", 1e15), "TERA": ("T", 1e12), "GIGA": ("G", 1e9), "MEGA": ("M", 1e6),
    "KILO": ("k", 1e3), "HECTO": ("h", 1e2), "DECA": ("da", 1e1), "DECI": ("d", 1e-1), "CENTI": ("c", 1e-2),
    "MILLI": ("m", 1e-3), "MICRO": ("µ", 1e-6), "NANO": ("n", 1e-9), "PICO": ("p", 1e-12),
}  # fmt: skip
# Millimetres of each metre prefix, written out: 1000 * 1e-3 need not be 1.
_MILLIMETRES = {"": 1e3, "MILLI": 1.0, "CENTI": 10.0, "DECI": 100.0, "MICRO": 1e-3, "KILO": 1e6, "NANO": 1e-6}
_MAX_UNIT_DEPTH = 8
# Relations from an aspect to what it consists of or is derived from; datum targets are linked the other way.
_PART_OF = (
    "SHAPE_ASPECT_RELATIONSHIP",
    "SHAPE_ASPECT_DERIVING_RELATIONSHIP",
    "SHAPE_ASPECT_ASSOCIATIVITY",
    "COMPONENT_FEATURE_RELATIONSHIP",
)
_TARGET_OF = "FEATURE_FOR_DATUM_TARGET_RELATIONSHIP"
AFFECTED_PLANE = "affected plane association"
LOCATIONS = (
    "DIMENSIONAL_LOCATION",
    "ANGULAR_LOCATION",
    "DIRECTED_DIMENSIONAL_LOCATION",
    "DIMENSIONAL_LOCATION_WITH_PATH",
    "DIMENSIONAL_LOCATION_WITH_DATUM_FEATURE",
    "DIRECTED_ANGULAR_LOCATION",
)


@dataclass(frozen=True)
class Unit:
    """A unit of the file: ``kind`` length, angle or other; ``factor`` to mm or rad; its usual ``name``."""

    kind: str
    factor: float
    name: str


@dataclass(frozen=True)
class Measure:
    """A number with its unit: ``value`` in mm or rad, ``raw`` as written."""

    value: float
    raw: float
    unit: Unit
    name: str = ""


def references(value: object) -> Iterator[int]:
    """Yield the instance numbers in a value, however it is nested."""
    pending = [value]
    while pending:
        item = pending.pop()
        if isinstance(item, Reference):
            yield int(item)
        elif isinstance(item, Typed):
            pending.extend(reversed(item.values))
        elif isinstance(item, tuple):
            pending.extend(reversed(item))


class PmiGraph:
    """Typed access to the PMI of an indexed STEP file; nothing is parsed before it is asked for.

    Parameters
    ----------
    file : Part21File
    """

    def __init__(self, file: Part21File) -> None:
        self.file = file
        self._units: dict[int, Unit] = {}

    # -- attributes --------------------

    def inherited(self, number: int, supertype: str) -> tuple[Value, ...]:
        """Return the record of ``supertype`` in a complex instance, or all values of a simple one."""
        records = self.file.records(number)
        for record in records:
            if record.name == supertype:
                return record.values
        return records[0].values if len(records) == 1 else ()

    def label(self, number: int, supertype: str) -> str:
        """Return the first text of the attributes of ``supertype``: the name of the instance."""
        values = self.inherited(number, supertype)
        return (
            values[0]
            if values and isinstance(values[0], str) and not isinstance(values[0], Enumeration)
            else ""
        )

    def reference(self, number: int, position: int, supertype: str | None = None) -> int | None:
        """Return the instance that an attribute refers to; None where it refers to none."""
        values = self.file.values(number) if supertype is None else self.inherited(number, supertype)
        if position < len(values):
            found = values[position]
            if isinstance(found, Typed) and len(found.values) == 1:
                found = found.values[0]
            if isinstance(found, Reference):
                return int(found)
        return None

    # -- units and measures --------------------

    def unit(self, number: int, depth: int = 0) -> Unit:
        """Return a unit; one that is not understood has the kind ``other``."""
        found = self._units.get(number)
        if found is None:
            found = self._unit(number, depth)
            self._units[number] = found
        return found

    def _unit(self, number: int, depth: int) -> Unit:
        file = self.file
        if depth > _MAX_UNIT_DEPTH:
            return Unit("other", 1.0, "?")
        si = file.values(number, "SI_UNIT")
        if si:
            return _si_unit(si)
        for record in file.records(number):
            if "CONVERSION_BASED_UNIT" in record.name and record.values:
                base = next((int(x) for x in reversed(record.values) if isinstance(x, Reference)), None)
                raw = self._raw(base) if base is not None else None
                name = next((x for x in record.values if isinstance(x, str)), "?")
                if raw is not None and raw[1] is not None:
                    below = self.unit(raw[1], depth + 1)
                    return Unit(below.kind, raw[0] * below.factor, _usual(name))
        return Unit("other", 1.0, "?")

    def _raw(self, number: int) -> tuple[float, int | None] | None:
        """Return number and unit of a measure in any of its spellings; OCCT writes the number untyped."""
        for record in self.file.records(number):
            if "MEASURE_WITH_UNIT" not in record.name and record.name != "MEASURE_REPRESENTATION_ITEM":
                continue
            numbers = []
            unit = None
            for value in record.values:
                plain = value.values[0] if isinstance(value, Typed) and value.values else value
                if isinstance(plain, Reference):
                    unit = int(plain)
                elif isinstance(plain, int | float):
                    numbers.append(float(plain))
            if numbers:
                return numbers[0], unit
        return None

    def measure(self, value: object) -> Measure | None:
        """Return the measure that a value refers to, or is; None where it is none."""
        if isinstance(value, Typed) and len(value.values) == 1:
            inner = value.values[0]
            if isinstance(inner, int | float) and not isinstance(inner, Reference):
                unit = self.context_unit("angle" if "ANGLE" in value.name else "length")
                return (
                    None if not isfinite(inner) else Measure(_in_mm_or_rad(inner, unit), float(inner), unit)
                )
            value = inner
        if not isinstance(value, int):
            return None
        raw = self._raw(int(value))
        if raw is None:
            return None
        unit = self.unit(raw[1]) if raw[1] is not None else self.context_unit("length")
        number = _in_mm_or_rad(raw[0], unit)
        return Measure(number, raw[0], unit, self._item_name(int(value))) if isfinite(number) else None

    def _item_name(self, number: int) -> str:
        records = self.file.records(number)
        for record in records:
            if record.name == "REPRESENTATION_ITEM" or (len(records) == 1 and record.name.endswith("_ITEM")):
                return next((x for x in record.values[:1] if isinstance(x, str)), "")
        return ""

    def context_unit(self, kind: str) -> Unit:
        """Return the unit of the geometry for ``length`` or ``angle``."""
        return self._context_units.get(kind, Unit(kind, 1.0, "mm" if kind == "length" else "rad"))

    @cached_property
    def _context_units(self) -> dict[str, Unit]:
        found: dict[str, Unit] = {}
        for number in self.file.of_type("GLOBAL_UNIT_ASSIGNED_CONTEXT"):
            for reference in references(self.file.values(number, "GLOBAL_UNIT_ASSIGNED_CONTEXT")):
                unit = self.unit(reference)
                found.setdefault(unit.kind, unit)
        return found

    # -- relations --------------------

    @cached_property
    def items(self) -> dict[int, list[int]]:
        """Geometry of every aspect, as the file links it."""
        found: defaultdict[int, dict[int, None]] = defaultdict(dict)
        for kind in ("GEOMETRIC_ITEM_SPECIFIC_USAGE", "ITEM_IDENTIFIED_REPRESENTATION_USAGE"):
            for number in self.file.of_type(kind):
                values = self.file.values(number, kind)
                aspect = next(references(values[2:3]), None)
                if aspect is not None:
                    aspect = self._defined(aspect)
                    found[aspect].update(dict.fromkeys(references(values[4:5])))
        return {aspect: list(items) for aspect, items in found.items()}

    def _defined(self, number: int) -> int:
        """Behind a property definition stands what it is a property of."""
        if self.file.is_a(number, "PROPERTY_DEFINITION"):
            return self.reference(number, 2, "PROPERTY_DEFINITION") or number
        return number

    @cached_property
    def properties(self) -> dict[int, list[int]]:
        """Representation items of the properties of every aspect (sizes and places of datum targets)."""
        found: defaultdict[int, list[int]] = defaultdict(list)
        for number in self.file.of_type(
            "SHAPE_DEFINITION_REPRESENTATION", "PROPERTY_DEFINITION_REPRESENTATION"
        ):
            values = self.file.values(number)
            definition, representation = (next(references(values[i : i + 1]), None) for i in (0, 1))
            if definition is None or representation is None:
                continue
            if not self.file.is_a(definition, "PROPERTY_DEFINITION"):
                continue
            owner = self.reference(definition, 2, "PROPERTY_DEFINITION")
            if owner is not None:
                found[owner].extend(references(self.inherited(representation, "REPRESENTATION")[1:2]))
        return dict(found)

    @cached_property
    def _relations(self) -> tuple[dict[int, list[int]], dict[int, list[int]], dict[int, list[int]]]:
        parts, owners, targets = (defaultdict(list), defaultdict(list), defaultdict(list))
        for number in self.file.of_type(*_PART_OF, _TARGET_OF):
            if self.file.is_a(number, *LOCATIONS) or self.is_affected_plane(number):
                continue
            relating = self.reference(number, 2, "SHAPE_ASPECT_RELATIONSHIP")
            related = self.reference(number, 3, "SHAPE_ASPECT_RELATIONSHIP")
            if relating is None or related is None:
                continue
            if self.file.is_a(number, _TARGET_OF):
                targets[related].append(relating)
            else:
                parts[relating].append(related)
                owners[related].append(relating)
        return dict(parts), dict(owners), dict(targets)

    def is_affected_plane(self, relation: int) -> bool:
        """Tell whether a relation of aspects ties a plane to a zone, and no component to its whole."""
        words = self.inherited(relation, "SHAPE_ASPECT_RELATIONSHIP")[:2]
        return any(isinstance(word, str) and word.strip().lower() == AFFECTED_PLANE for word in words)

    def parts_of(self, aspect: int) -> list[int]:
        """Return the aspects that an aspect relates to: its components, or what it is derived from."""
        return self._relations[0].get(aspect, [])

    def owners_of(self, aspect: int) -> list[int]:
        """Return the aspects that relate to an aspect: the datum features of a datum."""
        return self._relations[1].get(aspect, [])

    def target_features(self, aspect: int) -> list[int]:
        """Return the aspects of the surfaces on which a datum target lies."""
        return self._relations[2].get(aspect, [])

    def numbers(self, values: Iterable[Value]) -> list[float]:
        """Return the plain numbers among values."""
        return [float(x) for x in values if isinstance(x, int | float) and not isinstance(x, Reference)]


def clean(value: float) -> float:
    """Return 0.762 for 0.03 inch, not 0.7619999999999999: what a product of two rounded numbers means."""
    return float(f"{value:.15g}")


def _in_mm_or_rad(raw: float, unit: Unit) -> float:
    return float(raw) if unit.factor == 1.0 else clean(raw * unit.factor)


def _si_unit(values: tuple[Value, ...]) -> Unit:
    prefix = values[-2] if len(values) >= 2 and isinstance(values[-2], Enumeration) else ""
    name = str(values[-1])
    symbol, factor = _PREFIXES.get(str(prefix), ("", 1.0))
    if name == "METRE":
        return Unit("length", _MILLIMETRES.get(str(prefix), factor * 1e3), symbol + "m")
    if name == "RADIAN":
        return Unit("angle", factor, symbol + "rad")
    return Unit("other", factor, symbol + name.lower())


def _usual(name: str) -> str:
    word = name.strip().lower()
    return {
        "in": "inch",
        "inches": "inch",
        "degree": "deg",
        "degrees": "deg",
        "feet": "foot",
        "ft": "foot",
    }.get(word, word)
