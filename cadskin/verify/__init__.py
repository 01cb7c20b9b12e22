"""Verification: characteristics of ISO 1101 with minimum zones, datum systems and certificates."""

from __future__ import annotations

import sys
from types import ModuleType
from typing import Any

from cadskin.verify.cases import Case, evaluate_case, read_case
from cadskin.verify.datums import (
    DatumFeature,
    DatumFrame,
    EstablishedDatum,
    Standard,
    establish,
    establish_one,
)
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.form import cylindricity, flatness, form, roundness, straightness
from cadskin.verify.location import MaterialReport, Target, material_report, position, symmetry
from cadskin.verify.median import median_line, median_points
from cadskin.verify.orientation import orientation
from cadskin.verify.profile import bezier_closest, profile
from cadskin.verify.runout import runout
from cadskin.verify.size import global_size, local_diameters, rank
from cadskin.verify.verification import EnsembleVerification, Verification, verify

__all__ = [
    "Case",
    "DatumFeature",
    "DatumFrame",
    "EnsembleVerification",
    "EstablishedDatum",
    "Evaluation",
    "MaterialReport",
    "Standard",
    "Target",
    "Verification",
    "bezier_closest",
    "cylindricity",
    "establish",
    "establish_one",
    "evaluate_case",
    "flatness",
    "form",
    "global_size",
    "local_diameters",
    "material_report",
    "median_line",
    "median_points",
    "orientation",
    "position",
    "profile",
    "rank",
    "read_case",
    "roundness",
    "runout",
    "straightness",
    "symmetry",
    "verify",
]


class _Verb(ModuleType):
    """The room carries the name of its main verb: ``cadskin.verify(skin, spec)`` works either way.

    Once this package is imported it stands as ``cadskin.verify``, in the place of the function of that name.
    """

    def __call__(self, *arguments: Any, **options: Any) -> Verification | EnsembleVerification:
        return verify(*arguments, **options)


sys.modules[__name__].__class__ = _Verb
