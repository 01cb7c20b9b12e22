"""Places on a face, such as datum targets, carried from the nominal part to a made one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import frame_about
from cadskin.shape.discrete import triangle_normals
from cadskin.verify.nearest import closest_on_triangles
from cadskin.verify.part_patches import WORLD, nominal_patch

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Points
    from cadskin.shape import Feature
    from cadskin.spec import DatumTarget
    from cadskin.verify.extraction import MadePart

__all__ = ["Contact", "target_contact"]

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
        index, weights = closest_on_triangles(nominal, part.surface.points, triangles)
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
        index, weights = closest_on_triangles(origin, nominal.points, triangles)
        centre = _between(nominal.points, triangles[index], weights)[0]
        feature = part.geometry.feature_of(int(nominal.face_ids[chosen][index[0]]))
        if target.kind == "circular_curve":
            feature, centre = _round_feature(part, target, faces, feature), origin[0]
        places = centre + _shape(target, feature, centre)
    own = part.geometry.triangles(feature.face_indices)
    index, weights = closest_on_triangles(places, nominal.points, own)
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
