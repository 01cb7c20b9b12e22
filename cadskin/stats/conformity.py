"""Probability that a part of a learned process conforms, with the interval that few parts allow.

The mean and covariance of the coefficients are not known but estimated from n parts. Drawing them from their
posterior (normal - inverse Wishart, the prior that makes the interval of one coefficient exact) gives one
probability per draw; their mean is the answer, their quantiles are its interval.

References
----------
.. [1] Gelman et al.: Bayesian Data Analysis, 3rd ed. (2013), section 3.6 (non-informative prior).
.. [2] Clopper, Pearson: Biometrika 26 (1934), doi:10.1093/biomet/26.4.404 (counted parts).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import beta

from cadskin._progress import report
from cadskin._random import child, seed_sequence
from cadskin.errors import StatisticsError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Progress, RNGLike
    from cadskin.stats.model import StatisticalShapeModel

__all__ = ["Conformity", "conformity", "counted_interval"]


@dataclass(frozen=True)
class Conformity:
    """Probability of conforming, never without its interval.

    Parameters
    ----------
    probability : float
        Of a new part, by the model.
    low, high : float
        Interval of the process's true share at ``level``.
    level : float
    counted : int
        Training parts that conform (as the model describes them).
    n_parts : int
    counted_low, counted_high : float
        Clopper-Pearson interval of the count: what is known without any model.
    """

    probability: float
    low: float
    high: float
    level: float
    counted: int
    n_parts: int
    counted_low: float
    counted_high: float

    def __str__(self) -> str:
        return (
            f"P = {self.probability:.3g} [{self.low:.3g}, {self.high:.3g}] at {100 * self.level:g} %; "
            f"{self.counted} of {self.n_parts} parts conform "
            f"[{self.counted_low:.3g}, {self.counted_high:.3g}]"
        )


def conformity(
    model: StatisticalShapeModel,
    characteristic: Callable[[Floats], Floats],
    limit: float,
    *,
    draws: int = 200,
    size: int = 200,
    level: float = 0.9,
    rng: RNGLike = 0,
    progress: Progress | None = None,
) -> Conformity:
    """Return the probability that ``characteristic(part) <= limit``.

    Parameters
    ----------
    model : StatisticalShapeModel
        With at most n - 2 modes: truncate first.
    characteristic : callable
        Takes fields (N, d) [mm], returns a value each (N,), for example a flatness.
    limit : float
        [mm].
    draws : int
        Processes drawn from what is known.
    size : int
        Parts drawn from each.
    level : float
        Of both intervals.
    rng, progress

    Raises
    ------
    StatisticsError
        Too many modes for the number of parts, or a characteristic that does not return one value per field.
    """
    n, k = model.effective_parts, model.n_modes
    if not 0 < k <= n - 2:
        raise StatisticsError(
            f"{k} modes from {n:.3g} effective parts: the covariance of coefficients needs 1 to n - 2 modes; "
            "truncate the model first"
        )
    if not 0.0 < level < 1.0:
        raise StatisticsError(f"level must be between 0 and 1, got {level}")
    seed = seed_sequence(rng)
    shares = np.zeros(draws)
    for i in range(draws):
        generator = child(seed, i)
        c = _process(generator, n, k, size)
        values = np.asarray(characteristic(model.fields(c)))
        if values.shape != (size,):
            raise StatisticsError(
                f"the characteristic must return {size} values for {size} fields, got shape {values.shape}"
            )
        shares[i] = float((values <= limit).mean())
        report(progress, i + 1, draws)
    mean = float(shares.mean())
    low, high = np.quantile(shares, [0.5 - 0.5 * level, 0.5 + 0.5 * level])
    low, high = min(float(low), mean), max(float(high), mean)  # a rare event may lie in the last draws alone
    own = characteristic(model.fields(model.scores))
    counted = int((np.asarray(own) <= limit).sum())
    below, above = counted_interval(counted, model.n_parts, level=level)
    return Conformity(mean, low, high, level, counted, model.n_parts, below, above)


def counted_interval(count: int, n: int, *, level: float = 0.9) -> tuple[float, float]:
    """Return the Clopper-Pearson interval of a share when ``count`` of ``n`` were counted.

    Examples
    --------
    >>> [round(x, 3) for x in counted_interval(5, 10)]
    [0.222, 0.778]
    """
    tail = 0.5 - 0.5 * level
    low = float(beta.ppf(tail, count, n - count + 1)) if count else 0.0
    high = float(beta.ppf(1 - tail, count + 1, n - count)) if count < n else 1.0
    return low, high


def _process(rng: np.random.Generator, n: float, k: int, size: int) -> Floats:
    """Coefficients (size, k) of parts of one process that could have made the n training parts.

    In sigma units the estimated covariance is the identity: the posterior of the true one is inverse Wishart
    with n - 1 degrees of freedom (Bartlett's factor), that of the mean normal with it over n.
    """
    lower = np.tril(rng.standard_normal((k, k)), -1)
    lower[np.diag_indices(k)] = np.sqrt(rng.chisquare(n - 1 - np.arange(k)))
    root = np.sqrt(n - 1) * np.linalg.inv(lower)  # root' root is one draw of the covariance
    centre = rng.standard_normal(k) @ root / np.sqrt(n)
    return np.asarray(centre + rng.standard_normal((size, k)) @ root)
