"""Conformity: parts inside their tolerances by law, jointly, verified on the welded mesh."""

from __future__ import annotations

from cadskin.conform.bound import BoundPart, bound_part
from cadskin.conform.capability import capability_scale, fraction_outside, tail_quantile
from cadskin.conform.capable import capable_model
from cadskin.conform.pca_zone import PcaZone, pca_zone
from cadskin.conform.policy import Conformity, conditioned, policies_of, target
from cadskin.conform.process import process_of
from cadskin.conform.simulate import ConformingSampler, Made, prepare_conforming, simulate_conforming

__all__ = [
    "BoundPart",
    "ConformingSampler",
    "Conformity",
    "Made",
    "PcaZone",
    "bound_part",
    "capability_scale",
    "capable_model",
    "conditioned",
    "fraction_outside",
    "pca_zone",
    "policies_of",
    "prepare_conforming",
    "process_of",
    "simulate_conforming",
    "tail_quantile",
    "target",
]
