"""Skin model shapes: a nominal model and a deviation field, welded to a watertight mesh."""

from __future__ import annotations

from cadskin.skin.faults import check_skin
from cadskin.skin.model import SkinEnsemble, SkinFeature, SkinModel
from cadskin.skin.provenance import Provenance
from cadskin.skin.simulate import simulate, simulate_ensemble
from cadskin.skin.weld import WeldReport, weld, weld_report
from cadskin.skin.zone import simulate_in_profile_zone

__all__ = [
    "Provenance",
    "SkinEnsemble",
    "SkinFeature",
    "SkinModel",
    "WeldReport",
    "check_skin",
    "simulate",
    "simulate_ensemble",
    "simulate_in_profile_zone",
    "weld",
    "weld_report",
]
