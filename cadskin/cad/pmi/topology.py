"""Edges, curves, axes and surfaces of the file tied to the faces they mean, on the text alone."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from functools import cached_property
from math import isfinite

import numpy as np

from cadskin._typing import Points, Vectors
from cadskin.cad.pmi.graph import PmiGraph, references
from cadskin.cad.pmi.tokens import Typed, Value

__all__ = ["FACES", "Topology"]

FACES = ("ADVANCED_FACE", "FACE_SURFACE")
_ROUND = ("CYLINDRICAL_SURFACE", "CONICAL_SURFACE", "SURFACE_OF_REVOLUTION", "TOROIDAL_SURFACE")
_KINDS = {
    "PLANE": "plane",
    "CYLINDRICAL_SURFACE": "cylinder",
    "CONICAL_SURFACE": "cone",
    "SPHERICAL_SURFACE": "sphere",
    "TOROIDAL_SURFACE": "torus",
    "DEGENERATE_TOROIDAL_SURFACE": "torus",
    "SURFACE_OF_REVOLUTION": "revolution",
    "SURFACE_OF_LINEAR_EXTRUSION": "extrusion",
    "OFFSET_SURFACE": "offset",
}
_MAX_DEPTH = 16
_PARALLEL = 1e-6
_COAXIAL_MM = 1e-3


class Topology:
    """Which faces an item of the geometry belongs to.

    Parameters
    ----------
    graph : PmiGraph
    """

    def __init__(self, graph: PmiGraph) -> None:
        self.graph = graph
        self.file = graph.file
        self._tolerance = _COAXIAL_MM / (graph.context_unit("length").factor or 1.0)

    # -- faces and their surfaces --------------------

    @cached_property
    def faces(self) -> list[int]:
        """All faces of the file, in its order."""
        return self.file.of_type(*FACES)

    def surface(self, face: int) -> int | None:
        """Return the surface of a face."""
        if self.file.is_a(face, "FACE_SURFACE"):
            return self.graph.reference(face, -2, "FACE_SURFACE") or _last(
                self.graph.inherited(face, "FACE_SURFACE")
            )
        return _last(self.file.values(face))

    def kind(self, face: int) -> str:
        """Return the kind of a face's surface, in the words of `cadskin.shape.ideal`."""
        surface = self.surface(face)
        for name in self.file.types(surface) if surface is not None else ():
            if name in _KINDS:
                return _KINDS[name]
            if "B_SPLINE_SURFACE" in name:
                return "bspline"
        return "other"

    def _vector(self, number: int | None) -> Points | None:
        if number is None:
            return None
        for value in self.file.values(number):
            if isinstance(value, tuple):
                numbers = self.graph.numbers(value)
                return np.array(numbers) if len(numbers) == 3 and all(map(isfinite, numbers)) else None
        return None

    def _direction(self, number: int | None) -> Vectors | None:
        vector = self._vector(number)
        length = 0.0 if vector is None else float(np.linalg.norm(vector))
        if vector is None or not 0 < length < np.inf:
            return None
        return vector if abs(length - 1.0) < 1e-15 else vector / length

    def placement(self, number: int | None) -> tuple[Points, Vectors] | None:
        """Return the origin and axis [file units] of an ``AXIS1_PLACEMENT`` or ``AXIS2_PLACEMENT_3D``."""
        if number is None or not self.file.is_a(number, "AXIS1_PLACEMENT", "AXIS2_PLACEMENT_3D"):
            return None
        origin = self._vector(self.graph.reference(number, 1))
        axis = self._direction(self.graph.reference(number, 2))
        if origin is None:
            return None
        return origin, np.array([0.0, 0.0, 1.0]) if axis is None else axis

    def frame(self, number: int) -> tuple[Points, Vectors | None, Vectors | None] | None:
        """Return origin, third and first axis of a placement; None for an axis that is left out."""
        placed = self.placement(number)
        if placed is None:
            return None
        axis, first = (self._direction(self.graph.reference(number, i)) for i in (2, 3))
        return placed[0], axis, first

    def axis_of_surface(self, surface: int) -> tuple[Points, Vectors] | None:
        """Return a point and the direction of a surface's axis (a plane's normal) [file units]."""
        placement = next(
            (
                x
                for x in references(self.file.values(surface))
                if self.file.is_a(x, "AXIS1_PLACEMENT", "AXIS2_PLACEMENT_3D")
            ),
            None,
        )
        return self.placement(placement)

    def same_surface_key(self, face: int) -> tuple[object, ...]:
        """Return a key, equal for the faces of one analytic surface: half-cylinders, a cut plane."""
        surface = self.surface(face)
        kind = self.kind(face)
        placed = None if surface is None else self.axis_of_surface(surface)
        if placed is None or kind in ("bspline", "other", "revolution", "extrusion", "offset"):
            return ("surface", surface)
        origin, axis = placed
        step = 10 * self._tolerance
        axis = axis if next(x for x in axis if abs(x) > 1e-3) > 0 else -axis
        sizes = tuple(round(x / step) for x in self.graph.numbers(self.file.values(surface or 0)))
        direction = tuple(int(x) for x in np.round(axis * 1e5))
        if kind == "plane":
            return (kind, direction, round(float(origin @ axis) / step))
        if kind == "cylinder":
            origin = origin - axis * float(origin @ axis)
        where = tuple(int(x) for x in np.round(origin / step))
        return (kind, where, sizes) if kind == "sphere" else (kind, direction, where, sizes)

    # -- edges, curves and axes --------------------

    @cached_property
    def _edges(self) -> dict[int, list[int]]:
        """Faces at every edge."""
        found: defaultdict[int, dict[int, None]] = defaultdict(dict)
        for face in self.faces:
            for loop in self._loops(face):
                for oriented in references(self.file.values(loop, "EDGE_LOOP")):
                    edge = self.graph.reference(oriented, 3)
                    if edge is not None:
                        found[edge][face] = None
        return {edge: list(faces) for edge, faces in found.items()}

    def _loops(self, face: int) -> Iterable[int]:
        for bound in references(self.file.values(face)[1:2]):
            loop = self.graph.reference(bound, 1)
            if loop is not None:
                yield loop

    @cached_property
    def _curves(self) -> dict[int, list[int]]:
        """Edges that lie on every curve."""
        found: defaultdict[int, list[int]] = defaultdict(list)
        for edge in self._edges:
            for curve in references(self.file.values(edge)[3:4]):
                found[curve].append(edge)
                if self.file.is_a(curve, "SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE"):
                    inner = self.graph.reference(curve, 1)
                    if inner is not None:
                        found[inner].append(edge)
        return dict(found)

    def edges_on(self, curve: int) -> list[int]:
        """Return the edges whose geometry is this curve."""
        return self._curves.get(curve, [])

    def faces_at_edge(self, edge: int) -> list[int]:
        """Return the faces that meet at an edge."""
        return self._edges.get(edge, [])

    def faces_at_vertex(self, vertex: int) -> list[int]:
        """Return the faces that meet at a vertex."""
        found: dict[int, None] = {}
        for edge, faces in self._edges.items():
            if vertex in tuple(references(self.file.values(edge)[1:3])):
                found.update(dict.fromkeys(faces))
        return list(found)

    def line(self, curve: int, depth: int = 0) -> tuple[Points, Vectors] | None:
        """Return a point and the direction [file units] of a straight curve, or of a circle's axis."""
        if depth > _MAX_DEPTH:
            return None
        file, graph = self.file, self.graph
        if file.is_a(curve, "TRIMMED_CURVE", "SURFACE_CURVE"):
            inner = graph.reference(curve, 1)
            return None if inner is None else self.line(inner, depth + 1)
        if file.is_a(curve, "CIRCLE", "ELLIPSE"):
            return self.placement(graph.reference(curve, 1))
        if file.is_a(curve, "AXIS1_PLACEMENT", "AXIS2_PLACEMENT_3D"):
            return self.placement(curve)
        if file.is_a(curve, "LINE"):
            origin, vector = self._vector(graph.reference(curve, 1)), graph.reference(curve, 2)
            direction = None if vector is None else self._direction(graph.reference(vector, 1))
            return None if origin is None or direction is None else (origin, direction)
        if file.is_a(curve, "POLYLINE"):
            return self._polyline(list(references(file.values(curve)[1:2])))
        return None

    def _polyline(self, numbers: list[int]) -> tuple[Points, Vectors] | None:
        ends = [self._vector(numbers[i]) for i in (0, -1)] if len(numbers) >= 2 else []
        if not ends or ends[0] is None or ends[1] is None:
            return None
        chord = ends[1] - ends[0]
        length = float(np.linalg.norm(chord))
        return (ends[0], chord / length) if length > 0 else None

    def _placed(self, *kinds: str) -> tuple[list[int], Points, Vectors]:
        """Return the faces on surfaces of these entities, with origin (n, 3) and axis (n, 3) [file units]."""
        numbers, origins, axes = [], [], []
        for face in self.faces:
            surface = self.surface(face)
            if surface is not None and self.file.is_a(surface, *kinds):
                placed = self.axis_of_surface(surface)
                if placed is not None:
                    numbers.append(face)
                    origins.append(placed[0])
                    axes.append(placed[1])
        return numbers, np.array(origins).reshape(-1, 3), np.array(axes).reshape(-1, 3)

    @cached_property
    def _round_faces(self) -> tuple[list[int], Points, Vectors]:
        return self._placed(*_ROUND)

    def coaxial_faces(self, point: Points, direction: Vectors) -> list[int]:
        """Return the faces of revolution whose axis is this line, cylinders before all others."""
        numbers, origins, axes = self._round_faces
        parallel = np.abs(np.abs(axes @ direction) - 1) < _PARALLEL
        off = np.linalg.norm(_across(origins - point, direction), axis=1)
        found = [numbers[i] for i in np.flatnonzero(parallel & (off < self._tolerance))]
        cylinders = [face for face in found if self.kind(face) == "cylinder"]
        return cylinders or found

    # -- a line that lies in a face --------------------

    def ends(self, curve: int) -> Points | None:
        """Return the end points (2, 3) [file units] of a trimmed straight curve or polyline."""
        if self.file.is_a(curve, "POLYLINE"):
            points = [self._vector(x) for x in references(self.file.values(curve)[1:2])]
        elif self.file.is_a(curve, "TRIMMED_CURVE"):
            points = [self._trim(curve, self.file.values(curve)[i : i + 1]) for i in (2, 3)]
        else:
            return None
        if len(points) < 2 or points[0] is None or points[-1] is None:
            return None
        return np.array([points[0], points[-1]])

    def _trim(self, curve: int, values: tuple[Value, ...]) -> Points | None:
        for number in references(values):
            point = self._vector(number)
            if point is not None:
                return point
        line, basis = self.line(curve), self.graph.reference(curve, 1)
        if line is None or basis is None or not self.file.is_a(basis, "LINE"):
            return None
        vector = self.graph.reference(basis, 2)
        length = self.graph.numbers(self.file.values(vector))[:1] if vector is not None else []
        group = values[0] if values and isinstance(values[0], tuple) else ()
        for item in group:
            if isinstance(item, Typed) and item.values and length:
                parameter = self.graph.numbers(item.values)
                if parameter:
                    return line[0] + line[1] * (parameter[0] * length[0])
        return None

    def corners(self, face: int) -> Points:
        """Return the vertices (n, 3) [file units] of a face."""
        found: dict[int, Points] = {}
        for loop in self._loops(face):
            for oriented in references(self.file.values(loop, "EDGE_LOOP")):
                edge = self.graph.reference(oriented, 3)
                for vertex in references(self.file.values(edge)[1:3]) if edge is not None else ():
                    point = self._vector(self.graph.reference(vertex, 1))
                    if point is not None:
                        found[vertex] = point
        return np.array(list(found.values())).reshape(-1, 3)

    @cached_property
    def _planes(self) -> tuple[list[int], Points, Vectors]:
        return self._placed("PLANE")

    @cached_property
    def _cylinders(self) -> tuple[list[int], Points, Vectors]:
        return self._placed("CYLINDRICAL_SURFACE")

    def faces_holding(self, curve: int) -> list[int]:
        """Return the planar and cylindrical faces in which a straight curve lies, within their boxes."""
        ends = self.ends(curve)
        if ends is None:
            return []
        return [*self._planes_holding(ends), *self._cylinders_holding(ends)]

    def _planes_holding(self, ends: Points) -> list[int]:
        numbers, origins, axes = self._planes
        off = np.abs(((ends[:, None] - origins) * axes).sum(axis=2)).max(axis=0)
        return [numbers[i] for i in np.flatnonzero(off <= self._tolerance) if self._in_box(numbers[i], ends)]

    def _in_box(self, face: int, ends: Points) -> bool:
        corners = self.corners(face)
        if len(corners) < 2:
            return False
        low, high = corners.min(axis=0) - self._tolerance, corners.max(axis=0) + self._tolerance
        return bool(((ends >= low) & (ends <= high)).all())

    def _cylinders_holding(self, ends: Points) -> list[int]:
        numbers, origins, axes = self._cylinders
        radii = np.array([self._radius(face) for face in numbers])
        across = [_across(end - origins, axes) for end in ends]
        off = np.abs(np.array([np.linalg.norm(rows, axis=1) for rows in across]) - radii).max(axis=0)
        near = np.flatnonzero(off <= self._tolerance)
        return [numbers[i] for i in near if self._along(numbers[i], origins[i], axes[i], ends)]

    def _radius(self, face: int) -> float:
        surface = self.surface(face)
        return (self.graph.numbers(self.file.values(surface)) if surface is not None else [np.inf])[-1]

    def _along(self, face: int, origin: Points, axis: Vectors, ends: Points) -> bool:
        corners = self.corners(face)
        if len(corners) < 2:
            return False
        along, reach = (ends - origin) @ axis, (corners - origin) @ axis
        return bool(
            along.min() >= reach.min() - self._tolerance and along.max() <= reach.max() + self._tolerance
        )


def _across(vectors: Vectors, axes: Vectors) -> Vectors:
    """Return the part of vectors (n, 3) square to unit axes (n, 3) or to one axis (3,)."""
    return np.asarray(vectors - (vectors * axes).sum(axis=1, keepdims=True) * axes)


def _last(values: tuple[Value, ...]) -> int | None:
    found = list(references(values))
    return found[-1] if found else None
