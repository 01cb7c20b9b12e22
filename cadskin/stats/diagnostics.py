"""How good a statistical shape model is, in mm: compactness, generalisation, specificity, influence.

References
----------
.. [1] Davies, Twining, Taylor: Statistical Models of Shape (2008), section 9.2 (the three measures).
.. [2] Horn: A rationale and test for the number of factors, Psychometrika 30 (1965), doi:10.1007/BF02289447.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.stats import f as fisher

from cadskin._arrays import frozen
from cadskin._progress import report
from cadskin._random import child, seed_sequence
from cadskin.errors import StatisticsError
from cadskin.stats._gram import gram_and_mean, recentred
from cadskin.stats.fitting import weighted_eigen
from cadskin.stats.population import population
from cadskin.stats.sampling import draw_coefficients

if TYPE_CHECKING:
    from cadskin._typing import Floats, Progress, RNGLike
    from cadskin.stats.model import Law, StatisticalShapeModel

__all__ = [
    "Generalisation",
    "Membership",
    "compactness",
    "influence",
    "leave_one_out",
    "membership",
    "parallel_analysis",
    "specificity",
]

_MOST_FOLDS = 200
_FEW_FOLDS = 10


@dataclass(frozen=True, eq=False)
class Generalisation:
    """What a model of the other parts leaves of a part it has not seen.

    Parameters
    ----------
    error : (t + 1,) float
        Root mean square over area and parts [mm] with 0, 1, ... t modes.
    parts : (n, t + 1) float
        The same for each part, left out in its turn.
    """

    error: Floats
    parts: Floats

    def __post_init__(self) -> None:
        """Freeze."""
        for key in ("error", "parts"):
            object.__setattr__(self, key, frozen(getattr(self, key), name=key))

    def modes(self, *, gain: float = 0.05) -> int:
        """Return the number of modes after which one more takes off less than ``gain`` of the error."""
        drop = 1.0 - self.error[1:] / np.maximum(self.error[:-1], np.finfo(float).tiny)
        small = np.flatnonzero(drop < gain)
        return int(small[0]) if len(small) else len(self.error) - 1


def compactness(model: StatisticalShapeModel) -> Floats:
    """Return the share of the variance that the first 1, 2, ... k modes hold (k,)."""
    return np.asarray(np.cumsum(model.variances) / model.total_variance)


def leave_one_out(model: StatisticalShapeModel, *, progress: Progress | None = None) -> Generalisation:
    """Return the generalisation error of a model for every number of modes, from the Gram matrix alone.

    Above 200 parts, tenths of the population are left out together instead of single parts.

    Raises
    ------
    StatisticsError
        The model has no Gram matrix (it was fitted with missing data), or has two parts only.

    Examples
    --------
    >>> from cadskin.stats import StatisticalShapeModel
    >>> line = np.arange(5.0)[:, None] * np.ones((1, 4))  # five plates of different thickness
    >>> bool(leave_one_out(StatisticalShapeModel.fit(line)).error[1] < 1e-6)
    True
    """
    gram = _gram(model)
    n = len(gram)
    if n < 3:
        raise StatisticsError("leave-one-out needs at least three parts: the others must still have a spread")
    folds = (
        [np.array([i]) for i in range(n)] if n <= _MOST_FOLDS else np.array_split(np.arange(n), _FEW_FOLDS)
    )
    most = n - 1 - max(map(len, folds))
    if n > _MOST_FOLDS:
        most = min(most, max(model.n_modes, 1))
    squared = np.zeros((n, most + 1))
    for done, left_out in enumerate(folds, start=1):
        squared[left_out] = _left(gram, model.part_weights, left_out, most, model.ddof)
        report(progress, done, len(folds))
    share = model.part_weights / model.part_weights.sum()
    return Generalisation(np.sqrt(share @ squared), np.sqrt(squared))


def specificity(
    model: StatisticalShapeModel, *, size: int = 500, law: Law = "gaussian", rng: RNGLike = 0
) -> float:
    """Return the mean distance [mm, root mean square over the area] of samples to the nearest training part.

    Samples carry no noise; what a training part has outside of the modes counts.
    """
    seed = seed_sequence(rng)
    own = model.scores * model.sigmas
    outside = np.zeros(model.n_parts)
    if model.gram is not None:
        share = model.part_weights / model.part_weights.sum()
        outside = np.maximum(np.diag(recentred(model.gram, share)) - (own**2).sum(axis=1), 0.0)
    nearest = np.zeros(size)
    for i in range(size):
        drawn = draw_coefficients(model, child(seed, i), law) * model.sigmas
        nearest[i] = np.sqrt((((own - drawn) ** 2).sum(axis=1) + outside).min())
    return float(nearest.mean())


def influence(model: StatisticalShapeModel) -> Floats:
    """Return how far [mm, root mean square over the area] the mean moves when each part is left out (n,)."""
    gram = _gram(model)
    q = model.part_weights
    others = q.sum() - q
    distance = np.sqrt(np.maximum(np.diag(recentred(gram, q / q.sum())), 0.0))
    if (others <= 0).any():
        raise StatisticsError("one part has all the weight: without it nothing is left")
    return np.asarray(q / others * distance)


def parallel_analysis(
    model: StatisticalShapeModel,
    parts: Any,
    *,
    repeats: int = 100,
    level: float = 0.95,
    rng: RNGLike = 0,
    progress: Progress | None = None,
) -> int:
    """Return the number of modes that stand out of chance (Horn 1965).

    The parts' values are shuffled independently at every sample, which keeps each sample's variance and
    destroys what samples have in common; a mode counts while its share is above the ``level`` quantile of
    the shuffled.

    Parameters
    ----------
    model : StatisticalShapeModel
        With all its modes.
    parts : as for `StatisticalShapeModel.fit`
        The training parts, complete.
    repeats : int
    level : float
    rng, progress

    Raises
    ------
    StatisticsError
        Parts that are not those of the model.
    """
    nominal = None if hasattr(parts, "nominal") else model.nominal
    people = population(parts, nominal=nominal)
    columns = people.columns
    if model.nominal is not None:
        columns.rows = model.rows
        columns.d = len(model.mean)
    if (columns.n, columns.d) != (model.n_parts, len(model.mean)):
        raise StatisticsError(
            f"the model has {model.n_parts} parts of {len(model.mean)} samples, "
            f"got {columns.n} of {columns.d}"
        )
    real, _ = weighted_eigen(gram_and_mean(columns, model.weights).gram, np.ones(columns.n))
    real = real[: columns.n - 1] / real.sum()
    seed = seed_sequence(rng)
    chance = np.zeros((repeats, columns.n - 1))
    for i in range(repeats):
        values, _ = weighted_eigen(_shuffled_gram(columns, model.weights, child(seed, i)), np.ones(columns.n))
        chance[i] = values[: columns.n - 1] / values.sum()
        report(progress, i + 1, repeats)
    above = real > np.quantile(chance, level, axis=0)
    return len(above) if above.all() else int(np.argmin(above))


@dataclass(frozen=True)
class Membership:
    """Whether a part belongs to the population.

    Parameters
    ----------
    hotelling : float
        Squared Mahalanobis distance of its coefficients.
    p_value : float
        Probability that a part of the population is as far out (Hotelling's T², F distribution).
    residual : float
        What the modes leave of it [mm, root mean square over the area]; compare with `noise` of the model.
    """

    hotelling: float
    p_value: float
    residual: float


def membership(model: StatisticalShapeModel, field: Any) -> Membership:
    """Return how well a new part (d,) [mm] fits a model; see `Membership`.

    Raises
    ------
    StatisticsError
        As many modes as degrees of freedom: truncate the model first.
    """
    n, k = model.effective_parts, model.n_modes
    if n - k <= 0:
        raise StatisticsError(
            f"{k} modes of {n:.3g} effective parts leave nothing to test with; truncate first"
        )
    c = model.coefficients(field)
    t2 = float(c @ c)
    scale = n * (n - k) / (k * (n - 1) * (n + 1)) if k else 1.0
    p = float(fisher.sf(t2 * scale, k, n - k)) if k else 1.0
    x = np.asarray(getattr(field, "deviation", field), dtype=np.float64)
    if model.nominal is not None and len(x) != len(model.mean):
        x = x[model.rows]
    rest = x - model.instance(c)
    seen = np.isfinite(rest)
    square = float((model.weights[seen] * rest[seen] ** 2).sum() / model.weights[seen].sum())
    return Membership(t2, p, float(np.sqrt(square)))


def _gram(model: StatisticalShapeModel) -> Floats:
    if model.gram is None:
        raise StatisticsError("this needs a model of complete parts; the model was fitted with missing data")
    return model.gram


def _left(gram: Floats, q: Floats, left_out: np.ndarray, most: int, ddof: int) -> Floats:
    """Squared errors (len(left_out), most + 1) [mm²] of parts under the model of the others."""
    others = np.delete(np.arange(len(gram)), left_out)
    weight = q[others]
    share = weight / weight.sum()
    inner = gram[np.ix_(others, others)]
    values, vectors = weighted_eigen(inner, weight, ddof=ddof, largest=most)
    pull = gram[np.ix_(left_out, others)]
    own = np.diag(gram)[left_out] - 2.0 * pull @ share + share @ inner @ share
    cross = pull - (pull @ share)[:, None] - (inner @ share)[None, :] + share @ inner @ share
    length = np.sqrt(values * _divisor(weight, ddof))
    usable = length > 1e-6 * max(float(length[0]), np.finfo(float).tiny)
    along = (cross * np.sqrt(weight)) @ vectors / np.where(usable, length, np.inf)
    errors = own[:, None] - np.concatenate(
        [np.zeros((len(left_out), 1)), np.cumsum(along**2, axis=1)], axis=1
    )
    return np.asarray(np.maximum(errors, 0.0))


def _divisor(q: Floats, ddof: int) -> float:
    return float(q.sum() - ddof * (q**2).sum() / q.sum())


def _shuffled_gram(columns: Any, weights: Floats, rng: np.random.Generator) -> Floats:
    gram = np.zeros((columns.n, columns.n))
    for start, stop in columns.chunks():
        block = rng.permuted(columns.read(start, stop).astype(np.float64), axis=0)
        block -= block.mean(axis=0)
        gram += (block * weights[start:stop]) @ block.T
    return gram
