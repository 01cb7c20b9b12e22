"""What the deviations at one vertex ask of its displacement: ``n_f . d = delta_f`` for each feature."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array, csr_array

from cadskin.shape.discrete import triangle_normals
from cadskin.shape.patches import TANGENT_ANGLE

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Vectors
    from cadskin.shape import NominalModel

__all__ = ["VertexConstraints", "constraint_vectors", "vertex_constraints"]

_MAX_STRETCH = 4.0  # an apex moves at most this many times its deviation


@dataclass(frozen=True, eq=False)
class VertexConstraints:
    """The equations of all vertices, solved once.

    Parameters
    ----------
    particular : (3n, n_c) sparse
        Deviations to the least-norm displacements.
    equations : (n_c, 3n) sparse
        Displacements to the realised deviations.
    free : (n, 3, 3) float
        Projector on the directions that no equation holds: the tangent plane inside of a face, the tangent of
        an edge, nothing at a corner.
    rank : (n,) int
        Independent equations of each vertex: 1 inside of a face, 2 at an edge, 3 at a corner.
    shared : (n_c,) bool
        Samples that share their deviation with a tangent feature.
    overdetermined : (n_c,) bool
        Samples at vertices with more independent features than can be satisfied.
    """

    particular: csr_array
    equations: csr_array
    free: Floats
    rank: Ints
    shared: Bools
    overdetermined: Bools


def constraint_vectors(nominal: NominalModel) -> Vectors:
    """Return the vector c (n_c, 3) of each sample with ``c . d = delta``.

    It is the exact unit normal; at a singular sample (the apex of a cone), which has none, it is the vector
    that moves the apex as an offset of the triangles around it does.
    """
    samples = nominal.samples
    vectors = samples.normals.copy()
    if not samples.singular.any():
        return vectors
    surface = nominal.surface
    for row in np.flatnonzero(samples.singular):  # a handful: apexes
        star = (nominal.corner_samples == row).any(axis=1)
        normals = triangle_normals(surface.points, surface.triangles[star])
        move = np.linalg.lstsq(normals, np.ones(len(normals)), rcond=0.1)[0]
        length = float(np.linalg.norm(move))
        if length > 0:
            vectors[row] = move / (length * min(length, _MAX_STRETCH))
    return vectors


def vertex_constraints(nominal: NominalModel, *, shared_angle: float = TANGENT_ANGLE) -> VertexConstraints:
    """Solve the equations of all vertices, together for those with the same number of features."""
    samples, n = nominal.samples, nominal.surface.n_points
    vectors = constraint_vectors(nominal)
    free = np.tile(np.eye(3), (n, 1, 1))
    rank = np.zeros(n, dtype=np.int64)
    shared = np.zeros(len(samples), dtype=bool)
    overdetermined = np.zeros(len(samples), dtype=bool)
    entries: list[tuple[Floats, Ints, Ints]] = []
    order = np.argsort(samples.vertex_ids, kind="stable")
    first = np.flatnonzero(np.diff(samples.vertex_ids[order], prepend=-1))
    counts = np.diff(np.append(first, len(order)))
    for count in np.unique(counts):
        rows = order[first[counts == count][:, None] + np.arange(count)]
        vertices = samples.vertex_ids[rows[:, 0]]
        averages, group_sizes = _tangent_groups(vectors[rows], np.cos(shared_angle))
        solution, kept = _least_norm(
            vectors[rows], averages, group_sizes, np.sqrt(2) * np.sin(shared_angle / 2)
        )
        free[vertices] -= np.einsum("gki,gkj->gij", kept, kept)
        rank[vertices] = (np.abs(kept).sum(axis=2) > 0).sum(axis=1)
        shared[rows] = group_sizes > 1
        n_groups = (1.0 / group_sizes).sum(axis=1)
        overdetermined[rows] = (n_groups > rank[vertices] + 0.5)[:, None]
        entries.append(_block_entries(solution, vertices, rows))
    return VertexConstraints(
        particular=_from_entries(entries, (3 * n, len(samples))),
        equations=_equations(vectors, samples.vertex_ids, n),
        free=free,
        rank=rank,
        shared=shared,
        overdetermined=overdetermined,
    )


def _tangent_groups(vectors: Vectors, cosine: float) -> tuple[Floats, Ints]:
    """Averages (g, k, k) over the tangent features of each vertex, and the size of each row's group (g, k).

    Tangency is passed on: a and c are in one group when both are tangent to b.
    """
    count = vectors.shape[1]
    if count == 1:
        return np.ones((len(vectors), 1, 1)), np.ones((len(vectors), 1), dtype=np.int64)
    length = np.linalg.norm(vectors, axis=2)
    products = np.einsum("gai,gbi->gab", vectors, vectors) / (length[:, :, None] * length[:, None, :])
    together = products >= cosine
    together |= np.eye(count, dtype=bool)
    for _ in range(int(np.ceil(np.log2(count)))):
        together = np.matmul(together, together)
    sizes = together.sum(axis=2)
    return together / sizes[:, :, None], sizes


def _least_norm(vectors: Vectors, averages: Floats, sizes: Ints, cut: float) -> tuple[Floats, Vectors]:
    """Least-norm solution (g, 3, k) of the averaged equations and its row space (g, min(k, 3), 3).

    Singular values below ``cut`` are left out (three features that are nearly parallel to one line): their
    equations are met in the least-squares sense.
    """
    weighted = averages / np.sqrt(sizes)[:, :, None]  # a group counts once, however many features it has
    left, values, right = np.linalg.svd(np.matmul(weighted, vectors), full_matrices=False)
    keep = values > cut
    inverse = np.where(keep, 1.0 / np.where(keep, values, 1.0), 0.0)
    kept = np.where(keep[:, :, None], right, 0.0)
    solution = np.einsum("gsi,gs,gks,gkl->gil", kept, inverse, left, weighted)
    return solution, kept


def _block_entries(blocks: Floats, vertices: Ints, rows: Ints) -> tuple[Floats, Ints, Ints]:
    """Values, row and column indices of the blocks (g, 3, k) in the particular solution."""
    size = rows.shape[1]
    row = np.repeat((3 * vertices[:, None] + np.arange(3)).ravel(), size)
    column = np.repeat(rows, 3, axis=0).ravel()
    return blocks.ravel(), row, column


def _from_entries(entries: list[tuple[Floats, Ints, Ints]], shape: tuple[int, int]) -> csr_array:
    if not entries:
        return csr_array(shape)
    value, row, column = (np.concatenate(parts) for parts in zip(*entries, strict=True))
    return coo_array((value, (row, column)), shape=shape).tocsr()


def _equations(vectors: Vectors, vertex_ids: Ints, n_points: int) -> csr_array:
    columns = (3 * vertex_ids[:, None] + np.arange(3)).ravel()
    starts = 3 * np.arange(len(vectors) + 1)
    return csr_array((vectors.ravel(), columns, starts), shape=(len(vectors), 3 * n_points))
