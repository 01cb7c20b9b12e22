"""From a population to a statistical shape model: Gram matrix, part weights, eigenvectors, sign rule."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh

from cadskin.errors import CadskinWarning, StatisticsError
from cadskin.stats._gram import gram_and_mean, recentred, weighted_combinations
from cadskin.stats.missing import fit_with_missing
from cadskin.stats.model import StatisticalShapeModel
from cadskin.stats.robust import Center, part_weights

if TYPE_CHECKING:
    from cadskin._typing import Floats, Progress
    from cadskin.stats.population import Population

__all__ = ["fewest_modes", "fit_shape_model", "mode_signs", "weighted_eigen"]

_MANY_PARTS = 300  # from here a few eigenpairs of the Gram matrix are found by iteration


def fit_shape_model(
    people: Population,
    *,
    center: Center = "arithmetic",
    ddof: int = 1,
    modes: int | None = None,
    share: float | None = None,
    progress: Progress | None = None,
) -> StatisticalShapeModel:
    """Return the model of a population; see `StatisticalShapeModel.fit`."""
    columns = people.columns
    if columns.n < 2:
        raise StatisticsError("one part has no spread; a statistical shape model needs at least two")
    if ddof not in (0, 1):
        raise StatisticsError(f"ddof must be 0 (divide by n, as Z(5)) or 1 (by n - 1), got {ddof}")
    if modes is not None and share is not None:
        raise StatisticsError("give modes or share, not both")
    first = gram_and_mean(columns, people.weights, progress=progress)
    gram, mean = first.gram, first.mean
    if not np.isfinite(mean).all():
        if center != "arithmetic":
            raise StatisticsError(
                f"center={center!r} needs complete parts; fit with missing data has the arithmetic mean only"
            )
        return fit_with_missing(people, ddof=ddof, modes=modes, share=share)
    _tell_of_twins(gram)
    q = part_weights(gram, center)
    variances, vectors = weighted_eigen(gram, q, ddof=ddof, largest=None if modes is None else modes + 1)
    rank = min(_rank(variances, columns.dtype.itemsize == 4), columns.n - 1)
    if rank == 0:
        raise StatisticsError(f"all {columns.n} parts are equal: there is no variance to analyse")
    total = float(q @ np.diag(recentred(gram, q / q.sum()))) / _norm(q, ddof)
    count = rank if modes is None else modes
    if share is not None:
        count = fewest_modes(variances[:rank], share, total)
    if not 0 <= count <= rank:
        raise StatisticsError(f"{columns.n} parts have {rank} modes with variance, {count} were asked for")
    variances, vectors = variances[:count], vectors[:, :count]
    if center != "arithmetic":
        mean = mean + weighted_combinations(columns, mean, (q / q.sum())[:, None])[0][0]
    combine = np.sqrt(q)[:, None] * vectors / np.sqrt(_norm(q, ddof) * variances)
    shapes, peaks = weighted_combinations(columns, mean, combine)
    area_means = combine.T @ (first.part_means - q @ first.part_means / q.sum())
    signs = _signs(area_means, *peaks)
    for row in np.flatnonzero(signs < 0):
        np.negative(shapes[row], out=shapes[row])
    for array in (shapes, mean):
        array.flags.writeable = False  # handed over without a copy
    centred = recentred(gram, q / q.sum())
    scores = signs * (centred @ combine) / np.sqrt(variances)
    return StatisticalShapeModel(
        mean=mean,
        modes=shapes,
        variances=variances,
        weights=people.weights,
        total_variance=total,
        part_weights=q,
        scores=scores,
        gram=gram,
        ddof=ddof,
        center=center,
        nominal=people.nominal,
        rows=people.rows,
    )


def weighted_eigen(
    gram: Floats, q: Floats, *, ddof: int = 1, largest: int | None = None
) -> tuple[Floats, Floats]:
    """Return eigenvalues of the weighted covariance, falling, and eigenvectors (n, k) of its Gram matrix.

    Parameters
    ----------
    gram : (n, n) float
        About any common centre.
    q : (n,) float
        Part weights.
    ddof : int
    largest : int, optional
        Only so many.
    """
    n = len(gram)
    root = np.sqrt(q)
    inner = root[:, None] * recentred(gram, q / q.sum()) * root[None, :]
    count = n if largest is None else min(n, largest)
    if n >= _MANY_PARTS and count <= n // 20:  # Lanczos to machine precision, from a fixed start
        start = np.random.default_rng(0).standard_normal(n)
        values, vectors = eigsh(inner, k=count, v0=start, ncv=min(n, 2 * count + 20))
        order = np.argsort(values)
        values, vectors = values[order], vectors[:, order]
    else:
        values, vectors = eigh(inner, subset_by_index=None if count == n else (n - count, n - 1))
    return np.maximum(values[::-1], 0.0) / _norm(q, ddof), vectors[:, ::-1]


def fewest_modes(variances: Floats, share: float, total: float) -> int:
    """Return the least t with ``sum of the first t variances >= share * total``, Z(7) read as an at-least.

    Examples
    --------
    >>> fewest_modes(np.array([6.0, 3.0, 1.0]), 0.9, 10.0)
    2
    """
    if not 0.0 < share <= 1.0:
        raise StatisticsError(f"share must be above 0 and at most 1, got {share}")
    reached = np.cumsum(variances) >= share * total * (1.0 - 1e-12)
    return int(np.argmax(reached)) + 1 if reached.any() else len(variances)


def mode_signs(shapes: Floats, weights: Floats) -> Floats:
    """Return the factors (k,), 1 or -1, that give modes (k, d) the sign of `StatisticalShapeModel`'s rule."""
    return _signs(shapes @ weights, shapes.max(axis=1), -shapes.min(axis=1))


def _signs(area_means: Floats, highest: Floats, deepest: Floats) -> Floats:
    return np.where(np.abs(area_means) >= 0.1, np.sign(area_means), np.where(highest >= deepest, 1.0, -1.0))


def _norm(q: Floats, ddof: int) -> float:
    """Divisor of the weighted covariance: n - ddof for equal weights, unbiased for fixed others."""
    return float(q.sum() - ddof * (q**2).sum() / q.sum())


def _rank(variances: Floats, single: bool) -> int:
    limit = 1e-7 if single else 1e-12
    return int((variances > limit * max(variances[0], np.finfo(float).tiny)).sum())


def _tell_of_twins(gram: Floats) -> None:
    """Warn where two parts are the same to rounding: one part copied is not two parts measured."""
    own = np.diag(gram)
    squared = own[:, None] + own[None, :] - 2.0 * gram
    np.fill_diagonal(squared, np.inf)
    i, j = np.unravel_index(int(np.argmin(squared)), squared.shape)
    if own.max() > 0 and squared[i, j] <= 1e-13 * float(own.max()):
        warnings.warn(
            CadskinWarning(
                f"parts {i} and {j} are the same; a copy is not another part and narrows the spread"
            ),
            stacklevel=4,
        )
