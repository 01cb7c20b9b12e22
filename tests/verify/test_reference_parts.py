"""Made parts with a prescribed value: what is prescribed is what verification finds."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cadskin.errors import SelectionError, SpecificationError
from cadskin.shape.association import associate
from cadskin.spec import (
    Specification,
    circular_runout,
    cylindricity,
    flatness,
    parallelism,
    perpendicularity,
    position,
    read_spec,
    roundness,
    straightness,
    surface_profile,
    total_runout,
)
from cadskin.verify import verify
from cadskin.verify.meshes import read_labelled_mesh
from cadskin.verify.reference_parts import reference_part, write_reference_parts

# Faces of the box: -x 0, +x 1, -y 2, +y 3, -z 4, +z 5; of the shaft: round 0+1, bottom 2, top 3.
BOX = Specification(
    flatness(5, 0.2, id="flatness"),
    straightness(5, 0.2, id="straightness"),
    parallelism(5, 0.2, datums="A", id="parallelism"),
    perpendicularity(5, 0.2, datums="B", id="perpendicularity"),
    position(5, 0.2, datums="A", id="position"),
    surface_profile(5, 0.2, datums="A", id="profile in A"),
    surface_profile(5, 0.2, id="profile"),
    datums={"A": 4, "B": 2},
)
SHAFT = Specification(
    cylindricity(0, 0.1, id="cylindricity"),
    roundness(0, 0.1, id="roundness"),
    straightness(0, 0.1, diameter=True, id="median line"),
    perpendicularity(0, 0.1, diameter=True, datums="B", id="perpendicularity of the axis"),
    total_runout(3, 0.1, datums="A", id="axial total run-out"),
    circular_runout(3, 0.1, datums="A", id="axial run-out"),
    datums={"A": 0, "B": 2},
)


@pytest.mark.parametrize("tolerance", [item.id for item in BOX])
def test_prescribed_value_on_a_box(array_box, tolerance):
    made = reference_part(array_box, BOX, tolerance, 0.05, rng=3)
    found = verify(made.skin, BOX)[tolerance]
    assert found.value == pytest.approx(0.05, abs=1e-12)
    assert found.certified


@pytest.mark.parametrize("tolerance", [item.id for item in SHAFT])
def test_prescribed_value_on_a_shaft(array_shaft, tolerance):
    made = reference_part(array_shaft, SHAFT, tolerance, 0.03, rng=5)
    assert verify(made.skin, SHAFT)[tolerance].value == pytest.approx(0.03, abs=1e-12)


def test_form_is_that_of_the_association(array_box):
    """The flatness is that of the vertices of the face, by the association alone; the datum is exact."""
    made = reference_part(array_box, BOX, "flatness", 0.3, rng=1)
    points, triangles = made.skin.surface.points, made.skin.surface.triangles
    vertices, below = (np.unique(triangles[array_box.features[k].triangle_ids]) for k in (5, 4))
    assert associate(points[vertices], "plane").value == pytest.approx(0.3, abs=1e-12)
    assert np.ptp(points[below, 2]) == 0.0


def test_written_parts_are_read_and_evaluate_to_the_value(array_box, tmp_path):
    paths = write_reference_parts(tmp_path, array_box, BOX, "parallelism", 0.02, count=3, rng=7)
    answers = json.loads((tmp_path / "answers.json").read_text())
    spec = read_spec(tmp_path / "spec.toml")
    assert [answer["part"] for answer in answers] == [path.name for path in paths]
    shapes = []
    for path, answer in zip(paths, answers, strict=True):
        mesh = read_labelled_mesh(path)
        found = verify(mesh, spec, nominal=array_box)["parallelism"]
        assert found.value == pytest.approx(answer["value"], abs=1e-12)
        shapes.append(mesh.points)
    assert not np.allclose(shapes[0], shapes[1])


@pytest.mark.parametrize(
    ("arguments", "error", "text"),
    [
        (("flatness", 0.0), SpecificationError, "positive"),
        (("flatness", float("nan")), SpecificationError, "positive"),
        (("loveliness", 0.1), SelectionError, "no tolerance"),
    ],
)
def test_bad_requests(array_box, arguments, error, text):
    with pytest.raises(error, match=text):
        reference_part(array_box, BOX, *arguments)


def run(*words):
    command = [sys.executable, "-m", "cadskin.cli.main", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=300)


@pytest.mark.slow
def test_command_makes_parts_of_a_step_file(tmp_path):
    """From the shell: parts of the example bracket, evaluated by the shell again."""
    parts = Path(__file__).resolve().parents[2] / "examples" / "parts"
    cad, spec = parts / "bracket.step", parts / "bracket.spec.toml"
    out = tmp_path / "out"
    wish = ("--characteristic", "parallelism", "--value", 0.05, "--part", cad, "--spec", spec, "--seed", 1)
    done = run("reference", *wish, "-o", out)
    assert done.returncode == 0, done.stderr
    checked = run("verify", out / "part_0000.npz", "--of", cad, "--spec", out / "spec.toml", "--json")
    found = json.loads(checked.stdout)["evaluations"]["parallelism-1"]
    assert found["value"] == pytest.approx(0.05, abs=1e-12)
    missing = run("reference", "--characteristic", "symmetry", "--value", 0.1, "--part", cad, "--spec", spec)
    assert missing.returncode == 2
    assert "no tolerance of type 'symmetry'" in missing.stderr
