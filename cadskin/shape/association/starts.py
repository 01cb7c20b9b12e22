"""Where a least-squares fit starts: algebraic fits about many directions, and curvatures of a small patch.

References
----------
.. [1] G. Taubin, Estimation of planar curves, surfaces and nonplanar space curves defined by implicit
   equations, IEEE PAMI 13 (1991), doi:10.1109/34.103273 (circles).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association import _kernels
from cadskin.shape.association._kernels import CONE, CYLINDER, PLANE, SPHERE, TORUS
from cadskin.shape.association.least_squares import fit, principal_axes
from cadskin.shape.association.pose import Pose, frame_about

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["best_start", "coarse_start", "start_poses"]

_SAMPLE = 400  # points of the search
_TRIES = {CONE: 16, TORUS: 24}  # starts that are refined
_SLOPES = np.concatenate(
    [-np.array([1.4, 1.1, 0.8, 0.5, 0.3, 0.15, 0.05]), [0.0], [0.05, 0.15, 0.3, 0.5, 0.8, 1.1, 1.4]]
)


def start_poses(points: Points, kind: int, *, axis: Vectors | None = None) -> list[Pose]:
    """Return start poses, best first, for the least-squares fit of ``kind``.

    Parameters
    ----------
    points : (n, 3) float
    kind : int
    axis : (3,) float, optional
        A known or guessed direction (normal of the plane, of the section of a circle, axis of a cylinder).
    """
    centre, directions, _ = principal_axes(points)
    if kind == PLANE:
        normal = directions[:, 2] if axis is None else np.asarray(axis, dtype=np.float64)
        return [Pose(centre, frame_about(normal, None), np.zeros(2))]
    if kind == SPHERE:
        middle, radius = _algebraic_sphere(points - centre)
        return [Pose(centre + middle, np.eye(3), np.array([radius, 0.0]))]
    sample = points[:: max(1, len(points) // _SAMPLE)]
    axes = [np.asarray(axis, dtype=np.float64)] if axis is not None else _directions(directions)
    found, refused = [], None
    for direction in axes:
        try:
            found += _starts_about(sample, centre, direction, kind)
        except AssociationError as error:  # seen from here the points are on a line: not this direction
            refused = error
    if not found and refused is not None:
        raise refused
    return [*found, *_patch_starts(sample, kind)] if kind != CYLINDER or axis is None else found


def _directions(principal: Vectors) -> list[Vectors]:
    """Principal directions first, then a spiral of 40 over the half sphere."""
    k = np.arange(40) + 0.5
    height, angle = k / 40, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - height**2)
    spiral = np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)
    return [*principal.T, *spiral]


def _starts_about(sample: Points, centre: Points, axis: Vectors, kind: int) -> list[Pose]:
    axes = frame_about(axis)
    local = (sample - centre) @ axes
    if kind == CYLINDER:
        middle, radius = _algebraic_circle(local[:, :2])
        return [Pose(centre + axes[:, :2] @ middle, axes, np.array([radius, 0.0]))]
    if kind == CONE:
        return _cone_starts(local, centre, axes)
    return _torus_starts(local, centre, axes)


def _algebraic_circle(xy: Floats) -> tuple[Floats, float]:
    """Taubin's circle; for three points their circumcircle."""
    middle = xy.mean(axis=0)
    u = xy - middle
    z = (u**2).sum(axis=1)
    mean = float(z.mean())
    if mean <= 0.0:
        raise AssociationError("all points coincide; a circle cannot be associated")
    design = np.column_stack([(z - mean) / (2 * np.sqrt(mean)), u])
    _, _, right = np.linalg.svd(design, full_matrices=len(design) < 3)
    a, b, c = right[2]
    a /= 2 * np.sqrt(mean)
    d = -mean * a
    if abs(a) < 1e-14 * np.hypot(b, c) / np.sqrt(mean):
        raise AssociationError("the points are collinear; a circle cannot be associated")
    return middle - np.array([b, c]) / (2 * a), float(np.sqrt(b * b + c * c - 4 * a * d) / (2 * abs(a)))


