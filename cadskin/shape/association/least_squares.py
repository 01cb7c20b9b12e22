"""Orthogonal-distance least squares (Gaussian association): start values and Gauss-Newton on all points.

References
----------
.. [1] A. B. Forbes, Least-squares best-fit geometric elements, NPL Report DITC 140/89 (1989).
.. [2] G. Taubin, Estimation of planar curves, surfaces and nonplanar space curves defined by implicit
   equations, IEEE PAMI 13 (1991), doi:10.1109/34.103273 (start values of circles and spheres).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association import _kernels
from cadskin.shape.association._kernels import CONE, CYLINDER, N_COLUMNS, PLANE, SPHERE, TORUS
from cadskin.shape.association.pose import Pose, frame_about

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["fit", "principal_axes", "start_poses"]

_SAMPLE = 400  # points of the search for a start
_EPS = float(np.finfo(np.float64).eps)


def principal_axes(points: Points) -> tuple[Points, Vectors, Floats]:
    """Return centroid (3,), principal directions as columns (3, 3), standard deviations (3,)."""
    base = np.zeros(3) if len(points) > 10_000 else points[0]
    first, second = _kernels.moments(points, base)
    centre = base + first / len(points)
    if len(points) <= 10_000:  # the eigenvalues of the squares lose half of the digits of a thin cloud
        triangle = np.linalg.qr(points - centre, mode="r")
        _, singular, right = np.linalg.svd(triangle, full_matrices=True)
        spread = np.zeros(3)
        spread[: len(singular)] = singular / np.sqrt(len(points))
        return centre, _right_handed(right.T), spread
    shift = centre - base
    values, vectors = np.linalg.eigh(second / len(points) - np.outer(shift, shift))
    spread = np.sqrt(np.maximum(values[::-1], 0.0))
    return centre, _right_handed(vectors[:, ::-1]), np.where(spread > 1e-7 * spread[0], spread, 0.0)


def _right_handed(vectors: Vectors) -> Vectors:
    out = np.ascontiguousarray(vectors, dtype=np.float64)
    if np.linalg.det(out) < 0:
        out[:, 2] *= -1
    return out


def fit(points: Points, kind: int, start: Pose, free: tuple[int, ...], *, max_iterations: int = 300) -> Pose:
    """Return the pose of least squared distances, from ``start``, over the ``free`` columns.

    Levenberg-Marquardt with blocked normal equations; the gradient is exact, so the solution is not limited
    by the condition of the squares.

    Raises
    ------
    AssociationError
        No convergence.
    """
    if not free:
        return start
    columns = list(free)
    pose = start
    length = max(_kernels.farthest(points, pose.origin), _EPS)
    scale = _scales(kind, length)[columns]
    square, right, total = _kernels.normal_equations(points, kind, pose.origin, pose.axes, pose.shape)
    damping, last = 0.0, np.inf
    for _ in range(max_iterations):
        matrix = square[np.ix_(columns, columns)] * np.outer(scale, scale)
        side = right[columns] * scale
        step = _damped_step(matrix, side, damping)
        full = np.zeros(N_COLUMNS)
        full[columns] = step * scale
        trial = pose.moved(full)
        new = _kernels.normal_equations(points, kind, trial.origin, trial.axes, trial.shape)
        size = float(np.abs(step).max())
        if new[2] > total * (1 + 1e-12) + (_EPS * length) ** 2 * len(points) or not np.isfinite(new[2]):
            damping = max(10.0 * damping, 1e-4)
            if damping > 1e12:
                return pose.tidy()
            continue
        pose, (square, right, total) = trial, new
        damping = damping * 0.1 if damping > 1e-9 else 0.0
        if size <= 4 * _EPS * length or (size <= 1e-11 * length and size >= 0.5 * last and damping == 0.0):
            return pose.tidy()
        last = size
    raise AssociationError(
        f"the least-squares fit did not converge in {max_iterations} steps; check that the points belong to "
        "this kind of surface, or give a start"
    )


def _damped_step(matrix: Floats, side: Floats, damping: float) -> Floats:
    diagonal = np.diag(matrix).copy()
    damped = matrix + damping * np.diag(np.maximum(diagonal, 1e-12 * diagonal.max(initial=1.0)))
    try:
        return np.asarray(-np.linalg.solve(damped, side))
    except np.linalg.LinAlgError:
        return np.asarray(-np.linalg.lstsq(damped, side, rcond=1e-13)[0])


def _scales(kind: int, length: float) -> Floats:
    scale = np.ones(N_COLUMNS)
    scale[3:6] = 1.0 / length
    if kind == CONE:
        scale[7] = 1.0 / length
    return scale


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
    return [pose for a in axes for pose in _starts_about(sample, centre, a, kind)]


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
    _, _, right = np.linalg.svd(design, full_matrices=True)
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
    """Refine each start on a sample of the points and return the best.

    Raises
    ------
    AssociationError
        No start converges to a proper surface.
    """
    if len(starts) == 1 and kind in (PLANE, SPHERE):
        return starts[0]
    sample = np.ascontiguousarray(points[:: max(1, len(points) // _SAMPLE)])
    coarse = []
    for pose in starts:
        total = _kernels.normal_equations(sample, kind, pose.origin, pose.axes, pose.shape)[2]
        coarse.append(total if np.isfinite(total) else np.inf)
    ranked = [starts[i] for i in np.argsort(coarse, kind="stable")[: 12 if kind != TORUS else 24]]
    best, lowest = None, np.inf
    for pose in ranked:
        try:
            refined = fit(sample, kind, pose, free, max_iterations=60)
        except AssociationError:
            continue
        total = _kernels.normal_equations(sample, kind, refined.origin, refined.axes, refined.shape)[2]
        if total < 0.999 * lowest and _is_proper(kind, refined):
            best, lowest = refined, total
    if best is None:
        raise AssociationError(
            "no start of the least-squares fit converged; check that the points belong to this kind of "
            "surface, or give the direction"
        )
    return best


def _is_proper(kind: int, pose: Pose) -> bool:
    if not np.isfinite(pose.origin).all():
        return False
    if kind == CONE:
        return bool(1e-6 < pose.shape[1] < np.pi / 2 - 1e-6)
    return bool(pose.shape[0] > 0) and (kind != TORUS or bool(pose.shape[1] > 0))
