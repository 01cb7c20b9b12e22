"""Conformity: parts inside their tolerances by law, jointly, verified on the welded mesh."""

from __future__ import annotations

from cadskin.conform.policy import Conformity, policies_of, target
from cadskin.conform.simulate import ConformingSampler, Made, prepare_conforming, simulate_conforming

__all__ = [
    "ConformingSampler",
    "Conformity",
    "Made",
    "policies_of",
    "prepare_conforming",
    "simulate_conforming",
    "target",
]
