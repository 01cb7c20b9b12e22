"""Datum systems of any kind of group: common datums of several surfaces, datum targets (ISO 5459, 7.4).

Every compartment is a group of surfaces at their exact places to each other, moved as one rigid body onto the
points of the part; each takes the freedoms that those before it left. What a group holds follows from its
surfaces: the motions that leave all of them on themselves are the null space of its rows [n, p x n].

| group | minimised over the motions it takes |
|---|---|
| cylinders, spheres | largest overshoot over the nominal surfaces (inside: intrusion): all radii grow alike |
| planes | width of the zone, then moved out of the material |
| planes and round surfaces | largest distance, round ones with their own mating size |
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Minimax, Patch, Pose, associate, frame_about
from cadskin.shape.association._kernels import CYLINDER, PLANE, SPHERE
from cadskin.verify.datum_types import DatumFrame, DatumKind, EstablishedDatum, Standard
from cadskin.verify.zones import FREEDOMS, free_columns, solve

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Points, Vectors

__all__ = ["DatumGroup", "GroupSurface", "establish_groups"]

_FLAT = 1e-6  # a motion that moves no surface off itself, per unit of motion at the size of the part
_MOST = 2000  # points that tell what a group holds
_ALL: tuple[str, ...] = FREEDOMS


@dataclass(frozen=True, eq=False)
class GroupSurface:
    """One surface of a group: nominal patch in the part's coordinates, its nominal and its made points.

    Parameters
    ----------
    patch : Patch
    nominal, made : (n, 3) float
    internal : bool
    """

    patch: Patch
    nominal: Points
    made: Points
    internal: bool


@dataclass(frozen=True, eq=False)
class DatumGroup:
    """The surfaces of one compartment of a datum system.

    Parameters
    ----------
    label : str
    surfaces : tuple of GroupSurface
    targets : bool
        The points are contacts at datum targets.
    orientation_only : bool
    """

    label: str
    surfaces: tuple[GroupSurface, ...]
    targets: bool = False
    orientation_only: bool = False


@dataclass(frozen=True, eq=False)
class _Held:
    """The frame of what has been held so far, in the nominal part, and the motions that are left in it."""

    origin: Points
    axes: Vectors
    free: tuple[str, ...]
    kind: DatumKind


def establish_groups(groups: Sequence[DatumGroup], *, standard: Standard) -> tuple[DatumFrame, DatumFrame]:
    """Return the datum system of groups on the nominal part and on the made part.

    Raises
    ------
    SpecificationError
        A group that holds nothing more, or motions that no situation feature describes.
    """
    everything = np.concatenate([surface.nominal for group in groups for surface in group.surfaces])
    centre = everything.mean(axis=0)
    length = max(float(np.abs(everything - centre).max()), 1e-9)
    held = _Held(centre, np.eye(3), _ALL, "complex")
    rows, moved = np.zeros((0, 6)), Pose(np.zeros(3), np.eye(3), np.zeros(2))
    nominal, actual = [], []
    for group in groups:
        own = _rows(group, centre, length)
        rows = np.concatenate([rows, own])
        after = _situation(rows, centre, length, held, group.label)
        taken = free_columns(name for name in held.free if name not in after.free)
        if not taken:
            raise SpecificationError(f"datum {group.label} holds no motion that those before it leave free")
        found, criterion = _placed(group, moved, after, taken)
        moved = found[0]
        alone = _alone(group, own, length, replace(after, origin=centre))
        nominal.append(_datum(group, alone, Pose(np.zeros(3), np.eye(3), np.zeros(2)), criterion, True))
        actual.append(_datum(group, alone, moved, criterion, found[1]))
        if group.orientation_only:
            turned = {"rx", "ry", "rz"} & set(after.free)
            after = replace(after, free=("tx", "ty", "tz", *sorted(turned)))
        held = after
    origin, axes = moved.axes @ held.origin + moved.origin, np.ascontiguousarray(moved.axes @ held.axes)
    return (
        DatumFrame(held.origin, held.axes, held.free, tuple(nominal), standard),
        DatumFrame(origin, axes, held.free, tuple(actual), standard),
    )


def _datum(group: DatumGroup, alone: _Held, moved: Pose, criterion: str, certified: bool) -> EstablishedDatum:
    point, direction = moved.axes @ alone.origin + moved.origin, moved.axes @ alone.axes[:, 2]
    if alone.kind == "plane" and not group.targets:
        outward = moved.axes @ group.surfaces[0].patch.place.axes[:, 2]
        direction = direction if direction @ outward > 0 else -direction
    return EstablishedDatum(
        group.label, alone.kind, point, direction, None, criterion, certified, group.orientation_only
    )


def _alone(group: DatumGroup, rows: Floats, length: float, after: _Held) -> _Held:
    """Return the situation feature of a group by itself; of a lone target there is none but its place."""
    surfaces = np.concatenate([surface.nominal for surface in group.surfaces])
    before = _Held(surfaces.mean(axis=0), after.axes, _ALL, "complex")
    try:
        return _situation(rows, after.origin, length, before, group.label)
    except SpecificationError:
        return before


def _rows(group: DatumGroup, centre: Points, length: float) -> Floats:
    """Return what small motions about the centre do to the distances of a group, (m, 6) as its R factor."""
    out = []
    for surface in group.surfaces:
        step = max(1, len(surface.nominal) // _MOST)
        points = np.ascontiguousarray(surface.nominal[::step])
        _, local = surface.patch.rows(points, surface.patch.place)
        normals = local @ surface.patch.place.axes.T
        lever = np.cross((points - centre) / length, normals)
        out.append(np.column_stack([normals, lever]) / np.sqrt(len(points)))
    return np.asarray(np.linalg.qr(np.concatenate(out), mode="r"))


def _situation(rows: Floats, centre: Points, length: float, before: _Held, label: str) -> _Held:
    """Return the frame of the motions that leave the surfaces on themselves (their invariance class)."""
    _, sizes, right = np.linalg.svd(rows, full_matrices=True)
    full = np.concatenate([sizes, np.zeros(6 - len(sizes))])
    null = right[full < _FLAT]
    shifts, turns = null[:, :3], null[:, 3:] / length
    rank = int((np.linalg.svd(turns * length, compute_uv=False) > 1e-4).sum()) if len(null) else 0
    z = before.axes[:, 2]
    if len(null) == 0:
        return _Held(before.origin, before.axes, (), "complex")
    if (len(null), rank) == (3, 3):
        matrix = np.concatenate([_cross(turn) for turn in turns])
        point = np.linalg.lstsq(matrix, shifts.ravel(), rcond=None)[0]
        return _Held(centre + point, before.axes, ("rx", "ry", "rz"), "sphere")
    if (len(null), rank) == (3, 1):
        normal = _principal(turns)
        return _Held(centre, _axes(normal, z), ("tx", "ty", "rz"), "plane")
    if (len(null), rank) == (2, 1) or (len(null), rank) == (1, 1):
        axis = _principal(turns)
        turn = turns[int(np.argmax(np.linalg.norm(turns, axis=1)))]
        shift = shifts[int(np.argmax(np.linalg.norm(turns, axis=1)))]
        speed = float(np.linalg.norm(turn))
        across = shift - (shift @ axis) * axis
        point = centre + np.cross(turn, across) / speed**2
        slides = len(null) == 2
        if not slides and abs(float(shift @ axis)) > 1e-4 * speed * length:
            raise SpecificationError(f"datum {label} leaves a screw motion; that is not supported")
        return _Held(point, _axes(axis, z), ("tz", "rz") if slides else ("rz",), "cylinder")
    if (len(null), rank) == (1, 0):
        along = shifts[0] / np.linalg.norm(shifts[0])
        if before.free == ("tx", "ty", "rz"):
            return _Held(before.origin, frame_about(z, along), ("tx",), "complex")
        return _Held(before.origin, _axes(along, z), ("tz",), "complex")
    raise SpecificationError(
        f"datum {label} leaves {len(null)} motions that no point, line or plane describes; add a datum "
        "before it"
    )


def _cross(vector: Vectors) -> Floats:
    x, y, z = vector
    return np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])


def _principal(turns: Vectors) -> Vectors:
    direction = np.linalg.svd(turns, full_matrices=False)[2][0]
    return np.asarray(direction * np.sign(direction[int(np.argmax(np.abs(direction)))]))


def _axes(axis: Vectors, z: Vectors) -> Vectors:
    """Return axes about ``axis``, turned to the side of the z axis before."""
    return frame_about(axis if axis @ z >= -1e-9 else -axis)


def _placed(
    group: DatumGroup, moved: Pose, after: _Held, taken: tuple[int, ...]
) -> tuple[tuple[Pose, bool], str]:
    """Move the nominal part onto a group; returns the motion, whether it is proved, and the criterion."""
    mode, criterion = _criterion(group)
    frame = Pose(after.origin, after.axes, np.zeros(2))
    parts = [(_in_frame(_sized(surface, mode), frame), surface.made) for surface in group.surfaces]
    start = Pose(
        moved.axes @ frame.origin + moved.origin, np.ascontiguousarray(moved.axes @ frame.axes), np.zeros(2)
    )
    found = solve(parts, start, taken, mode, what=f"datum {group.label}")
    axes = found.pose.axes @ frame.axes.T
    origin = found.pose.origin - axes @ frame.origin + _outward(group, found, axes)
    return (Pose(origin, np.ascontiguousarray(axes), np.zeros(2)), found.certified), criterion


def _criterion(group: DatumGroup) -> tuple[Literal["zone", "upper", "symmetric"], str]:
    kinds = {surface.patch.kind for surface in group.surfaces}
    contacts = "contacts of targets, " if group.targets else ""
    if kinds <= {CYLINDER, SPHERE} and not group.targets:
        inside = {surface.internal for surface in group.surfaces}
        word = "outside of the material"
        if len(inside) == 1:
            word = "inscribed" if inside == {True} else "circumscribed"
        return "upper", f"all at their exact places, {word}"
    if kinds <= {PLANE} or group.targets:
        return "zone", f"{contacts}all at their exact places, minimax outside of the material"
    return "symmetric", "all at their exact places, minimax, round surfaces of their own size"


def _sized(surface: GroupSurface, mode: str) -> Patch:
    """Return the patch of a surface; in a mixed group a round one has its own size."""
    kind = {CYLINDER: "cylinder", SPHERE: "sphere"}.get(surface.patch.kind)
    if mode != "symmetric" or kind is None:
        return surface.patch
    criterion = "maximum inscribed" if surface.internal else "minimum circumscribed"
    place = surface.patch.place
    axis = place.axis if kind == "cylinder" else None
    radius = associate(surface.made, kind, criterion, axis=axis).radius  # type: ignore[arg-type]
    return replace(surface.patch, place=Pose(place.origin, place.axes, np.array([radius, 0.0])))


def _in_frame(patch: Patch, frame: Pose) -> Patch:
    place = Pose(
        frame.axes.T @ (patch.place.origin - frame.origin),
        np.ascontiguousarray(frame.axes.T @ patch.place.axes),
        patch.place.shape,
    )
    return replace(patch, place=place)


def _outward(group: DatumGroup, found: Minimax, axes: Vectors) -> Vectors:
    """Return the shift (3,) that brings planes out of the material, where one shift does that for all.

    Planes that face each other have none: they grow to both sides.
    """
    counts = np.cumsum([0, *(len(surface.made) for surface in group.surfaces)])
    rows = [k for k, surface in enumerate(group.surfaces) if surface.patch.kind == PLANE]
    if not rows:
        return np.zeros(3)
    normals = np.array([group.surfaces[k].patch.place.axes[:, 2] for k in rows])
    shift = np.linalg.lstsq(normals, np.ones(len(rows)), rcond=1e-6)[0]
    if np.abs(normals @ shift - 1.0).max() > 1e-6:
        return np.zeros(3)
    top = max(float(found.distances[counts[k] : counts[k + 1]].max()) for k in rows)
    return np.asarray(top * (axes @ shift))
