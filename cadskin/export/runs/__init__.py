"""Run folders: populations on disk, made to last; written atomically, read lazily, resumed bit by bit."""

from __future__ import annotations

from cadskin.export.runs.nominal_archive import load_nominal, save_nominal
from cadskin.export.runs.read import Run, open_run
from cadskin.export.runs.write import simulate_run

__all__ = ["Run", "load_nominal", "open_run", "save_nominal", "simulate_run"]
