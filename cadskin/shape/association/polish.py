"""Newton's method on the Kuhn-Tucker system of the points in contact, and what it proves."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.shape.association._kernels import N_COLUMNS, linear_program

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints
    from cadskin.shape.association.models import DistanceModel
    from cadskin.shape.association.pose import Pose

__all__ = ["Contact", "Problem", "contact_is_unique", "lower_nearby", "polish"]

_DIFFERENCE = 3e-4  # step of second differences, relative to the size


@dataclass(frozen=True, eq=False)
class Problem:
    """A minimax problem: points, free columns, and which sides are bounded by which offset."""

    model: DistanceModel
    free: tuple[int, ...]
    groups: tuple[int | None, int | None]
    length: float

    @property
    def n_free(self) -> int:
        """Number of free motions."""
        return len(self.free)

    @property
    def n_offsets(self) -> int:
        """Number of offsets that are minimised."""
        return len({group for group in self.groups if group is not None})

    def take(self, ids: Ints) -> Problem:
        """Return the problem on some of the points."""
        return replace(self, model=self.model.take(ids))

    def bounded_sides(self) -> Iterator[tuple[float, int]]:
        """Yield sign and offset index of each bounded side."""
        for sign, group in zip((1.0, -1.0), self.groups, strict=True):
            if group is not None:
                yield sign, group

    def scales(self) -> Floats:
        """Return the unit of each free motion: 1 mm, or the angle that moves the farthest point by 1 mm."""
        angular = {3, 4, 5, 7} if self.model.angular_shape() else {3, 4, 5}
        return np.array([1.0 / self.length if c in angular else 1.0 for c in self.free])

    def moved(self, pose: Pose, step: Floats) -> Pose:
        """Return the pose moved by a step of the free motions [mm]."""
        full = np.zeros(N_COLUMNS)
        full[list(self.free)] = step * self.scales()
        return pose.moved(full)

    def rows(self, pose: Pose) -> tuple[Floats, Floats]:
        """Return the distances (n,) and the Jacobian (n, n_free) in mm per mm."""
        values, jacobian = self.model.rows(pose)
        return values, np.ascontiguousarray(jacobian[:, list(self.free)] * self.scales())

    def offsets(self, values: Floats) -> Floats:
        """Return the smallest offsets (n_offsets,) that hold all rows."""
        out = np.full(self.n_offsets, -np.inf)
        for sign, group in self.bounded_sides():
            out[group] = max(out[group], float(values.max()) if sign > 0 else -float(values.min()))
        return out

    def beyond(self, values: Floats, offsets: Floats, slack: float) -> Ints:
        """Return the points that reach beyond the offsets by more than ``slack`` [mm]."""
        bad = np.zeros(len(values), dtype=bool)
        for sign, group in self.bounded_sides():
            bad |= sign * values > offsets[group] + slack
        return np.flatnonzero(bad)

    def ran_away(self, pose: Pose) -> bool:
        """Tell whether the origin of the pose left the points far behind."""
        return self.model.length(pose) > 6.0 * self.length

    def measured(self, contact: Contact) -> Contact:
        """Return the contact with its Kuhn-Tucker residual."""
        system = _System.at(self, contact)
        return replace(contact, kkt=system.residual(contact.multipliers))


@dataclass(frozen=True, eq=False)
class Contact:
    """A candidate optimum: pose, offsets, rows in contact with their sides and multipliers."""

    pose: Pose
    offsets: Floats
    rows: Ints
    sides: Ints
    multipliers: Floats
    kkt: float


@dataclass(frozen=True, eq=False)
class _System:
    """The rows in contact, linearised: ``matrix`` (k, n_free + n_offsets), ``gap`` (k,) [mm], cost."""

    matrix: Floats
    gap: Floats
    cost: Floats

    @classmethod
    def at(cls, problem: Problem, contact: Contact) -> _System:
        values, jacobian = problem.take(contact.rows).rows(contact.pose)
        p, g = problem.n_free, problem.n_offsets
        matrix = np.zeros((len(contact.rows), p + g))
        matrix[:, :p] = contact.sides[:, None] * jacobian
        groups = _groups_of(problem, contact.sides)
        matrix[np.arange(len(matrix)), p + groups] = -1.0
        gap = contact.sides * values - contact.offsets[groups]
        return cls(matrix, gap, np.concatenate([np.zeros(p), np.ones(g)]))

    def residual(self, multipliers: Floats) -> float:
        return float(np.abs(self.cost + self.matrix.T @ multipliers).max())


def _groups_of(problem: Problem, sides: Ints) -> Ints:
    upper, lower = problem.groups
    return np.where(sides > 0, 0 if upper is None else upper, 0 if lower is None else lower)


def polish(problem: Problem, contact: Contact, rounding: float) -> Contact | None:
    """Return the optimum with (about) the given contacts, or None when they do not carry one.

    Contacts that pull (negative multiplier) are dropped, points beyond the zone are added, a few times.
    """
    for _ in range(4 * (problem.n_free + problem.n_offsets)):
        if not len(contact.rows):
            return None
        solved = _newton(problem, contact)
        if solved is None:
            return None
        pulling = int(np.argmin(solved.multipliers))
        if solved.multipliers[pulling] < -1e-10:
            contact = _without(solved, pulling)
            continue
        values = problem.model.distances(solved.pose)
        outside = problem.beyond(values, solved.offsets, rounding)
        if not len(outside):
            return solved if solved.kkt <= 1e-9 else None
        if len(contact.rows) >= problem.n_free + problem.n_offsets:
            return None
        contact = _with_worst(problem, solved, values)
    return None


def _without(contact: Contact, index: int) -> Contact:
    keep = np.arange(len(contact.rows)) != index
    return replace(
        contact,
        rows=contact.rows[keep],
        sides=contact.sides[keep],
        multipliers=np.maximum(contact.multipliers[keep], 0.0),
    )


def _with_worst(problem: Problem, contact: Contact, values: Floats) -> Contact:
    excess = [(sign * values - contact.offsets[group], sign) for sign, group in problem.bounded_sides()]
    worst, sign = max(excess, key=lambda pair: float(pair[0].max()))
    return replace(
        contact,
        rows=np.append(contact.rows, int(np.argmax(worst))),
        sides=np.append(contact.sides, int(sign)),
        multipliers=np.append(contact.multipliers, 0.0),
    )


def _newton(problem: Problem, contact: Contact) -> Contact | None:
    """Solve the Kuhn-Tucker equations of the contacts; None when the iteration leaves the neighbourhood."""
    size = problem.n_free + problem.n_offsets
    hessian = np.zeros((size, size))
    last = np.inf
    for iteration in range(30):
        system = _System.at(problem, contact)
        if len(contact.rows) < size and (iteration < 3 or iteration % 8 == 0):
            hessian = _lagrangian_hessian(problem, contact)
        step, multipliers = _kkt_step(system, hessian)
        contact = replace(
            contact,
            pose=problem.moved(contact.pose, step[: problem.n_free]),
            offsets=contact.offsets + step[problem.n_free :],
            multipliers=multipliers,
        )
        moved = float(np.abs(step).max())
        if not moved < 0.5 * problem.length:
            return None
        if moved <= 4e-16 * problem.length or (moved <= 1e-12 * problem.length and moved >= 0.5 * last):
            system = _System.at(problem, contact)
            if np.abs(system.gap).max() > 1e-12 * problem.length:
                return None
            return replace(contact, kkt=system.residual(contact.multipliers))
        last = moved
    return None


def _kkt_step(system: _System, hessian: Floats) -> tuple[Floats, Floats]:
    """Solve the linearised Kuhn-Tucker equations in the least-norm sense."""
    k, size = system.matrix.shape
    matrix = np.zeros((size + k, size + k))
    matrix[:size, :size] = hessian
    matrix[:size, size:] = system.matrix.T
    matrix[size:, :size] = system.matrix
    right = np.concatenate([-system.cost, -system.gap])
    try:
        solution = np.linalg.solve(matrix, right)
        trusted = np.linalg.cond(matrix) < 1e12
    except np.linalg.LinAlgError:
        trusted = False
    if not trusted:
        solution = np.linalg.lstsq(matrix, right, rcond=1e-12)[0]
    return solution[:size], solution[size:]


def _lagrangian_hessian(problem: Problem, contact: Contact) -> Floats:
    """Return second differences of ``sum multiplier * side * distance`` (zero for the offsets)."""
    p = problem.n_free
    model = problem.model.take(contact.rows)
    weights = contact.multipliers * contact.sides
    # Well within the curvature of the distances, and clear of their rounding.
    h = max(min(_DIFFERENCE * problem.length, 1e-2 * model.bend(contact.pose)), 1e-9 * problem.length)

    def value(step: Floats) -> float:
        return float(weights @ model.distances(problem.moved(contact.pose, step)))

    unit = np.eye(p) * h
    centre = value(np.zeros(p))
    ahead, behind = [value(e) for e in unit], [value(-e) for e in unit]
    hessian = np.zeros((p + problem.n_offsets, p + problem.n_offsets))
    for i in range(p):
        hessian[i, i] = (ahead[i] - 2 * centre + behind[i]) / h**2
        for j in range(i):
            both = value(unit[i] + unit[j]) + value(-unit[i] - unit[j])
            mixed = both - ahead[i] - behind[i] - ahead[j] - behind[j] + 2 * centre
            hessian[i, j] = hessian[j, i] = mixed / (2 * h**2)
    return hessian


def contact_is_unique(problem: Problem, contact: Contact, rounding: float) -> bool:
    """Tell whether the optimum cannot be moved without loss (strict local optimum)."""
    system = _System.at(problem, contact)
    loaded = system.matrix[contact.multipliers > 1e-9]
    if not len(loaded):
        return False
    _, singular, right = np.linalg.svd(loaded)
    rank = int((singular > 1e-9).sum())
    null = right[rank:].T
    if null.shape[1] == 0:
        return True
    curvature = np.linalg.eigvalsh(null.T @ _lagrangian_hessian(problem, contact) @ null)
    if curvature[0] > 1e-6 / problem.length:
        return True
    return not _can_slide(problem, contact, system.cost, rounding)


def lower_nearby(problem: Problem, contact: Contact, radius: float) -> Pose | None:
    """Return a better pose along a direction of negative curvature, where the contacts carry a saddle only.

    Few contacts leave directions in which the value changes to second order: a two-lobed hole touches its
    concentric inscribed circle at two valleys, and grows when the circle moves along the long axis. The
    search stays within ``radius`` [mm]: farther off lie other basins (out of the hole).
    """
    p = problem.n_free
    if len(contact.rows) >= p + problem.n_offsets:
        return None
    system = _System.at(problem, contact)
    _, singular, right = np.linalg.svd(system.matrix)
    null = right[int((singular > 1e-9).sum()) :].T
    values, vectors = np.linalg.eigh(null.T @ _lagrangian_hessian(problem, contact) @ null)
    if not len(values) or values[0] > -1e-6 / problem.length:
        return None
    direction = (null @ vectors[:, 0])[:p]
    best, lowest = None, float(contact.offsets.sum())
    for exponent in np.arange(0.0, 7.0, 0.25):
        for sign in (1.0, -1.0):
            pose = problem.moved(contact.pose, sign * direction * radius * 10.0**-exponent)
            reached = float(problem.offsets(problem.model.distances(pose)).sum())
            if reached < lowest - 1e-14 * problem.length:
                best, lowest = pose, reached
    return best


def _can_slide(problem: Problem, contact: Contact, cost: Floats, rounding: float) -> bool:
    """Tell whether a motion exists that, to first order, moves no tied point outward."""
    p, size = problem.n_free, problem.n_free + problem.n_offsets
    values, jacobian = problem.rows(contact.pose)
    blocks = [cost[None, :]]
    for sign, group in problem.bounded_sides():
        tied = sign * values > contact.offsets[group] - rounding
        block = np.zeros((int(tied.sum()), size))
        block[:, :p] = sign * jacobian[tied]
        block[:, p + group] = -1.0
        blocks.append(block)
    matrix = np.concatenate(blocks)
    right, box = np.zeros(len(matrix)), np.ones(size)
    for j in range(p):
        for sign in (1.0, -1.0):
            wish = np.zeros(size)
            wish[j] = sign
            try:
                motion = linear_program(matrix, right, wish, box, 1e-12)[0]
            except np.linalg.LinAlgError:  # a degenerate basis proves nothing: not known to be unique
                return True
            if abs(motion[j]) > 1e-6:
                return True
    return False
