"""Faces, edges and vertices of a shape and how they meet, read once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from OCP.BRep import BRep_Tool
from OCP.BRepAdaptor import BRepAdaptor_Curve
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp, TopExp_Explorer

from cadskin._typing import Ints, Points
from cadskin.cad._occ import edges_of, faces_of, index_map, solids_of, to_edge, to_face, to_vertex, xyz

__all__ = ["EdgeUse", "Topology", "read_topology"]

_BOUNDARY = (TopAbs_Orientation.TopAbs_FORWARD, TopAbs_Orientation.TopAbs_REVERSED)


@dataclass(frozen=True, eq=False)
class EdgeUse:
    """One use of an edge by a face (a seam is used twice).

    Parameters
    ----------
    edge : int
        Zero-based index of the edge.
    shape : TopoDS_Edge
        With its orientation in the FORWARD face.
    forward : bool
    """

    edge: int
    shape: Any
    forward: bool


@dataclass(frozen=True, eq=False)
class Topology:
    """What the mesher needs to know about a shape.

    Parameters
    ----------
    faces : tuple of TopoDS_Face
        In map order, with their orientation in the shape.
    uses : tuple of tuple of EdgeUse
        For each face its bounding edges; INTERNAL and EXTERNAL edges bound nothing and are left out.
    edges : tuple of TopoDS_Edge
    edge_faces : tuple of frozenset of int
        For each edge the faces that use it.
    ends : (e, 2) int
        First and last vertex of each edge.
    vertices : (v, 3) float
        Vertex points [mm]; edges without vertices get one of their own, behind those of the shape.
    skipped : frozenset of int
        Faces that bound no material (orientation INTERNAL or EXTERNAL).
    ignored_edges : int
        Number of INTERNAL and EXTERNAL edge uses that were left out.
    is_solid : bool
        Whether the shape holds a solid, so that its mesh must be closed.
    """

    faces: tuple[Any, ...]
    uses: tuple[tuple[EdgeUse, ...], ...]
    edges: tuple[Any, ...]
    edge_faces: tuple[frozenset[int], ...]
    ends: Ints
    vertices: Points
    skipped: frozenset[int]
    ignored_edges: int
    is_solid: bool


def read_topology(shape: Any) -> Topology:
    """Read the topology of a shape; faces in the order of ``TopExp.MapShapes`` and of ``.Faces()``."""
    faces = tuple(faces_of(shape))
    edge_map = index_map(shape, TopAbs_ShapeEnum.TopAbs_EDGE)
    edges = tuple(edges_of(shape))
    skipped = frozenset(i for i, face in enumerate(faces) if face.Orientation() not in _BOUNDARY)
    uses: list[tuple[EdgeUse, ...]] = []
    edge_faces: list[set[int]] = [set() for _ in edges]
    ignored = 0
    for index, face in enumerate(faces):
        found, left_out = _uses_of(face, edge_map)
        ignored += left_out
        uses.append(tuple(found))
        for use in found:
            edge_faces[use.edge].add(index)
    ends, vertices = _ends_of(shape, edges)
    return Topology(
        faces=faces,
        uses=tuple(uses),
        edges=edges,
        edge_faces=tuple(frozenset(found) for found in edge_faces),
        ends=ends,
        vertices=vertices,
        skipped=skipped,
        ignored_edges=ignored,
        is_solid=bool(solids_of(shape)),
    )


def _uses_of(face: Any, edge_map: Any) -> tuple[list[EdgeUse], int]:
    explorer = TopExp_Explorer(face.Oriented(TopAbs_Orientation.TopAbs_FORWARD), TopAbs_ShapeEnum.TopAbs_EDGE)
    found: list[EdgeUse] = []
    left_out = 0
    while explorer.More():
        edge = to_edge(explorer.Current())
        orientation = edge.Orientation()
        if orientation in _BOUNDARY:
            found.append(EdgeUse(edge_map.FindIndex(edge) - 1, edge, orientation == _BOUNDARY[0]))
        else:
            left_out += 1
        explorer.Next()
    return found, left_out


def _ends_of(shape: Any, edges: tuple[Any, ...]) -> tuple[Ints, Points]:
    vertex_map = index_map(shape, TopAbs_ShapeEnum.TopAbs_VERTEX)
    points = [
        xyz(BRep_Tool.Pnt_s(to_vertex(vertex_map.FindKey(i)))) for i in range(1, vertex_map.Extent() + 1)
    ]
    ends = np.full((len(edges), 2), -1, dtype=np.int64)
    for index, edge in enumerate(edges):
        for column, vertex in enumerate((TopExp.FirstVertex_s(edge), TopExp.LastVertex_s(edge))):
            if not vertex.IsNull():
                ends[index, column] = vertex_map.FindIndex(vertex) - 1
        if (ends[index] < 0).any():
            _give_vertices(index, edge, ends, points)
    return ends, np.array(points, dtype=np.float64).reshape(-1, 3)


def _give_vertices(index: int, edge: Any, ends: Ints, points: list[tuple[float, float, float]]) -> None:
    """Put vertices at the ends of an edge that has none; a closed curve gets one."""
    curve = BRepAdaptor_Curve(edge)
    places = [xyz(curve.Value(curve.FirstParameter())), xyz(curve.Value(curve.LastParameter()))]
    closed = np.allclose(places[0], places[1], rtol=0.0, atol=2.0 * BRep_Tool.Tolerance_s(edge))
    for column in (0, 1):
        if ends[index, column] < 0:
            if column == 1 and closed:
                ends[index, 1] = ends[index, 0]
            else:
                ends[index, column] = len(points)
                points.append(places[column])


def forward_face(face: Any) -> Any:
    """Return the face with orientation FORWARD, as its pcurves are stored."""
    return to_face(face.Oriented(TopAbs_Orientation.TopAbs_FORWARD))
