"""Statistical shape analysis: learn mean and modes from parts that exist, predict new ones."""

from __future__ import annotations

from cadskin.stats.archive import load_shape_model
from cadskin.stats.conformity import Conformity, conformity, counted_interval
from cadskin.stats.covariance_fit import CovarianceFit, fit_covariance
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
from cadskin.stats.field_alignment import align_fields, aligned_ensemble
from cadskin.stats.landmarks import LandmarkGrid, landmark_grid
from cadskin.stats.learned import LearnedShape
from cadskin.stats.measured import MeasuredPart, measure, nearest_samples
from cadskin.stats.model import StatisticalShapeModel
from cadskin.stats.population import sample_areas
from cadskin.stats.posterior import Posterior
from cadskin.stats.process import FeatureProcess, FormTerm, learn_process, process_model
from cadskin.stats.procrustes import Procrustes, generalised_procrustes
from cadskin.stats.registration import Alignment, Registration, register
from cadskin.stats.rigid import RigidMotion, best_motion
from cadskin.stats.robust import (
    RobustScatter,
    minimum_covariance_determinant,
    part_weights,
    pointwise_median,
    trimmed_mean,
)
from cadskin.stats.statismo import save_statismo

__all__ = [
    "Alignment",
    "Conformity",
    "CovarianceFit",
    "FeatureProcess",
    "FormTerm",
    "Generalisation",
    "LandmarkGrid",
    "LearnedShape",
    "MeasuredPart",
    "Membership",
    "Posterior",
    "Procrustes",
    "Registration",
    "RigidMotion",
    "RobustScatter",
    "StatisticalShapeModel",
    "align_fields",
    "aligned_ensemble",
    "best_motion",
    "compactness",
    "conformity",
    "counted_interval",
    "fit_covariance",
    "generalised_procrustes",
    "influence",
    "landmark_grid",
    "learn_process",
    "leave_one_out",
    "load_shape_model",
    "measure",
    "membership",
    "minimum_covariance_determinant",
    "nearest_samples",
    "parallel_analysis",
    "part_weights",
    "pointwise_median",
    "process_model",
    "register",
    "sample_areas",
    "save_statismo",
    "specificity",
    "trimmed_mean",
]
