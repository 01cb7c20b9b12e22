"""Skin model shapes: a nominal model and a deviation field, welded to a watertight mesh."""

from __future__ import annotations

from cadskin.skin.model import SkinEnsemble, SkinFeature, SkinModel
from cadskin.skin.provenance import Provenance
from cadskin.skin.simulate import simulate, simulate_ensemble
from cadskin.skin.weld import WeldReport, weld, weld_report

__all__ = [
    "Provenance",
    "SkinEnsemble",
    "SkinFeature",
    "SkinModel",
    "WeldReport",
    "simulate",
    "simulate_ensemble",
    "weld",
    "weld_report",
]
