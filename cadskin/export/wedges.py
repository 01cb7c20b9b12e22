"""Wedges: a vertex as one feature sees it, so that colours and normals stop at sharp edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cadskin._typing import Floats, Ints, Points, Triangles, Vectors
from cadskin.export.content import Content
from cadskin.shape import vertex_normals

__all__ = ["Wedges", "wedge_normals", "wedges_of"]


@dataclass(frozen=True, eq=False)
class Wedges:
    """One row per (feature, vertex); for a shape without features per (B-rep face, vertex).

    Parameters
    ----------
    corners : (m, 3) int
        Row of each triangle corner.
    vertex_ids : (r,) int
        Vertex of each row.
    deviation : (r,) float or None
        Deviation of each row [mm].
    """

    corners: Triangles
    vertex_ids: Ints
    deviation: Floats | None = None


def wedges_of(content: Content) -> Wedges:
    """Return the wedges of a shape; those of a nominal model are its feature samples, in their order."""
    if content.nominal is not None:
        nominal = content.nominal
        return Wedges(nominal.corner_samples, nominal.samples.vertex_ids, content.deviation)
    base = np.int64(content.surface.n_points)
    keys = content.surface.face_ids[:, None] * base + content.triangles
    rows, corners = np.unique(keys, return_inverse=True)
    return Wedges(corners.reshape(-1, 3), rows % base)


def wedge_normals(content: Content, wedges: Wedges, points: Points) -> Vectors:
    """Return unit normals (r, 3) of the wedges when the vertices stand at ``points`` (n, 3).

    With a nominal model they are the exact CAD normals, turned by what the displacement does to the mesh
    normals: tangent faces shade without a seam, and the deviation shows.
    """
    mesh_normals = vertex_normals(points[wedges.vertex_ids], wedges.corners)
    if content.nominal is None:
        return mesh_normals
    ideal_points = content.nominal.surface.points
    exact = content.nominal.samples.normals
    if points is ideal_points:
        return exact
    turned = exact + mesh_normals - vertex_normals(ideal_points[wedges.vertex_ids], wedges.corners)
    length = np.linalg.norm(turned, axis=1, keepdims=True)
    return np.asarray(np.where(length > 1e-6, turned / np.maximum(length, 1e-6), exact))
