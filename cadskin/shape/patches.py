"""Smooth patches: features that meet tangentially (a fillet and its plane) carry one continuous field.

Samples that sit at one vertex and whose normals agree are one *node*; nodes joined by triangles are one
*patch*. A sharp edge, and the gap between the two sides of a thin wall, part the patches.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cadskin._arrays import frozen

if TYPE_CHECKING:
    from cadskin._typing import Bools, Ints, Points, Triangles, Vectors
    from cadskin.shape.nominal import NominalModel

__all__ = ["TANGENT_ANGLE", "SmoothPatches", "smooth_patches"]

TANGENT_ANGLE = float(np.deg2rad(10.0))
"""Features whose normals differ by less than this angle [rad] at a common vertex meet tangentially there.

CAD systems call an edge smooth below about 1°, and files with loose tolerances reach 2° on fillets. Real
edges of 4° to 9° (a plane that runs into a cylinder) would let two independent fields a and b move their
common edge sideways by |a - b| / (2 sin(angle / 2)), which grows without bound; a made part has no such
step. The weld uses this angle too.
"""


@dataclass(frozen=True, eq=False)
class SmoothPatches:
    """Nodes and patches of a nominal model.

    Parameters
    ----------
    node_of_sample : (n_c,) int
        Node of each feature sample; ``field[node_of_sample]`` spreads a node field to the samples.
    vertex_of_node : (n_nodes,) int
    patch_of_node : (n_nodes,) int
    triangles : (m, 3) int
        The triangles of the discrete shape, in nodes.
    patch_of_triangle : (m,) int
    n_patches : int
    """

    node_of_sample: Ints
    vertex_of_node: Ints
    patch_of_node: Ints
    triangles: Triangles
    patch_of_triangle: Ints
    n_patches: int

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.vertex_of_node)

    def points(self, nominal: NominalModel) -> Points:
        """Nominal position of the nodes (n_nodes, 3) [mm]."""
        return nominal.surface.points[self.vertex_of_node]

    def normals(self, nominal: NominalModel) -> Vectors:
        """Mean unit normal of the samples of each node (n_nodes, 3)."""
        total = np.stack(
            [
                np.bincount(
                    self.node_of_sample, weights=nominal.samples.normals[:, k], minlength=self.n_nodes
                )
                for k in range(3)
            ],
            axis=1,
        )
        return np.asarray(total / np.linalg.norm(total, axis=1, keepdims=True), dtype=np.float64)


_CACHE: WeakKeyDictionary[NominalModel, dict[float, SmoothPatches]] = WeakKeyDictionary()


def smooth_patches(nominal: NominalModel, *, angle: float = TANGENT_ANGLE) -> SmoothPatches:
    """Return the nodes and smooth patches of a nominal model (kept as long as the model lives).

    Parameters
    ----------
    nominal : NominalModel
    angle : float
        Largest angle between normals that still counts as tangent [rad].

    Examples
    --------
    A box has six patches, one per face; a fillet joins its two neighbours to one.
    """
    known = _CACHE.setdefault(nominal, {})
    if angle not in known:
        known[angle] = _smooth_patches(nominal, angle)
    return known[angle]


def _smooth_patches(nominal: NominalModel, angle: float) -> SmoothPatches:
    samples = nominal.samples
    node_of_sample = _merge_tangent(samples.vertex_ids, samples.normals, samples.singular, np.cos(angle))
    n_nodes = int(node_of_sample.max(initial=-1)) + 1
    vertex_of_node = np.zeros(n_nodes, dtype=np.int64)
    vertex_of_node[node_of_sample] = samples.vertex_ids
    triangles = node_of_sample[nominal.corner_samples]
    a, b, c = triangles.T
    graph = coo_array(
        (np.ones(2 * len(triangles), dtype=np.int8), (np.concatenate([a, b]), np.concatenate([b, c]))),
        shape=(n_nodes, n_nodes),
    )
    n_patches, patch_of_node = connected_components(graph, directed=False)
    patch_of_node = patch_of_node.astype(np.int64)
    return SmoothPatches(
        node_of_sample=frozen(node_of_sample, dtype=np.int64),
        vertex_of_node=frozen(vertex_of_node, dtype=np.int64),
        patch_of_node=frozen(patch_of_node, dtype=np.int64),
        triangles=frozen(triangles, dtype=np.int64),
        patch_of_triangle=frozen(patch_of_node[triangles[:, 0]] if len(triangles) else [], dtype=np.int64),
        n_patches=int(n_patches),
    )


@lru_cache(maxsize=64)
def _pairs(count: int) -> tuple[Ints, Ints]:
    """All pairs i < j of ``count`` things."""
    i, j = np.triu_indices(count, 1)
    return i.astype(np.int64), j.astype(np.int64)


def _merge_tangent(vertex_ids: Ints, normals: Vectors, singular: Bools, cosine: float) -> Ints:
    """Node of each sample: samples of one vertex whose normals agree are one node."""
    n = len(vertex_ids)
    order = np.argsort(vertex_ids, kind="stable")
    first = np.flatnonzero(np.diff(vertex_ids[order], prepend=-1))
    counts = np.diff(np.append(first, n))
    rows, columns = [np.zeros(0, dtype=np.int64)], [np.zeros(0, dtype=np.int64)]
    for count in np.unique(counts[counts > 1]):
        starts = first[counts == count]
        i, j = _pairs(int(count))
        left = order[(starts[:, None] + i).ravel()]
        right = order[(starts[:, None] + j).ravel()]
        agree = np.einsum("ij,ij->i", normals[left], normals[right]) >= cosine
        agree &= ~(singular[left] | singular[right])
        rows.append(left[agree])
        columns.append(right[agree])
    i, j = np.concatenate(rows), np.concatenate(columns)
    graph = coo_array((np.ones(len(i), dtype=np.int8), (i, j)), shape=(n, n))
    nodes: Ints = connected_components(graph, directed=False)[1].astype(np.int64)
    return nodes