def _algebraic_sphere(xyz: Points) -> tuple[Points, float]:
    z = (xyz**2).sum(axis=1)
    design = np.column_stack([2 * xyz, np.ones(len(xyz))])
    scale = np.abs(design).max(axis=0)
    solution = np.linalg.lstsq(design / scale, z, rcond=None)[0] / scale
    return solution[:3], float(np.sqrt(max(solution[3] + solution[:3] @ solution[:3], 0.0)))


def _cone_starts(local: Points, centre: Points, axes: Vectors) -> list[Pose]:
    """Fit ``x^2 + y^2 = 2 a x + 2 b y + c + 2 e h + f h^2`` about the direction, and read the cone off it."""
    h = local[:, 2]
    z = (local[:, :2] ** 2).sum(axis=1)
    unit = float(np.abs(local).max())
    design = np.column_stack([2 * local[:, :2] / unit, np.ones(len(h)), 2 * h / unit, (h / unit) ** 2])
    a, b, c, e, f = np.linalg.lstsq(design, z / unit**2, rcond=None)[0]
    middle = np.array([a, b]) * unit
    r0 = float(np.sqrt(max(c + a * a + b * b, 1e-6)) * unit)
    slope = float(e * unit / r0) if abs(e) > 1e-9 else 1e-3
    if abs(f) > 1e-3 and f > 0:
        slope = float(np.sign(e or 1.0) * np.sqrt(f))
    origin = centre + axes[:, :2] @ middle
    flipped = np.ascontiguousarray(axes * np.array([1.0, -1.0, -1.0]))
    angle = float(np.arctan(np.clip(abs(slope), 1e-3, 20.0)))
    frame = axes if slope >= 0 else flipped
    return [Pose(origin, frame, np.array([r0, angle]))]


def _torus_starts(local: Points, centre: Points, axes: Vectors) -> list[Pose]:
    middle, _ = _algebraic_circle(local[:, :2])
    starts = []
    for xy in (np.zeros(2), middle):
        radius = np.linalg.norm(local[:, :2] - xy, axis=1)
        section = np.column_stack([radius, local[:, 2]])
        try:
            (major, height), minor = _algebraic_circle(section)
        except AssociationError:
            continue
        if major > 0:
            origin = centre + axes @ np.array([xy[0], xy[1], height])
            starts.append(Pose(origin, axes, np.array([minor, major])))
    return starts


