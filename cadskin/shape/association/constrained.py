"""Constrained least squares: the best feature outside of the material (ISO 1101 GE, ASME Y14.5.1-2019).

References
----------
.. [1] C. M. Shakarji, V. Srinivasan, Datum planes based on a constrained L1 norm, J. Comput. Inf. Sci. Eng.
   15 (2015), doi:10.1115/1.4030811, and later papers on the constrained L2 plane.
.. [2] C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, SIAM 1995, chapter 23 (LDP by NNLS).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association import _kernels as kernels
from cadskin.shape.association.packing import pack_squares
from cadskin.shape.association.pose import Pose
from cadskin.shape.association.result import Association, Certificate, Kind

if TYPE_CHECKING:
    from collections.abc import Callable

    from cadskin._typing import Floats, Ints, Points
    from cadskin.shape.association.models import SurfaceModel

__all__ = ["constrained"]

_EPS = float(np.finfo(np.float64).eps)
_SAMPLE = 4000  # points from which curvature, and the first step, are estimated


def constrained(
    model: SurfaceModel, base: Points, kind: Kind, pose: Pose, columns: tuple[int, ...], *, sign: float = 1.0
) -> Association:
    """Minimise the squared distances with every point on one side of the surface.

    Sequential quadratic programming: each step is a least-distance problem over a working set of points.

    Parameters
    ----------
    model : SurfaceModel
    base : (3,) float
        What was subtracted from the points.
    kind : str
    pose : Pose
        The unconstrained fit.
    columns : tuple of int
    sign : float
        +1: no point beyond the surface (``d <= 0``); -1: none before it.
    """
    length = max(model.length(pose), _EPS)
    unit = np.ones(kernels.N_COLUMNS)
    unit[3:6] = 1.0 / length
    if model.angular_shape():
        unit[7] = 1.0 / length
    chosen, squares = list(columns), Squares(model)
    task = _Task(model, np.array(chosen), unit[chosen], sign, 4 * _EPS * length)
    ids = _extremes(sign * model.distances(pose))
    guess, last, loads = len(model) > _SAMPLE, 0.0, np.zeros(len(ids))
    for _ in range(100):
        # The unconstrained fit has no gradient: its first step needs the sum over a sample only.
        matrix, right = squares.estimate(pose) if guess else squares.at(pose)
        matrix = matrix + sign * _contact_curvature(model.take(ids[loads > 0.0]), pose, loads[loads > 0.0])
        reached = _settle(task, pose, ids, matrix, right)
        pose, ids, loads = reached.pose, reached.ids, reached.multipliers
        if guess:
            guess = False
            continue
        size = reached.size
        # The step that would follow shrinks by about the factor by which this one shrank.
        ratio = min(size / last, 1.0) if last > 0.0 else 1.0
        done = size <= 8 * _EPS * length or size * ratio <= _EPS * length
        if reached.clear and (done or (size < 1e-11 * length and ratio >= 0.5)):
            break
        last = size
    else:
        raise AssociationError("the constrained least-squares fit did not converge in 100 steps")
    return _packed(model, base, kind, pose, chosen, ids, reached.multipliers, sign)


@dataclass(frozen=True, eq=False)
class Squares:
    """Second-order model of half the sum of squared distances at a pose.

    Of planes the moments of the points say everything: one pass serves every pose.
    """

    model: SurfaceModel

    @cached_property
    def _moments(self) -> tuple[Points, Points, Floats]:
        centre = np.asarray(self.model.points[:: max(1, len(self.model) // 1000)].mean(axis=0))
        return (centre, *kernels.moments(self.model.points, centre))

    @cached_property
    def _sample(self) -> Points:
        points = self.model.points
        return np.ascontiguousarray(points[:: max(1, len(points) // _SAMPLE)])

    def at(self, pose: Pose) -> tuple[Floats, Floats]:
        """Return Hessian (8, 8) and gradient (8,); the curvature of the distances comes from a sample."""
        if self.model.kind == kernels.PLANE:
            square, right = self._of_plane(pose)
        else:
            square, right, _ = self._sums(self.model.points, pose)
        share = len(self.model) / len(self._sample)
        return square + share * self._bending(pose), right

    def estimate(self, pose: Pose) -> tuple[Floats, Floats]:
        """Return the Hessian (8, 8) from the sample, and no gradient: at an unconstrained optimum."""
        square, _, _ = self._sums(self._sample, pose)
        return square * (len(self.model) / len(self._sample)), np.zeros(kernels.N_COLUMNS)

    def _sums(self, points: Points, pose: Pose) -> tuple[Floats, Floats, float]:
        sums: tuple[Floats, Floats, float] = kernels.normal_equations(
            points, self.model.kind, pose.origin, pose.axes, pose.shape
        )
        return sums

    def _bending(self, pose: Pose) -> Floats:
        """Return the part of the Hessian that the curvature of the distances adds, over the sample."""
        square, _, _ = self._sums(self._sample, pose)
        return _slope(lambda at: self._sums(self._sample, at)[1], pose, self.model) - square

    def _of_plane(self, pose: Pose) -> tuple[Floats, Floats]:
        centre, first, second = self._moments
        n, shift = len(self.model), centre - pose.origin
        cross = np.outer(first, shift)
        moved = pose.axes.T @ (second + cross + cross.T + n * np.outer(shift, shift)) @ pose.axes
        sums = pose.axes.T @ (first + n * shift)
        # The row of a point q is (0, 0, -1, -q2, q1, 0, -1, 0), its distance q3 - s0.
        rows = np.zeros((kernels.N_COLUMNS, 3))
        rows[2, 2] = rows[6, 2] = rows[3, 1] = -1.0
        rows[4, 0] = 1.0
        full = np.array(
            [[moved[0, 0], moved[0, 1], sums[0]], [moved[0, 1], moved[1, 1], sums[1]], [*sums[:2], n]]
        )
        heights = np.array([moved[0, 2], moved[1, 2], sums[2]]) - pose.shape[0] * np.array([*sums[:2], n])
        return np.asarray(rows @ full @ rows.T), np.asarray(rows @ heights)


def _slope(gradient: Callable[[Pose], Floats], pose: Pose, model: SurfaceModel) -> Floats:
    """Return the symmetric derivative (8, 8) of a gradient by central differences."""
    length = model.take(np.arange(1)).length(pose)
    columns = []
    for k in range(kernels.N_COLUMNS):
        angular = k in (3, 4, 5) or (k == 7 and model.angular_shape())
        unit = np.zeros(kernels.N_COLUMNS)
        unit[k] = 1e-5 if angular else 1e-5 * max(length, _EPS)
        columns.append((gradient(pose.moved(unit)) - gradient(pose.moved(-unit))) / (2.0 * unit[k]))
    hessian = np.array(columns)
    return np.asarray(0.5 * (hessian + hessian.T))


def _contact_curvature(model: SurfaceModel, pose: Pose, loads: Floats) -> Floats:
    """Return the second derivative (8, 8) of the loaded distances of the contacts."""
    if not len(loads):
        return np.zeros((kernels.N_COLUMNS, kernels.N_COLUMNS))
    return _slope(lambda at: np.asarray(model.rows(at)[1].T @ loads), pose, model)


@dataclass(frozen=True, eq=False)
class _Task:
    """Points, free columns with their units, the side, and what counts as beyond [mm]."""

    model: SurfaceModel
    columns: Ints
    unit: Floats
    sign: float
    floor: float


@dataclass(frozen=True, eq=False)
class _Settled:
    """A pose after a step, its working set and multipliers, the size of the step [mm]."""

    pose: Pose
    ids: Ints
    multipliers: Floats
    size: float
    clear: bool


def _settle(task: _Task, pose: Pose, ids: Ints, matrix: Floats, right: Floats) -> _Settled:
    """Take the step of one quadratic model; points that come to lie beyond join the working set."""
    chosen = task.columns
    scaled = matrix[np.ix_(chosen, chosen)] * np.outer(task.unit, task.unit)
    for _ in range(8):
        values, jacobian = task.model.take(ids).rows(pose)
        step, multipliers = _least_distance(
            scaled,
            right[chosen] * task.unit,
            task.sign * jacobian[:, chosen] * task.unit,
            task.sign * values,
        )
        full = np.zeros(kernels.N_COLUMNS)
        full[chosen] = step * task.unit
        moved = pose.moved(full).tidy()
        outside = np.setdiff1d(_extremes(task.sign * task.model.distances(moved), floor=task.floor), ids)
        if not len(outside):
            break
        ids = np.concatenate([ids, outside])
        multipliers = np.concatenate([multipliers, np.zeros(len(outside))])
    return _Settled(moved, ids, multipliers, float(np.abs(step).max()), not len(outside))


def _least_variance(model: SurfaceModel, kind: Kind, pose: Pose) -> float:
    """Return the least variance of the points along a plane or line [mm²].

    Over the feature as a graph ``z = a x + b y + c`` the constraints are linear, and the squares are a convex
    quadratic over ``1 + a^2 + b^2``. Its level sets are convex up to this variance per point:
    an optimum below is the only one.
    """
    first, second = kernels.moments(model.points, pose.origin)
    mean = first / len(model)
    along = pose.axes[:, 1:2] if kind == "profile line" else pose.axes[:, :2]
    spread = along.T @ (second / len(model) - np.outer(mean, mean)) @ along
    return float(np.linalg.eigvalsh(spread)[0])


def _extremes(outward: Floats, *, floor: float | None = None, count: int = 100) -> Ints:
    order = np.argpartition(-outward, min(count, len(outward) - 1))[:count]
    return order if floor is None else order[outward[order] > floor]


def _least_distance(square: Floats, side: Floats, matrix: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Minimise ``x S x / 2 + side x`` with ``matrix x <= -values``; return x and the multipliers."""
    from scipy.optimize import nnls

    factor = _cholesky(square)
    free = -np.linalg.solve(square, side)
    # y = factor.T (x - free): min |y|, rows @ y <= gap
    rows = np.linalg.solve(factor, matrix.T).T
    gap = -values - matrix @ free
    size = max(float(np.abs(gap).max()), 1e-300)
    stacked = np.concatenate([-rows.T, (-gap / size)[None, :]])
    target = np.zeros(len(stacked))
    target[-1] = 1.0
    dual, _ = nnls(stacked, target, maxiter=50 * len(values))
    residual = stacked @ dual - target
    if -residual[-1] <= 1e-14:
        raise AssociationError("no feature has all points on one side")
    y = -size * residual[:-1] / residual[-1]
    multipliers = dual * size / -residual[-1]
    step = np.asarray(free + np.linalg.solve(factor.T, y))
    return _sharpened(square, side, matrix, values, step, np.asarray(multipliers))


