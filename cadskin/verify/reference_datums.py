"""Reference point sets of orientation, location and run-out: datums with form error, an exact value.

What is planted, and why the value is exact, stands in `cadskin.verify.reference_planted`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._random import child, seed_sequence
from cadskin.errors import SpecificationError
from cadskin.shape.association import rotation
from cadskin.verify.reference_planted import MAKERS, Wish

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cadskin._typing import Points, RNGLike, Vectors
    from cadskin.verify.reference_sampling import Sampling

__all__ = ["DATUM_CHARACTERISTICS", "DatumReferenceSet", "datum_reference_set"]

DATUM_CHARACTERISTICS = tuple(MAKERS)


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
        Exact direction of each datum: outward normal of a plane, axis of a cylinder, normal of a width.
    outliers : (m, 3) float
        Points that belong to no feature.
    entries : Mapping
        What the JSON object of the case says about datums, zone and toleranced feature.
    """

    characteristic: str
    value: float
    features: Mapping[str, Points]
    outward: Mapping[str, Vectors]
    outliers: Points
    entries: Mapping[str, Any]

    def question(self, name: str) -> dict[str, Any]:
        """Return the JSON object of a case, the answer included."""
        datums = []
        for datum in self.entries["datums"]:
            hint = np.round(self.outward[datum["label"]], 3).tolist()
            is_axis = "cylinder" in datum["feature_type"]
            datums.append({**datum, "axis_hint" if is_axis else "outward_normal_hint": hint})
        return {
            "id": name,
            "units": "mm",
            "csv": f"{name}.csv",
            "characteristic": MAKERS[self.characteristic][0],
            **self.entries,
            "datums": datums,
            "reference": {
                "value": self.value,
                "u": 1e-12,
                "datum_directions": {label: normal.tolist() for label, normal in self.outward.items()},
            },
            "tolerance_abs": 1e-9,
            "proof": "datums: planted; feature: contacts that no free motion relieves, the rest inside",
        }


def datum_reference_set(
    characteristic: str,
    value: float,
    *,
    n_points: int = 1000,
    datum_form: float | None = None,
    sampling: Sampling = "random",
    n_outliers: int = 0,
    rng: RNGLike = None,
) -> DatumReferenceSet:
    """Make datum and feature points whose orientation, location or run-out has a prescribed value.

    Parameters
    ----------
    characteristic : str
        One of `DATUM_CHARACTERISTICS`.
    value : float
        [mm]
    n_points : int
        Of the toleranced feature, and of each datum.
    datum_form : float, optional
        Form deviation of the datums [mm]; by default 0.6 of the value.
    sampling : {"random", "grid", "sections", "generatrix", "helix", "bird cage"}
        Where the points lie; circular run-outs are in sections or circles always.
    n_outliers : int
        Points far off the toleranced feature, kept apart.
    rng : seed or generator

    Raises
    ------
    SpecificationError
        A characteristic that is not known, a value that is not positive, fewer than 40 points.

    Examples
    --------
    >>> from cadskin.verify import DatumFeature, establish, orientation
    >>> made = datum_reference_set("parallelism", 0.05, rng=3)
    >>> datum = establish([DatumFeature("A", "plane", made.features["A"], hint=made.outward["A"])])
    >>> round(orientation(made.features["T"], "parallelism", datum).value, 12)
    0.05
    """
    if characteristic not in MAKERS:
        raise SpecificationError(
            f"no reference sets of {characteristic!r}; choose one of {', '.join(DATUM_CHARACTERISTICS)}"
        )
    form = 0.6 * value if datum_form is None else datum_form
    if not value > 0 or not form > 0 or n_points < 40:
        raise SpecificationError(
            f"a reference set needs a positive value and form and at least 40 points, got {value}, {form} "
            f"and {n_points}"
        )
    generator = child(seed_sequence(rng), 0)
    made = MAKERS[characteristic][1](Wish(value, form, n_points, sampling, generator))
    turn, shift = rotation(generator.standard_normal(3) * 1.5), generator.uniform(-50, 50, 3)
    features = {label: np.asarray(points @ turn.T + shift) for label, points in made.features.items()}
    last = features[next(reversed(features))]
    off = generator.standard_normal((n_outliers, 3)) * 10 * value
    return DatumReferenceSet(
        characteristic,
        float(value),
        features,
        {label: np.asarray(turn @ normal) for label, normal in made.directions.items()},
        np.asarray(last[generator.integers(0, len(last), n_outliers)] + off),
        made.entries,
    )
