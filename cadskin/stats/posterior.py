"""A whole field from a few measured samples: the Gaussian conditional of a statistical shape model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.stats import t as student

from cadskin._arrays import frozen
from cadskin.errors import StatisticsError

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cadskin._typing import Floats
    from cadskin.stats.model import StatisticalShapeModel

__all__ = ["Posterior", "posterior"]


@dataclass(frozen=True, eq=False)
class Posterior:
    """What is known of a part after some of its samples were measured.

    Parameters
    ----------
    mean : (d,) float
        Most probable field [mm].
    std : (d,) float
        Standard deviation [mm] of the part about it, the residual noise included.
    coefficients : (k,) float
        In sigma units.
    covariance : (k, k) float
        Of the coefficients.
    freedom : float
        Degrees of freedom of the bands: effective parts - 1.
    """

    mean: Floats
    std: Floats
    coefficients: Floats
    covariance: Floats
    freedom: float

    def __post_init__(self) -> None:
        """Freeze."""
        for key in ("mean", "std", "coefficients", "covariance"):
            object.__setattr__(self, key, frozen(getattr(self, key), name=key))

    def band(self, level: float = 0.95) -> tuple[Floats, Floats]:
        """Return lower and upper limits (d,) [mm] that hold each sample with probability ``level``.

        Raises
        ------
        StatisticsError
            ``level`` is not between 0 and 1.
        """
        if not 0.0 < level < 1.0:
            raise StatisticsError(f"level must be between 0 and 1, got {level}")
        half = student.ppf(0.5 + 0.5 * level, self.freedom) * self.std
        return self.mean - half, self.mean + half


def posterior(model: StatisticalShapeModel, rows: ArrayLike, values: ArrayLike, *, noise: float) -> Posterior:
    """Return the conditional of a model given measured samples; see `StatisticalShapeModel.posterior`.

    The prior of the coefficients of a new part is normal with variance 1 + 1/n (the mean is itself known
    from n parts only); a measured value has the variance ``noise² + residual noise²`` about the modes.

    References
    ----------
    Luethi, Gerig, Jud, Vetter: Gaussian process morphable models, IEEE TPAMI 40 (2018),
    doi:10.1109/TPAMI.2017.2739743, equation 16.

    Raises
    ------
    StatisticsError
        Rows and values that do not fit, a row out of range, negative noise, or no noise at all where there
        are more values than modes.
    """
    index, measured = np.atleast_1d(np.asarray(rows)), np.atleast_1d(np.asarray(values, dtype=np.float64))
    if index.dtype.kind not in "iu" or index.shape != measured.shape or index.ndim != 1:
        raise StatisticsError(
            f"rows {index.shape} must be integers, one for each of the values {measured.shape}"
        )
    if index.size and (index.min() < 0 or index.max() >= len(model.mean)):
        raise StatisticsError(f"rows must be 0 to {len(model.mean) - 1}, got {index.min()} to {index.max()}")
    if not (np.isfinite(noise) and noise >= 0):
        raise StatisticsError(f"noise must be zero or more [mm], got {noise}")
    seen = np.isfinite(measured)
    index, measured = index[seen], measured[seen]
    prior = 1.0 + 1.0 / model.effective_parts
    shapes = model.sigmas[:, None] * model.modes  # (k, d), mm per sigma
    design = shapes[:, index].T
    variance = noise**2 + model.noise**2
    inner = prior * design @ design.T + variance * np.eye(len(index))
    try:
        gain = np.linalg.solve(inner, prior * design).T if len(index) else np.zeros((model.n_modes, 0))
    except np.linalg.LinAlgError:
        raise StatisticsError(
            f"{len(index)} values without any noise contradict {model.n_modes} modes; state the noise"
        ) from None
    covariance = prior * (np.eye(model.n_modes) - gain @ design)
    covariance = 0.5 * (covariance + covariance.T)
    coefficients = gain @ (measured - model.mean[index])
    spread = np.maximum(np.einsum("kd,kl,ld->d", shapes, covariance, shapes, optimize=True), 0.0)
    return Posterior(
        mean=model.mean + coefficients @ shapes,
        std=np.sqrt(spread + model.noise**2),
        coefficients=coefficients,
        covariance=covariance,
        freedom=max(model.effective_parts - 1.0, 1.0),
    )
