"""Statistical shape analysis: learn mean and modes from parts that exist, predict new ones."""

from __future__ import annotations

from cadskin.stats.archive import load_shape_model
from cadskin.stats.diagnostics import (
    Generalisation,
    Membership,
    compactness,
    influence,
    leave_one_out,
    membership,
    parallel_analysis,
    specificity,
)
from cadskin.stats.model import StatisticalShapeModel
from cadskin.stats.population import sample_areas
from cadskin.stats.posterior import Posterior
from cadskin.stats.robust import (
    RobustScatter,
    minimum_covariance_determinant,
    part_weights,
    pointwise_median,
    trimmed_mean,
)

__all__ = [
    "Generalisation",
    "Membership",
    "Posterior",
    "RobustScatter",
    "StatisticalShapeModel",
    "compactness",
    "influence",
    "leave_one_out",
    "load_shape_model",
    "membership",
    "minimum_covariance_determinant",
    "parallel_analysis",
    "part_weights",
    "pointwise_median",
    "sample_areas",
    "specificity",
    "trimmed_mean",
]
