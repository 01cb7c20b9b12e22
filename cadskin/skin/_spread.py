"""Spread of the shift of edges and corners: harmonic along the edges, then harmonic into the faces.

A corner that moves along an edge drags the vertices of that edge; an edge that moves along a face drags the
vertices of that face. Both are discrete harmonic extensions: along an edge with weights 1 / length, on a face
with cotangent weights, for which the flat nominal mesh itself is harmonic. A face whose edges all move by a
linear map is mapped by it, and on a plane face no triangle turns over while its outline stays convex [1]_.

References
----------
.. [1] M. S. Floater, "One-to-one piecewise linear mappings over triangulations", Math. Comp. 72 (2003),
   685-696, doi:10.1090/S0025-5718-02-01466-7.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array, csr_array
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from cadskin.shape.check import edge_table

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Triangles, Vectors
    from cadskin.shape import NominalModel

__all__ = ["Spread", "edge_spread", "face_spread"]

_SMALLEST_COTANGENT = 0.02  # keeps the weights of obtuse triangles positive


@dataclass(frozen=True, eq=False)
class Spread:
    """A harmonic extension, factorised once.

    Parameters
    ----------
    vertices : (f,) int
        Vertices that follow.
    pull : (3f, 3n) sparse
        Displacements of the vertices that lead, weighted, on the right-hand side.
    factors : SuperLU or None
        Of the Laplacian (f, f); None where nothing follows.
    free : (f, 3, 3) float
        Projector on the directions in which each vertex may follow.
    """

    vertices: Ints
    pull: csr_array
    factors: Any
    free: Floats

    def apply(self, displacement: Vectors) -> None:
        """Add the spread of ``displacement`` (n, 3) to its own rows that follow."""
        if self.factors is None:
            return
        pulled = self.pull @ displacement.ravel()
        if not pulled.any():
            return
        follow = self.factors.solve(pulled.reshape(-1, 3))
        displacement[self.vertices] += np.einsum("fij,fj->fi", self.free, follow)


def edge_spread(nominal: NominalModel, rank: Ints, free: Floats) -> Spread:
    """Return the spread from corners (rank 3) along edges (rank 2)."""
    surface = nominal.surface
    table = edge_table(surface.triangles)
    feature_of_face = np.zeros(len(nominal.faces), dtype=np.int64)
    for feature in nominal.features:
        feature_of_face[list(feature.face_indices)] = feature.id
    feature_of_triangle = feature_of_face[surface.face_ids]
    one, two = table.triangles.T
    crease = (table.count == 2) & (feature_of_triangle[one] != feature_of_triangle[two])
    ends = table.vertices[crease & (rank[table.vertices] >= 2).all(axis=1)]
    side = surface.points[ends[:, 1]] - surface.points[ends[:, 0]]
    length = np.linalg.norm(side, axis=1)
    ends, side, length = ends[length > 0], side[length > 0], length[length > 0]
    along = np.einsum("ei,ej->eij", side, side) / (length**2)[:, None, None]
    leader = np.concatenate([ends[:, 0], ends[:, 1]])
    follower = np.concatenate([ends[:, 1], ends[:, 0]])
    weight = np.concatenate([1.0 / length] * 2)
    return _factorised(leader, follower, weight, np.concatenate([along] * 2), rank == 2, rank >= 3, free)


def face_spread(nominal: NominalModel, rank: Ints, free: Floats) -> Spread:
    """Return the spread from edges and corners (rank 2 and 3) into the faces (rank 1)."""
    triangles = nominal.surface.triangles
    cotangents = _cotangents(nominal.surface.points, triangles)
    follows, leads = rank == 1, rank >= 2
    parts = []
    for k in range(3):
        for a, b in (((k + 1) % 3, (k + 2) % 3), ((k + 2) % 3, (k + 1) % 3)):
            wanted = follows[triangles[:, b]]
            rows = nominal.corner_samples[wanted, a]
            parts.append((triangles[wanted, a], triangles[wanted, b], cotangents[wanted, k], rows))
    leader, follower, weight, rows = (np.concatenate(p) for p in zip(*parts, strict=True))
    normals = nominal.samples.normals[rows]
    in_face = np.where(
        leads[leader][:, None, None], np.eye(3) - normals[:, :, None] * normals[:, None, :], 0.0
    )
    return _factorised(leader, follower, weight, in_face, follows, leads, free)


def _factorised(
    leader: Ints, follower: Ints, weight: Floats, blocks: Floats, follows: Bools, leads: Bools, free: Floats
) -> Spread:
    """Assemble and factorise ``sum_w weight (u_v - u_w) = 0`` at the vertices that hang on one that leads."""
    follows = _pulled(leader, follower, follows, leads)
    vertices = np.flatnonzero(follows)
    n, size = len(follows), len(vertices)
    if not size:
        return Spread(vertices, csr_array((0, 3 * n)), None, free[vertices])
    local = np.full(n, -1, dtype=np.int64)
    local[vertices] = np.arange(size)
    active = follows[follower] & (follows[leader] | leads[leader])
    leader, weight, blocks = leader[active], weight[active], blocks[active]
    row = local[follower[active]]
    inside = follows[leader]
    diagonal = np.bincount(row, weights=weight, minlength=size)
    matrix = coo_array(
        (
            np.concatenate([-weight[inside], diagonal]),
            (
                np.concatenate([row[inside], np.arange(size)]),
                np.concatenate([local[leader[inside]], np.arange(size)]),
            ),
        ),
        shape=(size, size),
    )
    outside = ~inside
    values = weight[outside, None, None] * blocks[outside]
    shape = values.shape
    pull = coo_array(
        (
            values.ravel(),
            (
                np.broadcast_to(3 * row[outside, None, None] + np.arange(3)[:, None], shape).ravel(),
                np.broadcast_to(3 * leader[outside, None, None] + np.arange(3), shape).ravel(),
            ),
        ),
        shape=(3 * size, 3 * n),
    ).tocsr()
    factors = splu(
        matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    return Spread(vertices, pull, factors, free[vertices])


def _pulled(leader: Ints, follower: Ints, follows: Bools, leads: Bools) -> Bools:
    """Vertices that follow and whose connected piece touches one that leads (a sphere has none)."""
    n = len(follows)
    link = follows[follower] & follows[leader]
    graph = coo_array((np.ones(int(link.sum()), dtype=np.int8), (leader[link], follower[link])), shape=(n, n))
    piece = connected_components(graph, directed=False)[1]
    has_leader = np.zeros(n, dtype=bool)
    has_leader[piece[follower[follows[follower] & leads[leader]]]] = True
    return np.asarray(follows & has_leader[piece], dtype=np.bool_)


def _cotangents(points: Vectors, triangles: Triangles) -> Floats:
    """Half the cotangent of the angle at each corner (m, 3), kept positive."""
    corners = points[triangles]
    ahead = np.roll(corners, -1, axis=1) - corners
    back = np.roll(corners, -2, axis=1) - corners
    cosine = (ahead * back).sum(axis=2)
    sine = np.linalg.norm(np.cross(ahead, back), axis=2)
    return np.asarray(0.5 * np.clip(cosine / np.where(sine > 0, sine, np.inf), _SMALLEST_COTANGENT, 50.0))
