"""The members of a tolerance on a part: which faces are one feature, and what is toleranced of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.shape.ideal import Cone, Cylinder

if TYPE_CHECKING:
    from cadskin.shape import Feature
    from cadskin.spec import Tolerance
    from cadskin.verify.extraction import MadePart

__all__ = ["Members", "members_of"]

Members = tuple[tuple[int, ...], ...]


def members_of(tolerance: Tolerance, part: MadePart) -> tuple[Members, tuple[str, ...]]:
    """Return the members of a tolerance, and what had to be interpreted.

    Two faces with one median plane between them are one member. Of a member with an axis the round surfaces
    count, and each axis or radius is a member of its own: of a counterbored hole the hole and the
    counterbore, not the floor between them.
    """
    members = tolerance.feature.members
    if tolerance.feature.derived == "median_plane" and len(members) == 2:
        if all(len(part.features(faces)) == 1 for faces in members):
            return ((*members[0], *members[1]),), ()
        return members, ()
    if tolerance.feature.derived != "axis" and tolerance.zone.shape != "diameter":
        return members, ()
    found: list[tuple[int, ...]] = []
    left_out: list[str] = []
    for faces in members:
        features = part.features(faces)
        round_ones = [feature for feature in features if isinstance(feature.ideal, Cylinder | Cone)]
        if len(features) == 1 or not round_ones:
            found.append(faces)
            continue
        found += _by_axis(round_ones)
        left_out += [feature.name for feature in features if feature not in round_ones]
    notes = (f"without {', '.join(left_out)}: no axis is derived from them",) if left_out else ()
    return tuple(found), notes


def _by_axis(features: list[Feature]) -> list[tuple[int, ...]]:
    """Return the faces of round features, those of one axis and radius together."""
    groups: list[list[Feature]] = []
    for feature in features:
        for group in groups:
            if _same(group[0], feature):
                group.append(feature)
                break
        else:
            groups.append([feature])
    return [tuple(face for feature in group for face in feature.face_indices) for group in groups]


def _same(one: Feature, other: Feature) -> bool:
    first, second = one.ideal, other.ideal
    if not isinstance(first, Cylinder) or not isinstance(second, Cylinder):
        return False
    parallel = np.linalg.norm(np.cross(first.axis, second.axis)) < 1e-6
    apart = np.linalg.norm(np.cross(second.origin - first.origin, first.axis))
    alike = abs(first.radius - second.radius) < 1e-6 * first.radius and one.internal == other.internal
    return bool(parallel and apart < 1e-6 * max(first.radius, 1.0) and alike)
