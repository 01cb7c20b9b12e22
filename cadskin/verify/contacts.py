"""Places on a face, such as datum targets, carried from the nominal part to a made one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import frame_about
from cadskin.shape.discrete import triangle_normals
from cadskin.verify.part_patches import WORLD, nominal_patch

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Points
    from cadskin.shape import Feature
    from cadskin.spec import DatumTarget
    from cadskin.verify.extraction import MadePart

__all__ = ["Contact", "target_contact"]

_CANDIDATES = 24
_LINE, _GRID, _RING = 9, 5, 24  # contact points of a line, of a side of an area, of a circle


@dataclass(frozen=True, eq=False)
class Contact:
    """Contact points on one feature: nominal places (n, 3), and the points (n, 3) of the made part there."""

    feature: Feature
    nominal: Points
    made: Points


def target_contact(part: MadePart, letter: str, target: DatumTarget) -> Contact:
    """Return where a datum target touches a made part.

    Parameters
    ----------
    part : MadePart
    letter : str
        Of the datum, for messages.
    target : DatumTarget
        Points, lines and areas are sampled: a line by 9 points, an area by a grid, a circle by 24.

    Raises
    ------
    SpecificationError
        A movable target, one without a place, or one that lies on no face.
    """
    if target.movable:
        raise SpecificationError(f"datum target {target.label}: a movable target is not supported")
    feature, corners, weights, nominal = part.geometry.of_nominal(
        ("target", letter, target), lambda: _on_nominal(part, letter, target)
    )
    if not part.same_vertices:
        triangles = part.triangles(feature.face_indices)
        index, weights = _closest(nominal, part.surface.points, triangles)
        return Contact(feature, nominal, _between(part.surface.points, triangles[index], weights))
    lift = nominal - _between(part.nominal.surface.points, corners, weights)
    return Contact(feature, nominal, _between(part.surface.points, corners, weights) + lift)


def _on_nominal(part: MadePart, letter: str, target: DatumTarget) -> tuple[Feature, Ints, Floats, Points]:
    """Return the feature of a target, the triangles and weights of its places, and the places themselves."""
    nominal = part.nominal.surface
    if target.origin is None and not target.feature.faces:
        raise SpecificationError(f"datum target {target.label} of datum {letter} has no place")
    faces = target.feature.faces
    chosen = _candidates(part, target)
    triangles = nominal.triangles[chosen]
    if target.origin is None or target.kind == "area":
        feature = part.geometry.feature_of(faces[0])
        places = part.nominal_points(feature.face_indices)
    else:
        origin = np.array([target.origin])
        index, weights = _closest(origin, nominal.points, triangles)
        centre = _between(nominal.points, triangles[index], weights)[0]
        feature = part.geometry.feature_of(int(nominal.face_ids[chosen][index[0]]))
        if target.kind == "circular_curve":
            feature, centre = _round_feature(part, target, faces, feature), origin[0]
        places = centre + _shape(target, feature, centre)
    own = part.geometry.triangles(feature.face_indices)
    index, weights = _closest(places, nominal.points, own)
    found = _between(nominal.points, own[index], weights)
    apart = np.linalg.norm(found - places, axis=1)
    if target.kind == "rectangle" or target.kind == "circle":
        inside = apart <= 1e-3 * nominal.diagonal  # an area may reach over the rim of its face
        index, weights, found = index[inside], weights[inside], found[inside]
    patch = nominal_patch(part, feature, WORLD)
    distance, local = patch.rows(found, patch.place)
    if not len(found):
        raise SpecificationError(f"datum target {target.label} of datum {letter} lies on no face of the part")
    foot = found - distance[:, None] * (local @ patch.place.axes.T)
    return feature, own[index], weights, np.asarray(foot)


def _candidates(part: MadePart, target: DatumTarget) -> Bools:
    """Return which triangles a target may lie on: its faces, else all that an area's axis looks at."""
    nominal = part.nominal.surface
    if target.feature.faces:
        return np.asarray(np.isin(nominal.face_ids, target.feature.faces))
    if target.kind not in ("rectangle", "circle") or target.axis is None:
        return np.ones(nominal.n_triangles, dtype=bool)
    facing = np.abs(triangle_normals(nominal.points, nominal.triangles) @ np.array(target.axis))
    return np.asarray(facing > 0.99 * np.linalg.norm(target.axis))