def coarse_start(points: Points, kind: int, starts: list[Pose]) -> Pose:
    """Return the start of least squared distances; for a minimax of points whose least squares run away."""
    sample = np.ascontiguousarray(points[:: max(1, len(points) // _SAMPLE)])
    totals = [_kernels.normal_equations(sample, kind, p.origin, p.axes, p.shape)[2] for p in starts]
    return starts[int(np.argmin(np.where(np.isfinite(totals), totals, np.inf)))]


def best_start(points: Points, kind: int, starts: list[Pose], free: tuple[int, ...]) -> Pose:
    """Refine the starts on a sample of the points and return the best.

    Raises
    ------
    AssociationError
        No start leads to a proper surface.
    """
    if len(starts) == 1 and kind in (PLANE, SPHERE):
        return starts[0]
    sample = np.ascontiguousarray(points[:: max(1, len(points) // _SAMPLE)])
    ranked = [starts[i] for i in np.argsort([_squares(sample, kind, pose) for pose in starts], kind="stable")]
    best, lowest = None, np.inf
    for pose in ranked[: _TRIES.get(kind, 12)]:
        refined = _turned_upright(kind, fit(sample, kind, pose, free, max_iterations=60, must_converge=False))
        total = _squares(sample, kind, refined)
        if total < 0.999 * lowest and _is_proper(kind, refined):
            best, lowest = refined, total
    if best is None:
        raise AssociationError(
            "no start of the least-squares fit converged; check that the points belong to this kind of "
            "surface, or give the direction"
        )
    return best


def _squares(sample: Points, kind: int, pose: Pose) -> float:
    """Return the sum of squared distances; infinite where it is not a number."""
    total = float(_kernels.normal_equations(sample, kind, pose.origin, pose.axes, pose.shape)[2])
    return total if np.isfinite(total) else np.inf


def _turned_upright(kind: int, pose: Pose) -> Pose:
    """Return a cone whose half angle came out negative as the same cone, seen from its other end."""
    if kind != CONE or pose.shape[1] >= 0:
        return pose
    axes = np.ascontiguousarray(pose.axes * np.array([1.0, -1.0, -1.0]))
    return Pose(pose.origin, axes, np.array([pose.shape[0], -pose.shape[1]]))


def _is_proper(kind: int, pose: Pose) -> bool:
    if not np.isfinite(pose.origin).all():
        return False
    if kind == CONE:
        return bool(1e-6 < pose.shape[1] < np.pi / 2 - 1e-6)
    return bool(pose.shape[0] > 0) and (kind != TORUS or bool(pose.shape[1] > 0))


def _patch_starts(sample: Points, kind: int) -> list[Pose]:
    """Return starts from the curvatures of a paraboloid through the points: right for a small patch.

    The normal line of a surface of revolution meets the axis at the centre of curvature of the parallel; of a
    cylinder or cone the other principal direction is the generator, of a torus that of the tube.
    """
    centre, axes, spread = principal_axes(sample)
    if len(sample) < 6 or spread[1] <= 0.0:
        return []
    x, y, z = ((sample - centre) @ axes).T
    unit = float(spread[0])
    design = np.column_stack(
        [np.ones(len(x)), x / unit, y / unit, (x / unit) ** 2, x * y / unit**2, (y / unit) ** 2]
    )
    height, bx, by, dxx, dxy, dyy = np.linalg.lstsq(design, z, rcond=None)[0]
    bends, turns = np.linalg.eigh(np.array([[2 * dxx, dxy], [dxy, 2 * dyy]]) / unit**2)
    normal = axes @ np.array([-bx / unit, -by / unit, 1.0])
    normal /= np.linalg.norm(normal)
    foot = centre + height * axes[:, 2]
    starts: list[Pose] = []
    for k in (0, 1):
        if abs(bends[k]) * unit < 1e-9:
            continue
        along = axes[:, :2] @ turns[:, 1 - k]
        along -= (along @ normal) * normal
        starts += _revolved(foot, normal, along / np.linalg.norm(along), bends[k], bends[1 - k], kind)
    return starts


def _revolved(
    foot: Points, normal: Vectors, along: Vectors, parallel: float, meridian: float, kind: int
) -> list[Pose]:
    """Return surfaces of revolution with given curvatures at a point; the slope of the axis is tried out."""
    on_axis = foot + normal / parallel
    if kind == CYLINDER:
        return [Pose(on_axis, frame_about(along), np.array([abs(1.0 / parallel), 0.0]))]
    starts = []
    for slope in _SLOPES:
        axis = np.cos(slope) * along + np.sin(slope) * normal
        frame = frame_about(axis)
        if kind == CONE:
            if abs(slope) < 1e-9 or abs(slope) > 1.5:
                continue
            if slope * parallel > 0:  # the axis points into the cone: the radius grows along it
                axis = -axis
            frame = frame_about(axis)
            qx, qy, qz = (foot - on_axis) @ frame
            r0 = float(np.hypot(qx, qy) - qz * np.tan(abs(slope)))
            starts.append(Pose(on_axis, frame, np.array([r0, abs(slope)])))
        elif abs(meridian) > 1e-12:
            tube = foot + normal / meridian
            centre = on_axis + ((tube - on_axis) @ axis) * axis
            major = float(np.linalg.norm(tube - centre))
            if major > 0:
                starts.append(Pose(centre, frame, np.array([abs(1.0 / meridian), major])))
    return starts
