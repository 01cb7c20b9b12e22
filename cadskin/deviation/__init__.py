"""Deviation models: one class, one formula; ``a + b`` adds, ``2 * a`` scales, ``a.on(">Z")`` restricts."""

from __future__ import annotations

from cadskin.deviation.algebra import RestrictedModel, ScaledModel, SumModel
from cadskin.deviation.base import DeviationModel
from cadskin.deviation.bases import BasisForm
from cadskin.deviation.designs import Design, parameter_design, with_parameter
from cadskin.deviation.field import GaussianField
from cadskin.deviation.forms import (
    Cone,
    Cylinder,
    Ellipsoid,
    Paraboloid,
    Quadric,
    Saddle,
    Sphere,
    biconic_sag,
    morph,
)
from cadskin.deviation.gibbs import Gibbs
from cadskin.deviation.given import FromArray, FromFE, FromFunction, Towards
from cadskin.deviation.kernels import correlation
from cadskin.deviation.modal import KarhunenLoeve, Modes
from cadskin.deviation.noise import WhiteNoise
from cadskin.deviation.processes import (
    ClampedBow,
    LayerSteps,
    clamped_plate,
    drilled,
    ground,
    milled,
    printed,
    turned,
)
from cadskin.deviation.randomised import Randomised
from cadskin.deviation.registry import from_dict, model_class, model_names, register
from cadskin.deviation.rigid import Bend, Shift, SizeOffset, Taper, Thermal, Tilt, Torsor, Twist
from cadskin.deviation.samplers import Sampler
from cadskin.deviation.scan import FromScan
from cadskin.deviation.text_form import from_text
from cadskin.deviation.texture import Fractal, FromSpectrum, Lobing, Waviness
from cadskin.deviation.vibration import VibrationModes

__all__ = [
    "BasisForm",
    "Bend",
    "ClampedBow",
    "Cone",
    "Cylinder",
    "Design",
    "DeviationModel",
    "Ellipsoid",
    "Fractal",
    "FromArray",
    "FromFE",
    "FromFunction",
    "FromScan",
    "FromSpectrum",
    "GaussianField",
    "Gibbs",
    "KarhunenLoeve",
    "LayerSteps",
    "Lobing",
    "Modes",
    "Paraboloid",
    "Quadric",
    "Randomised",
    "RestrictedModel",
    "Saddle",
    "Sampler",
    "ScaledModel",
    "Shift",
    "SizeOffset",
    "Sphere",
    "SumModel",
    "Taper",
    "Thermal",
    "Tilt",
    "Torsor",
    "Towards",
    "Twist",
    "VibrationModes",
    "Waviness",
    "WhiteNoise",
    "biconic_sag",
    "clamped_plate",
    "correlation",
    "drilled",
    "from_dict",
    "from_text",
    "ground",
    "milled",
    "model_class",
    "model_names",
    "morph",
    "parameter_design",
    "printed",
    "register",
    "turned",
    "with_parameter",
]