def _sharpened(
    square: Floats, side: Floats, matrix: Floats, values: Floats, step: Floats, multipliers: Floats
) -> tuple[Floats, Floats]:
    """Solve the equations of the contacts that were found: a least-distance program loses digits."""
    active = np.flatnonzero(multipliers > 1e-9 * multipliers.max(initial=0.0))
    size, k = len(side), len(active)
    if not 0 < k <= size:
        return step, multipliers
    unit = np.trace(square) / size
    system = np.zeros((size + k, size + k))
    system[:size, :size], system[:size, size:] = square / unit, matrix[active].T
    system[size:, :size] = matrix[active]
    try:
        solved = np.linalg.solve(system, np.concatenate([-side / unit, -values[active]]))
    except np.linalg.LinAlgError:
        return step, multipliers
    near = float(np.abs(solved[:size] - step).max()) <= 1e-6 * float(np.abs(values).max()) + 1e-9
    if not near or (solved[size:] < 0).any():
        return step, multipliers
    out = np.zeros(len(multipliers))
    out[active] = solved[size:] * unit
    return solved[:size], out


def _cholesky(square: Floats) -> Floats:
    """Return the lower factor (k, k), with as much added to the diagonal as it takes."""
    size = np.trace(square) / len(square)
    for added in (1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 10.0):
        try:
            return np.asarray(np.linalg.cholesky(square + added * size * np.eye(len(square))))
        except np.linalg.LinAlgError:
            continue
    raise AssociationError("the constrained least-squares fit is not determined by the points")


