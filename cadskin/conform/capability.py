"""Process capability: the standard deviation for which a tolerance is missed with a given, small probability.

``Cpk = C`` stands for a fraction ``Phi(-3 C)`` of parts outside (one limit). The quantile of a characteristic
at such probabilities is found by subset simulation: a population is driven level by level into the tail by
Markov chains that keep the law of the model. Extrapolating a fitted distribution reads 2 to 50 % low there.

References
----------
.. [1] S.-K. Au, J. L. Beck, Estimation of small failure probabilities in high dimensions by subset
   simulation, Probabilistic Engineering Mechanics 16 (2001) 263-277, doi:10.1016/S0266-8920(01)00019-4.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from cadskin._progress import report
from cadskin._random import child, seed_sequence
from cadskin.conform.requirements import made_part, value_of
from cadskin.errors import ConformityError, SpecificationError
from cadskin.skin.simulate import child_seed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from cadskin._typing import Floats, Progress, RNGLike
    from cadskin.conform.requirements import Requirement
    from cadskin.conform.simulate import ConformingSampler
    from cadskin.deviation import Sampler

__all__ = ["capability_scale", "fraction_outside", "tail_quantile"]

_LEVEL = 0.1  # share of the population that goes on to the next level
_CLOSE = 0.5  # tolerances that use less than this part of the pilot's worst share cannot bind
_PILOTS = 32
_CHEAPER = 4


def fraction_outside(cpk: float) -> float:
    """Return the fraction of parts outside at a process capability, ``Phi(-3 Cpk)``.

    Raises
    ------
    SpecificationError
        A capability that is not positive and finite, or beyond what can be simulated (Cpk 3).

    Examples
    --------
    >>> round(fraction_outside(1.0), 6)
    0.00135
    """
    if not (math.isfinite(cpk) and cpk > 0):
        raise SpecificationError(f"a process capability Cpk must be positive and finite, got {cpk}")
    if cpk > 3:
        raise SpecificationError(f"Cpk {cpk:g} means one part in 1e19 outside; give at most 3")
    return 0.5 * math.erfc(3.0 * cpk / math.sqrt(2.0))


def tail_quantile(
    sampler: Sampler,
    value: Callable[[Floats], float],
    probability: float,
    *,
    mean: Floats | None = None,
    population: int = 400,
    rng: RNGLike = None,
) -> float:
    """Return the value that a characteristic of a Gaussian field exceeds with a small probability.

    Parameters
    ----------
    sampler : Sampler
        Of a Gaussian model.
    value : callable
        Characteristic of a field (n_c,).
    probability : float
        Of exceeding, between 0 and 1.
    mean : (n_c,) float, optional
        Of the model; zero by default.
    population : int
        Fields per level; the relative error of the quantile is about ``0.4 / sqrt(population)``.
    rng : int, SeedSequence or None

    Raises
    ------
    SpecificationError
        A probability outside of (0, 1).
    """
    if not 0.0 < probability < 1.0:
        raise SpecificationError(f"a probability lies between 0 and 1, got {probability}")
    seed = seed_sequence(rng)
    middle = np.zeros(sampler.n_samples) if mean is None else mean
    fields = sampler.draw([child_seed(seed, i) for i in range(population)])
    values = np.array([value(field) for field in fields])
    left, angle, level = probability, 0.5, 0
    stream = child(seed, population)
    while left < _LEVEL:
        level += 1
        keep = np.argsort(values)[::-1][: max(1, round(_LEVEL * population))]
        threshold = float(values[keep[-1]])
        fields, values, share = _driven(
            sampler, value, middle, fields[keep], values[keep], threshold, population, angle, stream
        )
        angle = float(np.clip(angle * math.exp(1.5 * (share - 0.4)), 0.05, 1.5))
        left /= _LEVEL
    return float(np.quantile(values, 1.0 - left))


def _driven(  # the symbols of one level of the algorithm
    sampler: Sampler,
    value: Callable[[Floats], float],
    mean: Floats,
    starts: Floats,
    start_values: Floats,
    threshold: float,
    population: int,
    angle: float,
    stream: np.random.Generator,
) -> tuple[Floats, Floats, float]:
    """Move chains from the starts, above a threshold; return all states, their values and the acceptance."""
    steps = -(-population // len(starts))
    fields, values = np.array(starts), np.array(start_values)
    all_fields, all_values, moved = [], [], 0
    cosine, sine = math.cos(angle), math.sin(angle)
    for _ in range(steps):
        words = [int(word) for word in stream.integers(0, 2**32, size=4, dtype=np.uint32)]
        seed = np.random.SeedSequence(words)
        fresh = sampler.draw([child_seed(seed, k) for k in range(len(fields))])
        proposals = mean + cosine * (fields - mean) + sine * (fresh - mean)
        for k, proposal in enumerate(proposals):
            found = value(proposal)
            if found > threshold:
                fields[k], values[k] = proposal, found
                moved += 1
        all_fields.append(fields.copy())
        all_values.append(values.copy())
    return (
        np.concatenate(all_fields)[:population],
        np.concatenate(all_values)[:population],
        moved / (steps * len(fields)),
    )


def capability_scale(
    sampler: ConformingSampler,
    cpk: float,
    *,
    population: int = 400,
    rng: RNGLike = 0,
    progress: Progress | None = None,
) -> float:
    """Return the factor by which a model is scaled so that the tolerance that binds has a capability.

    Values are homogeneous in the deviations (to first order where a datum is involved), so one quantile
    per tolerance is enough: the factor is the smallest ``limit / quantile``.

    Parameters
    ----------
    sampler : ConformingSampler
    cpk : float
        Capability, between 0 and 3: a fraction ``Phi(-3 Cpk)`` of raw parts misses the tolerance.
    population : int
        Fields per level; four times as many for a flatness, which is cheap to find.
    rng : int, SeedSequence or None
    progress : callable, optional
        Called with (tolerances done, tolerances).

    Raises
    ------
    SpecificationError
        ``cpk`` has no meaning.
    ConformityError
        The model is not known to be Gaussian, or moves no toleranced feature.
    """
    probability = fraction_outside(cpk)
    setup = sampler.setup
    if setup.mean is None:
        raise ConformityError(f"the capability of {sampler.model} is not known: it is no Gaussian model")
    seed = seed_sequence(rng)
    close = _that_may_bind(sampler, seed)
    factors = []
    for k, item in enumerate(close):
        quantile = tail_quantile(
            setup.samplers.whole,
            _value_function(sampler, item),
            probability,
            mean=setup.mean,
            population=population if item.flat is None else _CHEAPER * population,
            rng=child_seed(seed, k + 1),
        )
        factors.append(item.limit / quantile)
        report(progress, k + 1, len(close))
    return min(factors)


def _value_function(sampler: ConformingSampler, item: Requirement) -> Callable[[Floats], float]:
    if item.flat is not None and item.feature is not None:
        places, rows = item.flat, item.feature.rows
        return lambda field: places.bounds(np.ascontiguousarray(field[rows]))[1]
    return lambda field: value_of(
        item, made_part(sampler.nominal, field, like=sampler.setup.pattern), sampler.spec
    )


def _that_may_bind(sampler: ConformingSampler, seed: np.random.SeedSequence) -> Sequence[Requirement]:
    """Return the tolerances whose pilot values come close to their limits, compared with the others."""
    own = child_seed(seed, 0)
    fields = sampler.setup.samplers.whole.draw([child_seed(own, i) for i in range(_PILOTS)])
    items = [item for item in sampler.requirements if item.policy.method != "none"]
    shares = np.array([[_value_function(sampler, item)(f) / item.limit for f in fields] for item in items])
    used = shares.mean(axis=1) + 3.0 * shares.std(axis=1) if len(items) else np.zeros(0)
    if not len(items) or used.max() <= 0:
        raise ConformityError("no toleranced feature is moved by the model; its capability has no meaning")
    return [item for item, share in zip(items, used, strict=True) if share >= _CLOSE * used.max()]
