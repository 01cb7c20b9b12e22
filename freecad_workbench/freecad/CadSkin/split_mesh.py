"""One vertex per pair of mesh vertex and B-rep face, so that colours end at the edges. numpy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

__all__ = ["SplitMesh", "split_mesh", "vertex_normals"]


@dataclass(frozen=True, eq=False)
class SplitMesh:
    """A mesh whose vertices are split along the edges of the B-rep.

    Parameters
    ----------
    vertex_ids : (k,) int64
        The mesh vertex of each split vertex; the first n are the mesh vertices themselves.
    triangles : (m, 3) int32
        Split vertices of each triangle.
    border : (b, 2) int32
        Mesh edges between triangles of two faces, as split vertices.
    """

    vertex_ids: np.ndarray
    triangles: np.ndarray
    border: np.ndarray

    @property
    def n_vertices(self) -> int:
        """Number of split vertices."""
        return len(self.vertex_ids)

    def values(self, corner_values: np.ndarray) -> np.ndarray:
        """Return one value (k,) per split vertex from the values (m, 3) at the triangles' corners."""
        values = np.zeros(self.n_vertices, dtype=np.float32)
        values[self.triangles.ravel()] = corner_values.ravel()
        return values


def split_mesh(triangles: np.ndarray, triangle_face: np.ndarray, n_points: int) -> SplitMesh:
    """Split the vertices of a mesh where faces meet.

    Each vertex stays with one of its faces; only the corners that belong to another one are sorted, so the
    cost is that of the edges and not that of the mesh.
    """
    corners = triangles.ravel().astype(np.int64)
    corner_face = np.repeat(triangle_face.astype(np.int64), 3)
    owner = np.zeros(n_points, dtype=np.int64)
    owner[corners] = corner_face
    foreign = np.flatnonzero(owner[corners] != corner_face)
    n_faces = int(triangle_face.max(initial=0)) + 1
    pairs, place = np.unique(corners[foreign] * n_faces + corner_face[foreign], return_inverse=True)
    split = corners.copy()
    split[foreign] = n_points + place
    vertex_ids = np.concatenate([np.arange(n_points), pairs // n_faces])
    split_triangles = split.reshape(-1, 3).astype(np.int32)
    on_border = np.zeros(n_points, dtype=bool)
    on_border[pairs // n_faces] = True
    return SplitMesh(vertex_ids, split_triangles, _border_edges(triangles, triangle_face, on_border))


def _border_edges(triangles: np.ndarray, triangle_face: np.ndarray, on_border: np.ndarray) -> np.ndarray:
    """Return the mesh edges (b, 2) whose two triangles lie on different faces."""
    touching = on_border[triangles]
    firsts, seconds, faces = [], [], []
    for start, end in ((0, 1), (1, 2), (2, 0)):
        chosen = touching[:, start] & touching[:, end]
        firsts.append(triangles[chosen, start])
        seconds.append(triangles[chosen, end])
        faces.append(triangle_face[chosen])
    if not sum(map(len, firsts)):
        return np.zeros((0, 2), dtype=np.int32)
    ends = np.sort(np.stack([np.concatenate(firsts), np.concatenate(seconds)], axis=1), axis=1)
    face = np.concatenate(faces)
    order = np.lexsort((face, ends[:, 1], ends[:, 0]))
    ends, face = ends[order], face[order]
    same_edge = (ends[1:] == ends[:-1]).all(axis=1)
    return ends[1:][same_edge & (face[1:] != face[:-1])].astype(np.int32)


def vertex_normals(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the area-weighted unit normals (k, 3) float32 at the vertices of a (split) mesh."""
    points = np.ascontiguousarray(points, dtype=np.float32)
    first, second, third = (points[triangles[:, k]] for k in range(3))
    normals = np.cross(second - first, third - first)
    corners = triangles.ravel()
    summed = np.stack(
        [np.bincount(corners, np.repeat(normals[:, k], 3), minlength=len(points)) for k in range(3)], axis=1
    ).astype(np.float32)
    length = np.sqrt((summed**2).sum(axis=1, keepdims=True))
    return np.divide(summed, length, out=np.zeros_like(summed), where=length > 0.0)
