"""Meshes that another program made: parameters, orientation and wedges from our own surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cadskin._typing import Floats, Ints, Points, Triangles
from cadskin.cad.meshing.assemble import Assembly
from cadskin.cad.meshing.build import Part
from cadskin.cad.meshing.check import find_faults
from cadskin.cad.meshing.domain import Domain, project_onto
from cadskin.cad.meshing.face import FaceMesh
from cadskin.cad.meshing.result import LabelledMesh
from cadskin.cad.meshing.wedges import face_wedges
from cadskin.cad.surface import unit_normals

__all__ = ["ForeignMesh", "labelled_from"]

MISS = 1e-6  # of the part's diagonal: a parameter further off its point is projected anew


@dataclass(frozen=True, eq=False)
class ForeignMesh:
    """Arrays of a mesh with labels.

    Parameters
    ----------
    points : (n, 3) float
    triangles : (m, 3) int
    face_ids : (m,) int
    pairs : (k, 2) int
        Face and vertex of each known parameter; may be empty.
    uv : (k, 2) float
    """

    points: Points
    triangles: Triangles
    face_ids: Ints
    pairs: Ints
    uv: Floats


def labelled_from(part: Part, mesh: ForeignMesh, notes: Sequence[str]) -> LabelledMesh:
    """Turn the triangles outward and evaluate the wedges."""
    used, corners = np.unique(mesh.triangles, return_inverse=True)
    triangles = corners.reshape(-1, 3).astype(np.int64)
    points = mesh.points[used]
    new = np.full(len(mesh.points), -1, dtype=np.int64)
    new[used] = np.arange(len(used))
    known = new[mesh.pairs[:, 1]] >= 0
    pairs, uv = np.stack([mesh.pairs[:, 0], new[mesh.pairs[:, 1]]], axis=1)[known], mesh.uv[known]
    meshes, node_ids = [], []
    for face in range(len(part.surfaces)):
        rows = np.flatnonzero(mesh.face_ids == face)
        if not len(rows):
            continue
        vertices = np.unique(triangles[rows])
        own = pairs[:, 0] == face
        face_mesh = _face_mesh(part, face, vertices, points, pairs[own, 1], uv[own])
        meshes.append(face_mesh)
        node_ids.append(vertices)
        if _points_inward(part, face_mesh, points, triangles[rows], vertices):
            triangles[rows] = triangles[rows, ::-1]
    assembly = Assembly(points, triangles, mesh.face_ids, np.arange(len(triangles)), tuple(node_ids))
    wedges = face_wedges(assembly, meshes)
    found = find_faults(points, triangles, mesh.face_ids)
    missing = set(range(len(part.surfaces))) - {m.index for m in meshes} - set(part.topology.skipped)
    return LabelledMesh(
        points=points,
        triangles=triangles,
        face_ids=mesh.face_ids,
        wedge_faces=wedges.faces,
        wedge_vertices=wedges.vertices,
        wedge_uv=wedges.uv,
        wedge_normals=wedges.normals,
        wedge_curvatures=wedges.curvatures,
        wedge_directions=wedges.directions,
        wedge_singular=wedges.singular,
        closed=found.closed,
        failed_faces=tuple(sorted(missing)),
        notes=tuple(notes),
    )


def _face_mesh(
    part: Part, face: int, vertices: Ints, points: Points, known: Ints, known_uv: Floats
) -> FaceMesh:
    """Find the parameters of a face's vertices; those unknown or wrong are projected onto the surface."""
    surface = part.surfaces[face]
    here = points[vertices]
    uv = np.full((len(vertices), 2), np.nan)
    place = np.searchsorted(vertices, known).clip(max=len(vertices) - 1)
    hit = vertices[place] == known
    uv[place[hit]] = known_uv[hit]
    miss = np.full(len(vertices), np.inf)
    finite = np.isfinite(uv).all(axis=1)
    miss[finite] = np.linalg.norm(surface.points(uv[finite]) - here[finite], axis=1)
    wrong = np.flatnonzero(~(miss <= MISS * part.diagonal))
    if len(wrong):
        project_onto(surface, here, uv, miss, wrong)
    empty = Domain(
        uv=np.zeros((0, 2)),
        nodes=np.zeros((0, 2), dtype=np.int64),
        vertex_ids=np.zeros(0, dtype=np.int64),
        points=np.zeros((0, 3)),
        sizes=np.zeros(0),
        segments=np.zeros((0, 2), dtype=np.int64),
        segment_edges=np.zeros(0, dtype=np.int64),
        reprojected=0,
    )
    return FaceMesh(
        index=face,
        surface=surface,
        domain=empty,
        uv=uv,
        triangles=np.zeros((0, 3), dtype=np.int64),
        points=here,
        derivatives=surface.derivatives(uv),  # a row of NaN becomes a flagged stand-in
        area=0.0,
    )


def _points_inward(part: Part, mesh: FaceMesh, points: Points, triangles: Triangles, vertices: Ints) -> bool:
    outward = unit_normals(mesh.derivatives, reversed=part.surfaces[mesh.index].reversed)
    corners = points[triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    wanted = outward[np.searchsorted(vertices, triangles)].sum(axis=1)
    return bool(np.einsum("ni,ni->", normals, wanted) < 0)
