"""Pack solved associations into results with their certificates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association import _kernels as kernels
from cadskin.shape.association.bounds import enclosing_line_bound, widest_weights
from cadskin.shape.association.pose import Pose
from cadskin.shape.association.result import Association, Certificate, Circle, Criterion, Kind, Line
from cadskin.shape.association.ring_bounds import inscribed_within, zone_is_least
from cadskin.shape.association.slabs import hull_proof, tilt_proof
from cadskin.shape.association.widths import width_in_plane
from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere, Torus

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points
    from cadskin.shape.association.minimax import Minimax, Mode
    from cadskin.shape.association.models import SurfaceModel
    from cadskin.shape.association.result import AssociatedFeature, Proof

__all__ = ["pack", "pack_squares"]

_EPS = float(np.finfo(np.float64).eps)


def pack_squares(
    model: SurfaceModel,
    base: Points,
    kind: Kind,
    pose: Pose,
    columns: list[int],
    *,
    sums: tuple[Floats, Floats, float] | None = None,
) -> Association:
    """Return the result of a least-squares fit over ``columns``; ``sums``: its normal equations, if known."""
    values = model.distances(pose)
    if sums is None:
        sums = kernels.normal_equations(model.points, model.kind, pose.origin, pose.axes, pose.shape)
    square, right, total = sums
    length = max(model.length(pose), _EPS)
    unit = np.array([1, 1, 1, 1 / length, 1 / length, 1 / length, 1, 1.0])
    # The step that would still be taken, in mm.
    left = float(np.abs(right * unit)[columns].max(initial=0.0)) / len(model)
    none = np.zeros(0, dtype=np.int64)
    return Association(
        kind=kind,
        criterion="least squares",
        feature=_feature(kind, pose, base, 0.0),
        value=float(np.sqrt(total / len(model))),
        residuals=values,
        active=none,
        sides=none,
        multipliers=np.zeros(0),
        certificate=Certificate(
            holds=left <= 1e-12 * length,
            scope="global" if kind in ("plane", "line", "profile line") else "local",
            kkt=left,
            violation=0.0,
            bound=None,
            reason="the gradient of the squared distances vanishes",
        ),
        unique=bool(np.linalg.cond(square[np.ix_(columns, columns)]) < 1e14) if columns else True,
        pose=_in_world(pose, base),
    )


def pack(
    found: Minimax,
    model: SurfaceModel,
    base: Points,
    kind: Kind,
    criterion: Criterion,
    mode: Mode,
    *,
    exact: bool = False,
    proof: Proof | None = None,
) -> Association:
    """Return the result of a minimax association; ``base`` was subtracted from the points."""
    value, middle = found.value, 0.0
    if mode == "zone":
        middle = 0.5 * float(found.distances.max() + found.distances.min())
    elif mode == "upper":
        middle = value
    else:
        value = -value
        middle = value
    if kind == "line":
        value, middle = 2.0 * value, 0.0
    if exact:
        proof = ("global", value, "the points are on one ideal feature to rounding")
    scope, bound, reason = proof or _scope(found, model, kind, mode, value)
    return Association(
        kind=kind,
        criterion=criterion,
        feature=_feature(kind, found.pose, base, middle),
        value=value,
        residuals=found.distances - middle,
        active=found.active,
        sides=found.sides,
        multipliers=found.multipliers,
        certificate=Certificate(
            holds=found.certified,
            scope=scope,
            kkt=found.kkt,
            violation=found.violation,
            bound=bound,
            reason=reason,
        ),
        unique=found.unique,
        pose=_in_world(found.pose, base),
    )


def tied_line_bound(model: SurfaceModel, found: Minimax) -> float:
    """Return the dual bound of all tied points, weighted to lie far apart along the axis [mm]."""
    tied = np.flatnonzero(found.distances >= found.distances.max() - 1e-11 * _diagonal(model.points))
    if len(tied) > 2000:
        return 0.0
    tied_model = model.take(tied)
    length = max(model.length(found.pose), _EPS)
    _, jacobian = tied_model.rows(found.pose)
    weights = widest_weights(
        jacobian[:, [0, 1, 3, 4]] / np.array([1, 1, length, length]),
        found.pose.local(tied_model.points)[:, 2],
    )
    return 0.0 if weights is None else enclosing_line_bound(tied_model.points, weights)


def _scope(found: Minimax, model: SurfaceModel, kind: Kind, mode: Mode, value: float) -> Proof:
    """Return scope, bound and reason of a certificate."""
    points = model.points
    if kind == "profile line":
        section = np.ascontiguousarray(found.pose.axes[:, 0])
        return tilt_proof(points, found, kind)[0] or hull_proof(found, width_in_plane(points, section))
    if kind == "plane":  # in a direction that is given
        return "global", value, "the direction is given"
    if mode == "upper" and kind in ("circle", "sphere"):
        return "global", value, "the problem is convex"
    if mode == "upper" and len(found.active):
        diameter = 2.0 if kind == "line" else 1.0
        close = value - 1e-12 * max(_diagonal(points), value)
        bound = diameter * enclosing_line_bound(points[found.active], found.multipliers)
        if bound < close:
            bound = max(bound, diameter * tied_line_bound(model, found))
        if bound >= close:
            return "global", bound, "dual bound trace(M) - lambda_max(M) of the weighted contacts"
        return "local", bound, "Kuhn-Tucker conditions; the dual bound leaves a gap"
    if kind in ("circle", "sphere"):
        return _ring_proof(found, points, kind, mode, value)
    return "local", None, "Kuhn-Tucker conditions"


def _ring_proof(found: Minimax, points: Points, kind: Kind, mode: Mode, value: float) -> Proof:
    """Return what the contacts and the points all around prove about a circle or sphere."""
    size = 2 if kind == "circle" else 3
    sample = found.pose.local(points[:: max(1, len(points) // 2000)])[:, :size]
    outer, inner = (found.pose.local(points[found.active[found.sides == s]])[:, :size] for s in (1, -1))
    nearest, farthest = (
        float(end + found.pose.shape[0]) for end in (found.distances.min(), found.distances.max())
    )
    if mode == "zone":
        if zone_is_least(sample, outer, inner, (nearest, farthest)):
            return "global", value, "every other centre widens the zone: contacts near it, points all around"
        return "local", None, "Kuhn-Tucker conditions; the points are not all around, or few carry the zone"
    within = inscribed_within(sample, inner, (nearest, farthest))
    if within >= farthest:
        return "global", value, f"no centre within {within:.6g} mm, all that the points surround, is better"
    return "local", None, f"Kuhn-Tucker conditions; no better centre within {within:.6g} mm"


def _diagonal(points: Points) -> float:
    """Return a bound of the size of the points [mm]."""
    return 2.0 * kernels.farthest(points, points[0])


def _feature(kind: Kind, pose: Pose, base: Points, middle: float) -> AssociatedFeature:
    """Return the ideal feature at offset ``middle`` from the surface of the pose."""
    origin, axis, (s0, s1) = pose.origin + base, pose.axis, pose.shape
    if kind == "plane" or kind == "profile line":
        normal_offset = (s0 + middle) * axis
        if kind == "plane":
            return Plane(origin + normal_offset, axis)
        return Line(origin + normal_offset, np.ascontiguousarray(pose.axes[:, 1]))
    if kind == "line":
        return Line(origin, axis)
    if kind == "circle":
        return Circle(origin, axis, float(s0 + middle))
    if kind == "cylinder":
        return Cylinder(origin, axis, float(s0 + middle))
    if kind == "sphere":
        return Sphere(origin, float(s0 + middle))
    if kind == "torus":
        return Torus(origin, axis, float(s1), float(s0 + middle))
    if not 0.0 < abs(s1) < 0.5 * np.pi:
        raise AssociationError(
            f"the points are no cone: its half angle came out as {np.degrees(s1):.3g} degrees; "
            "associate a plane or a cylinder"
        )
    if s1 < 0:  # the same cone, seen from the other end of its axis
        axis, s1 = -axis, -s1
    radius = s0 + middle / np.cos(s1)
    return Cone(origin - axis * radius / np.tan(s1), axis, float(s1))


def _in_world(pose: Pose, base: Points) -> Pose:
    return Pose(pose.origin + base, pose.axes, pose.shape)
