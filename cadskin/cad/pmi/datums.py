"""Datums, datum targets and datum systems of a STEP file."""

from __future__ import annotations

from collections.abc import Iterator

from cadskin.cad.pmi.aspects import Aspects, Resolved
from cadskin.cad.pmi.graph import references
from cadskin.cad.pmi.selections import FaceMap, selection
from cadskin.cad.pmi.tokens import Enumeration, Reference, Typed, Value
from cadskin.errors import SpecificationError
from cadskin.spec.datums import Datum, DatumModifier, DatumReference, DatumSystem, DatumTarget, TargetKind
from cadskin.spec.specification import Unresolved

__all__ = ["DatumReader"]

_TARGETS = ("PLACED_DATUM_TARGET_FEATURE", "DATUM_TARGET", "MOVABLE_DATUM_TARGET")
_KINDS: dict[str, TargetKind] = {
    "point": "point",
    "line": "line",
    "rectangle": "rectangle",
    "circle": "circle",
    "circular curve": "circular_curve",
    "circular_curve": "circular_curve",
    "area": "area",
    "curve": "circular_curve",
}
_MAX_ELEMENTS = 64


class DatumReader:
    """Reads datums and datum systems.

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

    # -- letters and systems --------------------

    def letters(self, datum: int) -> tuple[str, ...]:
        """Return the letter of a datum; those of a common datum ``A-B``."""
        values = self.graph.inherited(datum, "DATUM")
        word = values[-1] if values and isinstance(values[-1], str) else ""
        return tuple(part.strip() for part in word.split("-") if part.strip())

    def system(self, value: Value) -> DatumSystem:
        """Return the datum system that a tolerance refers to."""
        placed: list[tuple[int, DatumReference]] = []
        for number in references(value):
            if self.file.is_a(number, "DATUM_SYSTEM"):
                constituents = self.graph.inherited(number, "DATUM_SYSTEM")[-1:]
                for compartment in references(constituents):
                    found = self._compartment(compartment)
                    if found is not None:
                        placed.append((len(placed) + 1, found))
            elif self.file.is_a(number, "DATUM_REFERENCE", "REFERENCED_MODIFIED_DATUM"):
                found_old = self._old_reference(number)
                if found_old is not None:
                    placed.append(found_old)
        return DatumSystem(tuple(_joined(placed)))

    def _compartment(self, number: int, depth: int = 0) -> DatumReference | None:
        records = self.file.records(number)
        if not records or depth > 4:
            return None
        if len(records) == 1:
            base, modifiers = (*records[0].values[4:6], None, None)[:2]
        else:
            base, modifiers = (*self.file.values(number, "GENERAL_DATUM_REFERENCE"), None, None)[:2]
        own = self._modifiers(modifiers)
        if isinstance(base, Reference) and not self.file.is_a(int(base), "DATUM_REFERENCE_ELEMENT"):
            letters = self.letters(int(base))
            return DatumReference(letters, own) if letters else None
        elements = [self._compartment(x, depth + 1) for x in list(references(base))[:_MAX_ELEMENTS]]
        found = [element for element in elements if element is not None]
        if not found:
            return None
        letters = tuple(letter for element in found for letter in element.letters)
        nested = tuple(element.modifiers for element in found for _ in element.letters)
        return DatumReference(letters, own, nested)

    def _modifiers(self, value: Value) -> tuple[DatumModifier, ...]:
        found = []
        for item in value if isinstance(value, tuple) else () if value is None else (value,):
            inner = item.values[0] if isinstance(item, Typed) and item.values else item
            if isinstance(inner, Enumeration):
                found.append(DatumModifier(_modern(str(inner))))
            elif isinstance(inner, Reference):
                name, measure = (*self.file.values(int(inner)), None, None)[:2]
                size = self.graph.measure(measure)
                if isinstance(name, Enumeration):
                    found.append(DatumModifier(str(name), size.value if size else None))
        return tuple(found)

    def _old_reference(self, number: int) -> tuple[int, DatumReference] | None:
        values = self.graph.inherited(number, "DATUM_REFERENCE")
        target = self.graph.reference(number, 1, "DATUM_REFERENCE")
        letters = self.letters(target) if target is not None else ()
        if not letters:
            return None
        modifier = self.file.values(number, "REFERENCED_MODIFIED_DATUM")[-1:]
        place = values[0] if isinstance(values[0], int) else 1
        return int(place), DatumReference(letters, self._modifiers(modifier))

    # -- datums --------------------

    def datums(self) -> tuple[Datum, ...]:
        """Return all datums of the file, ordered by letter; datum entities of one letter are one datum."""
        found: dict[tuple[str | None, str], Datum] = {}
        for number in self.file.of_type("DATUM"):
            letters = self.letters(number)
            if not letters:
                self._leave(number, "datum", "it has no letter")
                continue
            if len(letters) > 1:
                continue  # a common datum: its letters are datums themselves
            try:
                datum = self._datum(number, letters[0])
            except SpecificationError as error:
                self._leave(number, "datum", f"its data have no meaning: {error}")
                continue
            key = (datum.feature.part, datum.letter)
            if key in found and (found[key].feature or found[key].targets):
                if datum.feature.step_faces not in ((), found[key].feature.step_faces):
                    self._leave(
                        number, "datum", f"letter {datum.letter} is defined twice; the first one is used"
                    )
                continue
            found[key] = datum
        return tuple(sorted(found.values(), key=lambda datum: (datum.feature.part or "", datum.letter)))

    def _leave(self, number: int, kind: str, reason: str) -> None:
        self.unresolved.append(Unresolved(f"#{number}", kind, reason))

    def _datum(self, number: int, letter: str) -> Datum:
        faces: list[Resolved] = []
        targets = []
        own_items = self.graph.items.get(number)
        if own_items:
            faces.append(self.aspects.resolve_items([own_items], prefer="either"))
        for owner in [*self.graph.owners_of(number), *self._of_shape_users(number)]:
            if self.file.is_a(owner, *_TARGETS):
                targets.append(self._target(owner, letter))
            else:
                faces.append(self.aspects.resolve(owner, prefer="either"))
        joined = _join(faces)
        feature, _ = selection(joined, self.face_map, self.aspects.topology)
        if not feature and not targets:
            reason = "its datum feature has no geometry in the file" if joined.empty else "no face found for "
            self._leave(number, "datum", f"datum {letter}: {reason}{', '.join(joined.missing[:3])}")
        ordered = tuple(sorted(targets, key=lambda target: (len(target.label), target.label)))
        return Datum(letter, feature, ordered, source=f"{self.file.name} #{number}")

    def _of_shape_users(self, number: int) -> Iterator[int]:
        """Yield the features that a datum relates to: some writers turn the relation round."""
        for other in self.graph.parts_of(number):
            if self.file.is_a(other, "DATUM_FEATURE", "SHAPE_ASPECT", "DIMENSIONAL_SIZE_WITH_DATUM_FEATURE"):
                yield other

    def _target(self, number: int, letter: str) -> DatumTarget:
        values = self.graph.inherited(number, "SHAPE_ASPECT")
        kind = _KINDS.get(str(values[1]).strip().lower() if len(values) > 1 else "", "area")
        # Simple: the fifth attribute; complex: the only one of the record DATUM_TARGET.
        stated = self.file.values(number)[4:5] or self.file.values(number, "DATUM_TARGET")[-1:]
        label = f"{letter}{stated[0]}" if stated and isinstance(stated[0], str) else letter
        resolved = [self.aspects.resolve(x) for x in [number, *self.graph.target_features(number)]]
        feature, _ = selection(_join(resolved), self.face_map, self.aspects.topology)
        sizes: dict[str, float] = {}
        frame = None
        for item in self.graph.properties.get(number, []):
            if self.file.is_a(item, "AXIS2_PLACEMENT_3D"):
                frame = self.aspects.topology.frame(item)
            measure = self.graph.measure(Reference(item))
            if measure is not None:
                sizes[measure.name.lower()] = measure.value
        scale = self.graph.context_unit("length").factor
        origin, axis, direction = frame if frame is not None else (None, None, None)
        return DatumTarget(
            label=label,
            kind=kind,
            origin=None if origin is None else _triple(origin * scale),
            axis=None if axis is None else _triple(axis),
            direction=None if direction is None else _triple(direction),
            length=sizes.get("target length"),
            width=sizes.get("target width"),
            diameter=sizes.get("target diameter"),
            feature=feature,
            movable=self.file.is_a(number, "MOVABLE_DATUM_TARGET"),
        )


def _triple(vector: object) -> tuple[float, float, float]:
    x, y, z = (float(component) for component in vector)  # type: ignore[attr-defined]
    return x, y, z


def _join(parts: list[Resolved]) -> Resolved:
    return Resolved(
        tuple(dict.fromkeys(face for part in parts for face in part.faces)),
        tuple(group for part in parts for group in part.groups) if len(parts) < 2 else (),
        tuple(dict.fromkeys(word for part in parts for word in part.via)),
        tuple(dict.fromkeys(word for part in parts for word in part.missing)),
        all(part.empty for part in parts),
    )


def _modern(name: str) -> str:
    return name.replace("_MATERIAL_CONDITION", "_MATERIAL_REQUIREMENT")


def _joined(placed: list[tuple[int, DatumReference]]) -> Iterator[DatumReference]:
    """Yield the references in order; several old-style references of one precedence are a common datum."""
    by_place: dict[int, list[DatumReference]] = {}
    for place, reference in placed:
        by_place.setdefault(place, []).append(reference)
    for place in sorted(by_place):
        same = by_place[place]
        if len(same) == 1:
            yield same[0]
        else:
            letters = tuple(letter for reference in same for letter in reference.letters)
            nested = tuple(reference.modifiers for reference in same for _ in reference.letters)
            yield DatumReference(letters, (), nested)
