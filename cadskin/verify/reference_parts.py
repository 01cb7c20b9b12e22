"""Reference parts: made parts on which one tolerance has a prescribed value.

The toleranced features of a nominal part get waves and noise; everything else, the datums above all, stays
exact. The size of the deviation is then the root of ``value of the part = prescribed value``, which a secant
finds to rounding in a few evaluations: each of them is a minimum zone with its certificate.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._progress import report
from cadskin._random import child, seed_sequence
from cadskin.errors import SpecificationError
from cadskin.spec.binding import bound_to
from cadskin.verify.prepared import prepare

if TYPE_CHECKING:
    from cadskin._typing import Floats, Progress, RNGLike
    from cadskin.shape import Feature, NominalModel
    from cadskin.skin import SkinModel
    from cadskin.spec import Specification, Tolerance
    from cadskin.verify.evaluation import Evaluation
    from cadskin.verify.prepared import PreparedVerification

__all__ = ["ReferencePart", "reference_part", "write_reference_parts"]

_EXACT = 1e-12  # relative to the value, or 1 mm


@dataclass(frozen=True, eq=False)
class ReferencePart:
    """A made part with the prescribed value of one tolerance.

    Parameters
    ----------
    skin : SkinModel
    tolerance : str
        Id of the tolerance.
    value : float
        What its evaluation must give [mm].
    evaluation : Evaluation
        What it gives here, with certificate and active points.
    """

    skin: SkinModel
    tolerance: str
    value: float
    evaluation: Evaluation

    def answer(self, name: str) -> dict[str, Any]:
        """Return the answer as plain data."""
        return {
            "part": name,
            "tolerance": self.tolerance,
            "characteristic": self.evaluation.characteristic,
            "value": self.value,
            "u": _EXACT * max(1.0, self.value),
            "certified": self.evaluation.certified,
            "operations": list(self.evaluation.operations),
        }


def reference_part(
    nominal: NominalModel,
    spec: Specification,
    tolerance: str,
    value: float,
    *,
    waves: int = 4,
    noise: float = 0.2,
    rng: RNGLike = None,
) -> ReferencePart:
    """Make a part on which a tolerance has a prescribed value.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification
    tolerance : str
        Id of a tolerance of ``spec``: form, orientation, location, run-out or profile.
    value : float
        [mm], to 1e-12 mm.
    waves : int
        Waves over the size of a feature at most.
    noise : float
        Share of random deviation from point to point.
    rng : seed or generator

    Raises
    ------
    SpecificationError
        There is no such tolerance, it cannot be evaluated, or no size of the deviation gives the value.
    """
    if not value > 0.0:
        raise SpecificationError(f"a reference part needs a positive value, got {value}")
    bound = bound_to(spec, nominal)
    return _made(
        prepare(nominal, bound),
        bound[tolerance],
        value,
        waves,
        noise,
        np.random.default_rng(seed_sequence(rng)),
    )


def _made(
    prepared: PreparedVerification,
    wanted: Tolerance,
    value: float,
    waves: int,
    noise: float,
    rng: np.random.Generator,
) -> ReferencePart:
    from cadskin.skin import SkinModel

    nominal = prepared.nominal
    field = np.zeros(nominal.n_samples)
    chosen = {nominal.feature_of(face).id: nominal.feature_of(face) for face in wanted.feature.faces}
    if not chosen:
        raise SpecificationError(f"tolerance {wanted.id} is on no face of the part")
    for feature in chosen.values():
        field[feature.rows] = _uneven(feature, waves, noise, rng)

    def at(size: float) -> tuple[SkinModel, Evaluation]:
        skin = SkinModel(nominal, size * field)
        return skin, prepared.evaluate_tolerance(wanted, skin)

    size, (skin, found) = value, at(value)
    if not found.value > 0.0:
        raise SpecificationError(
            f"tolerance {wanted.id}: deviations of {wanted.feature} leave its value at 0; no value can be set"
        )
    last, best = (0.0, 0.0), (skin, found)
    for _ in range(30):
        error = found.value - value
        if abs(error) < abs(best[1].value - value):
            best = skin, found
        if abs(error) <= 0.1 * _EXACT * max(1.0, value) or size == last[0]:
            break
        slope = (found.value - last[1]) / (size - last[0])
        last = size, found.value
        step = -error / slope if slope > 0.0 else -0.5 * error
        size = max(size + step, 0.1 * size)
        skin, found = at(size)
    if abs(best[1].value - value) > _EXACT * max(1.0, value):
        raise SpecificationError(
            f"tolerance {wanted.id}: no size of the deviation gave {value} mm, the nearest {best[1].value!r}"
        )
    return ReferencePart(best[0], wanted.id, float(value), best[1])


def _uneven(feature: Feature, waves: int, noise: float, rng: np.random.Generator) -> Floats:
    """Return deviations (k,) of a feature, about 1 from lowest to highest: five waves and noise."""
    points = feature.points
    size = max(float(np.ptp(points, axis=0).max()), 1e-9)
    total = np.zeros(len(points))
    for _ in range(5):
        direction = rng.standard_normal(3)
        direction /= np.linalg.norm(direction)
        phase = 2 * np.pi * (points @ direction / size * rng.uniform(0.3, max(waves, 0.3)) + rng.uniform())
        total += rng.uniform(0.3, 1.0) * np.cos(phase)
    total /= max(float(np.ptp(total)), 1e-9)
    return np.asarray((1.0 - noise) * total + noise * rng.uniform(-0.5, 0.5, len(points)))


def write_reference_parts(
    folder: str | Path,
    nominal: NominalModel,
    spec: Specification,
    tolerance: str,
    value: float,
    *,
    count: int = 1,
    waves: int = 4,
    rng: RNGLike = None,
    progress: Progress | None = None,
) -> tuple[Path, ...]:
    """Write ``count`` reference parts as labelled meshes, with the specification and the answers.

    Parameters
    ----------
    folder : path
        Made where it is missing; gets ``part_0000.npz`` ..., ``spec.toml`` and ``answers.json``.
    nominal, spec, tolerance, value, waves
        As for `reference_part`.
    count : int
    rng : seed or generator
        Part i uses the child stream i.
    progress : callable, optional

    Returns
    -------
    tuple of Path
        The meshes; ``cadskin verify part_0000.npz --of PART --spec spec.toml`` evaluates them.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    seed, written = seed_sequence(rng), []
    answers: list[Mapping[str, Any]] = []
    for index in range(count):
        made = reference_part(nominal, spec, tolerance, value, waves=waves, rng=child(seed, index))
        path = target / f"part_{index:04d}.npz"
        made.skin.save(path)
        answers.append(made.answer(path.name))
        written.append(path)
        report(progress, index + 1, count)
    spec.save(target / "spec.toml")
    (target / "answers.json").write_text(json.dumps(answers, indent=1) + "\n", encoding="utf-8")
    return tuple(written)
