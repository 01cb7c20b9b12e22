"""Zones that are fixed to a frame: points against surfaces placed in it, over the motions that are left free.

Orientation, location, run-out and profile are all this one problem; they differ in the surface, in the free
motions, and in whether the size of the zone is free (``zone``), one-sided (``upper``) or centred
(``symmetric``).
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import Minimax, Patch, Pose, concatenate, frame_about, minimax, rotation
from cadskin.shape.association._kernels import CYLINDER, PLANE, SPHERE

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.shape.association.minimax import Mode

__all__ = [
    "FREEDOMS",
    "free_columns",
    "line_patch",
    "plane_patch",
    "point_patch",
    "rounded_base",
    "solve",
    "tilted_direction",
    "turned_towards",
]

FREEDOMS = ("tx", "ty", "tz", "rx", "ry", "rz")


def free_columns(names: Iterable[str]) -> tuple[int, ...]:
    """Return the columns of freedoms named ``tx`` ... ``rz``.

    Examples
    --------
    >>> free_columns(["tx", "rz"])
    (0, 5)
    """
    chosen = []
    for name in names:
        if name not in FREEDOMS:
            raise SpecificationError(f"unknown degree of freedom {name!r}; choose from {', '.join(FREEDOMS)}")
        chosen.append(FREEDOMS.index(name))
    return tuple(sorted(set(chosen)))


def solve(
    parts: list[tuple[Patch, Points]], frame: Pose, free: tuple[int, ...], mode: Mode, *, what: str
) -> Minimax:
    """Minimise the zone of points against patches that move together.

    Parameters
    ----------
    parts : list of (Patch, (n, 3) float)
        Surfaces in the frame, each with its points in the world [mm].
    frame : Pose
        Where the frame starts.
    free : tuple of int
        Columns of the motions of the frame that are left.
    mode : str
        See `cadskin.shape.association.minimax`.
    what : str
        Named in errors.
    """
    checked = [(patch, _finite(points, what)) for patch, points in parts]
    base = rounded_base(np.concatenate([points for _, points in checked]))
    moved = [(patch, points - base) for patch, points in checked]
    start = Pose(frame.origin - base, frame.axes, frame.shape)
    found = minimax(concatenate(moved), start, free, mode)
    pose = Pose(found.pose.origin + base, found.pose.axes, found.pose.shape)
    return _with_pose(found, pose)


def _finite(points: Points, what: str) -> Points:
    """Return points (n, 3), finite and at least one."""
    cloud: Points = frozen(points, shape=(None, 3), name=f"points of {what}")
    if not len(cloud):
        raise AssociationError(f"{what}: a feature without points; extract some")
    return cloud


def _with_pose(found: Minimax, pose: Pose) -> Minimax:
    from dataclasses import replace

    return replace(found, pose=pose)


def rounded_base(points: Points) -> Points:
    """Return the centroid in whole millimetres (3,): subtracting it loses no digit."""
    return np.asarray(np.round(points.mean(axis=0)))


def plane_patch(
    normal: Vectors, point: Points | None = None, *, sign: float = 1.0, offset: float = 0.0
) -> Patch:
    """Return a plane in the frame."""
    origin = np.zeros(3) if point is None else np.asarray(point, dtype=np.float64)
    return Patch(PLANE, Pose(origin, frame_about(normal), np.zeros(2)), sign, offset)


def line_patch(
    direction: Vectors, point: Points | None = None, *, radius: float = 0.0, sign: float = 1.0
) -> Patch:
    """Return a line (a cylinder of radius 0) in the frame."""
    origin = np.zeros(3) if point is None else np.asarray(point, dtype=np.float64)
    return Patch(CYLINDER, Pose(origin, frame_about(direction), np.array([radius, 0.0])), sign)


def point_patch(point: Points) -> Patch:
    """Return a point (a sphere of radius 0) in the frame."""
    return Patch(SPHERE, Pose(np.asarray(point, dtype=np.float64), np.eye(3), np.zeros(2)))


def tilted_direction(angle: float) -> Vectors:
    """Return the direction at ``angle`` [rad] from the third axis, in the plane of the first and third."""
    return np.array([np.sin(angle), 0.0, np.cos(angle)])


def turned_towards(axis: Vectors, direction: Vectors, angle: float) -> tuple[Vectors, bool]:
    """Return axes (3, 3) about ``axis`` such that `tilted_direction` comes closest to ``direction``.

    Returns
    -------
    axes : (3, 3) float
    flipped : bool
        Whether ``-direction`` was meant.
    """
    axis = np.asarray(axis, dtype=np.float64) / np.linalg.norm(axis)
    best, out, flip = -np.inf, np.eye(3), False
    for sign in (1.0, -1.0):
        wanted = sign * np.asarray(direction, dtype=np.float64)
        across = wanted - (wanted @ axis) * axis
        if np.linalg.norm(across) < 1e-9:
            across = frame_about(axis)[:, 0]
        axes = frame_about(axis, across)
        match = float(wanted @ axes @ tilted_direction(angle))
        if match > best:
            best, out, flip = match, axes, sign < 0
    return out, flip


def turned_about(axes: Vectors, angle: float) -> Vectors:
    """Return axes turned about their third column by ``angle`` [rad]."""
    return np.asarray(axes @ rotation(np.array([0.0, 0.0, angle])))
