"""Shape aspects resolved to faces: what a tolerance, a datum or a dimension is about."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, TypeAlias

from cadskin.cad.pmi.graph import LOCATIONS, PmiGraph, references
from cadskin.cad.pmi.topology import FACES, Topology

__all__ = ["SIZES", "Aspects", "Prefer", "Resolved"]

Prefer: TypeAlias = Literal["surface", "axis", "either"]

SIZES = (
    "DIMENSIONAL_SIZE",
    "ANGULAR_SIZE",
    "DIMENSIONAL_SIZE_WITH_PATH",
    "DIMENSIONAL_SIZE_WITH_DATUM_FEATURE",
)
_BODIES: tuple[str, ...] = (
    "MANIFOLD_SOLID_BREP",
    "BREP_WITH_VOIDS",
    "CLOSED_SHELL",
    "OPEN_SHELL",
    "ORIENTED_CLOSED_SHELL",
    "CONNECTED_FACE_SET",
    "SHELL_BASED_SURFACE_MODEL",
    "FACE_BASED_SURFACE_MODEL",
)
_SETS = ("GEOMETRIC_CURVE_SET", "GEOMETRIC_SET", "COMPOSITE_CURVE", "COMPOSITE_CURVE_SEGMENT")
_CURVES = ("TRIMMED_CURVE", "LINE", "POLYLINE", "CIRCLE", "ELLIPSE", "AXIS1_PLACEMENT", "AXIS2_PLACEMENT_3D")
_SURFACES: tuple[str, ...] = (
    "PLANE",
    "CYLINDRICAL_SURFACE",
    "CONICAL_SURFACE",
    "SPHERICAL_SURFACE",
    "TOROIDAL_SURFACE",
)
_SURFACES += ("RECTANGULAR_TRIMMED_SURFACE", "CURVE_BOUNDED_SURFACE")
_COMPOSITES: tuple[str, ...] = (
    "COMPOSITE_SHAPE_ASPECT",
    "COMPOSITE_GROUP_SHAPE_ASPECT",
    "COMPOSITE_UNIT_SHAPE_ASPECT",
)
_COMPOSITES += ("ALL_AROUND_SHAPE_ASPECT", "BETWEEN_SHAPE_ASPECT", "CONTINUOUS_SHAPE_ASPECT")
_GROUPS = ("COMPOSITE_GROUP_SHAPE_ASPECT",)
_MAX_VISITED = 100_000


@dataclass(frozen=True)
class Resolved:
    """What an aspect came to.

    Parameters
    ----------
    faces : tuple of int
        STEP numbers of the faces.
    groups : tuple of tuple of int
        Faces that belong together: one analytic surface, or one component of a composite.
    via : tuple of str
        How they were found where the file does not name faces: ``edge``, ``axis``, ``curve``, ...
    missing : tuple of str
        Items that no face could be found for, ``#12 POINT``.
    empty : bool
        The aspect has no geometry at all.
    """

    faces: tuple[int, ...] = ()
    groups: tuple[tuple[int, ...], ...] = ()
    via: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    empty: bool = False


class Aspects:
    """Resolver of shape aspects.

    Parameters
    ----------
    graph : PmiGraph
    """

    def __init__(self, graph: PmiGraph) -> None:
        self.graph = graph
        self.file = graph.file
        self.topology = Topology(graph)
        self._resolved: dict[tuple[int, Prefer], Resolved] = {}

    def resolve(self, aspect: int, *, prefer: Prefer = "surface") -> Resolved:
        """Return the faces of an aspect.

        Parameters
        ----------
        aspect : int
        prefer : {"surface", "axis", "either"}
            Of the faces at an edge take all, or the cylinders and cones; a straight curve can be an
            axis, a line in a face, or either.
        """
        key = (aspect, prefer)
        if key not in self._resolved:
            self._resolved[key] = self.resolve_items(
                self.item_groups(aspect), prefer=prefer, stated=self._is_stated_pattern(aspect)
            )
        return self._resolved[key]

    def resolve_items(
        self, item_groups: list[list[int]], *, prefer: Prefer = "surface", stated: bool = False
    ) -> Resolved:
        """Return the faces of geometric items; the members of a ``stated`` pattern stay apart."""
        groups: list[tuple[int, ...]] = []
        via: dict[str, None] = {}
        missing: dict[str, None] = {}
        any_item = False
        for items in item_groups:
            found: dict[int, None] = {}
            faces = [item for item in items if self.file.is_a(item, *FACES)]
            for item in faces or items:
                any_item = True
                how, at_item = self._faces_of(item, prefer)
                found.update(dict.fromkeys(at_item))
                if not at_item:
                    missing["/".join(self.file.types(item)[:1] or ("nothing",)) + f" #{item}"] = None
                elif how != "face":
                    via[how] = None
            if found:
                groups.append(tuple(found))
        numbers = tuple(dict.fromkeys(face for group in groups for face in group))
        members = tuple(groups) if stated else self._merged(groups)
        return Resolved(numbers, members, tuple(via), tuple(missing), not any_item)

    def item_groups(self, aspect: int) -> list[list[int]]:
        """Return the geometric items of an aspect, those of each component by itself.

        Curves of an aspect that has components (a thread, a centre line) count only where these have
        no geometry.
        """
        groups: list[list[int]] = []
        second_choice: list[list[int]] = []
        seen: set[int] = set()
        level = [aspect]
        while level:
            number = level.pop(0)
            if number in seen or len(seen) > _MAX_VISITED:
                continue
            seen.add(number)
            children = self._next(number)
            own = list(self.graph.items.get(number, []))
            plain = not children or any(self.file.is_a(item, *FACES) for item in own)
            (groups if plain else second_choice).append(own)
            if self._is_united(number):
                groups.append([item for child in children for item in self._subtree(child, seen)])
                continue
            for child in children:
                if len(children) == 1 or self.file.is_a(child, *_GROUPS):
                    level.append(child)
                else:
                    groups.append(self._subtree(child, seen))
        return [group for group in groups if group] or [group for group in second_choice if group]

    def _subtree(self, aspect: int, seen: set[int]) -> list[int]:
        items: dict[int, None] = {}
        pending = [aspect]
        while pending:
            number = pending.pop()
            if number in seen or len(seen) > _MAX_VISITED:
                continue
            seen.add(number)
            pending += reversed(self._next(number))
            items.update(dict.fromkeys(self.graph.items.get(number, [])))
        return list(items)

    def _is_stated_pattern(self, number: int) -> bool:
        values = self.graph.inherited(number, "SHAPE_ASPECT") if self.file.is_a(number, *_COMPOSITES) else ()
        return len(values) > 1 and values[1] == "pattern of features"

    def _is_united(self, number: int) -> bool:
        if self.file.is_a(number, "COMPOSITE_UNIT_SHAPE_ASPECT", "CONTINUOUS_SHAPE_ASPECT"):
            return True
        values = self.graph.inherited(number, "SHAPE_ASPECT") if self.file.is_a(number, *_COMPOSITES) else ()
        return len(values) > 1 and values[1] == "unified geometric item"

    def _next(self, number: int) -> list[int]:
        file, graph = self.file, self.graph
        if file.is_a(number, *SIZES):
            applies_to = self.size_target(number)
            follow = [] if applies_to is None or applies_to == number else [applies_to]
            return follow + self._components(number)
        if file.is_a(number, *LOCATIONS):
            return [x for x in self.location_targets(number) if x is not None]
        if file.is_a(number, "DATUM", "COMMON_DATUM"):
            return graph.owners_of(number)
        following = self._components(number)
        if not following and not graph.items.get(number):
            if file.is_a(number, *_COMPOSITES):
                return [x for x in graph.owners_of(number) if not file.is_a(x, "DATUM")]
            properties = graph.properties.get(number, [])
            if properties:
                graph.items.setdefault(number, [x for x in properties if self._is_shape(x)])
                return []
        return following

    def _is_shape(self, item: int) -> bool:
        return self.file.is_a(item, *FACES, *_BODIES, "EDGE_CURVE", *_SETS, "TRIMMED_CURVE")

    def _components(self, number: int) -> list[int]:
        return [x for x in self.graph.parts_of(number) if not self.file.is_a(x, "DATUM", "COMMON_DATUM")]

    def size_target(self, number: int) -> int | None:
        """Return the aspect that a dimensional size applies to."""
        file, graph = self.file, self.graph
        position = 4 if file.types(number) == ("DIMENSIONAL_SIZE_WITH_DATUM_FEATURE",) else 0
        return graph.reference(number, position, "DIMENSIONAL_SIZE")

    def location_targets(self, number: int) -> tuple[int | None, int | None]:
        """Return the two aspects of a dimensional location."""
        graph = self.graph
        return (
            graph.reference(number, 2, "SHAPE_ASPECT_RELATIONSHIP"),
            graph.reference(number, 3, "SHAPE_ASPECT_RELATIONSHIP"),
        )

    def _faces_of(self, item: int, prefer: Prefer) -> tuple[str, list[int]]:
        file, topology = self.file, self.topology
        if file.is_a(item, *FACES):
            return "face", [item]
        if file.is_a(item, *_BODIES):
            return "body", list(self.body_faces(item))
        if file.is_a(item, "EDGE_CURVE"):
            faces = topology.faces_at_edge(item)
            round_faces = [face for face in faces if topology.kind(face) in ("cylinder", "cone")]
            return "edge", faces if prefer == "surface" else round_faces or faces
        if file.is_a(item, "VERTEX_POINT"):
            return "vertex", topology.faces_at_vertex(item)
        if file.is_a(item, *_SETS):
            return "curve", self._set_faces(item, prefer)
        if file.is_a(item, *_SURFACES):
            return "surface", self._on_surface(item)
        if file.is_a(item, *_CURVES):
            return self._curve_faces(item, prefer)
        edges = topology.edges_on(item)
        return "curve", list(dict.fromkeys(face for edge in edges for face in topology.faces_at_edge(edge)))

    def _set_faces(self, item: int, prefer: Prefer) -> list[int]:
        found: dict[int, None] = {}
        for number in references(self.file.values(item)):
            if not self.file.is_a(number, *_SETS[:2]):
                found.update(dict.fromkeys(self._faces_of_curve_item(number, prefer)))
        return list(found)

    def _faces_of_curve_item(self, number: int, prefer: Prefer) -> list[int]:
        if self.file.is_a(number, "COMPOSITE_CURVE_SEGMENT", "COMPOSITE_CURVE"):
            inner = [x for x in references(self.file.values(number)) if self.file.is_a(x, *_CURVES)]
            return [face for x in inner for face in self._curve_faces(x, prefer)[1]]
        return self._curve_faces(number, prefer)[1]

    def _curve_faces(self, item: int, prefer: Prefer) -> tuple[str, list[int]]:
        topology = self.topology
        edges = topology.edges_on(item)
        if edges:
            return "curve", list(
                dict.fromkeys(face for edge in edges for face in topology.faces_at_edge(edge))
            )
        line = topology.line(item)
        if line is None:
            return "curve", []
        faces = topology.coaxial_faces(*line)
        if faces:
            return "axis", faces
        held = [] if prefer == "axis" else topology.faces_holding(item)
        return "line in face", held if len({topology.same_surface_key(face) for face in held}) == 1 else []

    def _on_surface(self, surface: int) -> list[int]:
        topology = self.topology
        return [face for face in topology.faces if topology.surface(face) == surface]

    def body_faces(self, item: int) -> Iterator[int]:
        """Yield the faces of a solid or shell."""
        seen: set[int] = set()
        pending = [item]
        while pending:
            number = pending.pop()
            if number in seen:
                continue
            seen.add(number)
            if self.file.is_a(number, *FACES):
                yield number
            elif self.file.is_a(number, *_BODIES):
                pending.extend(references(self.file.values(number)))

    def _merged(self, groups: list[tuple[int, ...]]) -> tuple[tuple[int, ...], ...]:
        """Join groups that share a face or an analytic surface: they are one feature."""
        merged: list[dict[int, None]] = []
        owner: dict[object, int] = {}
        for group in groups:
            keys = {self.topology.same_surface_key(face) for face in group}
            index = next((owner[key] for key in keys if key in owner), None)
            if index is None:
                index = len(merged)
                merged.append({})
            merged[index].update(dict.fromkeys(group))
            owner.update(dict.fromkeys(keys, index))
        return tuple(tuple(group) for group in merged if group)
