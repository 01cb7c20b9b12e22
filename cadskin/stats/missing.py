"""Modes of parts with missing samples: probabilistic principal components by expectation maximisation."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import StatisticsError

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats
    from cadskin.stats.model import StatisticalShapeModel
    from cadskin.stats.population import Population

__all__ = ["fit_with_missing", "missing_components"]


def fit_with_missing(
    people: Population, *, ddof: int = 1, modes: int | None = None, share: float | None = None
) -> StatisticalShapeModel:
    """Return the model of parts of which samples are missing (NaN); nothing is filled in beforehand.

    Raises
    ------
    StatisticsError
        A sample that fewer than two parts observed, or more modes than n - 2.
    """
    from cadskin.stats.fitting import fewest_modes, mode_signs
    from cadskin.stats.model import StatisticalShapeModel

    columns = people.columns
    fields = np.asarray(columns.read(0, columns.d), dtype=np.float64)
    seen = np.isfinite(fields)
    _check_observed(seen)
    n = len(fields)
    count = max(1, (n - 1) // 2) if modes is None else modes
    if not 1 <= count <= n - 2:
        raise StatisticsError(
            f"{n} parts with missing samples can have 1 to {n - 2} modes (what is left tells the noise), "
            f"{count} were asked for"
        )
    mean, loadings, noise, scores = missing_components(fields, seen, people.weights, count)
    root = np.sqrt(people.weights)
    left, singular, turn = np.linalg.svd((loadings * root).T, full_matrices=False)
    variances = singular**2 * (n / (n - ddof))
    shapes = left.T / root
    signs = mode_signs(shapes, people.weights)
    shapes = shapes * signs[:, None]
    standard = signs * (scores @ turn.T) * np.sqrt((n - ddof) / n)
    kept = count if share is None else fewest_modes(variances, share, float(variances.sum()))
    lost = float(variances[kept:].sum())
    return StatisticalShapeModel(
        mean=mean,
        modes=shapes[:kept],
        variances=variances[:kept],
        weights=people.weights,
        total_variance=float(variances.sum()) + noise**2,
        part_weights=np.ones(n),
        scores=standard[:, :kept],
        ddof=ddof,
        residual=float(np.hypot(noise, np.sqrt(lost))),
        nominal=people.nominal,
        rows=people.rows,
        notes=(f"{100 * (1 - seen.mean()):.3g} % of the values missing, modes by EM",),
    )


def missing_components(
    fields: Floats, seen: Bools, weights: Floats, count: int, *, tol: float = 1e-6, limit: int = 2000
) -> tuple[Floats, Floats, float, Floats]:
    """Return mean (d,), loadings (k, d), noise [mm] and scores (n, k) of fields with missing entries.

    The model is ``x = mean + scores @ loadings + e`` with standard normal scores and white e; where an entry
    is missing, it takes no part in either step.

    References
    ----------
    Tipping, Bishop, J. R. Statist. Soc. B 61 (1999), doi:10.1111/1467-9868.00196; with missing values: Ilin,
    Raiko, J. Mach. Learn. Res. 11 (2010) 1957, section 3.
    """
    filled = np.where(seen, fields, 0.0)
    mean = filled.sum(axis=0) / seen.sum(axis=0)
    centred = np.where(seen, fields - mean, 0.0)
    _, singular, right = np.linalg.svd(centred, full_matrices=False)
    loadings = singular[:count, None] * right[:count] / np.sqrt(len(fields))
    noise2 = max(
        float((singular[count:] ** 2).sum()) / seen.sum(), 1e-6 * float((centred**2).sum()) / seen.sum()
    )
    weight = weights * len(weights)
    before = np.full(count + 1, np.inf)
    for _ in range(limit):
        scores, spread = _expect(filled - np.where(seen, mean, 0.0), seen, loadings, noise2, weight)
        mean, loadings = _maximise(filled, seen, scores, spread)
        noise2 = _noise(filled, seen, mean, loadings, scores, spread, weight)
        mean, loadings = _standardised(mean, loadings, scores, spread)
        singular = np.linalg.svd(loadings * np.sqrt(weight), compute_uv=False)
        now = np.append(singular, np.sqrt(weight.sum() * noise2))
        if np.abs(now - before).max() <= tol * now.max():
            break
        before = now
    scores, _ = _expect(filled - np.where(seen, mean, 0.0), seen, loadings, noise2, weight)
    shift = scores.mean(axis=0)
    return mean + shift @ loadings, loadings, float(np.sqrt(noise2)), scores - shift


def _expect(
    centred: Floats, seen: Bools, loadings: Floats, noise2: float, weight: Floats
) -> tuple[Floats, Floats]:
    """Mean (n, k) and covariance (n, k, k) of the scores of each part given its observed entries."""
    weighted = loadings * weight
    products = (loadings[:, None, :] * weighted[None, :, :]).reshape(-1, loadings.shape[1])
    k = len(loadings)
    inner = (seen.astype(np.float64) @ products.T).reshape(-1, k, k) / noise2 + np.eye(k)
    spread: Floats = np.linalg.inv(inner).astype(np.float64)
    pulled = centred @ weighted.T / noise2
    return np.einsum("nkl,nl->nk", spread, pulled), spread


def _maximise(filled: Floats, seen: Bools, scores: Floats, spread: Floats) -> tuple[Floats, Floats]:
    """Regress every sample on the scores and 1, over the parts that observed it."""
    n, k = scores.shape
    joint = np.concatenate([scores, np.ones((n, 1))], axis=1)
    second = joint[:, :, None] * joint[:, None, :]
    second[:, :k, :k] += spread
    left = (seen.T.astype(np.float64) @ second.reshape(n, -1)).reshape(-1, k + 1, k + 1)
    right = filled.T @ joint
    solved = np.linalg.solve(left, right[:, :, None])[:, :, 0]
    return solved[:, k], np.ascontiguousarray(solved[:, :k].T)


def _standardised(mean: Floats, loadings: Floats, scores: Floats, spread: Floats) -> tuple[Floats, Floats]:
    """Absorb mean and covariance of the scores: expanded EM (Liu, Rubin, Wu 1998) takes far fewer rounds."""
    centre = scores.mean(axis=0)
    away = scores - centre
    covariance = (away.T @ away + spread.sum(axis=0)) / len(scores)
    return mean + centre @ loadings, np.asarray(np.linalg.cholesky(covariance).T @ loadings)


def _noise(
    filled: Floats,
    seen: Bools,
    mean: Floats,
    loadings: Floats,
    scores: Floats,
    spread: Floats,
    weight: Floats,
) -> float:
    residual = np.where(seen, filled - mean - scores @ loadings, 0.0)
    extra = np.einsum("kd,nkl,ld->nd", loadings, spread, loadings, optimize=True)
    total = (weight * (residual**2 + np.where(seen, extra, 0.0))).sum()
    return max(float(total / (weight * seen).sum()), 1e-24)


def _check_observed(seen: Bools) -> None:
    times = seen.sum(axis=0)
    if times.min() < 2:
        few = int((times < 2).sum())
        raise StatisticsError(
            f"{few} samples were observed on fewer than two parts, the first is {int(np.argmin(times))}; "
            "leave them out (features=) or measure more parts: they are not invented"
        )
    if (seen.sum(axis=1) == 0).any():
        raise StatisticsError(f"part {int(np.argmin(seen.sum(axis=1)))} has no observed sample")
