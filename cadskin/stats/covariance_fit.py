"""Standard deviation, correlation length, anisotropy and nugget of fields, by restricted maximum likelihood.

n parts of k samples with a free mean tell the covariance through their scatter matrix; what an alignment or a
trend took off each part is left out by contrasts. Intervals come from the curvature of the likelihood in the
logarithms of the parameters, where it is nearly quadratic.

References
----------
.. [1] Patterson, Thompson: Recovery of inter-block information when block sizes are unequal, Biometrika 58
   (1971), doi:10.1093/biomet/58.3.545 (contrasts, REML).
.. [2] Stein: Interpolation of Spatial Data (1999), section 6.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve, null_space
from scipy.optimize import minimize
from scipy.stats import norm

from cadskin.deviation import correlation
from cadskin.errors import StatisticsError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats

__all__ = ["KERNEL_NAMES", "CovarianceFit", "fit_covariance"]

KERNEL_NAMES = ("squared_exponential", "matern52", "matern32", "exponential")
_LEAST_NUGGET = 1e-9  # share of the variance; keeps the factorisation stable
_DITHER = 1e-5  # share of the variance: a three-hundredth of the spread is the finest that is looked at


@dataclass(frozen=True)
class CovarianceFit:
    """Parameters of a correlated field with a nugget.

    Parameters
    ----------
    kernel : str
        See `cadskin.deviation.kernels`.
    sigma : float
        Standard deviation of the correlated part [mm].
    length : float
        Correlation length across the marks [mm].
    nugget : float
        Standard deviation of white noise on top (roughness, measurement) [mm].
    anisotropy : float
        Length along the marks over ``length``; 1 where it was not asked for.
    angle : float
        Direction of the marks in the coordinates given [rad], -pi/2 to pi/2.
    intervals : dict
        Name -> (low, high) at ``level``; the nugget's is missing where it came out as zero.
    level : float
    log_likelihood : float
    """

    kernel: str
    sigma: float
    length: float
    nugget: float
    anisotropy: float
    angle: float
    intervals: dict[str, tuple[float, float]]
    level: float
    log_likelihood: float


@dataclass(frozen=True, eq=False)
class _Data:
    """Scatter of contrasts and the coordinates they belong to."""

    coordinates: Floats
    contrasts: Floats | None  # (k, q) orthonormal; None for all
    scatter: Floats  # (q, q)
    freedom: int
    kernel: str
    dither: float  # variance of the white noise that the scatter was given [mm²]


def fit_covariance(
    fields: Floats,
    coordinates: Floats,
    *,
    kernel: str | Sequence[str] = KERNEL_NAMES,
    removed: Floats | None = None,
    free_mean: bool = True,
    anisotropic: bool = False,
    level: float = 0.95,
) -> CovarianceFit:
    """Estimate the covariance of deviation fields.

    Parameters
    ----------
    fields : (n, k) array of float
        Deviations [mm] of n parts at the same k samples; a few hundred samples tell enough.
    coordinates : (k, dim) array of float
        Their places [mm].
    kernel : str or sequence of str
        Of several the one of the greatest likelihood.
    removed : (k, p) array of float, optional
        What was taken off each part on its own: the columns of an alignment or trend (`rigid_basis`).
    free_mean : bool
        True: the mean field is unknown at every sample, which costs one part. False: zero but for
        ``removed``; for a single profile.
    anisotropic : bool
        Estimate a direction too (two coordinates).
    level : float
        Of the intervals.

    Raises
    ------
    StatisticsError
        Too few parts, NaN, or a likelihood without a maximum.
    """
    values, places = np.asarray(fields, dtype=np.float64), np.asarray(coordinates, dtype=np.float64)
    if values.ndim != 2 or places.shape[:1] != values.shape[1:] or not np.isfinite(values).all():
        raise StatisticsError(
            f"fields {values.shape} must be complete (n, k), coordinates {places.shape} must be (k, dim)"
        )
    if anisotropic and places.shape[1] != 2:
        raise StatisticsError("anisotropy needs two coordinates per sample")
    freedom = len(values) - int(free_mean)
    if freedom < 1:
        raise StatisticsError("with a free mean at least two parts are needed; use free_mean=False for one")
    centred = values - values.mean(axis=0) if free_mean else values
    contrasts = None if removed is None else null_space(np.asarray(removed).T)
    reduced = centred if contrasts is None else centred @ contrasts
    scatter = reduced.T @ reduced
    if not np.trace(scatter) > 0:
        raise StatisticsError("the fields do not vary: nothing can be learned of their covariance")
    # Fields are smooth beyond any measurement where they are simulated; without a floor of noise in the data
    # too, the many directions without energy would outvote the few that tell the length.
    dither = _DITHER * float(np.trace(scatter)) / (len(scatter) * freedom)
    scatter[np.diag_indices_from(scatter)] += dither * freedom
    names = (kernel,) if isinstance(kernel, str) else tuple(kernel)
    fits = [
        _fit_one(_Data(places, contrasts, scatter, freedom, name, dither), anisotropic, level)
        for name in names
    ]
    return max(fits, key=lambda fit: fit.log_likelihood)


def _fit_one(data: _Data, anisotropic: bool, level: float) -> CovarianceFit:
    """Search the profile likelihood (variance taken out) from a few lengths, then read the curvature."""
    size = float(np.linalg.norm(np.ptp(data.coordinates, axis=0)))
    starts = [(np.log(share * size), np.log(ratio)) for share in (0.03, 0.1, 0.3) for ratio in (1e-4, 0.1)]
    extra = (0.5, 0.1) if anisotropic else ()
    best = min((np.array([*start, *extra]) for start in starts), key=lambda p: _profile(p, data))
    step = np.diag([0.4, 1.0, 0.5, 0.5][: len(best)])
    simplex = np.vstack([best, best + step])
    found = minimize(
        _profile, best, args=(data,), method="Nelder-Mead",
        options={"xatol": 1e-4, "fatol": 1e-5, "maxiter": 2000, "initial_simplex": simplex},
    )  # fmt: skip
    if not found.success or not np.isfinite(found.fun):
        raise StatisticsError(
            f"the likelihood of the kernel {data.kernel} has no clear maximum: {found.message}"
        )
    variance, log_likelihood = _variance(found.x, data)
    return _described(np.append(np.log(variance) / 2, found.x), data, level, log_likelihood)


def _correlation_matrix(shape: Floats, data: _Data) -> Floats:
    """Correlated part plus nugget ratio for ``[log length, log ratio]`` and the vector of `_mark`."""
    places = data.coordinates / np.exp(shape[0])
    if len(shape) > 2:
        stretch, angle = _mark(shape)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        places = (places @ turn) / [stretch, 1.0]
    squared = (places**2).sum(axis=1)
    distance = np.sqrt(np.maximum(squared[:, None] + squared[None, :] - 2 * places @ places.T, 0.0))
    full = correlation(distance, 1.0, data.kernel)
    full[np.diag_indices_from(full)] = 1.0 + max(np.exp(shape[1]), _LEAST_NUGGET)
    return full if data.contrasts is None else data.contrasts.T @ full @ data.contrasts


def _mark(shape: Floats) -> tuple[float, float]:
    """Return anisotropy (1 or more) and angle from a vector of length log(anisotropy) at twice the angle."""
    size = float(np.hypot(shape[2], shape[3]))
    return float(np.exp(size)), 0.5 * float(np.arctan2(shape[3], shape[2]))


def _variance(shape: Floats, data: _Data) -> tuple[float, float]:
    """Return the best variance for a shape and the log likelihood there."""
    q = len(data.scatter)
    try:
        factor = cho_factor(_correlation_matrix(shape, data), lower=True, check_finite=False)
    except LinAlgError:
        return np.nan, -np.inf
    log_det = 2.0 * float(np.log(np.diag(factor[0])).sum())
    variance = float(np.trace(cho_solve(factor, data.scatter, check_finite=False))) / (q * data.freedom)
    return variance, -0.5 * data.freedom * (log_det + q * np.log(variance) + q)


def _profile(shape: Floats, data: _Data) -> float:
    if not -25 < shape[1] < 15 or np.abs(shape[0]) > 30:
        return np.inf
    return -_variance(shape, data)[1]


def _negative(parameters: Floats, data: _Data) -> float:
    """Negative log likelihood of ``[log sigma, log length, log ratio, ...]``."""
    q = len(data.scatter)
    factor = cho_factor(_correlation_matrix(parameters[1:], data), lower=True, check_finite=False)
    log_det = 2.0 * float(np.log(np.diag(factor[0])).sum())
    trace = float(np.trace(cho_solve(factor, data.scatter, check_finite=False)))
    log_sigma2 = 2.0 * parameters[0]
    return float(0.5 * (data.freedom * (log_det + q * log_sigma2) + trace * np.exp(-log_sigma2)))


def _described(parameters: Floats, data: _Data, level: float, log_likelihood: float) -> CovarianceFit:
    sigma, length = np.exp(parameters[0]), np.exp(parameters[1])
    noise = float(np.exp(parameters[2])) * sigma**2 - data.dither  # what there is beyond the floor [mm²]
    without_nugget = noise < 3.0 * data.dither
    used = list(range(len(parameters)))  # the ratio too: held fixed, the noise would tell the spread
    covariance = np.linalg.pinv(_hessian(parameters, data, used), hermitian=True)
    deviations = dict(zip(used, np.sqrt(np.maximum(np.diag(covariance), 0.0)), strict=True))
    z = float(norm.ppf(0.5 + 0.5 * level))
    nugget = 0.0 if without_nugget else float(np.sqrt(noise))

    def around(value: float, spread: float) -> tuple[float, float]:
        return float(value * np.exp(-z * spread)), float(value * np.exp(z * spread))

    intervals = {"sigma": around(sigma, deviations[0]), "length": around(length, deviations[1])}
    if not without_nugget:
        a, b = used.index(0), used.index(2)
        spread = covariance[a, a] + 0.25 * covariance[b, b] + covariance[a, b]
        intervals["nugget"] = around(nugget, float(np.sqrt(max(spread, 0.0))))
    stretch, angle = _mark(parameters[1:]) if len(parameters) > 3 else (1.0, 0.0)
    if len(parameters) > 3:
        first, second = used.index(3), used.index(4)
        both = covariance[np.ix_([first, second], [first, second])]
        along = np.array([np.cos(2 * angle), np.sin(2 * angle)])
        across = np.array([-along[1], along[0]])
        intervals["anisotropy"] = around(stretch, float(np.sqrt(along @ both @ along)))
        half = z * 0.5 * float(np.sqrt(across @ both @ across)) / max(np.log(stretch), 1e-12)
        intervals["angle"] = (angle - half, angle + half)
    return CovarianceFit(
        data.kernel, float(sigma), float(length), nugget, stretch, angle, intervals, level, log_likelihood
    )


def _hessian(parameters: Floats, data: _Data, used: list[int]) -> Floats:
    """Second differences of the negative log likelihood in the logarithms."""
    step = 0.02
    count = len(used)
    out = np.zeros((count, count))

    def at(*moves: tuple[int, float]) -> float:
        moved = parameters.copy()
        for index, sign in moves:
            moved[used[index]] += sign * step
        return _negative(moved, data)

    middle = _negative(parameters, data)
    for i in range(count):
        out[i, i] = (at((i, 1)) - 2 * middle + at((i, -1))) / step**2
        for j in range(i):
            mixed = at((i, 1), (j, 1)) - at((i, 1), (j, -1)) - at((i, -1), (j, 1)) + at((i, -1), (j, -1))
            out[i, j] = out[j, i] = mixed / (4 * step**2)
    return out
