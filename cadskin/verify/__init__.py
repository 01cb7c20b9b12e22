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
from cadskin.verify.prepared import PreparedVerification, prepare
from cadskin.verify.profile import bezier_closest, profile
from cadskin.verify.qif import write_qif
from cadskin.verify.reference import reference_set
from cadskin.verify.reference_datums import datum_reference_set
from cadskin.verify.reference_parts import reference_part
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
    "PreparedVerification",
    "Standard",
    "Target",
    "Verification",
    "bezier_closest",
    "cylindricity",
    "datum_reference_set",
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
    "prepare",
    "profile",
    "rank",
    "read_case",
    "reference_part",
    "reference_set",
    "roundness",
    "runout",
    "straightness",
    "symmetry",
    "verify",
    "write_qif",
]


class _Verb(ModuleType):
    """The room carries the name of its main verb: ``cadskin.verify(skin, spec)`` works either way.

    Once this package is imported it stands as ``cadskin.verify``, in the place of the function of that name.
    """

    def __call__(self, *arguments: Any, **options: Any) -> Verification | EnsembleVerification:
        return verify(*arguments, **options)


sys.modules[__name__].__class__ = _Verb
