"""Designs of experiments over the parameters of a model: Latin hypercubes and Sobol sequences.

References
----------
McKay, Beckman, Conover: A comparison of three methods for selecting values of input variables in the analysis
of output from a computer code, Technometrics 21 (1979), doi:10.1080/00401706.1979.10489755; Sobol: On the
distribution of points in a cube and the approximate evaluation of integrals, USSR Comput. Math. Math. Phys. 7
(1967), doi:10.1016/0041-5553(67)90144-9.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import qmc

from cadskin._arrays import frozen
from cadskin._random import seed_sequence
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats, RNGLike
    from cadskin.deviation.base import DeviationModel

__all__ = ["Design", "parameter_design", "with_parameter"]

METHODS = ("latin_hypercube", "sobol", "random")


@dataclass(frozen=True, eq=False)
class Design:
    """The runs of a design.

    Parameters
    ----------
    names : tuple of str
        Paths of the parameters that vary.
    values : (N, k) float
        Their values in each run.
    models : tuple of DeviationModel
        The model of each run.
    """

    names: tuple[str, ...]
    values: Floats
    models: tuple[DeviationModel, ...]

    def __len__(self) -> int:
        return len(self.models)


def parameter_design(
    model: DeviationModel,
    distributions: Mapping[str, Any],
    *,
    size: int,
    method: str = "latin_hypercube",
    rng: RNGLike = None,
) -> Design:
    """Return models whose parameters fill the space of their distributions evenly.

    Parameters
    ----------
    model : DeviationModel
    distributions : mapping of str to frozen distribution
        Path of a parameter to what it is drawn from, an object with ``ppf`` as `scipy.stats` makes them. A
        path goes through composed models by the names of their parameters, numbers in lists and arrays and
        keys of tables: ``"sigma"``, ``"terms.0.model.amplitude"``, ``"coefficients.3,0"``.
    size : int
        Number of runs; for ``sobol`` best a power of two.
    method : str
        ``latin_hypercube``, ``sobol`` (scrambled) or ``random`` (independent).
    rng : int, SeedSequence, BitGenerator, Generator or None

    Raises
    ------
    DeviationError
        A path that leads nowhere (the message lists what there is), an unknown method, a bad size, or a
        value that the model refuses.

    Examples
    --------
    >>> from scipy.stats import uniform
    >>> from cadskin.deviation import GaussianField
    >>> design = parameter_design(GaussianField(0.01, 12), {"length": uniform(5, 20)}, size=8, rng=1)
    >>> len(design), bool((design.values >= 5).all())
    (8, True)
    """
    if size != int(size) or size < 1:
        raise DeviationError(f"a design needs one run or more, a whole number, got {size}")
    if method not in METHODS:
        raise DeviationError(f"the method of a design must be one of {', '.join(METHODS)}, got {method!r}")
    names = tuple(distributions)
    if not names:
        raise DeviationError("a design needs the distribution of one parameter or more")
    unit = _unit_points(method, len(names), size, np.random.default_rng(seed_sequence(rng)))
    for name in names:
        if not callable(getattr(distributions[name], "ppf", None)):
            raise DeviationError(
                f"the distribution of {name!r} must have a method ppf, like scipy.stats.norm(1, 0.1); "
                f"got {distributions[name]!r}"
            )
    columns = [distributions[name].ppf(unit[:, k]) for k, name in enumerate(names)]
    values = frozen(np.stack(columns, axis=1), shape=(None, None), name="values of the design")
    models = []
    for row in values:
        made = model
        for name, value in zip(names, row, strict=True):
            made = with_parameter(made, name, float(value))
        models.append(made)
    return Design(names, values, tuple(models))


def _unit_points(method: str, dimension: int, size: int, generator: np.random.Generator) -> Floats:
    """Points (size, dimension) in the open unit cube."""
    if method == "random":
        points = generator.random((size, dimension))
    elif method == "sobol":
        engine = qmc.Sobol(dimension, rng=generator)
        points = engine.random_base2(int(np.ceil(np.log2(size))))[:size]
    else:
        points = qmc.LatinHypercube(dimension, rng=generator).random(size)
    tiny = 2.0**-53
    return np.asarray(np.clip(points, tiny, 1.0 - tiny))


def with_parameter(model: DeviationModel, path: str, value: Any) -> DeviationModel:
    """Return a copy of a model with another value of one parameter, see `parameter_design`.

    Examples
    --------
    >>> from cadskin.deviation import Paraboloid, WhiteNoise
    >>> with_parameter(Paraboloid(0.05).on(">Z") + WhiteNoise(0.01), "terms.0.model.amplitude", 0.02)
    Paraboloid(amplitude=0.02 mm).on('>Z') + WhiteNoise(sigma=0.01 mm)
    """
    changed: DeviationModel = _replaced(model, path.split("."), value, path)
    return changed


def _entries(place: Any) -> list[str]:
    """Names of what is inside of a model, a list or a table."""
    if isinstance(place, tuple) or (isinstance(place, np.ndarray) and place.ndim):
        return [str(k) for k in range(len(place))]
    if isinstance(place, Mapping):
        return [str(key) for key in place]
    return [item.name for item in fields(place)] if is_dataclass(place) else []


def _replaced(place: Any, steps: list[str], value: Any, path: str) -> Any:
    if not steps:
        return value
    step, rest = steps[0], steps[1:]
    known = _entries(place)
    if step not in known:
        inside = ", ".join(known[:20]) or ("nothing yet" if place is None else "a number")
        raise DeviationError(f"the path {path!r} leads nowhere at {step!r}; there is {inside}")
    if isinstance(place, np.ndarray):
        changed = place.copy()
        changed[int(step)] = _replaced(place[int(step)], rest, value, path)
        return changed
    if isinstance(place, tuple):
        k = int(step)
        return (*place[:k], _replaced(place[k], rest, value, path), *place[k + 1 :])
    if isinstance(place, Mapping):
        return {**place, step: _replaced(place[step], rest, value, path)}
    return replace(place, **{step: _replaced(getattr(place, step), rest, value, path)})