def _packed(
    model: SurfaceModel,
    base: Points,
    kind: Kind,
    pose: Pose,
    chosen: list[int],
    ids: Ints,
    multipliers: Floats,
    sign: float,
) -> Association:
    beyond = float((sign * model.distances(pose)).max())  # rounding of the step: moved out again
    slope = np.cos(pose.shape[1]) if model.angular_shape() else 1.0
    pose = Pose(pose.origin, pose.axes, pose.shape + np.array([sign * beyond / slope, 0.0]))
    sums = kernels.normal_equations(model.points, model.kind, pose.origin, pose.axes, pose.shape)
    free, right = pack_squares(model, base, kind, pose, chosen, sums=sums), sums[1]
    values = free.residuals
    length = max(model.length(pose), _EPS)
    unit = np.where(np.isin(np.arange(kernels.N_COLUMNS), (3, 4, 5)), 1.0 / length, 1.0)
    loaded = multipliers > 1e-12 * max(float(multipliers.max(initial=0.0)), 1e-300)
    ids, multipliers = ids[loaded], multipliers[loaded]
    _, jacobian = model.take(ids).rows(pose)
    outward = (sign * jacobian * unit)[:, chosen]
    # The multipliers of the last step belong to the pose before it: those of this pose are close by.
    gradient = (right * unit)[chosen]
    multipliers = multipliers - np.linalg.lstsq(outward.T, gradient + outward.T @ multipliers, rcond=1e-12)[0]
    gradient = gradient + outward.T @ multipliers
    kkt = float(np.abs(gradient).max()) / max(len(model) * length * 1e-3, 1e-300)
    violation = max(0.0, float((sign * values).max()))
    proved = kind in ("plane", "profile line") and free.value**2 < _least_variance(model, kind, pose)
    return replace(
        free,
        criterion="constrained least squares",
        active=ids,
        sides=np.full(len(ids), int(sign)),
        multipliers=multipliers,
        certificate=Certificate(
            holds=kkt <= 1e-9 and bool((multipliers >= 0).all()) and violation <= 32 * _EPS * length,
            scope="global" if proved else "local",
            kkt=kkt,
            violation=violation,
            bound=None,
            reason="Kuhn-Tucker conditions of the constrained squares"
            + ("; their mean is below the variance along the feature: quasi-convex" if proved else ""),
        ),
    )
