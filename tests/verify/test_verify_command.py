"""``cadskin verify`` from outside, on a plate that was made and written by the library."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from cadskin.cad.measured import read_qif
from cadskin.cli.main import main
from cadskin.errors import CadskinWarning, ReadError
from cadskin.export import write
from cadskin.shape.association import rotation
from cadskin.verify.meshes import read_labelled_mesh
from cadskin.verify.scans import read_scan

cadquery = pytest.importorskip("cadquery", reason="needs cadquery to make a STEP file")

SPEC = """
[datums]
A = "<Z"

[[tolerances]]
flatness = {value}
on = ">Z"

[[tolerances]]
parallelism = 0.2
on = ">Z"
datums = "A"
"""


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """STEP file, mesh with a bowed top, and the top's bow."""
    from cadskin.cad import nominal

    folder = tmp_path_factory.mktemp("plate")
    step = folder / "plate.step"
    cadquery.exporters.export(cadquery.Workplane().box(60, 40, 8), str(step))
    part = nominal(step, edge_length=5.0)
    points = np.array(part.surface.points)
    top = np.isclose(points[:, 2], points[:, 2].max())
    points[top, 2] += 0.05 * (1 - (points[top, 0] / 30) ** 2)
    made = part.surface.with_points(points)
    write(folder / "made.npz", made)
    return folder, step, made


def run(*words):
    command = [sys.executable, "-m", "cadskin.cli.main", "verify", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)


@pytest.mark.parametrize(("value", "code"), [(0.06, 0), (0.04, 1)])
def test_exit_code_tells_whether_it_conforms(plate, value, code):
    folder, step, _ = plate
    spec = folder / f"spec_{code}.toml"
    spec.write_text(SPEC.format(value=value))
    qif = folder / f"made_{code}.qif"
    done = run(folder / "made.npz", "--of", step, "--spec", spec, "--qif", qif, "--json")
    assert done.returncode == code, done.stderr
    found = json.loads(done.stdout)
    values = {row["characteristic"]: row["value"] for row in found["evaluations"].values()}
    assert values["flatness"] == pytest.approx(0.05, abs=1e-3)
    assert values["parallelism"] == pytest.approx(0.05, abs=1e-3)
    assert found["conforming"] is (code == 0)
    assert read_qif(qif).parts[0].declared == ("FAIL" if code else "PASS")


def test_a_scan_is_aligned_and_takes_its_faces_from_the_part(plate):
    """An STL that lies elsewhere: labels, the warning of single precision, and exit code 1."""
    folder, step, made = plate
    turn = rotation(np.array([0.02, 0.01, 0.03]))
    stl = write(folder / "scan.stl", made.with_points(made.points @ turn.T + [0.5, -0.3, 0.2]))
    with pytest.warns(CadskinWarning, match="single precision"):
        read_scan(stl)
    spec = folder / "scan.toml"
    spec.write_text(SPEC.format(value=0.04))
    done = run(stl, "--of", step, "--spec", spec, "--align", "robust", "--json")
    assert done.returncode == 1, done.stderr
    assert "single precision" in done.stderr
    found = json.loads(done.stdout)
    values = {row["characteristic"]: row["value"] for row in found["evaluations"].values()}
    assert values["flatness"] == pytest.approx(0.05, abs=1e-3)
    assert values["parallelism"] == pytest.approx(0.05, abs=1e-3)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--align", "search"), "--align must be one of none, datum_frame"),
        (("--search",), "--search is about an alignment: add --align HOW"),
        (("--on", "3"), "--on is about an alignment"),
    ],
)
def test_wrong_alignments_are_refused(plate, capsys, words, message):
    folder, step, _ = plate
    assert main(["verify", str(folder / "made.npz"), "--of", str(step), *words]) == 2
    assert message in capsys.readouterr().err


def test_labelled_meshes_round_trip(plate, tmp_path):
    _, _, made = plate
    again = read_labelled_mesh(write(tmp_path / "made.npz", made))
    assert np.array_equal(again.points, made.points)
    assert np.array_equal(again.face_ids, made.face_ids)
    exact = read_labelled_mesh(write(tmp_path / "double.ply", made, double=True))
    assert np.array_equal(exact.points, made.points)
    assert np.array_equal(exact.triangles, made.triangles)
    assert np.array_equal(exact.face_ids, made.face_ids)


def test_single_precision_is_warned_of(plate, tmp_path):
    _, _, made = plate
    path = write(tmp_path / "single.ply", made)
    with pytest.warns(CadskinWarning, match="single precision"):
        read_labelled_mesh(path)


def test_ascii_ply(tmp_path):
    path = tmp_path / "one.ply"
    path.write_text(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
        "element face 1\nproperty list uchar int vertex_indices\nproperty int face_id\nend_header\n"
        "0 0 0\n1 0 0\n0 1 0\n3 0 1 2 4\n"
    )
    assert read_labelled_mesh(path).face_ids.tolist() == [4]


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("a.stl", b"solid", "no STL"),
        ("a.ply", b"hello", "no PLY"),
        ("a.npz", b"hello", "a.npz"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nelement face 0\nend_header\n", "damaged"),
    ],
)
def test_damaged_meshes_are_refused(tmp_path, name, content, text):
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ReadError, match=text):
        read_labelled_mesh(path)
