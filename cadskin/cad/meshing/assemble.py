"""From meshes of faces to one mesh: shared numbering along the edges, orientation, poles closed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cadskin._typing import Ints, Points, Triangles
from cadskin.cad.meshing.edges import EdgeCurve, EdgeSamples
from cadskin.cad.meshing.face import FaceMesh

__all__ = ["Assembly", "assemble"]


@dataclass(frozen=True, eq=False)
class Assembly:
    """A welded mesh that still knows where its parts come from.

    Parameters
    ----------
    points, triangles, face_ids
        As in `LabelledMesh`.
    rows : (m,) int
        Row of each triangle in its face's own mesh.
    node_ids : tuple of (k,) int
        For each face mesh the vertex of each of its nodes; -1 for a node that no triangle uses.
    """

    points: Points
    triangles: Triangles
    face_ids: Ints
    rows: Ints
    node_ids: tuple[Ints, ...]


def assemble(
    curves: Sequence[EdgeCurve],
    samples: Sequence[EdgeSamples],
    vertices: Points,
    meshes: Sequence[FaceMesh],
) -> Assembly:
    """Weld face meshes: turn reversed faces, drop triangles that a pole has made into segments."""
    inner = [sample.points[1:-1] for sample in samples]
    sizes = [0 if c.degenerate else len(p) for c, p in zip(curves, inner, strict=True)]
    offset = len(vertices) + np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    pool = [vertices] + [p for p, n in zip(inner, sizes, strict=True) if n]
    total = int(offset[-1])
    triangles, face_ids, rows, node_ids = [], [], [], []
    for mesh in meshes:
        n_fixed = len(mesh.domain.nodes)
        ids = np.zeros(len(mesh.uv), dtype=np.int64)
        edge, place = mesh.domain.nodes.T
        at_vertex = mesh.domain.vertex_ids >= 0
        ids[:n_fixed] = np.where(at_vertex, mesh.domain.vertex_ids, offset[edge] + place - 1)
        ids[n_fixed:] = np.arange(total, total + len(mesh.uv) - n_fixed)
        pool.append(mesh.points[n_fixed:])
        total += len(mesh.uv) - n_fixed
        corners = ids[mesh.triangles]
        if mesh.surface.reversed:
            corners = corners[:, ::-1]
        a, b, c = corners.T
        real = np.flatnonzero((a != b) & (b != c) & (c != a))
        triangles.append(corners[real])
        face_ids.append(np.full(len(real), mesh.index))
        rows.append(real)
        node_ids.append(ids)
    return _without_unused(
        np.concatenate(pool),
        np.concatenate([np.zeros((0, 3), np.int64), *triangles]),
        np.concatenate([np.zeros(0, np.int64), *face_ids]),
        np.concatenate([np.zeros(0, np.int64), *rows]),
        node_ids,
    )


def _without_unused(
    points: Points, triangles: Triangles, face_ids: Ints, rows: Ints, node_ids: Sequence[Ints]
) -> Assembly:
    used = np.zeros(len(points), dtype=bool)
    used[triangles] = True
    new = np.where(used, np.cumsum(used) - 1, -1)
    return Assembly(points[used], new[triangles], face_ids, rows, tuple(new[ids] for ids in node_ids))
