"""The doctor against wheels that are laid out by hand: every way the two OCP wheels can lie on a disk."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from cadskin import doctor
from cadskin._kernel_cache import KERNELS, kernels_to_compile
from cadskin.cli.main import main

SIZES = {"cadquery-ocp": 300, "cadquery-ocp-novtk": 200}
BINARY = "OCP/OCP.cpython-311-x86_64-linux-gnu.so"


def install(folder: Path, name: str, *, version: str = "7.9.3.1.1", unpack: bool = True) -> None:
    """Lay out what pip lays out: the metadata, and the binary over whatever was there."""
    info = folder / f"{name.replace('-', '_')}-{version}.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (info / "RECORD").write_text(f"{BINARY},sha256=x,{SIZES[name]}\n{info.name}/METADATA,,\n")
    if unpack:
        (folder / "OCP").mkdir(exist_ok=True)
        (folder / BINARY).write_bytes(b"\0" * SIZES[name])


def test_wheel_of_cadquery_wins_when_unpacked_last(tmp_path):
    install(tmp_path, "cadquery-ocp-novtk")
    install(tmp_path, "cadquery-ocp")
    found = doctor.kernel_wheel([str(tmp_path)])
    assert found.state == "ok"
    assert "cadquery-ocp is on the disk" in found.detail


def test_wheel_without_vtk_unpacked_last_is_broken_and_the_repair_names_the_other(tmp_path):
    install(tmp_path, "cadquery-ocp")
    install(tmp_path, "cadquery-ocp-novtk")
    found = doctor.kernel_wheel([str(tmp_path)])
    assert found.state == "broken"
    assert found.repair == "pip install --force-reinstall --no-deps cadquery-ocp==7.9.3.1.1"


def test_two_versions_are_broken(tmp_path):
    install(tmp_path, "cadquery-ocp")
    install(tmp_path, "cadquery-ocp-novtk", version="8.0.1.1")
    found = doctor.kernel_wheel([str(tmp_path)])
    assert found.state == "broken"
    assert "build123d<0.13" in found.repair


@pytest.mark.parametrize("names", [["cadquery-ocp"], ["cadquery-ocp", "cadquery-ocp-novtk"]])
def test_files_removed_by_an_uninstall_are_broken(tmp_path, names):
    for name in names:
        install(tmp_path, name, unpack=False)
    found = doctor.kernel_wheel([str(tmp_path)])
    assert found.state == "broken"
    assert "missing" in found.detail


def test_no_wheel_at_all_is_broken(tmp_path):
    assert doctor.kernel_wheel([str(tmp_path)]).state == "broken"


def test_only_the_wheel_without_vtk_is_broken_for_cadquery(tmp_path):
    install(tmp_path, "cadquery-ocp-novtk")
    assert doctor.kernel_wheel([str(tmp_path)]).state == "broken"


def test_missing_system_library_names_its_debian_package(monkeypatch):
    monkeypatch.setattr(doctor, "_loads", lambda library: library != "libGL.so.1")
    found = {finding.subject: finding for finding in doctor.examine(imports=False)}
    assert found["libraries of cadquery"].state == "broken"
    assert found["libraries of cadquery"].repair == "apt-get install libgl1"


def test_every_library_has_a_debian_package():
    assert {lib for libraries in doctor.LIBRARIES.values() for lib in libraries} <= set(
        doctor.DEBIAN_PACKAGES
    )


def test_import_that_dies_in_its_child_is_reported(tmp_path, monkeypatch):
    (tmp_path / "bad_module.py").write_text("import os; os.abort()\n")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    found = doctor._import_in_child("bad_module")
    assert (found.state, found.detail) == ("broken", "crashes with signal 6")


def test_command_exits_1_and_prints_the_repair_when_broken(monkeypatch, capsys):
    wrong = doctor.Finding("geometry kernel", "broken", "overwritten", "pip install something")
    monkeypatch.setattr(doctor, "examine", lambda *, imports: (wrong,))
    assert main(["doctor"]) == 1
    assert "repair: pip install something" in capsys.readouterr().out


def test_repair_runs_pip_once_for_equal_lines_and_returns_what_it_cannot_run(monkeypatch):
    ran = []
    monkeypatch.setattr(doctor, "_succeeds", lambda command: not ran.append(command))
    line = "pip install --no-deps cadquery-ocp==1"
    findings = tuple(doctor.Finding("x", "broken", "y", text) for text in (line, line, "install Python 3.11"))
    assert doctor.repair(findings) == ("install Python 3.11",)
    assert [command[1:] for command in ran] == [["-m", *line.split()]]


def test_json_lists_this_environment(capsys):
    code = main(["doctor", "--no-imports", "--json"])
    told = json.loads(capsys.readouterr().out)
    states = {finding["subject"]: finding["state"] for finding in told["findings"]}
    assert states["numpy"] == "ok"
    assert code == (1 if told["broken"] else 0)
    assert told["broken"] == sum(finding["state"] == "broken" for finding in told["findings"])


def test_report_hides_the_home_folder(capsys):
    main(["doctor", "--no-imports", "--report"])
    text = capsys.readouterr().out
    assert "numpy" in text
    assert str(Path.home()) not in text


def test_every_kernel_that_is_watched_exists():
    root = Path(doctor.__file__).parent
    for module, function in KERNELS.values():
        assert f"def {function}(" in (root / module).with_suffix(".py").read_text()


@pytest.mark.slow
def test_kernels_are_found_in_the_cache_that_numba_wrote(tmp_path, monkeypatch):
    """A process with a cache folder of its own compiles; the doctor sees it there."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    assert kernels_to_compile("fields") == ("fields",)
    code = (
        "import cadskin as cs\n"
        "import cadquery as cq\n"
        "part = cs.nominal(cq.Workplane().box(4, 4, 4), edge_length=2.0)\n"
        "cs.WhiteNoise(sigma=0.1).sample(part, rng=1)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    assert kernels_to_compile("fields", "meshing") == ()


def test_facade_explains_a_missing_library(monkeypatch):
    import cadskin
    from cadskin.errors import MissingDependencyError

    def fails(name):
        raise ImportError("libGL.so.1: cannot open shared object file: No such file or directory")

    monkeypatch.setattr(cadskin, "import_module", fails)
    monkeypatch.delitem(vars(cadskin), "nominal", raising=False)
    with pytest.raises(MissingDependencyError, match="apt-get install libgl1"):
        cadskin.nominal  # noqa: B018
