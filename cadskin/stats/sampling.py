"""Laws of the coefficients of new parts."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import StatisticsError

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.stats.model import Law, StatisticalShapeModel

__all__ = ["draw_coefficients"]


def draw_coefficients(model: StatisticalShapeModel, rng: np.random.Generator, law: Law) -> Floats:
    """Return coefficients (k,) of one new part in sigma units; see `StatisticalShapeModel.sample`.

    References
    ----------
    Smoothed bootstrap with the variance kept: Silverman, Density Estimation (1986), section 6.4.1.
    """
    normal = rng.standard_normal(model.n_modes)
    if law == "gaussian":
        return normal
    if law == "student":
        freedom = max(model.effective_parts - 1.0, 1.0)
        widened = np.sqrt((1.0 + 1.0 / model.effective_parts) * freedom / rng.chisquare(freedom))
        return np.asarray(normal * widened)
    if law == "kde":
        part = rng.choice(model.n_parts, p=model.part_weights / model.part_weights.sum())
        k = max(model.n_modes, 1)
        width = (4.0 / (model.effective_parts * (k + 2.0))) ** (1.0 / (k + 4.0))
        return np.asarray((model.scores[part] + width * normal) / np.sqrt(1.0 + width**2))
    raise StatisticsError(f"law must be gaussian, student or kde, got {law!r}")
