"""Tolerances, datums, dimensions and the specification of a part (plain data, ISO 1101, ISO 5459, AP242)."""

from __future__ import annotations

from cadskin.spec.characteristics import CHARACTERISTICS, Characteristic, characteristic
from cadskin.spec.checks import Finding, check
from cadskin.spec.constructors import (
    angularity,
    circular_runout,
    coaxiality,
    concentricity,
    cylindricity,
    distance,
    flatness,
    line_profile,
    parallelism,
    perpendicularity,
    position,
    roundness,
    size,
    straightness,
    surface_profile,
    symmetry,
    tolerance,
    total_runout,
)
from cadskin.spec.datums import Datum, DatumModifier, DatumReference, DatumSystem, DatumTarget
from cadskin.spec.dimension import Dimension
from cadskin.spec.fits import fit_deviations, standard_tolerance
from cadskin.spec.indicators import Indicator, as_indicator, section_normal
from cadskin.spec.reattach import Reattachment, fingerprinted, reattach
from cadskin.spec.selection import FeatureSelection, as_selection
from cadskin.spec.specification import FaceRecord, Specification, Unresolved
from cadskin.spec.tolerance import Tolerance
from cadskin.spec.toml_read import parse_spec, read_spec
from cadskin.spec.toml_write import to_toml, write_spec
from cadskin.spec.zone import AreaUnit, ToleranceZone

__all__ = [
    "CHARACTERISTICS",
    "AreaUnit",
    "Characteristic",
    "Datum",
    "DatumModifier",
    "DatumReference",
    "DatumSystem",
    "DatumTarget",
    "Dimension",
    "FaceRecord",
    "FeatureSelection",
    "Finding",
    "Indicator",
    "Reattachment",
    "Specification",
    "Tolerance",
    "ToleranceZone",
    "Unresolved",
    "angularity",
    "as_indicator",
    "as_selection",
    "characteristic",
    "check",
    "circular_runout",
    "coaxiality",
    "concentricity",
    "cylindricity",
    "distance",
    "fingerprinted",
    "fit_deviations",
    "flatness",
    "line_profile",
    "parallelism",
    "parse_spec",
    "perpendicularity",
    "position",
    "read_spec",
    "reattach",
    "roundness",
    "section_normal",
    "size",
    "standard_tolerance",
    "straightness",
    "surface_profile",
    "symmetry",
    "to_toml",
    "tolerance",
    "total_runout",
    "write_spec",
]
