"""Faults of a skin model that no weld can avoid: walls passed through, folds, intersections."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from weakref import WeakKeyDictionary

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cadskin._arrays import frozen
from cadskin._jit import kernel
from cadskin.errors import GeometryError
from cadskin.shape.check import inverted_triangles
from cadskin.shape.discrete import triangle_normals
from cadskin.shape.intersections import facing_pairs, near_pairs, pairs_intersect, self_intersections
from cadskin.skin import _messages as messages
from cadskin.skin.weld import weld

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Vectors
    from cadskin.shape import DiscreteShape, NominalModel

__all__ = ["check_skin", "intersecting_pairs", "passed_walls", "past_radius"]

_SPARE = 1.5  # the pairs kept for the next samples allow for moves that are so much longer


@dataclass(frozen=True, eq=False)
class _Kept:
    """What is kept of a nominal mesh between its samples.

    Parameters
    ----------
    piece : (n,) int
        Connected piece of each vertex.
    median_edge : float
        [mm].
    reach, relative_reach : float
        Moves [mm] for which ``pairs`` is complete.
    pairs : (k, 2) int
        Triangles that such moves can bring together.
    """

    piece: Ints
    median_edge: float
    reach: float
    relative_reach: float
    pairs: Ints


_KEPT: WeakKeyDictionary[DiscreteShape, _Kept] = WeakKeyDictionary()


def check_skin(
    nominal: NominalModel,
    deviation: Floats,
    displacement: Vectors | None = None,
    *,
    label: str = "the skin model",
) -> None:
    """Raise if a skin model passes through itself, turns over, loses more than a radius or intersects itself.

    Parameters
    ----------
    nominal : NominalModel
    deviation : (n_c,) float
        [mm].
    displacement : (n, 3) float, optional
        Of the vertices [mm]; the weld of ``deviation`` by default.
    label : str
        What the message calls the skin model.

    Raises
    ------
    GeometryError
        With the features, the place, the deviation and the wall thickness there, and what to do.

    Warns
    -----
    CadskinWarning
        The nominal mesh intersects itself already, for instance because its edges are too long for a thin
        curved wall; these places are left out.
    """
    moved = weld(nominal, deviation) if displacement is None else frozen(displacement)
    surface = nominal.surface
    inverted = inverted_triangles(surface.points + moved, surface.points, surface.triangles)
    crossing = _new_intersections(nominal, moved)
    several_pieces = _kept(surface).piece.max(initial=0) > 0
    if inverted.any() or len(crossing) or several_pieces:
        walls = passed_walls(surface, moved)
        if not (inverted.any() or len(crossing)):
            piece = _kept(surface).piece[surface.triangles[walls][:, :, 0]]
            walls = walls[piece[:, 0] != piece[:, 1]]
        if len(walls):
            raise GeometryError(messages.wall(nominal, deviation, walls, label))
    inverted |= past_radius(nominal, deviation)
    if inverted.any():
        raise GeometryError(messages.fold(nominal, deviation, np.flatnonzero(inverted), label))
    if len(crossing):
        raise GeometryError(messages.crossing(nominal, deviation, crossing, label))


def intersecting_pairs(surface: DiscreteShape, displacement: Vectors) -> Ints:
    """Return the pairs of triangles (k, 2) of a moved mesh that intersect.

    For moves well below the edge length only the few pairs are tested that the moves can bring together; they
    are kept for the next sample of the same nominal mesh.
    """
    moved = surface.points + displacement
    reach, relative = _moves(np.ascontiguousarray(displacement), np.array(surface.triangles, dtype=np.int64))
    if reach == 0.0:
        return np.zeros((0, 2), dtype=np.int64)
    kept = _kept(surface)
    if reach > 0.5 * kept.median_edge:
        return self_intersections(moved, surface.triangles)
    if reach > kept.reach or relative > kept.relative_reach:
        spare = _SPARE * reach, _SPARE * relative
        pairs = near_pairs(surface.points, surface.triangles, reach=spare[0], relative_reach=spare[1])
        kept = _KEPT[surface] = _Kept(kept.piece, kept.median_edge, *spare, frozen(pairs, dtype=np.int64))
    return kept.pairs[pairs_intersect(moved, surface.triangles, kept.pairs)]


@kernel
def _moves(displacement: Any, triangles: Any) -> Any:
    """Return the longest move of a vertex, and the longest difference of two along an edge."""
    reach, relative = 0.0, 0.0
    for i in range(displacement.shape[0]):
        square = 0.0
        for axis in range(3):
            square += displacement[i, axis] ** 2
        reach = max(reach, square)
    for t in range(triangles.shape[0]):
        for corner in range(3):
            i, j = triangles[t, corner], triangles[t, (corner + 1) % 3]
            square = 0.0
            for axis in range(3):
                square += (displacement[i, axis] - displacement[j, axis]) ** 2
            relative = max(relative, square)
    return np.sqrt(reach), np.sqrt(relative)


def passed_walls(surface: DiscreteShape, displacement: Vectors) -> Ints:
    """Return the pairs of triangles (k, 2) on the sides of a wall or gap that closed or turned inside out.

    The two triangles lie opposite each other, and each has come to the other side of the other.
    """
    reach = float(np.linalg.norm(displacement, axis=1).max(initial=0.0))
    pairs = facing_pairs(surface.points, surface.triangles, reach=reach)
    corners = surface.points[surface.triangles[pairs]]
    centres = corners.mean(axis=2)
    radius = np.linalg.norm(corners - centres[:, :, None], axis=3).max(axis=2).sum(axis=1)
    after = centres + displacement[surface.triangles[pairs]].mean(axis=2)
    normals = triangle_normals(surface.points, surface.triangles[pairs].reshape(-1, 3)).reshape(-1, 2, 3)
    apart, apart_after = centres[:, 1] - centres[:, 0], after[:, 1] - after[:, 0]
    passed = np.ones(len(pairs), dtype=bool)
    for k in range(2):
        gap = np.einsum("ki,ki->k", normals[:, k], apart)
        gap_after = np.einsum("ki,ki->k", normals[:, k], apart_after)
        beside = np.linalg.norm(apart - gap[:, None] * normals[:, k], axis=1)
        passed &= (gap * gap_after <= 1e-12 * gap * gap) & (beside <= radius)
    return pairs[passed]


def past_radius(nominal: NominalModel, deviation: Floats) -> Bools:
    """Return the triangles (m,) all of whose samples deviate past a centre of curvature of their face.

    The offset of a surface with principal curvature k by delta is turned inside out where ``1 - k delta`` is
    not positive: an outer fillet that loses, or a hole that gains, more than its radius.
    """
    turns = nominal.samples.curvatures * np.asarray(deviation)[:, None]
    if turns.max(initial=0.0) < 1.0:
        return np.zeros(nominal.surface.n_triangles, dtype=np.bool_)
    factor = (1.0 - turns).min(axis=1)
    return np.asarray((factor <= 0.0)[nominal.corner_samples].all(axis=1), dtype=np.bool_)


def _new_intersections(nominal: NominalModel, displacement: Vectors) -> Ints:
    """Pairs that intersect after the move and did not before; a warning tells of the others."""
    surface = nominal.surface
    pairs = intersecting_pairs(surface, displacement)
    before: Bools = pairs_intersect(surface.points, surface.triangles, pairs)
    if before.any():
        messages.warn_of_nominal(nominal, pairs[before])
    return pairs[~before]


def _kept(surface: DiscreteShape) -> _Kept:
    if surface not in _KEPT:
        ends = surface.edges
        links = coo_array(
            (np.ones(len(ends), dtype=np.int8), (ends[:, 0], ends[:, 1])), shape=(surface.n_points,) * 2
        )
        piece = connected_components(links, directed=False)[1]
        length = np.linalg.norm(surface.points[ends[:, 0]] - surface.points[ends[:, 1]], axis=1)
        median = float(np.median(length)) if len(length) else 0.0
        nothing = np.zeros((0, 2), dtype=np.int64)
        _KEPT[surface] = _Kept(
            frozen(piece, dtype=np.int64), median, -1.0, -1.0, frozen(nothing, dtype=np.int64)
        )
    return _KEPT[surface]
