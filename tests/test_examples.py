"""Every example runs in a process of its own and returns the number that its docstring promises."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parent.parent / "examples"

# Script -> (lowest, highest) value of main(), and why.
NUMBERS = {
    "00_quickstart": (0.8, 1.2),  # root mean square over sigma: one sample of some 60 independent patches
    "01_cadquery_plate": (0.05 - 1e-6, 0.05 + 1e-6),  # the paraboloid's height, mm
    "02_build123d_bracket": (0.98, 1.02),  # Steiner: volume over area times offset
    "03_step_to_skin": (0.25, 1.0),  # greatest deviation over half the tolerance: used, never exceeded
    "20_systematic_forms": (20, 20),  # models of the gallery that move all three faces
    "21_random_fields": (16, 16),
    "22_processes_and_data": (13, 13),
    "23_paper_gibbs": (1.1, 2.0),  # split R-hat of 32 chains: not converged after the paper's 1000 sweeps
    "24_all_models": (0, 0),  # classes of the registry that are not on the sheet
    "10_pmi_cadquery": (4, 4),  # tolerances that come back from AP242 as they were written
    "11_pmi_build123d": (8, 8),  # members of a pattern of four holes, in two segments
    "40_inside_the_tolerance": (0.8, 1.0),  # largest value over its limit: used, never exceeded
    "70_learn_from_ten_parts": (0.1, 0.7),  # error after six probed points over that of the mean alone
    "71_scan_to_deviation": (2.0, 7.0),  # um: 10 um noise, some 20 points per reading, less at edges
}
RUN = """
import pathlib, runpy, sys
sys.path.insert(0, str(pathlib.Path(sys.argv[1]).parent))  # as for `python script`: beside it is gallery.py
space = runpy.run_path(sys.argv[1])
print("@", space["main"]())
"""


def scripts() -> list[Path]:
    return sorted(FOLDER.glob("[0-9][0-9]_*.py"))


def test_every_example_has_its_number():
    assert {script.stem for script in scripts()} == set(NUMBERS)


@pytest.mark.parametrize("script", scripts(), ids=lambda script: script.stem)
def test_example_returns_its_number(script, tmp_path):
    command = [sys.executable, "-W", "error::cadskin.CadskinWarning", "-c", RUN, str(script)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300, cwd=tmp_path, check=False)
    assert done.returncode == 0, done.stderr
    value = float(done.stdout.rsplit("@", 1)[1])
    low, high = NUMBERS[script.stem]
    assert low <= value <= high
    assert list(tmp_path.iterdir()) == [], "main() writes no files; that is for __main__"


@pytest.mark.parametrize("script", scripts(), ids=lambda script: script.stem)
def test_example_is_short(script):
    assert len(script.read_text().splitlines()) < 60


def test_example_parts_are_what_their_script_makes():
    """Make the parts again in memory; the files that ship have the same volumes."""
    import runpy

    import cadquery as cq

    made = runpy.run_path(str(FOLDER / "parts" / "make_parts.py"))
    for name in ("bracket", "plate", "flange", "gallery"):
        shipped = cq.importers.importStep(str(FOLDER / "parts" / f"{name}.step")).val()
        assert shipped.Volume() == pytest.approx(made[name]().val().Volume(), rel=1e-9), name
    hinge = cq.importers.importStep(str(FOLDER / "parts" / "hinge.step")).val()
    assert hinge.Volume() == pytest.approx(made["hinge"]().toCompound().Volume(), rel=1e-9)
