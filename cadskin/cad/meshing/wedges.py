"""Exact normals and curvatures at every (face, vertex) pair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cadskin._typing import Bools, Floats, Ints, Vectors
from cadskin.cad.meshing.assemble import Assembly
from cadskin.cad.meshing.face import FaceMesh
from cadskin.cad.surface import FaceSurface, principal_curvatures, unit_normals

__all__ = ["Wedges", "face_wedges"]

SINGULAR = 1e-9  # of the face's median |Su x Sv|
UNSEEN = 10.0  # curvature times the shortest side at the vertex: the mesh cannot show such a bend
AGREEMENT = 0.02  # spread of the normals round a pole that still has a normal


@dataclass(frozen=True, eq=False)
class Wedges:
    """The wedge arrays of a `LabelledMesh`, sorted by face and vertex."""

    faces: Ints
    vertices: Ints
    uv: Floats
    normals: Vectors
    curvatures: Floats
    directions: Floats
    singular: Bools


def face_wedges(assembly: Assembly, meshes: Sequence[FaceMesh]) -> Wedges:
    """Evaluate the wedges of all faces at once; singular points are treated one face at a time."""
    vertices, uvs, derivatives, faces, sign = [], [], [], [], []
    for mesh, ids in zip(meshes, assembly.node_ids, strict=True):
        found, first = np.unique(ids, return_index=True)
        if len(found) and found[0] < 0:
            found, first = found[1:], first[1:]
        vertices.append(found)
        uvs.append(mesh.uv[first])
        derivatives.append(mesh.derivatives[first])
        faces.append(np.full(len(found), mesh.index))
        sign.append(np.full(len(found), mesh.surface.reversed))
    values = np.concatenate(derivatives)
    normals = unit_normals(values, reversed=np.concatenate(sign))
    with np.errstate(all="ignore"):
        curvatures, directions = principal_curvatures(values, normals)
    wedges = Wedges(
        np.concatenate(faces),
        np.concatenate(vertices),
        np.concatenate(uvs),
        normals,
        curvatures,
        directions,
        np.zeros(len(normals), dtype=bool),
    )
    _treat_singular(wedges, values, assembly, meshes)
    return wedges


def _treat_singular(wedges: Wedges, values: Floats, assembly: Assembly, meshes: Sequence[FaceMesh]) -> None:
    """Fill in the rows that have no normal or curvature of their own, in place."""
    density = np.linalg.norm(np.cross(values[:, 1], values[:, 2]), axis=1)
    starts = np.searchsorted(wedges.faces, [mesh.index for mesh in meshes])
    finite: Bools = np.asarray(
        np.isfinite(wedges.normals).all(axis=1)
        & np.isfinite(wedges.curvatures).all(axis=1)
        & np.isfinite(wedges.directions).all(axis=(1, 2))
    )
    shortest = _shortest_sides(assembly)[wedges.vertices]
    with np.errstate(invalid="ignore"):
        bent = np.abs(wedges.curvatures).max(axis=1) * shortest > UNSEEN
    ends = np.append(starts[1:], len(density))
    for mesh, ids, start, end in zip(meshes, assembly.node_ids, starts.tolist(), ends.tolist(), strict=True):
        if start == end:
            continue
        part = density[start:end]
        low = np.isfinite(part)
        floor = SINGULAR * float(np.median(part[low])) if low.any() else 0.0
        for row in (start + np.flatnonzero(~(part > floor) | ~finite[start:end] | bent[start:end])).tolist():
            copies = np.flatnonzero(ids == wedges.vertices[row])
            _fill_row(wedges, row, mesh, copies, assembly, float(shortest[row]))


def _shortest_sides(assembly: Assembly) -> Floats:
    """Return the length of the shortest side at each vertex [mm]."""
    corners = assembly.points[assembly.triangles]
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    shortest = np.full(len(assembly.points), np.inf)
    np.minimum.at(shortest, assembly.triangles, lengths)
    np.minimum.at(shortest, np.roll(assembly.triangles, -1, axis=1), lengths)
    return shortest


def _fill_row(
    wedges: Wedges, row: int, mesh: FaceMesh, copies: Ints, assembly: Assembly, shortest: float
) -> None:
    surface = mesh.surface
    if surface.kind == "sphere":
        outward = (assembly.points[wedges.vertices[row]] - surface.frame[0]) / surface.parameters[0]
        outward /= np.linalg.norm(outward)
        left_handed = float(np.linalg.det(surface.frame[1:])) < 0  # then Su x Sv points to the centre
        inward = surface.reversed != left_handed
        normal = -outward if inward else outward
        wedges.curvatures[row] = (1.0 if inward else -1.0) / surface.parameters[0]
    else:
        limit = None if surface.kind == "cone" else _limit(surface, mesh, copies)
        if limit is not None and float(np.abs(limit[1]).max()) * shortest > UNSEEN:
            limit = None
        wedges.singular[row] = limit is None
        if limit is None:
            normal = _mesh_normal(assembly, mesh.index, int(wedges.vertices[row]))
            wedges.curvatures[row] = 0.0
        else:
            normal, wedges.curvatures[row] = limit
    wedges.normals[row] = normal
    wedges.directions[row] = tangent_frame(normal)


def _limit(surface: FaceSurface, mesh: FaceMesh, copies: Ints) -> tuple[Vectors, Floats] | None:
    """Return normal and curvatures as the point is approached from inside, or None where they differ."""
    uv = mesh.uv[copies]
    if not np.isfinite(uv).all():
        return None
    near = uv + 1e-4 * (np.median(mesh.uv, axis=0) - uv)
    with np.errstate(all="ignore"):
        values = surface.derivatives(near)
        normals = unit_normals(values, reversed=surface.reversed)
        curvatures, _ = principal_curvatures(values, normals)
    mean = normals.mean(axis=0)
    length = float(np.linalg.norm(mean))
    if not (length > 1.0 - AGREEMENT and np.isfinite(curvatures).all()):
        return None
    return mean / length, np.median(curvatures, axis=0)


def _mesh_normal(assembly: Assembly, face: int, vertex: int) -> Vectors:
    """Return the normal of the face's triangles round a vertex, weighted by their angles, as a stand-in."""
    rows = np.flatnonzero((assembly.face_ids == face) & (assembly.triangles == vertex).any(axis=1))
    triangles = assembly.triangles[rows]
    place = (triangles == vertex).argmax(axis=1)
    pick = np.arange(len(rows))
    here = assembly.points[vertex]
    first = assembly.points[triangles[pick, (place + 1) % 3]] - here
    second = assembly.points[triangles[pick, (place + 2) % 3]] - here
    crosses = np.cross(first, second)
    lengths = np.linalg.norm(crosses, axis=1)
    angles = np.arctan2(lengths, np.einsum("ni,ni->n", first, second))
    total = (crosses * (angles / np.where(lengths > 0, lengths, 1.0))[:, None]).sum(axis=0)
    length = float(np.linalg.norm(total))
    return total / length if length > 0 else np.array([0.0, 0.0, 1.0])


def tangent_frame(normal: Vectors) -> Floats:
    """Return two unit vectors (2, 3) that span the plane across a unit normal."""
    axis = np.zeros(3)
    axis[int(np.argmin(np.abs(normal)))] = 1.0
    first = np.cross(normal, axis)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(normal, first)])
