"""Repairs of the welded mesh: edges that more than two triangles share."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cadskin._typing import Ints
from cadskin.cad.meshing.assemble import Assembly
from cadskin.cad.meshing.check import CROWDED, count_fans, half_edge_twins
from cadskin.cad.meshing.face import FaceMesh

__all__ = ["crowded_chords", "separate_fans", "split_chords"]

Chord = tuple[int, int, int]  # position of the face mesh, lower and higher local node


def crowded_chords(assembly: Assembly, meshes: Sequence[FaceMesh]) -> tuple[list[Chord], frozenset[int]]:
    """Find what makes edges crowded: two chords of faces, or two B-rep edges, with the same ends.

    Returns
    -------
    chords : list of (position, node, node)
        Inner sides of face meshes to split; one chord per crowded edge may stay where nothing else uses it.
    edges : frozenset of int
        B-rep edges that need a point between their ends.
    """
    twin = half_edge_twins(assembly.triangles, len(assembly.points))
    chords: dict[tuple[int, int], dict[Chord, int]] = {}
    brep_edges: dict[tuple[int, int], set[int]] = {}
    position_of = {mesh.index: position for position, mesh in enumerate(meshes)}
    for half in np.flatnonzero(twin == CROWDED).tolist():
        t, i = divmod(half, 3)
        position = position_of[int(assembly.face_ids[t])]
        mesh = meshes[position]
        local = mesh.triangles[assembly.rows[t]]
        if mesh.surface.reversed:
            local = local[::-1]
        a, b = sorted((int(local[i]), int(local[(i + 1) % 3])))
        ends = sorted((int(assembly.triangles[t, i]), int(assembly.triangles[t, (i + 1) % 3])))
        key = (ends[0], ends[1])
        on_edge = _boundary_edge(mesh, a, b)
        if on_edge is None:
            group = chords.setdefault(key, {})
            group[position, a, b] = group.get((position, a, b), 0) + 1
        else:
            brep_edges.setdefault(key, set()).add(on_edge)
    to_split: list[Chord] = []
    for key, group in chords.items():
        found = list(group)
        to_split += found if key in brep_edges else found[1:]
    crowded_edges = [edges for edges in brep_edges.values() if len(edges) > 1]
    return to_split, frozenset().union(*crowded_edges)


def _boundary_edge(mesh: FaceMesh, a: int, b: int) -> int | None:
    """Return the B-rep edge of a local side, None where it is an inner side."""
    if max(a, b) >= len(mesh.domain.nodes):
        return None
    hit = (np.sort(mesh.domain.segments, axis=1) == (a, b)).all(axis=1)
    return int(mesh.domain.segment_edges[hit][0]) if hit.any() else None


def split_chords(mesh: FaceMesh, sides: Sequence[tuple[int, int]]) -> FaceMesh:
    """Put a point on the middle of inner sides, at most one per triangle in one call."""
    triangles = mesh.triangles
    busy = np.zeros(len(triangles), dtype=bool)
    uv, points, derivatives = [mesh.uv], [mesh.points], [mesh.derivatives]
    n = len(mesh.uv)
    added: list[Ints] = []
    removed: list[int] = []
    for a, b in sides:
        rows = np.flatnonzero((triangles == a).any(axis=1) & (triangles == b).any(axis=1))
        if len(rows) != 2 or busy[rows].any():
            continue
        busy[rows] = True
        middle = 0.5 * (mesh.uv[a] + mesh.uv[b])[None]
        if np.isfinite(middle).all():
            value = mesh.surface.derivatives(middle)
            point = value[:, 0]
        else:
            point = 0.5 * (mesh.points[a] + mesh.points[b])[None]
            value = np.full((1, 6, 3), np.nan)
            value[:, 0] = point
        uv.append(middle)
        points.append(point)
        derivatives.append(value)
        for row in rows.tolist():
            added += [np.where(triangles[row] == old, n, triangles[row]) for old in (a, b)]
        removed += rows.tolist()
        n += 1
    if not removed:
        return mesh
    kept = np.delete(triangles, removed, axis=0)
    return replace(
        mesh,
        uv=np.concatenate(uv),
        points=np.concatenate(points),
        derivatives=np.concatenate(derivatives),
        triangles=np.concatenate([kept, np.array(added)]),
    )


def separate_fans(assembly: Assembly, meshes: Sequence[FaceMesh]) -> tuple[Assembly, list[FaceMesh], int]:
    """Give each fan of triangles at a pinched vertex a vertex of its own, in the same place.

    Two parts of a shape that touch in one point are then closed each. Returns the number of such vertices.
    """
    triangles = assembly.triangles
    twin = half_edge_twins(triangles, len(assembly.points))
    fan_of = np.zeros(len(twin), np.int64)
    pinched = count_fans(triangles, twin, len(assembly.points), fan_of) > 1
    moved = np.flatnonzero((fan_of > 0) & pinched[triangles.ravel()])
    if not len(moved) or (twin == CROWDED).any():
        return assembly, list(meshes), 0
    old = triangles.ravel()[moved]
    pairs, inverse = np.unique(np.stack([old, fan_of[moved]], axis=1), axis=0, return_inverse=True)
    corners = triangles.ravel().copy()
    corners[moved] = len(assembly.points) + inverse.ravel()
    new_triangles = corners.reshape(-1, 3)
    points = np.concatenate([assembly.points, assembly.points[pairs[:, 0]]])
    new_meshes, node_ids = [], []
    for mesh, ids in zip(meshes, assembly.node_ids, strict=True):
        used = np.unique(new_triangles[assembly.face_ids == mesh.index])
        fresh = used[used >= len(assembly.points)]
        origin = pairs[fresh - len(assembly.points), 0]
        copies = np.array([int(np.flatnonzero(ids == vertex)[0]) for vertex in origin], dtype=np.int64)
        kept = np.where(np.isin(ids, used), ids, -1)
        node_ids.append(np.concatenate([kept, fresh]))
        new_meshes.append(
            replace(
                mesh,
                uv=np.concatenate([mesh.uv, mesh.uv[copies]]),
                points=np.concatenate([mesh.points, mesh.points[copies]]),
                derivatives=np.concatenate([mesh.derivatives, mesh.derivatives[copies]]),
            )
            if len(fresh)
            else mesh
        )
    separated = Assembly(points, new_triangles, assembly.face_ids, assembly.rows, tuple(node_ids))
    return separated, new_meshes, int(pinched.sum())
