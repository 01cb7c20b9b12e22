"""Run CalculiX on one drawing process and keep what the case study needs: the sheet after springback."""

from __future__ import annotations

import os
import re
import resource
import shutil
import subprocess
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import cadskin as cs
from cadskin.cad.measured import read_frd

from .fe_deck import write_deck
from .fe_mesh import Blank
from .process import DrawingProcess, FeMesh

STEPS = 4.0  # time at the end of the last step: draw, binder away, die away, pad away
NO_CCX = (
    "CalculiX (ccx) is not installed: on Debian and Ubuntu `apt-get install calculix-ccx`, elsewhere "
    "https://www.calculix.de; or name the program in the environment variable CCX"
)


class DivergedError(cs.CadskinError):
    """CalculiX gave up before the part was released."""


@dataclass(frozen=True, eq=False)
class Drawn:
    """A quarter of the sheet after springback.

    ``grid`` holds the place (i along x, j along y, k upwards) of each node; ``k == 0`` is the outer side.
    """

    grid: np.ndarray  # (n, 3) int
    points: np.ndarray  # (n, 3) float, flat blank, mm
    displacements: np.ndarray  # (n, 3) float, mm
    cpu_seconds: float

    def save(self, path: Path) -> None:
        """Write an npz file (float32: 1 um in 16 m, 0.001 um in 16 mm) in one go, never half of it."""
        part = path.with_suffix(".part.npz")
        np.savez_compressed(
            part,
            grid=self.grid.astype(np.int16),
            points=self.points.astype(np.float32),
            displacements=self.displacements.astype(np.float32),
            cpu_seconds=self.cpu_seconds,
        )
        part.replace(path)

    @classmethod
    def load(cls, path: Path) -> Drawn:
        """Read what `save` wrote."""
        with np.load(path) as data:
            arrays = [data[name].astype(float) for name in ("points", "displacements")]
            return cls(data["grid"].astype(int), *arrays, float(data["cpu_seconds"]))


def find_ccx() -> str:
    """Return the solver's path; the error says where to get it."""
    found = shutil.which(os.environ.get("CCX", "ccx"))
    if found is None:
        raise cs.CadskinError(NO_CCX)
    return found


def ccx_version() -> str:
    """Return what ``ccx -v`` says, e.g. ``2.20``."""
    text = subprocess.run([find_ccx(), "-v"], capture_output=True, text=True, check=False).stdout
    found = re.search(r"Version\s+(\S+)", text)
    return found.group(1) if found else "unknown"


def draw(process: DrawingProcess, mesh: FeMesh, folder: Path) -> Drawn:
    """Draw one part in ``folder`` (made anew) on one thread.

    Raises
    ------
    DivergedError
        The message holds the solver's last words and the process parameters.
    CadskinError
        No solver.
    """
    solver = find_ccx()
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    blank = write_deck(folder / "draw.inp", process, mesh)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    with (folder / "draw.log").open("w") as log:
        done = subprocess.run(
            [solver, "-i", "draw"],
            cwd=folder,
            env=os.environ | {"OMP_NUM_THREADS": "1"},
            stdout=log,
            stderr=subprocess.STDOUT,
            check=False,
        )
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    return _result(folder, blank, process, done.returncode, seconds)


def _result(folder: Path, blank: Blank, process: DrawingProcess, code: int, seconds: float) -> Drawn:
    log = (folder / "draw.log").read_text(errors="replace")
    try:
        found = read_frd(folder / "draw.frd")
        reached = float(found.times[-1])
    except cs.CadskinError:
        found, reached = None, 0.0
    if code or found is None or reached < STEPS - 1e-6:
        last = " ".join(line.strip() for line in log.splitlines()[-40:] if "ERROR" in line or "error" in line)
        raise DivergedError(
            f"ccx stopped at step time {reached:.3g} of {STEPS:g} (code {code}): {last}; {process}"
        )
    grid = np.array(list(blank.nodes))
    rows = np.searchsorted(found.node_ids, list(blank.nodes.values()))
    return Drawn(grid, found.points[rows], found.displacements[rows], seconds)
