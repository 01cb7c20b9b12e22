"""The points a correlated field is sampled on: the nodes of the smooth patches of a part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cadskin.shape.patches import smooth_patches

if TYPE_CHECKING:
    from cadskin._typing import Ints, Points, Triangles, Vectors
    from cadskin.shape import Feature, NominalModel

__all__ = ["PatchPoints", "patch_points"]

_FLAT = 1e-9  # thickness over extent below which a patch counts as a plane


@dataclass(frozen=True, eq=False)
class PatchPoints:
    """One smooth patch.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    normals : (n, 3) float
    triangles : (m, 3) int
        In rows of ``points``.
    samples : (k,) int
        Feature samples on the patch.
    point_of_sample : (k,) int
        Row of ``points`` for each of them.
    """

    points: Points
    normals: Vectors
    triangles: Triangles
    samples: Ints
    point_of_sample: Ints

    @cached_property
    def edge_length(self) -> float:
        """Median edge length [mm]; 0 without triangles."""
        if not len(self.triangles):
            return 0.0
        corners = self.points[self.triangles]
        return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))

    @cached_property
    def area(self) -> float:
        """Area [mm²]."""
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())

    @cached_property
    def principal(self) -> Points:
        """Points in their own principal axes, largest extent first (n, 3) [mm]; the origin is their mean."""
        centred = self.points - self.points.mean(axis=0)
        _, axes = np.linalg.eigh(centred.T @ centred)
        return np.ascontiguousarray(centred @ axes[:, ::-1])

    @cached_property
    def flat(self) -> bool:
        """True where all points lie in one plane."""
        extent = np.ptp(self.principal, axis=0)
        return bool(extent[2] <= _FLAT * max(extent[0], 1e-300) + 1e-9)


def patch_points(nominal: NominalModel, features: Sequence[Feature] | None = None) -> list[PatchPoints]:
    """Return the smooth patches that carry samples of the given features (all by default)."""
    patches = smooth_patches(nominal)
    points, normals = patches.points(nominal), patches.normals(nominal)
    patch_of_sample = patches.patch_of_node[patches.node_of_sample]
    wanted = np.unique(
        patch_of_sample
        if features is None
        else np.concatenate([patch_of_sample[feature.rows] for feature in features])
    )
    node_order, node_bounds = _groups(patches.patch_of_node, patches.n_patches)
    sample_order, sample_bounds = _groups(patch_of_sample, patches.n_patches)
    triangle_order, triangle_bounds = _groups(patches.patch_of_triangle, patches.n_patches)
    local = np.zeros(patches.n_nodes, dtype=np.int64)
    found = []
    for patch in wanted:
        nodes = node_order[node_bounds[patch] : node_bounds[patch + 1]]
        samples = sample_order[sample_bounds[patch] : sample_bounds[patch + 1]]
        triangles = triangle_order[triangle_bounds[patch] : triangle_bounds[patch + 1]]
        local[nodes] = np.arange(len(nodes))
        found.append(
            PatchPoints(
                points=points[nodes],
                normals=normals[nodes],
                triangles=local[patches.triangles[triangles]],
                samples=samples,
                point_of_sample=local[patches.node_of_sample[samples]],
            )
        )
    return found


def _groups(labels: Ints, count: int) -> tuple[Ints, Ints]:
    """Return indices sorted by label, and where each label starts."""
    order = np.argsort(labels, kind="stable")
    return order, np.searchsorted(labels[order], np.arange(count + 1))
