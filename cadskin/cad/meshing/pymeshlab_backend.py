"""Isotropic remeshing by pymeshlab: for meshes that have no CAD, and as a second opinion for those that have.

It knows nothing of faces: labels are carried over from the nearest triangle of the mesh it started from, so
at tangent edges (fillets) they follow the triangles and not the edge.
"""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np
from scipy.spatial import cKDTree

from cadskin._typing import Floats, Ints, Points, Triangles
from cadskin.cad.meshing.build import Part
from cadskin.cad.meshing.domain import project_onto
from cadskin.cad.meshing.foreign import ForeignMesh, labelled_from
from cadskin.cad.meshing.result import LabelledMesh
from cadskin.errors import GeometryError, MeshingError, MissingDependencyError

__all__ = ["mesh_with_pymeshlab", "remesh_triangles"]

ITERATIONS = 10
NEIGHBOURS = 8


def remesh_triangles(
    points: Points, triangles: Triangles, *, edge_length: float, feature_angle: float = 0.5235987755982988
) -> tuple[Points, Triangles, Ints]:
    """Remesh a triangle mesh to one edge length (isotropic, edges of the shape kept).

    Parameters
    ----------
    points : (n, 3) float
        Vertices [mm].
    triangles : (m, 3) int
    edge_length : float
        Wanted edge length [mm].
    feature_angle : float
        Edges sharper than this stay [rad].

    Returns
    -------
    points : (k, 3) float
    triangles : (l, 3) int
    source : (l,) int
        For each new triangle the nearest old one, so that labels can be carried over.

    Raises
    ------
    GeometryError
        An edge length that is not positive and finite.
    MissingDependencyError
        pymeshlab is not installed.
    MeshingError
        Nothing was left.

    References
    ----------
    M. Botsch, L. Kobbelt, "A remeshing approach to multiresolution modeling", SGP 2004,
    doi:10.1145/1057432.1057457.
    """
    if not (np.isfinite(edge_length) and edge_length > 0):
        raise GeometryError(f"edge_length must be positive and finite, got {edge_length}")
    if find_spec("pymeshlab") is None:
        raise MissingDependencyError('remeshing needs pymeshlab: pip install "cadskin[pymeshlab]"')
    import pymeshlab

    work = pymeshlab.MeshSet()
    work.add_mesh(pymeshlab.Mesh(np.asarray(points, dtype=np.float64), np.asarray(triangles, dtype=np.int32)))
    work.meshing_isotropic_explicit_remeshing(
        iterations=ITERATIONS,
        targetlen=pymeshlab.PureValue(float(edge_length)),
        featuredeg=float(np.degrees(feature_angle)),
    )
    result = work.current_mesh()
    new_points = np.array(result.vertex_matrix(), dtype=np.float64)
    new_triangles = np.array(result.face_matrix(), dtype=np.int64)
    if not len(new_triangles):
        raise MeshingError(f"remeshing to {edge_length:g} mm left no triangles; use a smaller edge length")
    return new_points, new_triangles, nearest_triangles(new_points[new_triangles], points[triangles])


def nearest_triangles(corners: Floats, source_corners: Floats) -> Ints:
    """Return for each triangle (l, 3, 3) the source triangle that is nearest and turned alike."""
    middles, source_middles = corners.mean(axis=1), source_corners.mean(axis=1)
    count = min(NEIGHBOURS, len(source_middles))
    _, candidates = cKDTree(source_middles).query(middles, k=count)
    candidates = candidates.reshape(len(middles), count)
    normals, source_normals = _units(corners), _units(source_corners)
    offset = middles[:, None] - source_middles[candidates]
    across = np.abs(np.einsum("nki,nki->nk", offset, source_normals[candidates]))
    size = np.sqrt(np.linalg.norm(offset, axis=2).min(axis=1, keepdims=True) ** 2 + 1e-300)
    turned = 1.0 - np.einsum("ni,nki->nk", normals, source_normals[candidates])
    cost = np.linalg.norm(offset, axis=2) + 4.0 * across + 4.0 * size * turned
    return np.asarray(candidates[np.arange(len(middles)), cost.argmin(axis=1)], dtype=np.int64)


def _units(corners: Floats) -> Floats:
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(crosses, axis=1, keepdims=True)
    return np.asarray(crosses / np.where(lengths > 0, lengths, 1.0))


def mesh_with_pymeshlab(part: Part, source: LabelledMesh, edge_length: float) -> LabelledMesh:
    """Remesh a labelled mesh isotropically; inner vertices are put back onto their CAD face.

    Raises
    ------
    MissingDependencyError
        pymeshlab is not installed.
    """
    points, triangles, nearest = remesh_triangles(source.points, source.triangles, edge_length=edge_length)
    face_ids = source.face_ids[nearest]
    low, high = np.full(len(points), len(part.surfaces)), np.full(len(points), -1)
    np.minimum.at(low, triangles, face_ids[:, None])
    np.maximum.at(high, triangles, face_ids[:, None])
    pairs, parameters = [np.zeros((0, 2), dtype=np.int64)], [np.zeros((0, 2))]
    for face, surface in enumerate(part.surfaces):
        inner = np.flatnonzero((low == face) & (high == face))
        uv, miss = np.full((len(inner), 2), np.nan), np.full(len(inner), np.inf)
        project_onto(surface, points[inner], uv, miss, np.arange(len(inner)))
        near = miss < 0.5 * edge_length
        points[inner[near]] = surface.points(uv[near])
        pairs.append(np.stack([np.full(int(near.sum()), face), inner[near]], axis=1))
        parameters.append(uv[near])
    mesh = ForeignMesh(points, triangles, face_ids, np.concatenate(pairs), np.concatenate(parameters))
    return labelled_from(
        part, mesh, ["remeshed by pymeshlab: labels come from the nearest triangle, not from the edges"]
    )
