"""Nominal surfaces of features as patches of a frame."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.shape.association import Patch, Pose, frame_about
from cadskin.shape.association._kernels import CONE, CYLINDER, PLANE, SPHERE, TORUS
from cadskin.shape.association.models import FREEFORM
from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere, Torus
from cadskin.verify.sampled import sampled_closest

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.shape import Feature
    from cadskin.shape.association.models import ClosestPoints
    from cadskin.verify.extraction import MadePart

__all__ = ["WORLD", "nominal_patch"]

WORLD = Pose(np.zeros(3), np.eye(3), np.zeros(2))


def nominal_patch(part: MadePart, feature: Feature, frame: Pose, *, offset: float = 0.0) -> Patch:
    """Return the nominal surface of a feature, positive out of the material.

    Parameters
    ----------
    part : MadePart
    feature : Feature
    frame : Pose
        Where the patch's coordinates are those of, in the nominal part.
    offset : float
        Of an unequally disposed zone [mm].
    """
    ideal, sign = feature.ideal, -1.0 if feature.internal else 1.0

    def placed(origin: Points, axis: Vectors, s0: float, s1: float = 0.0) -> Pose:
        axes = frame_about(frame.axes.T @ np.asarray(axis))
        return Pose(frame.axes.T @ (np.asarray(origin) - frame.origin), axes, np.array([s0, s1]))

    if isinstance(ideal, Plane):
        return Patch(PLANE, placed(ideal.origin, feature.faces[0].normal, 0.0), 1.0, offset)
    if isinstance(ideal, Cylinder):
        return Patch(CYLINDER, placed(ideal.origin, ideal.axis, ideal.radius), sign, offset)
    if isinstance(ideal, Sphere):
        return Patch(SPHERE, placed(ideal.centre, np.array([0.0, 0, 1]), ideal.radius), sign, offset)
    if isinstance(ideal, Cone):
        height = float(((feature.points - ideal.apex) @ ideal.axis).mean())
        radius = height * float(np.tan(ideal.half_angle))
        place = placed(ideal.apex + height * ideal.axis, ideal.axis, radius, ideal.half_angle)
        return Patch(CONE, place, sign, offset)
    if isinstance(ideal, Torus):
        return Patch(
            TORUS, placed(ideal.centre, ideal.axis, ideal.minor_radius, ideal.major_radius), sign, offset
        )
    closest = part.geometry.of_nominal(("closest points", feature.id), lambda: _closest_points(feature))
    origin, axes = -frame.axes.T @ frame.origin, np.ascontiguousarray(frame.axes.T)
    return Patch(FREEFORM, Pose(origin, axes, np.zeros(2)), 1.0, offset, closest)


def _closest_points(feature: Feature) -> ClosestPoints:
    return sampled_closest(feature.points, feature.normals, feature.curvatures, feature.directions)
