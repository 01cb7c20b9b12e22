"""A specification as AP242 instances, for a file that holds the geometry already."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cadskin.cad.pmi.graph import PmiGraph, Unit, clean, references
from cadskin.cad.pmi.part21 import Part21File
from cadskin.cad.pmi.statements import Statements
from cadskin.cad.pmi.tokens import DERIVED, Enumeration, Reference, Typed, Value
from cadskin.errors import ExportError
from cadskin.spec.selection import FeatureSelection

__all__ = ["Composer"]

_TRUE, _FALSE = Enumeration("T"), Enumeration("F")
_INCH = 25.4


class Composer:
    """What all PMI instances need: the product, its representation, units, aspects.

    Parameters
    ----------
    file : Part21File
        The geometry.
    step_ids : sequence of int
        STEP number of every face, by face index.

    Raises
    ------
    ExportError
        The file has no product with a shape.
    """

    def __init__(self, file: Part21File, step_ids: Sequence[int]) -> None:
        self.file = file
        self.step_ids = tuple(step_ids)
        self.out = Statements(max(file, default=0) + 1)
        self.lost: list[str] = []
        self.product, self.representation, self.context = self._anchor()
        self._units: dict[str, Reference] = {}
        self._aspects: dict[tuple[object, ...], Reference] = {}

    def _anchor(self) -> tuple[Reference, Reference, Reference]:
        file = self.file
        faces = set(self.step_ids)
        for number in file.of_type("SHAPE_DEFINITION_REPRESENTATION"):
            values = file.values(number)
            product, representation = (next(references(values[i : i + 1]), None) for i in (0, 1))
            if (
                product is None
                or representation is None
                or not file.is_a(product, "PRODUCT_DEFINITION_SHAPE")
            ):
                continue
            context = next(references(file.values(representation)[2:3]), None)
            if context is not None and self._reaches(representation, faces):
                return Reference(product), Reference(representation), Reference(context)
        raise ExportError(f"{file.name}: no product shape with these faces, so tolerances cannot be attached")

    def _reaches(self, number: int, faces: set[int]) -> bool:
        seen: set[int] = set()
        pending = [number]
        while pending:
            item = pending.pop()
            if item in faces:
                return True
            if item not in seen and not self.file.is_a(item, "ADVANCED_FACE"):
                seen.add(item)
                pending.extend(references(tuple(record.values for record in self.file.records(item))))
        return not faces

    # -- units and measures --------------------

    def _unit(self, name: str) -> Reference:
        if name not in self._units:
            self._units[name] = self._existing_unit(name) or self._new_unit(name)
        return self._units[name]

    def _existing_unit(self, name: str) -> Reference | None:
        graph = PmiGraph(self.file)
        wanted = {"mm": Unit("length", 1.0, "mm"), "rad": Unit("angle", 1.0, "rad")}.get(name)
        for context in self.file.of_type("GLOBAL_UNIT_ASSIGNED_CONTEXT"):
            for number in references(self.file.values(context, "GLOBAL_UNIT_ASSIGNED_CONTEXT")):
                if graph.unit(number) == wanted:
                    return Reference(number)
        return None

    def _new_unit(self, name: str) -> Reference:
        named: tuple[str, tuple[Value, ...]] = ("NAMED_UNIT", (DERIVED,))
        if name == "mm":
            si: tuple[Value, ...] = (Enumeration("MILLI"), Enumeration("METRE"))
            return self.out.add_complex(("LENGTH_UNIT", ()), named, ("SI_UNIT", si))
        if name == "rad":
            si = (None, Enumeration("RADIAN"))
            return self.out.add_complex(("PLANE_ANGLE_UNIT", ()), named, ("SI_UNIT", si))
        millimetre = self._unit("mm")
        length = Typed("LENGTH_MEASURE", (_INCH,))
        factor = self.out.add("LENGTH_MEASURE_WITH_UNIT", length, millimetre)
        exponents = self.out.add("DIMENSIONAL_EXPONENTS", 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        conversion: tuple[Value, ...] = ("INCH", factor)
        return self.out.add_complex(
            ("CONVERSION_BASED_UNIT", conversion), ("LENGTH_UNIT", ()), ("NAMED_UNIT", (exponents,))
        )

    def length(self, value: float, *, raw: float | None = None, unit: str | None = None) -> Reference:
        """Add a length [mm]; in inch where it was written so and reads back the same."""
        if unit == "inch" and raw is not None and clean(raw * _INCH) == value:
            return self.out.add(
                "LENGTH_MEASURE_WITH_UNIT", Typed("LENGTH_MEASURE", (raw,)), self._unit("inch")
            )
        return self.out.add("LENGTH_MEASURE_WITH_UNIT", Typed("LENGTH_MEASURE", (value,)), self._unit("mm"))

    def angle(self, value: float) -> Reference:
        """Add an angle [rad]."""
        measure = Typed("PLANE_ANGLE_MEASURE", (value,))
        return self.out.add("PLANE_ANGLE_MEASURE_WITH_UNIT", measure, self._unit("rad"))

    def item(self, value: float, name: str, *, angular: bool = False) -> Reference:
        """Add a measure [mm or rad] as an item of a representation."""
        kind = "PLANE_ANGLE" if angular else "LENGTH"
        measure: tuple[Value, ...] = (
            Typed(f"{kind}_MEASURE", (value,)),
            self._unit("rad" if angular else "mm"),
        )
        return self.out.add_complex(
            (f"{kind}_MEASURE_WITH_UNIT", ()),
            ("MEASURE_REPRESENTATION_ITEM", ()),
            ("MEASURE_WITH_UNIT", measure),
            ("REPRESENTATION_ITEM", (name,)),
        )

    # -- aspects --------------------

    def numbers(self, feature: FeatureSelection) -> tuple[tuple[int, ...], tuple[tuple[int, ...], ...]]:
        """Return the STEP numbers of the faces of a selection, and of its groups.

        Raises
        ------
        ExportError
            A face that the part does not have.
        """

        def number(index: int) -> int:
            if not 0 <= index < len(self.step_ids):
                raise ExportError(
                    f"there is no face {index}; the part has faces 0 to {len(self.step_ids) - 1}"
                )
            return self.step_ids[index]

        groups = tuple(tuple(number(face) for face in group) for group in feature.groups)
        return tuple(number(face) for face in feature.faces), groups

    def aspect(
        self, feature: FeatureSelection, *, kind: str = "SHAPE_ASPECT", centre: bool = False, name: str = ""
    ) -> Reference:
        """Add the aspect of a selection, or return the one that is there already.

        Parameters
        ----------
        feature : FeatureSelection
        kind : str
            ``SHAPE_ASPECT``, ``DATUM_FEATURE``, ``ALL_AROUND_SHAPE_ASPECT`` or ``BETWEEN_SHAPE_ASPECT``.
        centre : bool
            The axis, median plane or centre of the faces.
        """
        faces, groups = self.numbers(feature)
        key = (faces, groups, kind, centre, name)
        if key not in self._aspects:
            self._aspects[key] = self._new_aspect(faces, groups, kind, centre, name)
        return self._aspects[key]

    def _new_aspect(
        self,
        faces: Sequence[int],
        groups: Sequence[Sequence[int]],
        kind: str,
        centre: bool,
        name: str,
    ) -> Reference:
        if not groups:
            if centre:
                return self._centre(faces, name)
            return self._located(self.out.add(kind, name, "", self.product, _TRUE), faces)
        members = [self._centre(g, "") if centre else self._plain(g) for g in groups]
        whole: tuple[Value, ...] = (name, "pattern of features", self.product, _TRUE)
        if kind == "SHAPE_ASPECT":
            group = self.out.add("COMPOSITE_GROUP_SHAPE_ASPECT", *whole)
        elif kind == "DATUM_FEATURE":
            group = self.out.add_complex(
                ("COMPOSITE_GROUP_SHAPE_ASPECT", ()),
                ("COMPOSITE_SHAPE_ASPECT", ()),
                ("DATUM_FEATURE", ()),
                ("SHAPE_ASPECT", whole),
            )
        else:
            group = self.out.add(kind, *whole)
        for member in members:
            self.out.add("SHAPE_ASPECT_RELATIONSHIP", "", "", group, member)
        return group

    def _plain(self, faces: Sequence[int]) -> Reference:
        key = (tuple(faces), (), "SHAPE_ASPECT", False, "")
        if key not in self._aspects:
            aspect = self.out.add("SHAPE_ASPECT", "", "", self.product, _TRUE)
            self._aspects[key] = self._located(aspect, faces)
        return self._aspects[key]

    def _centre(self, faces: Sequence[int], name: str) -> Reference:
        derived = self.out.add("CENTRE_OF_SYMMETRY", name, "", self.product, _FALSE)
        self.out.add("SHAPE_ASPECT_DERIVING_RELATIONSHIP", "", "", derived, self._plain(faces))
        return derived

    def _located(self, aspect: Reference, faces: Iterable[int]) -> Reference:
        for face in faces:
            self.out.add(
                "GEOMETRIC_ITEM_SPECIFIC_USAGE", "", "", aspect, self.representation, Reference(face)
            )
        return aspect
