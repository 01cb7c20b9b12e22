"""The kernel: finite minimax by linear programs over a working set, polished by Newton on the KKT system.

The problem is ``min over x of sum over groups g of max over rows i in g of s_i d_i(x)``, with ``d_i`` the
signed distance of point i and the sides ``s_i`` = +1 or -1. Four modes cover the associations of ISO 1101 and
ISO 5459:

==========  =======================  ===============================================
mode        minimised                used for
==========  =======================  ===============================================
zone        max d - min d            minimum zone (Chebyshev with free size)
upper       max d                    minimum circumscribed; worst boundary violation
lower       -min d                   maximum inscribed
symmetric   max abs(d)               Chebyshev with fixed size, profile, position
==========  =======================  ===============================================

References
----------
.. [1] G. A. Watson, Approximation Theory and Numerical Methods, Wiley 1980 (finite minimax, exchange, KKT).
.. [2] R. Fletcher, E. Sainz de la Maza, Nonlinear programming and nonsmooth optimization by successive linear
   programming, Math. Prog. 43, 235-256 (1989), doi:10.1007/BF01582292.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin.errors import AssociationError
from cadskin.shape.association._kernels import linear_program
from cadskin.shape.association.polish import Contact, Problem, contact_is_unique, lower_nearby, polish

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints
    from cadskin.shape.association.models import DistanceModel
    from cadskin.shape.association.pose import Pose

__all__ = ["Minimax", "Mode", "minimax"]

Mode: TypeAlias = Literal["zone", "upper", "lower", "symmetric"]

# (group of the + side, group of the - side); None where the side is not bounded.
_GROUPS: dict[str, tuple[int | None, int | None]] = {
    "zone": (0, 1),
    "upper": (0, None),
    "lower": (None, 0),
    "symmetric": (0, 0),
}
_WORKING_SET = 6000  # up to here every point is in the working set
_EPS = float(np.finfo(np.float64).eps)


@dataclass(frozen=True, eq=False)
class Minimax:
    """A solved minimax problem.

    Parameters
    ----------
    pose : Pose
    value : float
        The minimised quantity, from the distances of all points [mm].
    distances : (n,) float
        Signed distances at the optimum [mm].
    active : (k,) int
        Points that carry the optimum.
    sides : (k,) int
        +1 upper, -1 lower side.
    multipliers : (k,) float
        Kuhn-Tucker multipliers, >= 0, summing to 1 in each group.
    kkt : float
        Largest component of the Lagrangian's gradient in units of distance per distance.
    violation : float
        How far a point reaches beyond the active ones [mm].
    unique : bool
        False when the optimum can be moved without loss.
    certified : bool
        The Kuhn-Tucker conditions hold to rounding.
    iterations : int
        Linear programs solved.
    """

    pose: Pose
    value: float
    distances: Floats
    active: Ints
    sides: Ints
    multipliers: Floats
    kkt: float
    violation: float
    unique: bool
    certified: bool
    iterations: int


def minimax(
    model: DistanceModel,
    start: Pose,
    free: tuple[int, ...],
    mode: Mode,
    *,
    trust: float | None = None,
    max_iterations: int = 200,
) -> Minimax:
    """Minimise the largest distance over the free motions of a pose.

    Parameters
    ----------
    model : DistanceModel
        The points and their distance function.
    start : Pose
        Usually the least-squares fit.
    free : tuple of int
        Columns of `Pose` that may change.
    mode : {"zone", "upper", "lower", "symmetric"}
    trust : float, optional
        First trust radius [mm]; a fiftieth of the size at most.
    max_iterations : int
        Linear programs at most.

    Raises
    ------
    AssociationError
        The optimum runs away (none exists).
    """
    distances = model.distances(start)
    if not np.isfinite(distances).all():
        raise AssociationError("the distances are not finite at the start of the association")
    if not free:
        return _without_freedom(start, distances, mode)
    length = max(model.length(start), _EPS)
    rounding = 16 * _EPS * length
    problem = Problem(model, free, _GROUPS[mode], length)
    ids = _first_working_set(distances, _GROUPS[mode])
    pose, iterations = start, 0
    for _ in range(60):
        sub = problem if len(ids) == len(model) else problem.take(ids)
        contact, used = _solve(sub, pose, trust=trust, max_iterations=max_iterations - iterations)
        iterations += used
        pose = contact.pose.tidy()
        distances = model.distances(pose)
        reach = problem.offsets(distances)
        outside = problem.beyond(distances, contact.offsets, rounding)
        if not len(outside) or len(ids) == len(model):
            break
        ids = np.union1d(ids, _worst(outside, distances, problem, contact.offsets))
    else:
        raise AssociationError("the association did not settle its working set; the points may be degenerate")
    return Minimax(
        pose=pose,
        value=float(reach.sum()),
        distances=distances,
        active=ids[contact.rows],
        sides=contact.sides,
        multipliers=contact.multipliers,
        kkt=contact.kkt,
        violation=float(max(0.0, (reach - contact.offsets).max())),
        unique=contact_is_unique(sub, contact, rounding),
        certified=bool(contact.kkt <= 1e-9 and (reach - contact.offsets).max() <= 4 * rounding),
        iterations=iterations,
    )


def _without_freedom(pose: Pose, distances: Floats, mode: Mode) -> Minimax:
    """Return the value where nothing can move: an evaluation in closed form."""
    high, low = int(np.argmax(distances)), int(np.argmin(distances))
    top, bottom = float(distances[high]), -float(distances[low])
    if mode == "zone":
        value, active, sides = top + bottom, [high, low], [1, -1]
    elif mode == "upper" or (mode == "symmetric" and top >= bottom):
        value, active, sides = top, [high], [1]
    else:
        value, active, sides = bottom, [low], [-1]
    return Minimax(
        pose=pose,
        value=value,
        distances=distances,
        active=np.array(active),
        sides=np.array(sides),
        multipliers=np.ones(len(active)),
        kkt=0.0,
        violation=0.0,
        unique=True,
        certified=True,
        iterations=0,
    )


def _first_working_set(distances: Floats, groups: tuple[int | None, int | None]) -> Ints:
    """Every point of a small set; the extreme ones and a coarse sample of a large one."""
    n = len(distances)
    if n <= _WORKING_SET:
        return np.arange(n)
    count = _WORKING_SET // 4
    parts = [np.arange(0, n, max(1, n // count))]
    order = np.argpartition(distances, [count, n - count])
    if groups[1] is not None:
        parts.append(order[:count])
    if groups[0] is not None:
        parts.append(order[n - count :])
    return np.unique(np.concatenate(parts))


def _worst(outside: Ints, distances: Floats, problem: Problem, offsets: Floats) -> Ints:
    """Return the violating points, or the worst of them where they are many."""
    if len(outside) <= _WORKING_SET // 4:
        return outside
    excess = np.full(len(outside), -np.inf)
    for sign, group in problem.bounded_sides():
        excess = np.maximum(excess, sign * distances[outside] - offsets[group])
    return outside[np.argpartition(excess, -_WORKING_SET // 4)[-_WORKING_SET // 4 :]]


def _solve(problem: Problem, pose: Pose, *, trust: float | None, max_iterations: int) -> tuple[Contact, int]:
    """Solve the problem on its points: linear programs in a trust region, a polish after each."""
    values, jacobian = problem.rows(pose)
    offsets = problem.offsets(values)
    spread = float(np.ptp(values)) if problem.n_offsets == 2 else float(np.abs(offsets).sum())
    radius = min(0.02 * problem.length, 4.0 * max(float(np.ptp(values)), 1e-3 * spread))
    radius = max(trust if trust is not None else radius, 1e-9 * problem.length)
    rounding, first_radius = 16 * _EPS * problem.length, radius
    for iteration in range(1, max_iterations + 1):
        step, multipliers, rows, sides, boxed = _linear_step(problem, values, jacobian, offsets, radius)
        guess = Contact(pose, offsets, rows, sides, multipliers, np.inf)
        polished = polish(problem, guess, rounding)
        if polished is not None and polished.offsets.sum() <= offsets.sum() + rounding:
            better = lower_nearby(problem, polished, first_radius)
            if better is None:
                return polished, iteration
            pose = better
            values, jacobian = problem.rows(pose)
            offsets = problem.offsets(values)
            continue
        predicted = -float(step[problem.n_free :].sum())
        if predicted <= rounding and boxed <= 1e-9:
            return problem.measured(guess), iteration
        trial = problem.moved(pose, step[: problem.n_free])
        trial_values, trial_jacobian = problem.rows(trial)
        trial_offsets = problem.offsets(trial_values)
        gain = float((offsets - trial_offsets).sum())
        used = float(np.abs(step[: problem.n_free]).max(initial=0.0))
        if gain > 0.75 * predicted and used > 0.99 * radius:
            radius = min(3.0 * radius, 0.1 * problem.length)
        elif gain < 0.25 * predicted:
            radius = 0.3 * min(radius, max(used, 1e-3 * radius))
        if gain > 1e-4 * predicted:
            pose, values, jacobian, offsets = trial, trial_values, trial_jacobian, trial_offsets
        if problem.ran_away(pose):
            raise AssociationError(
                "none exists: the optimum runs away from the points (an arc of 180 degrees or less has no "
                "maximum inscribed element; other points are as well on a plane or a line)"
            )
        if radius < 1e-15 * problem.length or predicted <= 1e-3 * _EPS * problem.length:
            break
    # The best that was found; its Kuhn-Tucker residual tells that it is not certified.
    return problem.measured(replace(guess, pose=pose, offsets=offsets)), max(iteration, 1)


def _linear_step(
    problem: Problem, values: Floats, jacobian: Floats, offsets: Floats, radius: float
) -> tuple[Floats, Floats, Ints, Ints, float]:
    """Solve the linear program at a pose.

    Returns the step (free motions [mm], then change of the offsets), the multipliers, rows and sides of the
    contacts, and the sum of the multipliers on the trust region.
    """
    p, g = problem.n_free, problem.n_offsets
    matrices, right, row_ids, row_sides = [], [], [], []
    for sign, group in problem.bounded_sides():
        block = np.zeros((len(values), p + g))
        block[:, :p] = sign * jacobian
        block[:, p + group] = -1.0
        matrices.append(block)
        right.append((offsets[group] - sign * values) / radius)
        row_ids.append(np.arange(len(values)))
        row_sides.append(np.full(len(values), int(sign)))
    matrix, rows, sides = np.concatenate(matrices), np.concatenate(row_ids), np.concatenate(row_sides)
    cost = np.concatenate([np.zeros(p), np.ones(g)])
    box = np.concatenate([np.ones(p), np.full(g, 2.0 * p + 2.0)])
    z, basis, multipliers, status = linear_program(matrix, np.concatenate(right), cost, box, 1e-13)
    if status == 2:
        raise AssociationError("the linear program of the association has no solution (not finite input?)")
    real = basis < len(matrix)
    keep = real & (multipliers > 1e-12)
    return (
        z * radius,
        multipliers[keep],
        rows[basis[keep]],
        sides[basis[keep]],
        float(multipliers[~real].sum()),
    )
