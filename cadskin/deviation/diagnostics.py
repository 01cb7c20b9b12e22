"""Convergence of Markov chains: split R-hat and effective sample sizes, rank-normalised.

References
----------
Vehtari, Gelman, Simpson, Carpenter, Bürkner: Rank-normalization, folding, and localization, Bayesian Analysis
16 (2021), doi:10.1214/20-BA1221; Geyer: Practical Markov chain Monte Carlo, Statist. Sci. 7 (1992).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtri
from scipy.stats import rankdata

from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats

__all__ = [
    "ChainDiagnostics",
    "diagnose",
    "effective_sample_size",
    "split_rhat",
    "tail_effective_sample_size",
]


@dataclass(frozen=True)
class ChainDiagnostics:
    """What the traces of several chains say about one number.

    Parameters
    ----------
    rhat : float
        Split R-hat; above 1.01 the chains do not agree yet.
    bulk, tail : float
        Effective sample size of all chains together, in the middle and in the 5 % and 95 % tails.
    """

    rhat: float
    bulk: float
    tail: float


def diagnose(traces: Floats) -> ChainDiagnostics:
    """Return the diagnostics of traces (chains, draws)."""
    return ChainDiagnostics(
        split_rhat(traces), effective_sample_size(traces), tail_effective_sample_size(traces)
    )


def split_rhat(traces: Floats) -> float:
    """Return the rank-normalised split R-hat, the larger of the plain and the folded one.

    Parameters
    ----------
    traces : (chains, draws) float
        At least four draws.
    """
    halves = _split(traces)
    folded = np.abs(halves - np.median(halves))
    return max(_rhat(_normal_scores(halves)), _rhat(_normal_scores(folded)))


def effective_sample_size(traces: Floats) -> float:
    """Return the bulk effective sample size of traces (chains, draws)."""
    return _ess(_normal_scores(_split(traces)))


def tail_effective_sample_size(traces: Floats) -> float:
    """Return the smaller effective sample size of the 5 % and 95 % quantiles."""
    halves = _split(traces)
    return min(_ess((halves <= np.quantile(halves, q)).astype(float)) for q in (0.05, 0.95))


def _split(traces: Floats) -> Floats:
    values = np.atleast_2d(np.asarray(traces, dtype=np.float64))
    half = values.shape[1] // 2
    if half < 2 or not np.isfinite(values).all():
        raise DeviationError(f"traces must be (chains, 4 or more draws) and finite, got shape {values.shape}")
    return np.concatenate([values[:, :half], values[:, -half:]])


def _normal_scores(values: Floats) -> Floats:
    ranks = rankdata(values, axis=None).reshape(values.shape)
    return np.asarray(ndtri((ranks - 0.375) / (values.size + 0.25)))


def _rhat(values: Floats) -> float:
    count = values.shape[1]
    within = float(values.var(axis=1, ddof=1).mean())
    between = float(values.mean(axis=1).var(ddof=1))
    if within == 0:
        return 1.0 if between == 0 else np.inf
    return float(np.sqrt((count - 1) / count + between / within))


def _ess(values: Floats) -> float:
    """Geyer's initial monotone sequence on the autocorrelation over all chains."""
    chains, count = values.shape
    centred = values - values.mean(axis=1, keepdims=True)
    size = 1 << (2 * count - 1).bit_length()
    spectrum = np.fft.rfft(centred, size, axis=1)
    covariance = np.fft.irfft(spectrum * spectrum.conj(), size, axis=1)[:, :count] / count
    within = covariance[:, 0].mean() * count / (count - 1)
    total = within * (count - 1) / count + (values.mean(axis=1).var(ddof=1) if chains > 1 else 0.0)
    if total == 0:
        return float(chains * count)
    rho = 1.0 - (within - covariance.mean(axis=0)) / total
    rho[0] = 1.0
    pairs = rho[: count // 2 * 2].reshape(-1, 2).sum(axis=1)
    stop = int(np.argmax(pairs <= 0)) if (pairs <= 0).any() else len(pairs)
    time = -1.0 + 2.0 * float(np.minimum.accumulate(pairs[:stop]).sum())
    return float(chains * count / max(time, 1.0 / np.log10(chains * count)))
