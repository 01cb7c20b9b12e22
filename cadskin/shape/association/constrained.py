"""Constrained least squares: the best feature outside of the material (ISO 1101 GE, ASME Y14.5.1-2019).

References
----------
.. [1] C. M. Shakarji, V. Srinivasan, Datum planes based on a constrained L1 norm, J. Comput. Inf. Sci. Eng.
   15 (2015), doi:10.1115/1.4030811, and later papers on the constrained L2 plane.
.. [2] C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, SIAM 1995, chapter 23 (LDP by NNLS).
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association import _kernels as kernels
from cadskin.shape.association.packing import pack_squares
from cadskin.shape.association.pose import Pose
from cadskin.shape.association.result import Association, Certificate, Kind

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points
    from cadskin.shape.association.models import SurfaceModel

__all__ = ["constrained"]

_EPS = float(np.finfo(np.float64).eps)


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
    chosen = list(columns)
    ids = _extremes(sign * model.distances(pose))
    multipliers, last = np.zeros(len(ids)), np.inf
    for _ in range(100):
        square, right, _ = kernels.normal_equations(
            model.points, model.kind, pose.origin, pose.axes, pose.shape
        )
        values, jacobian = model.take(ids).rows(pose)
        step, multipliers = _least_distance(
            square[np.ix_(chosen, chosen)] * np.outer(unit[chosen], unit[chosen]),
            right[chosen] * unit[chosen],
            sign * jacobian[:, chosen] * unit[chosen],
            sign * values,
        )
        full = np.zeros(kernels.N_COLUMNS)
        full[chosen] = step * unit[chosen]
        pose = pose.moved(full).tidy()
        outside = np.setdiff1d(_extremes(sign * model.distances(pose), floor=4 * _EPS * length), ids)
        size = float(np.abs(step).max())
        if not len(outside) and (size <= 8 * _EPS * length or (size < 1e-11 * length and size >= 0.5 * last)):
            break
        ids = np.concatenate([ids, outside])
        last = size
    else:
        raise AssociationError("the constrained least-squares fit did not converge in 100 steps")
    return _packed(model, base, kind, pose, chosen, ids, multipliers, sign)


def _extremes(outward: Floats, *, floor: float | None = None, count: int = 100) -> Ints:
    order = np.argpartition(-outward, min(count, len(outward) - 1))[:count]
    return order if floor is None else order[outward[order] > floor]


def _least_distance(square: Floats, side: Floats, matrix: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Minimise ``x S x / 2 + side x`` with ``matrix x <= -values``; return x and the multipliers."""
    from scipy.optimize import nnls

    factor = np.linalg.cholesky(square + 1e-15 * np.trace(square) * np.eye(len(square)))
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
    return np.asarray(free + np.linalg.solve(factor.T, y)), np.asarray(multipliers)


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
    free = pack_squares(model, base, kind, pose, chosen)
    values = model.distances(pose)
    _, right, _ = kernels.normal_equations(model.points, model.kind, pose.origin, pose.axes, pose.shape)
    loaded = multipliers > 1e-12 * max(float(multipliers.max(initial=0.0)), 1e-300)
    _, jacobian = model.take(ids[loaded]).rows(pose)
    length = max(model.length(pose), _EPS)
    unit = np.where(np.isin(np.arange(kernels.N_COLUMNS), (3, 4, 5)), 1.0 / length, 1.0)
    gradient = ((right + sign * jacobian.T @ multipliers[loaded]) * unit)[chosen]
    kkt = float(np.abs(gradient).max()) / max(len(model) * length * 1e-3, 1e-300)
    violation = max(0.0, float((sign * values).max()))
    return replace(
        free,
        criterion="constrained least squares",
        active=ids[loaded],
        sides=np.full(int(loaded.sum()), int(sign)),
        multipliers=multipliers[loaded],
        certificate=Certificate(
            holds=kkt <= 1e-9 and violation <= 32 * _EPS * length,
            scope="global" if kind in ("plane", "profile line") else "local",
            kkt=kkt,
            violation=violation,
            bound=None,
            reason="Kuhn-Tucker conditions of the constrained squares",
        ),
    )
