"""The points a correlated field is sampled on: the nodes of the smooth patches of a part."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from cadskin.errors import CadskinWarning, DeviationError
from cadskin.shape.patches import smooth_patches

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Triangles, Vectors
    from cadskin.shape import Feature, NominalModel

__all__ = ["PatchPoints", "check_triangles", "is_thin", "patch_points"]

_LOOKERS = 200  # points of a patch that look for an opposite side
_WAYS = 8_000_000  # distances kept while looking for the way along the surface
_DETOUR = 2.5  # way along the surface over distance in space from which on a patch is thin
_FLAT = 1e-9  # thickness over extent below which a patch counts as a plane
_NO_AREA = 1e-12  # doubled area over longest edge squared below which a triangle has no usable shape


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

    def compressed(self, direction: tuple[float, float, float], ratio: float) -> PatchPoints:
        """Return a copy whose extent along a direction is divided by ``ratio``."""
        axis = np.array(direction) / np.linalg.norm(direction)
        points = self.points + np.outer(self.points @ axis * (1.0 / ratio - 1.0), axis)
        return replace(self, points=points)

    @cached_property
    def edge_length(self) -> float:
        """Median edge length [mm]; 0 without triangles."""
        if not len(self.triangles):
            return 0.0
        a, b, c = (self.points[self.triangles[:, k]] for k in range(3))
        squares = [np.einsum("ij,ij->i", side, side) for side in (b - a, c - b, a - c)]
        return float(np.sqrt(np.median(np.concatenate(squares))))

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


def check_triangles(patch: PatchPoints, owner: object) -> None:
    """Refuse points without triangles and triangles without area.

    Raises
    ------
    DeviationError
        The message says where, and what to do.
    """
    corners = patch.points[patch.triangles]
    sides = corners - np.roll(corners, 1, axis=1)
    doubled = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    longest = np.einsum("tki,tki->tk", sides, sides).max(axis=1, initial=0.0)
    flat = np.flatnonzero(~(doubled > _NO_AREA * longest))
    loose = np.flatnonzero(np.bincount(patch.triangles.ravel(), minlength=len(patch.points)) == 0)
    for bad, where, what in (
        (flat, corners[flat, 0], "a triangle without area"),
        (loose, patch.points[loose], "a point without triangles"),
    ):
        if len(bad):
            x, y, z = where[0]
            raise DeviationError(
                f"{type(owner).__name__}: there is {what} at ({x:.6g}, {y:.6g}, {z:.6g}) mm ({len(bad)} on "
                "this patch); mesh the part again with another edge length, or restrict the model to other "
                "faces with .on(...)"
            )


def _tell_of_pieces(features: Sequence[Feature], patch_of_sample: Ints) -> None:
    """Warn of a feature whose mesh is not connected: its pieces know nothing of each other."""
    for feature in features:
        pieces = patch_of_sample[feature.rows]
        if len(pieces) and pieces.min() != pieces.max():
            warnings.warn(
                f"{feature.name} is not connected, it has {len(np.unique(pieces))} pieces: random fields and "
                "modes are independent on each of them; make them features of their own to tell them apart",
                CadskinWarning,
                stacklevel=4,
            )


def patch_points(nominal: NominalModel, features: Sequence[Feature] | None = None) -> list[PatchPoints]:
    """Return the smooth patches that carry samples of the given features (all by default).

    Warns
    -----
    CadskinWarning
        A feature is not connected.
    """
    patches = smooth_patches(nominal)
    points, normals = patches.points(nominal), patches.normals(nominal)
    patch_of_sample = patches.patch_of_node[patches.node_of_sample]
    _tell_of_pieces(nominal.features if features is None else features, patch_of_sample)
    touched = np.zeros(patches.n_patches, dtype=bool)
    for rows in [slice(None)] if features is None else [feature.rows for feature in features]:
        touched[patch_of_sample[rows]] = True
    node_order, node_bounds = _groups(patches.patch_of_node, patches.n_patches)
    sample_order, sample_bounds = _groups(patch_of_sample, patches.n_patches)
    triangle_order, triangle_bounds = _groups(patches.patch_of_triangle, patches.n_patches)
    local = np.zeros(patches.n_nodes, dtype=np.int64)
    found = []
    for patch in np.flatnonzero(touched):
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


def is_thin(patch: PatchPoints, length: float) -> bool:
    """Return whether two sides of a patch are near in space, within a length, but far along the surface.

    Some points spread over the patch look for the nearest point with a normal turned away; the way along the
    mesh edges decides. The two sides of a shaft are no case (the way round is pi/2 times the distance).
    """
    if patch.flat:
        return False
    chosen = np.unique(np.linspace(0, len(patch.points) - 1, _LOOKERS).astype(np.int64))
    opposite, distance = _opposite_points(patch, chosen, length)
    near = np.flatnonzero(distance < length)
    if not len(near):
        return False
    near = near[
        np.unique(np.linspace(0, len(near) - 1, max(1, min(64, _WAYS // len(patch.points)))).astype(int))
    ]
    sides = patch.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    steps = np.linalg.norm(patch.points[sides[:, 0]] - patch.points[sides[:, 1]], axis=1)
    edges, first = np.unique(np.sort(sides, axis=1), axis=0, return_index=True)
    graph = coo_array((steps[first], (edges[:, 0], edges[:, 1])), shape=(len(patch.points),) * 2).tocsr()
    limit = _DETOUR * float(distance[near].max())
    ways = dijkstra(graph, directed=False, indices=chosen[near], limit=limit)
    way = ways[np.arange(len(near)), opposite[near]]
    return bool((way > _DETOUR * distance[near]).any())


def _opposite_points(patch: PatchPoints, chosen: Ints, length: float) -> tuple[Ints, Floats]:
    """Nearest point with a normal turned away from that of each chosen point, its distance (inf: none)."""
    tree = cKDTree(patch.points)
    nearest = np.zeros(len(chosen), dtype=np.int64)
    distance = np.full(len(chosen), np.inf)
    for k, i in enumerate(chosen):
        around = np.array(tree.query_ball_point(patch.points[i], length), dtype=np.int64)
        away = around[patch.normals[around] @ patch.normals[i] < -0.3]
        if len(away):
            step = np.linalg.norm(patch.points[away] - patch.points[i], axis=1)
            nearest[k], distance[k] = away[np.argmin(step)], step.min()
    return nearest, distance


def _groups(labels: Ints, count: int) -> tuple[Ints, Ints]:
    """Return indices sorted by label, and where each label starts."""
    order = np.argsort(labels, kind="stable")
    return order, np.searchsorted(labels[order], np.arange(count + 1))
