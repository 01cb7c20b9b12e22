"""Reference point sets: the value of a characteristic is prescribed by construction, exact to about 1e-12 mm.

A few contacts are placed on the two sides of the zone such that the Kuhn-Tucker conditions hold with
multipliers that are clear of zero (for a plane: the alternation 3-1 or 2-2); all other points lie strictly
inside. So the zone is a strict optimum, whatever the filling is: random, wavy, on a partial arc, in sections.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._random import child, seed_sequence
from cadskin.errors import SpecificationError
from cadskin.shape.association import _kernels as kernels
from cadskin.shape.association import associate, rotation
from cadskin.verify.reference_kinds import CHARACTERISTICS, RADIUS, FormKind, ideal_surface
from cadskin.verify.reference_sampling import Sampling, unit_square

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, RNGLike, Vectors

__all__ = ["CHARACTERISTICS", "ReferenceSet", "planted_plane", "planted_shaft", "reference_set"]


@dataclass(frozen=True, eq=False)
class ReferenceSet:
    """A point set with its prescribed value.

    Parameters
    ----------
    characteristic : str
    value : float
        What the evaluation must give [mm]; a diameter for sizes.
    points : (n, 3) float
    outliers : (m, 3) float
        Points that do not belong to the surface; the value is that of ``points`` alone.
    active : (k,) int
        The contacts.
    multipliers : (k,) float
    section_normal : (3,) float or None
    axis : (3,) float
        Axis, or normal of the plane.
    """

    characteristic: str
    value: float
    points: Points
    outliers: Points
    active: Ints
    multipliers: Floats
    section_normal: Vectors | None
    axis: Vectors

    def question(self, name: str) -> dict[str, Any]:
        """Return the JSON object of a case, the answer included."""
        kind = CHARACTERISTICS[self.characteristic]
        out: dict[str, Any] = {
            "id": name,
            "units": "mm",
            "csv": f"{name}.csv",
            "characteristic": kind.characteristic,
            "feature_type": kind.feature_type,
            "association": kind.criterion,
            "reference": {
                "value": self.value,
                "u": 1e-12,
                "quantity": kind.quantity,
                "active": self.active.tolist(),
                "multipliers": self.multipliers.tolist(),
                "axis": self.axis.tolist(),
            },
            "tolerance_abs": 1e-9,
            "proof": "strict optimum by construction: positive Kuhn-Tucker multipliers, the rest inside",
        }
        if self.section_normal is not None:
            out["section_plane_normal"] = self.section_normal.tolist()
        return out


def reference_set(
    characteristic: str,
    value: float,
    *,
    n_points: int = 1000,
    arc: float = 2 * np.pi,
    sampling: Sampling = "random",
    waviness: int = 0,
    n_outliers: int = 0,
    rng: RNGLike = None,
) -> ReferenceSet:
    """Make a point set whose characteristic has a prescribed value.

    Parameters
    ----------
    characteristic : str
        One of `CHARACTERISTICS`.
    value : float
        [mm]; for sizes the diameter.
    n_points : int
    arc : float
        Angle that is covered [rad]; a full turn by default.
    sampling : {"random", "grid", "sections", "generatrix", "helix", "bird cage"}
    waviness : int
        Undulations of a smooth part of the filling; 0 for random filling only.
    n_outliers : int
        Points far off the surface, kept apart.
    rng : seed or generator

    Raises
    ------
    SpecificationError
        A characteristic that is not known, a value that is not positive, an arc on which no such optimum
        exists.

    Examples
    --------
    >>> made = reference_set("cylindricity", 0.05, rng=7)
    >>> round(associate(made.points, "cylinder").value, 12)
    0.05
    """
    kind = CHARACTERISTICS.get(characteristic)
    if kind is None:
        raise SpecificationError(
            f"no reference sets of {characteristic!r}; choose one of {', '.join(CHARACTERISTICS)}"
        )
    contacts_needed = len(kind.free) + len(kind.sides)
    if not value > 0 or n_points < 4 * contacts_needed:
        raise SpecificationError(
            f"a reference set needs a positive value and at least {4 * contacts_needed} points, "
            f"got {value} and {n_points}"
        )
    if not kind.is_zone and arc <= np.pi:
        raise SpecificationError("a circumscribed or inscribed element needs an arc of more than 180 degrees")
    generator = child(seed_sequence(rng), 0)
    for _ in range(40):
        made = _attempt(characteristic, kind, value, n_points, arc, sampling, waviness, n_outliers, generator)
        if made is not None:
            return made
    raise SpecificationError(
        f"no {characteristic} of {value} mm could be planted on an arc of {np.degrees(arc):.3g} degrees"
    )


def _attempt(
    characteristic: str,
    kind: FormKind,
    value: float,
    n_points: int,
    arc: float,
    sampling: Sampling,
    waviness: int,
    n_outliers: int,
    rng: np.random.Generator,
) -> ReferenceSet | None:
    radius, amplitude = (0.5 * value, 0.01 * value) if len(kind.sides) == 1 else (RADIUS, 0.5 * value)
    contacts = _contacts(kind, radius, amplitude, arc, rng)
    if contacts is None:
        return None
    placed, multipliers = contacts
    filling = _filling(kind, radius, amplitude, n_points - len(placed), arc, sampling, waviness, rng)
    points = np.concatenate([filling, placed])
    order = rng.permutation(len(points))
    turn, shift = rotation(rng.standard_normal(3) * 1.5), rng.uniform(-50, 50, 3)
    world = points[order] @ turn.T + shift
    active = np.flatnonzero(order >= len(filling))
    section = turn[:, 2] if kind.name == "circle" else turn[:, 0] if kind.name == "profile line" else None
    found = associate(world, kind.name, kind.criterion, section_normal=section)  # type: ignore[arg-type]
    reached = found.value if kind.is_zone else 2.0 * found.value
    if abs(reached - value) > 1e-11 * max(1.0, value):
        return None  # another optimum is better: not what was planted
    outliers = (
        world[rng.integers(0, len(world), n_outliers)] + rng.standard_normal((n_outliers, 3)) * 20 * amplitude
    )
    return ReferenceSet(
        characteristic,
        float(value),
        np.asarray(world),
        np.asarray(outliers),
        active,
        multipliers[order[active] - len(filling)],
        section,
        turn[:, 2],
    )


def _contacts(
    kind: FormKind, radius: float, amplitude: float, arc: float, rng: np.random.Generator
) -> tuple[Points, Floats] | None:
    """Draw contacts until the Kuhn-Tucker multipliers of one draw are clear of zero."""
    count, n_sides = len(kind.free) + len(kind.sides), len(kind.sides)
    for _ in range(200):
        sides = rng.choice(kind.sides, size=count)
        if len(set(sides.tolist())) < n_sides:
            continue
        tries = 500
        base, normals = _surface(kind, radius, count * tries, arc, "random", rng)
        offset = amplitude if n_sides == 2 else 0.0
        placed = base + np.tile(sides, tries)[:, None] * offset * normals
        _, jacobian = kernels.rows(placed, kind.kernel, np.zeros(3), np.eye(3), kind.shape(radius))
        scale = np.array([1, 1, 1, 0.05, 0.05, 0.05, 1, 0.05])
        blocks = (jacobian * scale)[:, list(kind.free)].reshape(tries, count, -1) * sides[None, :, None]
        sums = np.stack([np.broadcast_to(sides == s, (tries, count)) for s in kind.sides], axis=2)
        matrices = np.concatenate([blocks, sums], axis=2).transpose(0, 2, 1)
        right = np.concatenate([np.zeros(len(kind.free)), np.ones(n_sides)])
        usable = np.abs(np.linalg.det(matrices)) > 1e-9
        if not usable.any():
            continue
        solved = np.linalg.solve(matrices[usable], np.broadcast_to(right[:, None], (usable.sum(), count, 1)))[
            ..., 0
        ]
        best = int(np.argmax(solved.min(axis=1)))
        if solved[best].min() > 0.05:
            return placed.reshape(tries, count, 3)[usable][best], solved[best]
    return None


def _filling(
    kind: FormKind,
    radius: float,
    amplitude: float,
    n: int,
    arc: float,
    sampling: Sampling,
    waviness: int,
    rng: np.random.Generator,
) -> Points:
    """Return points strictly inside of the zone."""
    base, normals = _surface(kind, radius, n, arc, sampling, rng)
    noise = rng.uniform(-1, 1, len(base))
    if waviness:
        phase = rng.uniform(0, 2 * np.pi, 2)
        along = base @ rng.standard_normal(3) / 15.0
        angle = np.arctan2(base[:, 1], base[:, 0])
        wave = np.cos(waviness * angle + phase[0]) * np.cos(along + phase[1])
        noise = 0.8 * wave + 0.2 * noise
    if kind.name == "line":
        return np.asarray(
            base - (1.0 - 0.95 * np.sqrt(rng.uniform(0, 1, len(base))))[:, None] * radius * normals
        )
    depth = 0.95 * amplitude * noise
    if len(kind.sides) == 1:  # strictly on the far side of the contacts
        depth = -kind.sides[0] * amplitude * (0.05 + 0.45 * (1 + noise))
    return np.asarray(base + depth[:, None] * normals)


def _surface(
    kind: FormKind, radius: float, n: int, arc: float, sampling: Sampling, rng: np.random.Generator
) -> tuple[Points, Vectors]:
    return ideal_surface(kind, radius, arc, *unit_square(n, sampling, rng))


def planted_plane(
    flatness: float, count: int, rng: np.random.Generator, *, sampling: Sampling = "random"
) -> Points:
    """Return a plane (count, 3) about z = 0 whose minimum zone is planted: |z| reaches half the flatness.

    The contacts stand first.
    """
    kind = CHARACTERISTICS["flatness"]
    for _ in range(40):
        contacts = _contacts(kind, RADIUS, 0.5 * flatness, 2 * np.pi, rng)
        if contacts is None:
            continue
        placed, _ = contacts
        filling = _filling(kind, RADIUS, 0.5 * flatness, count - len(placed), 2 * np.pi, sampling, 0, rng)
        points = np.concatenate([placed, filling])
        if abs(associate(points, "plane").value - flatness) <= 1e-11 * max(1.0, flatness):
            return np.asarray(points)
    raise SpecificationError(f"no flatness of {flatness} mm could be planted")


def planted_shaft(
    diameter: float, form: float, count: int, rng: np.random.Generator, *, sampling: Sampling = "random"
) -> Points:
    """Return a shaft (count, 3) about the z axis; its smallest circumscribed cylinder is planted there.

    All points lie between this cylinder and one whose radius is ``form`` smaller.
    """
    kind = CHARACTERISTICS["circumscribed cylinder"]
    for _ in range(40):
        contacts = _contacts(kind, 0.5 * diameter, form, 2 * np.pi, rng)
        if contacts is None:
            continue
        placed, _ = contacts
        rest = count - len(placed)
        filling = _filling(kind, 0.5 * diameter, form, rest, 2 * np.pi, sampling, 0, rng)
        points = np.concatenate([placed, filling])
        found = associate(points, "cylinder", "N")
        if abs(2.0 * found.value - diameter) <= 1e-11 * diameter and abs(abs(found.pose.axis[2]) - 1) < 1e-12:
            return np.asarray(points)
    raise SpecificationError(f"no shaft with a form of {form} mm could be planted")
