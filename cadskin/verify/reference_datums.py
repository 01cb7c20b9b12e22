"""Reference point sets of orientation and location: datums with form error, a value exact by construction.

The datum plane A carries a planted minimum zone (alternation 3-1 or 2-2), so its direction is exact although
its points are not flat. The toleranced feature then lies in a zone fixed to it: contacts on its sides, such
that no motion that is left can lessen it, and everything else strictly inside.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._random import child, seed_sequence
from cadskin.errors import SpecificationError
from cadskin.shape.association import rotation
from cadskin.verify.reference import planted_plane

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cadskin._typing import Floats, Points, RNGLike, Vectors

__all__ = ["DATUM_CHARACTERISTICS", "DatumReferenceSet", "datum_reference_set"]

DATUM_CHARACTERISTICS = ("parallelism", "perpendicularity", "angularity", "position")
_ANGLE = 30.0  # exact angle of the angularity [deg]
_PLACE = (30.0, 25.0)  # exact place of the position, from C and from B [mm]


@dataclass(frozen=True, eq=False)
class DatumReferenceSet:
    """Points of the datums and of the toleranced feature with the prescribed value.

    Parameters
    ----------
    characteristic : str
    value : float
        What the evaluation must give [mm].
    features : Mapping of str to (n, 3) float
        Points by label: the datums ``A`` ..., the toleranced feature ``T``.
    outward : Mapping of str to (3,) float
        Exact outward normal of each datum.
    """

    characteristic: str
    value: float
    features: Mapping[str, Points]
    outward: Mapping[str, Vectors]

    def question(self, name: str) -> dict[str, Any]:
        """Return the JSON object of a case, the answer included."""
        out: dict[str, Any] = {
            "id": name,
            "units": "mm",
            "csv": f"{name}.csv",
            "characteristic": self.characteristic,
            "zone": _ZONES[self.characteristic],
            "datums": [
                {
                    "label": label,
                    "feature_type": "plane",
                    "outward_normal_hint": np.round(normal, 3).tolist(),
                    "association": "minimax, external to material (ISO 5459:2011 default)",
                }
                for label, normal in self.outward.items()
            ],
            "toleranced": {
                "feature": "T",
                "type": "plane" if self.characteristic in ("parallelism", "angularity") else "median line",
            },
            "reference": {
                "value": self.value,
                "u": 1e-12,
                "datum_normals": {label: normal.tolist() for label, normal in self.outward.items()},
            },
            "tolerance_abs": 1e-9,
            "proof": "datum: planted minimum zone; feature: contacts that no free motion relieves",
        }
        if self.characteristic == "angularity":
            out["TED_angle_deg"] = _ANGLE
        if self.characteristic == "position":
            out["TED"] = list(_PLACE)
            out["TED_axes"] = "x from C (into the material), y from B, axis = inward normal of A"
        return out


_ZONES = {
    "parallelism": "two parallel planes parallel to A",
    "perpendicularity": "cylinder (diameter) perpendicular to A",
    "angularity": f"two parallel planes whose normal makes {_ANGLE} deg with the normal of A",
    "position": "cylinder about the exact axis",
}


def datum_reference_set(
    characteristic: str,
    value: float,
    *,
    n_points: int = 1000,
    datum_form: float | None = None,
    rng: RNGLike = None,
) -> DatumReferenceSet:
    """Make datum and feature points whose orientation or location has a prescribed value.

    Parameters
    ----------
    characteristic : {"parallelism", "perpendicularity", "angularity", "position"}
        Of a plane, a median line, a plane at 30 degrees, and a median line in a system A|B|C.
    value : float
        [mm]
    n_points : int
        Of the toleranced feature, and of each datum.
    datum_form : float, optional
        Flatness of the datums [mm]; by default 0.6 of the value.
    rng : seed or generator

    Raises
    ------
    SpecificationError
        A characteristic that is not known, a value that is not positive, fewer than 20 points.

    Examples
    --------
    >>> from cadskin.verify import DatumFeature, establish, orientation
    >>> made = datum_reference_set("parallelism", 0.05, rng=3)
    >>> datum = establish([DatumFeature("A", "plane", made.features["A"], hint=made.outward["A"])])
    >>> round(orientation(made.features["T"], "parallelism", datum).value, 12)
    0.05
    """
    if characteristic not in DATUM_CHARACTERISTICS:
        raise SpecificationError(
            f"no reference sets of {characteristic!r}; choose one of {', '.join(DATUM_CHARACTERISTICS)}"
        )
    form = 0.6 * value if datum_form is None else datum_form
    if not value > 0 or not form > 0 or n_points < 20:
        raise SpecificationError(
            f"a reference set needs a positive value and form and at least 20 points, got {value}, {form} "
            f"and {n_points}"
        )
    generator = child(seed_sequence(rng), 0)
    made = {"A": planted_plane(form, n_points, generator) * np.array([1.0, 1.0, -1.0])}
    normals = {"A": np.array([0.0, 0.0, -1.0])}
    low = made["A"][:, 2].min()
    made["A"] = made["A"] - np.array([0.0, 0.0, low])
    if characteristic == "position":
        made["B"], made["C"] = (
            _second_plane(form, n_points, generator),
            _third_plane(form, n_points, generator),
        )
        normals |= {"B": np.array([0.0, -1.0, 0.0]), "C": np.array([-1.0, 0.0, 0.0])}
    made["T"] = _TOLERANCED[characteristic](value, n_points, generator)
    turn, shift = rotation(generator.standard_normal(3) * 1.5), generator.uniform(-50, 50, 3)
    return DatumReferenceSet(
        characteristic,
        float(value),
        {label: np.asarray(points @ turn.T + shift) for label, points in made.items()},
        {label: np.asarray(turn @ normal) for label, normal in normals.items()},
    )


def _inside(width: float, count: int, rng: np.random.Generator) -> Floats:
    """Return depths (count,) strictly inside of a zone of this width about zero."""
    return np.asarray(0.475 * width * rng.uniform(-1, 1, count))


def _second_plane(form: float, count: int, rng: np.random.Generator) -> Points:
    """Return a plane y = 0 with the material at y > 0; about z the alternation 2-1 along x holds it."""
    x, z = rng.uniform(0, 100, count), rng.uniform(0, 40, count)
    y = 0.5 * form + _inside(form, count, rng)
    x[:3], y[:3] = [10.0, 90.0, 47.0], [0.0, 0.0, form]
    return np.column_stack([x, y, z])


def _third_plane(form: float, count: int, rng: np.random.Generator) -> Points:
    """Return a plane x = 0 that one point carries."""
    y, z = rng.uniform(0, 60, count), rng.uniform(0, 40, count)
    x = 0.5 * form + _inside(form, count, rng)
    x[0] = 0.0
    return np.column_stack([x, y, z])


def _parallel(value: float, count: int, rng: np.random.Generator) -> Points:
    """Return a plane over A: one point on each side of the zone."""
    z = _inside(value, count, rng)
    z[:2] = [0.5 * value, -0.5 * value]
    return np.column_stack([rng.uniform(-50, 50, count), rng.uniform(-30, 30, count), 30.0 + z])


def _upright(value: float, count: int, rng: np.random.Generator) -> Points:
    """Return a median line along z: three points on the circle, at angles that no shift relieves."""
    angle, radius = rng.uniform(0, 2 * np.pi, count), 0.475 * value * np.sqrt(rng.uniform(0, 1, count))
    angle[:3] = rng.uniform(0, 2 * np.pi) + 2 * np.pi / 3 * np.arange(3) + rng.uniform(-0.4, 0.4, 3)
    radius[:3] = 0.5 * value
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), rng.uniform(0, 40, count)])


def _tilted(value: float, count: int, rng: np.random.Generator) -> Points:
    """Return a plane at the exact angle; a turn about the normal of A is held by the alternation 2-1."""
    along, across = rng.uniform(-50, 50, count), rng.uniform(-30, 30, count)
    depth = _inside(value, count, rng)
    across[:3], depth[:3] = [-25.0, 25.0, 4.0], [0.5 * value, 0.5 * value, -0.5 * value]
    angle = np.radians(_ANGLE)
    normal = np.array([np.sin(angle), 0.0, np.cos(angle)])
    forward = np.array([np.cos(angle), 0.0, -np.sin(angle)])
    side = np.array([0.0, 1.0, 0.0])
    flat = along[:, None] * forward + across[:, None] * side
    return np.asarray(flat + depth[:, None] * normal + np.array([0.0, 0.0, 60.0]))


def _placed(value: float, count: int, rng: np.random.Generator) -> Points:
    """Return a median line about its exact place: one point on the zone."""
    angle, radius = rng.uniform(0, 2 * np.pi, count), 0.475 * value * np.sqrt(rng.uniform(0, 1, count))
    radius[0] = 0.5 * value
    x, y = _PLACE[0] + radius * np.cos(angle), _PLACE[1] + radius * np.sin(angle)
    return np.column_stack([x, y, rng.uniform(0, 20, count)])


_TOLERANCED = {
    "parallelism": _parallel,
    "perpendicularity": _upright,
    "angularity": _tilted,
    "position": _placed,
}