def _round_feature(part: MadePart, target: DatumTarget, faces: tuple[int, ...], nearest: Feature) -> Feature:
    """Return the feature whose radius a circular target has."""
    radius = 0.5 * (target.diameter or 0.0)
    features = part.features(faces) if faces else (nearest,)
    return min(features, key=lambda one: abs((one.radius or 0.0) - radius))


def _shape(target: DatumTarget, feature: Feature, centre: Points) -> Points:
    """Return the places (n, 3) of a target about its origin."""
    x = np.array(target.direction or (1.0, 0, 0))
    z = np.array(target.axis or (0.0, 0, 1))
    axes = frame_about(z, x)
    length = target.length or 0.0
    if target.kind == "line":
        normal = feature.normals[np.argmin(((feature.points - centre) ** 2).sum(axis=1))]
        along = min((axes[:, 0], axes[:, 1], axes[:, 2]), key=lambda one: round(abs(float(one @ normal)), 6))
        return np.asarray(np.outer(np.linspace(-0.5, 0.5, _LINE) * length, along))
    if target.kind == "rectangle":
        u, v = (a.ravel() for a in np.meshgrid(*[np.linspace(-0.5, 0.5, _GRID)] * 2))
        return np.outer(u * length, axes[:, 0]) + np.outer(v * (target.width or length), axes[:, 1])
    if target.kind in ("circle", "circular_curve"):
        turn = 2 * np.pi * np.arange(_RING) / _RING
        ring = np.outer(np.cos(turn), axes[:, 0]) + np.outer(np.sin(turn), axes[:, 1])
        radius = 0.5 * (target.diameter or 0.0)
        if target.kind == "circular_curve":
            return np.asarray(radius * ring)
        return np.concatenate(
            [np.zeros((1, 3)), *(share * radius * ring for share in (0.25, 0.5, 0.75, 1.0))]
        )
    return np.zeros((1, 3))


def _between(points: Points, corners: Ints, weights: Floats) -> Points:
    return np.asarray(np.einsum("nk,nkj->nj", weights, points[corners]))


def _closest(places: Points, points: Points, triangles: Ints) -> tuple[Ints, Floats]:
    """Return the nearest triangle (n,) of each place, and the barycentric weights (n, 3) of its foot."""
    from scipy.spatial import cKDTree

    corners = points[triangles]
    _, near = cKDTree(corners.mean(axis=1)).query(places, k=min(_CANDIDATES, len(triangles)))
    near = near.reshape(len(places), -1)
    best = np.full(len(places), np.inf)
    index, weights = near[:, 0].copy(), np.zeros((len(places), 3))
    for column in near.T:
        candidate = _foot_weights(places, corners[column])
        foot = np.einsum("nk,nkj->nj", candidate, corners[column])
        apart = ((foot - places) ** 2).sum(axis=1)
        better = apart < best
        best[better], index[better], weights[better] = apart[better], column[better], candidate[better]
    return index, weights


def _foot_weights(places: Points, corners: Floats) -> Floats:
    """Return the barycentric weights (n, 3) of the points of triangles (n, 3, 3) nearest to places."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    twice = np.maximum((normal**2).sum(axis=1), 1e-300)
    inner: Floats = np.stack(
        [
            np.einsum("ni,ni->n", np.cross(c - b, places - b), normal) / twice,
            np.einsum("ni,ni->n", np.cross(a - c, places - c), normal) / twice,
            np.einsum("ni,ni->n", np.cross(b - a, places - a), normal) / twice,
        ],
        axis=1,
    )
    options = [np.where(np.all(inner >= 0, axis=1)[:, None], inner, np.nan)]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        side = corners[:, j] - corners[:, i]
        share = np.einsum("ni,ni->n", places - corners[:, i], side) / np.maximum(
            (side**2).sum(axis=1), 1e-300
        )
        edge = np.zeros((len(places), 3))
        edge[:, j] = np.clip(share, 0.0, 1.0)
        edge[:, i] = 1.0 - edge[:, j]
        options.append(edge)
    stacked = np.stack(options)
    feet = np.einsum("onk,nkj->onj", stacked, corners)
    apart = ((feet - places) ** 2).sum(axis=2)
    best = np.argmin(np.where(np.isnan(apart), np.inf, apart), axis=0)
    return np.asarray(stacked[best, np.arange(len(places))])
