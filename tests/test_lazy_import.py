"""`import cadskin` and `cadskin --help` load nothing heavy (each measured in a process of its own)."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

HEAVY = {
    "numpy", "scipy", "numba", "OCP", "cadquery", "build123d", "gmsh", "pymeshlab", "pyvista", "vtk",
    "vtkmodules", "matplotlib", "pythoncdt", "trimesh", "meshio",
}  # fmt: skip


def loaded_by(code: str) -> tuple[set[str], float]:
    """Return the top-level packages that ``code`` loads and the CPU seconds it takes."""
    tail = (
        "\nimport sys, json, time"
        "\nprint('@' + json.dumps([sorted({n.split('.')[0] for n in sys.modules}), time.process_time()]))"
    )
    done = subprocess.run([sys.executable, "-c", code + tail], capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stderr
    modules, seconds = json.loads(done.stdout.rsplit("@", 1)[1])
    return set(modules), seconds


def test_import_of_the_package_loads_nothing_heavy():
    modules, seconds = loaded_by("import cadskin")
    assert not modules & (HEAVY | {"typer", "rich"})
    assert seconds < 0.3


def test_help_loads_nothing_heavy():
    modules, seconds = loaded_by("from cadskin.cli.main import main; assert main(['--help']) == 0")
    assert "typer" in modules
    assert not modules & HEAVY
    assert seconds < 1.0  # 0.12 s on the machine of development


@pytest.mark.parametrize("words", [["--version"], ["doctor", "--no-imports", "--json"]])
def test_light_commands_do_not_load_the_kernel(words):
    modules, _ = loaded_by(f"from cadskin.cli.main import main; main({words!r})")
    assert not modules & HEAVY


def test_core_of_the_nominal_model_needs_no_kernel():
    modules, _ = loaded_by("import cadskin; cadskin.NominalModel, cadskin.DiscreteShape")
    assert "numpy" in modules
    assert not modules & (HEAVY - {"numpy", "scipy"})
