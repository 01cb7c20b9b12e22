"""Signed distances of measured points to the nominal surface, exact where the face has a closed form."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np

from cadskin.shape import Freeform, NominalModel
from cadskin.stats._search import TriangleTree, box_tree, closest_on_mesh, closest_on_triangles

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Points, Vectors

__all__ = ["Contacts", "contacts", "foot_points", "signed_distances"]


@dataclass(frozen=True, eq=False)
class Contacts:
    """Where measured points meet the nominal surface.

    Parameters
    ----------
    triangles : (n,) int
        Triangle of the foot; -1 beyond the limit.
    faces : (n,) int
        B-rep face of the foot; -1 beyond the limit.
    weights : (n, 3) float
        Barycentric coordinates of the foot.
    normals : (n, 3) float
        Outward normal of the nominal surface there.
    on_edge : (n,) bool
        The foot lies on an edge between faces: the distance is one to the edge, not to a face.
    """

    triangles: Ints
    faces: Ints
    weights: Floats
    normals: Vectors
    on_edge: Bools


@dataclass(frozen=True, eq=False)
class _Index:
    tree: TriangleTree
    borders: Bools  # (m, 3): side opposite to corner k lies on an edge between faces
    corners: Bools  # (m, 3): corner k belongs to several faces
    across: Ints  # (m, 3): the triangle behind that side, -1 where there is none or the side is no border
    altitudes: Floats  # (m, 3): height of corner k over the opposite side
    closed_form: Bools  # per B-rep face
    sag: float  # how far the triangles leave the surface


_KEYS = ("triangles", "faces", "weights", "normals", "on_edge")
_INDICES: WeakKeyDictionary[NominalModel, _Index] = WeakKeyDictionary()


def contacts(nominal: NominalModel, points: Points, *, limit: float = np.inf, exact: bool = True) -> Contacts:
    """Return the nearest point of the nominal surface for each measured point.

    Parameters
    ----------
    nominal : NominalModel
    points : (n, 3) float
        [mm], in the frame of the nominal model.
    limit : float
        Look no further than this [mm].
    exact : bool
        Near edges of curved faces decide by the exact surfaces, not by the triangles.
    """
    index = _index(nominal)
    feet = closest_on_mesh(index.tree, points, limit=limit)
    found = _contacts(nominal, feet.triangles, feet.weights)
    return found if not exact else _behind_the_edge(nominal, np.asarray(points, dtype=np.float64), found)


def _contacts(nominal: NominalModel, triangles: Ints, weights: Floats) -> Contacts:
    index = _index(nominal)
    met = triangles >= 0
    rows = nominal.corner_samples[triangles]
    normals = np.einsum("nk,nkd->nd", weights, nominal.samples.normals[rows])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    zero = weights <= 1e-9
    side = (zero & index.borders[triangles]).any(axis=1) & (zero.sum(axis=1) == 1)
    tip = (~zero & index.corners[triangles]).any(axis=1) & (zero.sum(axis=1) == 2)
    return Contacts(
        triangles=triangles,
        faces=np.where(met, nominal.surface.face_ids[triangles], -1),
        weights=weights,
        normals=normals / np.where(length > 0, length, 1.0),
        on_edge=met & (side | tip),
    )


def _behind_the_edge(nominal: NominalModel, points: Points, found: Contacts) -> Contacts:
    """Near an edge, take the face whose exact surface is nearer: triangles of a curved face lie off it."""
    index = _index(nominal)
    reach = 4.0 * index.sag
    if reach <= 1e-9 * nominal.surface.diagonal:
        return found
    to_side = found.weights * index.altitudes[found.triangles]
    near = (to_side < reach) & (index.across[found.triangles] >= 0) & (found.triangles >= 0)[:, None]
    rows = np.flatnonzero(near.any(axis=1))
    if not len(rows):
        return found
    side = np.argmin(np.where(near[rows], to_side[rows], np.inf), axis=1)
    other = index.across[found.triangles[rows], side]
    corners = nominal.surface.points[nominal.surface.triangles[other]]
    beyond = _contacts(nominal, other, closest_on_triangles(corners, points[rows]))
    here = Contacts(*(getattr(found, key)[rows] for key in _KEYS))
    better = np.abs(signed_distances(nominal, points[rows], beyond)) < np.abs(
        signed_distances(nominal, points[rows], here)
    )
    better &= np.linalg.norm(points[rows] - foot_points(nominal, beyond), axis=1) < 4.0 * reach
    changed = rows[better]
    values = {}
    for key in _KEYS:
        values[key] = getattr(found, key).copy()
        values[key][changed] = getattr(beyond, key)[better]
    values["on_edge"][changed] = False
    return Contacts(**values)


def foot_points(nominal: NominalModel, where: Contacts) -> Points:
    """Return the feet (n, 3) [mm] on the triangles."""
    corners = nominal.surface.points[nominal.surface.triangles[where.triangles]]
    return np.asarray(np.einsum("nk,nkd->nd", where.weights, corners))


def signed_distances(nominal: NominalModel, points: Points, where: Contacts) -> Floats:
    """Return the distances (n,) [mm] of points to the nominal surface, + = outside of the material.

    Planes, cylinders, cones, spheres and tori are exact. On other faces three osculating paraboloids, one
    per corner of the triangle, are blended: the error falls with the third power of the edge length.

    Parameters
    ----------
    nominal : NominalModel
    points : (n, 3) float
    where : Contacts
        Of these points, or of the same points a little elsewhere.

    Returns
    -------
    (n,) float
        NaN where there is no contact.
    """
    out = np.full(len(points), np.nan)
    index = _index(nominal)
    order = np.argsort(where.faces, kind="stable")
    bounds = np.searchsorted(where.faces[order], np.arange(len(nominal.faces) + 1))
    for face, start, stop in zip(nominal.faces, bounds[:-1], bounds[1:], strict=True):
        rows = order[start:stop]
        if not len(rows):
            continue
        if isinstance(face.ideal, Freeform) or not index.closed_form[face.index]:
            out[rows] = _osculating(nominal, points[rows], where.triangles[rows], where.weights[rows])
        else:
            sign = -1.0 if face.internal and face.kind != "plane" else 1.0
            out[rows] = sign * face.ideal.distance(points[rows])
    return out


def _osculating(nominal: NominalModel, points: Points, triangles: Ints, weights: Floats) -> Floats:
    rows = nominal.corner_samples[triangles]
    samples = nominal.samples
    away = points[:, None] - nominal.surface.points[samples.vertex_ids[rows]]
    height = np.einsum("nkd,nkd->nk", away, samples.normals[rows])
    along = np.einsum("nkd,nkad->nka", away, samples.directions[rows])
    curvatures = samples.curvatures[rows]
    bend = 0.5 * (curvatures / (1.0 - curvatures * height[..., None]) * along**2).sum(axis=2)
    # seen from the foot, each corner's paraboloid weighs with the square of the corner's share: cubic blend
    blend = weights**2 * (3.0 - 2.0 * weights)
    blend = blend / blend.sum(axis=1, keepdims=True)
    return np.asarray((blend * (height - bend)).sum(axis=1))


def _index(nominal: NominalModel) -> _Index:
    if nominal not in _INDICES:
        _INDICES[nominal] = _build(nominal)
    return _INDICES[nominal]


def _build(nominal: NominalModel) -> _Index:
    surface = nominal.surface
    triangles, faces = surface.triangles, surface.face_ids
    sides = np.sort(triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2), axis=1)
    _, edge, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    edge = edge.reshape(-1)
    owner = np.repeat(faces, 3)
    low = np.full(len(count), np.iinfo(np.int64).max)
    high = np.full(len(count), -1)
    np.minimum.at(low, edge, owner)
    np.maximum.at(high, edge, owner)
    border = ((low != high) | (count == 1))[edge].reshape(-1, 3)
    own = np.repeat(np.arange(len(triangles)), 3)
    both = np.bincount(edge, weights=own, minlength=len(count)).astype(np.int64)
    across = np.where(border.ravel() & (count[edge] == 2), both[edge] - own, -1).reshape(-1, 3)
    corner_points = surface.points[triangles]
    lengths = np.linalg.norm(corner_points[:, [2, 0, 1]] - corner_points[:, [1, 2, 0]], axis=2)
    altitudes = 2.0 * surface.triangle_areas[:, None] / np.maximum(lengths, 1e-300)
    curved = np.abs(nominal.samples.curvatures).max(axis=1)[nominal.corner_samples].max(axis=1)
    sag = float((curved * lengths.max(axis=1) ** 2).max() / 8.0) if len(curved) else 0.0
    ends = sides.reshape(-1, 3, 2)[border]
    rim = np.zeros(surface.n_points, dtype=bool)
    rim[ends.ravel()] = True
    return _Index(
        tree=box_tree(surface.points, triangles),
        borders=border,
        corners=rim[triangles],
        across=across,
        altitudes=altitudes,
        closed_form=_closed_forms(nominal),
        sag=min(sag, 0.25 * float(lengths.max())),
    )


def _closed_forms(nominal: NominalModel) -> Bools:
    """Faces whose ideal surface really passes through their vertices (a stand-in mesh might not)."""
    good = np.zeros(len(nominal.faces), dtype=bool)
    scale = 1e-6 * max(nominal.surface.diagonal, 1.0)
    for face in nominal.faces:
        if not isinstance(face.ideal, Freeform):
            own = np.unique(nominal.surface.triangles[nominal.surface.face_ids == face.index])
            away = face.ideal.distance(nominal.surface.points[own])
            good[face.index] = len(own) > 0 and bool(np.abs(away).max() <= scale)
    return good
