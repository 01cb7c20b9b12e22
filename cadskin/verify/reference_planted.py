"""Toleranced features and datums of orientation, location and run-out sets, in the frame of the datums.

Every maker returns points in a frame whose datum directions are exact, although no datum is perfect: planes
and widths carry a planted minimum zone, shafts a planted circumscribed cylinder, secondary planes the
alternation that holds the turn that is left. The toleranced feature then touches its zone where no free
motion relieves it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from cadskin.verify.reference import planted_plane, planted_shaft
from cadskin.verify.reference_kinds import LENGTH
from cadskin.verify.reference_sampling import Sampling, unit_square

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["MAKERS", "Planted", "Wish"]

_ANGLE = 30.0  # exact angle of the angularity [deg]
_PLACE = (30.0, 25.0)  # exact place of the position, from C and from B [mm]
_WIDTH = 30.0  # of a width datum [mm]
_PLANE = "minimax, external to material (ISO 5459:2011 default)"
_X, _Y, _Z = (np.array(row) for row in np.eye(3))


@dataclass(frozen=True, eq=False)
class Wish:
    """What is asked for: value, form of the datums [mm], points of each feature, where they lie."""

    value: float
    form: float
    count: int
    sampling: Sampling
    rng: np.random.Generator

    def square(self) -> tuple[Floats, Floats]:
        """Return parameters of the unit square, one pair per point."""
        return unit_square(self.count, self.sampling, self.rng)

    def inside(self, width: float) -> Floats:
        """Return depths (count,) strictly inside of a zone of this width about zero."""
        return np.asarray(0.475 * width * self.rng.uniform(-1, 1, self.count))


@dataclass(frozen=True, eq=False)
class Planted:
    """Points by label, directions of the datums by label, entries of the case."""

    features: Mapping[str, Points]
    directions: Mapping[str, Vectors]
    entries: Mapping[str, Any]


Maker: TypeAlias = "Callable[[Wish], Planted]"


def _floor(wish: Wish) -> Points:
    """Return a datum plane z = 0 with the material above; its minimum zone is planted."""
    points = planted_plane(wish.form, wish.count, wish.rng, sampling=wish.sampling)
    return np.asarray(points - np.array([0.0, 0.0, points[:, 2].min()]))


def _plane_datum(label: str) -> dict[str, Any]:
    return {"label": label, "feature_type": "plane", "association": _PLANE}


def _on_floor(wish: Wish, points: Points, kind: str, zone: str, **entries: Any) -> Planted:
    return Planted(
        {"A": _floor(wish), "T": points},
        {"A": -_Z},
        {
            "zone": zone,
            "datums": [_plane_datum("A")],
            "toleranced": {"feature": "T", "type": kind},
            **entries,
        },
    )


def _parallel(wish: Wish) -> Planted:
    """Return a plane over A: one point on each side of the zone."""
    u, v = wish.square()
    z = wish.inside(wish.value)
    z[:2] = [0.5 * wish.value, -0.5 * wish.value]
    points = np.column_stack([100 * (u - 0.5), 60 * (v - 0.5), 30.0 + z])
    return _on_floor(wish, points, "plane", "two parallel planes parallel to A")


def _speck(wish: Wish, n_contacts: int) -> tuple[Points, Floats]:
    """Return points (count, 2) in a circle of the value, the first ones on it, and heights (count,)."""
    u, v = wish.square()
    radius = 0.475 * wish.value * np.sqrt(wish.rng.uniform(0, 1, wish.count))
    angle = 2 * np.pi * u
    start = wish.rng.uniform(0, 2 * np.pi)
    angle[:n_contacts] = start + 2 * np.pi / n_contacts * np.arange(n_contacts)
    angle[:n_contacts] += wish.rng.uniform(-0.4, 0.4, n_contacts)
    radius[:n_contacts] = 0.5 * wish.value
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)]), v


def _upright(wish: Wish) -> Planted:
    """Return a median line along z: three points on the circle, at angles that no shift relieves."""
    flat, v = _speck(wish, 3)
    points = np.column_stack([flat, 40.0 * v])
    return _on_floor(wish, points, "median line", "cylinder (diameter) perpendicular to A")


def _upright_plane(wish: Wish) -> Planted:
    """Return a plane across A; the turn about the normal of A is held by the alternation 2-1."""
    u, v = wish.square()
    y, x = wish.inside(wish.value), 80.0 * (u - 0.5)
    x[:3], y[:3] = [-30.0, 30.0, 4.0], [0.5 * wish.value, 0.5 * wish.value, -0.5 * wish.value]
    points = np.column_stack([x, 20.0 + y, 30.0 * v])
    return _on_floor(wish, points, "plane", "two parallel planes perpendicular to A")


def _tilted(wish: Wish) -> Planted:
    """Return a plane at the exact angle; the turn about the normal of A is held by the alternation 2-1."""
    u, v = wish.square()
    along, across, depth = 100 * (u - 0.5), 60 * (v - 0.5), wish.inside(wish.value)
    across[:3] = [-25.0, 25.0, 4.0]
    depth[:3] = [0.5 * wish.value, 0.5 * wish.value, -0.5 * wish.value]
    sine, cosine = np.sin(np.radians(_ANGLE)), np.cos(np.radians(_ANGLE))
    normal, forward = np.array([sine, 0.0, cosine]), np.array([cosine, 0.0, -sine])
    points = np.outer(along, forward) + np.outer(across, _Y) + np.outer(depth, normal) + 60.0 * _Z
    zone = f"two parallel planes whose normal makes {_ANGLE} deg with the normal of A"
    return _on_floor(wish, points, "plane", zone, TED_angle_deg=_ANGLE)


def _placed(wish: Wish) -> Planted:
    """Return a median line about its exact place in a system A|B|C: one point on the zone."""
    flat, v = _speck(wish, 1)
    points = np.column_stack([flat + np.array(_PLACE), 20.0 * v])
    made = _on_floor(wish, points, "median line", "cylinder about the exact axis", TED=list(_PLACE))
    u, v = wish.square()
    second = np.column_stack([100 * u, 0.5 * wish.form + wish.inside(wish.form), 40 * v])
    second[:3, 0], second[:3, 1] = [10.0, 90.0, 47.0], [0.0, 0.0, wish.form]
    third = np.column_stack([0.5 * wish.form + wish.inside(wish.form), 60 * u, 40 * v])
    third[0, 0] = 0.0
    return Planted(
        {**made.features, "B": second, "C": third},
        {"A": -_Z, "B": -_Y, "C": -_X},
        {
            **made.entries,
            "datums": [_plane_datum(label) for label in "ABC"],
            "TED_axes": "x from C (into the material), y from B, axis = inward normal of A",
        },
    )


def _on_shaft(wish: Wish, points: Points, kind: str, *, label: str = "T", **entries: Any) -> Planted:
    """Return a feature about the axis of a planted shaft."""
    shaft = planted_shaft(20.0, wish.form, wish.count, wish.rng, sampling=wish.sampling)
    datum = {
        "label": "A",
        "feature_type": "cylinder, external",
        "association": "minimum circumscribed (ISO 5459:2011)",
    }
    return Planted(
        {"A": shaft - 0.5 * LENGTH * _Z, label: points},
        {"A": _Z},
        {"datums": [datum], "toleranced": {"feature": label, "type": kind}, **entries},
    )


def _coaxial(wish: Wish) -> Planted:
    """Return a median line about the datum axis: one point on the zone."""
    flat, v = _speck(wish, 1)
    return _on_shaft(wish, np.column_stack([flat, 10 + 30 * v]), "median line", zone="cylinder (diameter)")


def _along_axis(wish: Wish) -> Planted:
    """Return a median line beside the datum axis, parallel to it: three points on the circle."""
    flat, v = _speck(wish, 3)
    points = np.column_stack([flat + 25.0, 30 * v])
    return _on_shaft(wish, points, "median line", zone="cylinder (diameter) parallel to A")


def _rings(wish: Wish, count: int) -> tuple[Points, Floats]:
    """Return angles (k, m) of ``count`` rings and depths (k, m): one spans the value, the others less."""
    per_ring = max(8, wish.count // count)
    angle = 2 * np.pi * (np.arange(per_ring) + wish.rng.uniform(0, 1, (count, 1))) / per_ring
    depth = 0.475 * wish.value * wish.rng.uniform(-1, 1, (count, per_ring))
    worst = int(wish.rng.integers(count))
    depth[worst, wish.rng.permutation(per_ring)[:2]] = [0.5 * wish.value, -0.5 * wish.value]
    return angle, depth


def _circular_radial(wish: Wish) -> Planted:
    """Sections of a taper: one of them spans the value, the whole far more."""
    angle, depth = _rings(wish, 9)
    height = np.linspace(10, 40, 9)[:, None] + 0.0 * angle
    radius = 6.0 + 0.1 * wish.value * np.arange(9)[:, None] + depth
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=2).reshape(-1, 3)
    made = _on_shaft(wish, points, "cylinder, external")
    return Planted(
        made.features,
        made.directions,
        {**made.entries, "toleranced": {"feature": "T", "type": "cylinder, external", "sections": 9}},
    )


def _total_radial(wish: Wish) -> Planted:
    """Return a mantle between two coaxial cylinders, one point on each."""
    u, v = wish.square()
    depth = wish.inside(wish.value)
    depth[:2] = [0.5 * wish.value, -0.5 * wish.value]
    radius, angle = 6.0 + depth, 2 * np.pi * u
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 10 + 30 * v])
    return _on_shaft(wish, points, "cylinder, external")


def _circular_axial(wish: Wish) -> Planted:
    """Circles of a dished face: one of them spans the value, the whole far more."""
    angle, depth = _rings(wish, 4)
    radius = np.array([2.0, 4.0, 6.0, 8.0])[:, None] + 0.0 * angle
    height = 50.0 + 0.3 * wish.value * np.arange(4)[:, None] + depth
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), height], axis=2).reshape(-1, 3)
    return _on_shaft(wish, points, "plane", label="face")


def _total_axial(wish: Wish) -> Planted:
    """Return a face between two planes across the axis, one point on each."""
    u, v = wish.square()
    depth = wish.inside(wish.value)
    depth[:2] = [0.5 * wish.value, -0.5 * wish.value]
    radius, angle = 9.0 * np.sqrt(v), 2 * np.pi * u
    points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 50.0 + depth])
    return _on_shaft(wish, points, "plane", label="face")


def _symmetric(wish: Wish) -> Planted:
    """Return a tab about the median plane of a width: the middle of one pair of points is on the zone."""
    slab = planted_plane(_WIDTH, wish.count, wish.rng, sampling=wish.sampling)
    contact = np.abs(np.abs(slab[:, 2]) - 0.5 * _WIDTH) < 1e-9
    u, v = wish.square()
    faces = {}
    for label, side in (("A1", 1.0), ("A2", -1.0)):
        depth = wish.form * (0.02 + 0.98 * wish.rng.uniform(0, 1, wish.count))
        fill = np.column_stack([100 * (u - 0.5), 60 * (v - 0.5), side * (0.5 * _WIDTH - depth)])
        faces[label] = np.concatenate([slab[contact & (np.sign(slab[:, 2]) == side)], fill])
    middle = wish.inside(wish.value)
    middle[0] = 0.5 * wish.value
    gap = 5.0 + wish.form * wish.rng.uniform(-1, 1, wish.count)
    flat = np.column_stack([60 * (u - 0.5), 40 * (v - 0.5)])
    tabs = {
        "tab1": np.column_stack([flat, middle + gap]),
        "tab2": np.column_stack([flat, middle - gap]),
    }
    datum = {"label": "A", "feature_type": "two opposite parallel planes, external"}
    entries = {"datums": [datum], "toleranced": {"features": ["tab1", "tab2"]}}
    return Planted({**faces, **tabs}, {"A": _Z}, entries)


MAKERS: dict[str, tuple[str, Maker]] = {
    "parallelism": ("parallelism", _parallel),
    "parallelism of an axis": ("parallelism", _along_axis),
    "perpendicularity": ("perpendicularity", _upright),
    "perpendicularity of a plane": ("perpendicularity", _upright_plane),
    "angularity": ("angularity", _tilted),
    "position": ("position", _placed),
    "coaxiality": ("coaxiality", _coaxial),
    "symmetry": ("symmetry", _symmetric),
    "circular run-out": ("circular run-out (radial)", _circular_radial),
    "total run-out": ("total run-out (radial)", _total_radial),
    "axial circular run-out": ("circular run-out (axial)", _circular_axial),
    "axial total run-out": ("total run-out (axial)", _total_axial),
}
