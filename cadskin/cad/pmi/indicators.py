"""Intersection planes, orientation planes and direction features of a STEP file."""

from __future__ import annotations

from collections import defaultdict
from functools import cached_property

import numpy as np

from cadskin._typing import Vectors
from cadskin.cad.pmi.aspects import Aspects, Resolved
from cadskin.cad.pmi.datums import DatumReader
from cadskin.cad.pmi.graph import references
from cadskin.cad.pmi.tokens import Enumeration, Reference
from cadskin.errors import SpecificationError
from cadskin.spec.indicators import Indicator, IndicatorKind, IndicatorRelation

__all__ = ["AFFECTED_PLANES", "IndicatorReader"]

AFFECTED_PLANES: dict[IndicatorKind, str] = {
    "intersection_plane": "intersection plane",
    "orientation_plane": "orientation plane",
}
_ZONES: dict[str, IndicatorKind] = {
    "ORIENTED_TOLERANCE_ZONE": "orientation_plane",
    "DIRECTED_TOLERANCE_ZONE": "direction_feature",
    "DIRECTION_FEATURE_TOLERANCE_ZONE": "direction_feature",
}
_RELATIONS: dict[str, IndicatorRelation] = {
    "PARALLEL": "parallel",
    "PERPENDICULAR": "perpendicular",
    "INCLINED": "inclined",
    "RUN_OUT": "run_out",
    "RUNOUT": "run_out",
}


class IndicatorReader:
    """Reads what AP242 says of indicators.

    A plane stands in an "affected plane association" of the zone or of the toleranced aspect, either way
    round; a zone with a datum system is an orientation plane or a direction feature.

    Parameters
    ----------
    aspects : Aspects
    datums : DatumReader
    """

    def __init__(self, aspects: Aspects, datums: DatumReader) -> None:
        self.aspects = aspects
        self.graph = aspects.graph
        self.file = aspects.file
        self.datums = datums

    def indicators(
        self, zones: list[int], target: int | None, *, on_derived: bool, resolved: Resolved | None
    ) -> tuple[tuple[Indicator, ...], tuple[str, ...]]:
        """Return the indicators of a tolerance with these zones and toleranced aspect, and notes."""
        found: dict[IndicatorKind, Indicator] = {}
        notes: list[str] = []
        for anchor in [*zones, *([] if target is None else [target])]:
            for plane in self._planes.get(anchor, ()):
                kind = self._kind(plane, on_derived=on_derived)
                normal = self._normal(plane, resolved)
                if normal is None:
                    notes.append(f"its affected plane #{plane} has no direction")
                else:
                    found[kind] = Indicator(kind, direction=_triple(normal))
        for zone in zones:
            self._of_zone(zone, found, notes)
        if resolved is not None and target is not None and "line in face" in resolved.via and not found:
            items = [item for group in self.aspects.item_groups(target) for item in group]
            normals = [n for n in (self._through_line(item, resolved) for item in items) if n is not None]
            if normals:
                found["intersection_plane"] = Indicator("intersection_plane", direction=_triple(normals[0]))
        return tuple(found.values()), tuple(notes)

    @cached_property
    def _planes(self) -> dict[int, list[int]]:
        found: defaultdict[int, list[int]] = defaultdict(list)
        for number in self.file.of_type("SHAPE_ASPECT_RELATIONSHIP"):
            if self.graph.is_affected_plane(number):
                one, other = (self.graph.reference(number, i, "SHAPE_ASPECT_RELATIONSHIP") for i in (2, 3))
                if one is not None and other is not None:
                    found[one].append(other)
                    found[other].append(one)
        return dict(found)

    def _kind(self, plane: int, *, on_derived: bool) -> IndicatorKind:
        words = " ".join(str(value) for value in self.graph.inherited(plane, "SHAPE_ASPECT")[:2]).lower()
        for kind, name in AFFECTED_PLANES.items():
            if name.split()[0] in words:
                return kind
        return "orientation_plane" if on_derived else "intersection_plane"

    def _normal(self, plane: int, resolved: Resolved | None) -> Vectors | None:
        topology = self.aspects.topology
        for item in [*self.graph.properties.get(plane, ()), *self.graph.items.get(plane, ())]:
            placed = topology.placement(item)
            surface = topology.surface(item) if self.file.is_a(item, "ADVANCED_FACE") else item
            if placed is None and surface is not None and self.file.is_a(surface, "PLANE"):
                placed = topology.axis_of_surface(surface)
            if placed is not None:
                return placed[1]
            through = self._through_line(item, resolved)
            if through is not None:
                return through
        return None

    def _through_line(self, item: int, resolved: Resolved | None) -> Vectors | None:
        """Return the normal of the plane through a straight line, square to the plane face it lies in."""
        topology = self.aspects.topology
        curve = self.graph.reference(item, 3) if self.file.is_a(item, "EDGE_CURVE") else item
        if curve is None or not self.file.is_a(curve, "LINE", "TRIMMED_CURVE", "POLYLINE", "SURFACE_CURVE"):
            return None
        line = topology.line(curve)
        for face in resolved.faces if resolved is not None and line is not None else ():
            surface = topology.surface(face)
            placed = None if surface is None else topology.axis_of_surface(surface)
            if line is not None and placed is not None and topology.kind(face) == "plane":
                normal = np.cross(line[1], placed[1])
                length = float(np.linalg.norm(normal))
                return normal / length if length > 1e-9 else None
        return None

    def _of_zone(self, zone: int, found: dict[IndicatorKind, Indicator], notes: list[str]) -> None:
        kind = next((_ZONES[name] for name in self.file.types(zone) if name in _ZONES), None)
        if kind is None:
            return
        values = [value for record in self.file.records(zone) for value in record.values]
        systems = tuple(x for value in values for x in references(value) if self.file.is_a(x, "DATUM_SYSTEM"))
        words = [_RELATIONS[str(v)] for v in values if isinstance(v, Enumeration) and str(v) in _RELATIONS]
        angles = [
            m.value for m in map(self.graph.measure, values) if m is not None and m.unit.kind == "angle"
        ]
        relation: IndicatorRelation = words[0] if words else "inclined" if angles else "parallel"
        try:
            datums = self.datums.system(tuple(Reference(system) for system in systems))
            found[kind] = Indicator(
                kind, relation, datums, angles[0] if angles and relation == "inclined" else None
            )
        except SpecificationError as error:
            notes.append(f"its {kind.replace('_', ' ')} #{zone} is not understood: {error}")


def _triple(vector: Vectors) -> tuple[float, float, float]:
    x, y, z = (float(component) + 0.0 for component in vector)
    return x, y, z
