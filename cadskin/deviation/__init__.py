"""Deviation models: one class, one formula; ``a + b`` adds, ``2 * a`` scales, ``a.on(">Z")`` restricts."""

from __future__ import annotations

from cadskin.deviation.base import (
    DeviationModel,
    Sampler,
    ScaledModel,
    SumModel,
    from_dict,
    model_class,
    model_names,
    register,
)
from cadskin.deviation.field import GaussianField
from cadskin.deviation.forms import Paraboloid
from cadskin.deviation.kernels import correlation
from cadskin.deviation.noise import WhiteNoise

__all__ = [
    "DeviationModel",
    "GaussianField",
    "Paraboloid",
    "Sampler",
    "ScaledModel",
    "SumModel",
    "WhiteNoise",
    "correlation",
    "from_dict",
    "model_class",
    "model_names",
    "register",
]
