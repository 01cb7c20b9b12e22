"""Profile cases: nominal surfaces written in JSON, in a nominal frame with a start pose."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Patch, Pose, frame_about
from cadskin.shape.association._kernels import CONE, CYLINDER, PLANE, SPHERE, TORUS
from cadskin.shape.association.models import FREEFORM
from cadskin.verify.case_check import array_of, number_of, vector_of
from cadskin.verify.profile import bezier_closest, profile

if TYPE_CHECKING:
    from cadskin.verify.cases import Case
    from cadskin.verify.evaluation import Evaluation

__all__ = ["nominal_patch", "profile_case"]


def profile_case(case: Case) -> Evaluation:
    """Profile of a surface or line against nominal patches."""
    nominal = case.get("nominal")
    if not nominal:
        raise SpecificationError(f"case {case.id}: a profile needs its nominal surface")
    offset = float(case.get("zone_offset_UZ") or 0.0)
    parts = []
    for index, entry in enumerate(nominal):
        label = str(entry.get("feature", f"patch{entry.get('patch', index)}"))
        if label not in case.features and len(nominal) == 1:
            label = next(iter(case.features))
        parts.append((nominal_patch(entry, offset), case.points(label)))
    given = case.get("start_pose", case.get("datum_frame"))
    pose = Pose(np.zeros(3), np.eye(3), np.zeros(2))
    if given is not None:
        axes = np.ascontiguousarray(np.asarray(given["axes"], dtype=np.float64))
        pose = Pose(np.asarray(given["origin"], dtype=np.float64), axes, np.zeros(2))
    words = f"{case.get('zone', '')} {case.get('association', '')} {case.quantity or ''}"
    return profile(
        parts,
        pose,
        free=case.get("free_dof") or (),
        offset_free="OZ" in words or bool(case.get("zone_offset_OZ")),
        characteristic=case.characteristic,
        operations=("datum system: given by the case",) if case.get("datums") else (),
    )


def nominal_patch(entry: Mapping[str, Any], offset: float = 0.0) -> Patch:
    """Return the patch of one nominal surface; its positive side is out of the material.

    Raises
    ------
    SpecificationError
        A type that is not known, or a number that is missing.
    """
    kind = str(entry.get("type", "")).lower()
    try:
        return _patch(kind, entry, offset)
    except KeyError as error:
        raise SpecificationError(f"the nominal {kind} has no entry {error}") from error


def _patch(kind: str, entry: Mapping[str, Any], offset: float) -> Patch:
    sign = -1.0 if "towards" in str(entry.get("outward", "")).lower() else 1.0
    if "bezier" in kind:
        control = array_of(entry, "control_points", last=(3,))
        weights = array_of(entry, "weights", last=()) if "weights" in entry else None
        closest = bezier_closest(control, weights=weights, outward=_side(entry.get("outward")))
        return Patch(FREEFORM, Pose(np.zeros(3), np.eye(3), np.zeros(2)), 1.0, offset, closest)
    if "plane" in kind:
        normal = vector_of(entry, "outward_normal" if "outward_normal" in entry else "normal", direction=True)
        return Patch(PLANE, _placed(vector_of(entry, "point"), normal, 0.0, 0.0), 1.0, offset)
    if "cylinder" in kind:
        place = _placed(vector_of(entry, "axis_point"), _axis(entry), number_of(entry, "radius"), 0.0)
        return Patch(CYLINDER, place, sign, offset)
    if "sphere" in kind:
        place = _placed(_centre(entry), [0, 0, 1], number_of(entry, "radius"), 0.0)
        return Patch(SPHERE, place, sign, offset)
    if "cone" in kind:
        angle = number_of(entry, "half_angle_deg" if "half_angle_deg" in entry else "half_angle")
        angle = float(np.radians(angle)) if "half_angle_deg" in entry else angle
        # The frame stands away from the apex, where the axis would be singular.
        axis = np.asarray(_axis(entry), dtype=np.float64)
        axis = axis / np.linalg.norm(axis)
        apex = np.asarray(vector_of(entry, "apex"), dtype=np.float64)
        return Patch(CONE, _placed(apex + axis, axis, float(np.tan(angle)), angle), sign, offset)
    if "torus" in kind:
        radii = number_of(entry, "minor_radius"), number_of(entry, "major_radius")
        return Patch(TORUS, _placed(_centre(entry), _axis(entry), *radii), sign, offset)
    raise SpecificationError(
        f"a nominal surface of type {kind!r} is not known; plane, cylinder, cone, "
        "sphere, torus, bezier patch are"
    )


def _axis(entry: Mapping[str, Any]) -> Any:
    return vector_of(entry, "axis", direction=True)


def _centre(entry: Mapping[str, Any]) -> Any:
    return vector_of(entry, "center" if "center" in entry else "centre")


def _placed(origin: Any, axis: Any, s0: float, s1: float) -> Pose:
    shape = np.array([s0, s1], dtype=np.float64)
    return Pose(np.asarray(origin, dtype=np.float64), frame_about(np.asarray(axis, dtype=np.float64)), shape)


def _side(text: Any) -> Any:
    """Read ``+z side`` and the like."""
    if not text:
        return None
    for k, letter in enumerate("xyz"):
        for sign, mark in ((1.0, "+"), (-1.0, "-")):
            if f"{mark}{letter}" in str(text):
                return sign * np.eye(3)[k]
    return None
