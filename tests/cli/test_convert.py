"""`convert` and `mesh`: files, names, seeds and numbers, read back by other libraries."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cadskin.cli._models import seed_of_part
from cadskin.cli._targets import names_for_parts
from cadskin.cli.main import main
from cadskin.errors import CadskinError
from cadskin.spec.general import CLASS_K, LENGTHS, general_tolerance

PARTS = Path(__file__).resolve().parents[2] / "examples" / "parts"
PLATE, HINGE = str(PARTS / "plate.step"), str(PARTS / "hinge.step")
COARSE = ["--edge-length", "4"]


@pytest.fixture(autouse=True)
def in_its_own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def convert(capsys, *words) -> list[dict]:
    assert main(["convert", *words, "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def test_one_solid_gives_a_watertight_mesh_within_tolerance_and_a_picture(capsys):
    (record,) = convert(capsys, PLATE, "-o", "out.stl", "--tolerance", "0.1", "--seed", "7", *COARSE)
    assert record["files"] == ["out.stl", "out.png"]
    mesh = trimesh.load_mesh("out.stl")
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert (len(mesh.vertices), len(mesh.faces)) == (record["points"], record["triangles"])
    assert -0.05 <= record["deviation_min_mm"] < 0.0 < record["deviation_max_mm"] <= 0.05
    outer = mesh.bounds - [[-30, -20, -4], [30, 20, 4]]
    assert np.abs(outer).max() <= 0.05 + 1e-5
    assert np.abs(outer).max() > 0.001
    assert Path("out.png").read_bytes().startswith(b"\x89PNG")


def test_same_seed_same_file_and_another_seed_another_file(capsys):
    for name, seed in (("a.stl", "7"), ("b.stl", "7"), ("c.stl", "8")):
        convert(capsys, PLATE, "-o", name, "--seed", seed, "--no-picture", *COARSE)
    first, again, other = (Path(name).read_bytes() for name in ("a.stl", "b.stl", "c.stl"))
    assert first == again
    assert first != other
    assert sorted(path.name for path in Path().iterdir()) == ["a.stl", "b.stl", "c.stl"]


def test_seed_that_was_not_given_is_told_and_repeats_the_result(capsys):
    (record,) = convert(capsys, PLATE, "-o", "a.stl", "--no-picture", *COARSE)
    convert(capsys, PLATE, "-o", "b.stl", "--no-picture", "--seed", str(record["seed"]), *COARSE)
    assert Path("a.stl").read_bytes() == Path("b.stl").read_bytes()


def test_general_tolerance_is_used_and_named(capsys):
    assert main(["convert", PLATE, "-o", "a.stl", "--no-picture", *COARSE]) == 0
    told = capsys.readouterr().out
    assert "ISO 2768-2 class K" in told
    assert " 0.2 " in told  # 60 mm: the row above 30 up to 100 mm


def test_two_solids_give_two_files_and_one_part_is_the_same_alone(capsys):
    records = convert(capsys, HINGE, "-o", "h.ply", "--seed", "3", "--no-picture", *COARSE)
    assert [record["files"] for record in records] == [["h_block.ply"], ["h_pin.ply"]]
    (alone,) = convert(
        capsys, HINGE, "-o", "alone.ply", "--seed", "3", "--no-picture", "--part", "pin", *COARSE
    )
    assert alone["deviation_max_mm"] == records[1]["deviation_max_mm"]
    both, one = (trimesh.load_mesh(name) for name in ("h_pin.ply", "alone.ply"))
    assert np.array_equal(both.vertices, one.vertices)


def test_deviation_in_the_file_is_the_offset_along_the_normal(capsys):
    import meshio

    convert(capsys, PLATE, "-o", "skin.vtu", "--seed", "5", "--no-picture", "--tolerance", "0.4", *COARSE)
    mesh = meshio.read("skin.vtu")
    points, deviation = mesh.points, mesh.point_data["deviation"]
    top = (np.abs(points[:, 2] - 4.0) < 0.3) & (np.hypot(points[:, 0], points[:, 1]) > 7.0)
    top &= (np.abs(points[:, 0]) < 28) & (np.abs(points[:, 1]) < 18)
    assert top.sum() > 30
    assert np.abs(deviation[top]).max() > 0.01
    assert points[top, 2] - 4.0 == pytest.approx(deviation[top], abs=1e-5)


def test_model_with_parameters_is_the_one_that_is_drawn(capsys):
    words = ["--model", "field:length=9,kernel=matern32", "--sigma", "0.002", "--tolerance", "0.05"]
    (record,) = convert(capsys, PLATE, "-o", "a.stl", "--seed", "1", "--no-picture", *words, *COARSE)
    assert "0.002" in record["model"]
    assert "length=9" in record["model"]
    assert "matern32" in record["model"]


def test_points_are_met_within_a_tenth(capsys):
    assert main(["mesh", PLATE, "-o", "a.ply", "--points", "3000", "--json"]) == 0
    (record,) = json.loads(capsys.readouterr().out)
    assert record["points"] == pytest.approx(3000, rel=0.1)


def test_mesh_has_the_exact_volume_and_its_labels(capsys):
    assert main(["mesh", PLATE, "-o", "a.ply", "--edge-length", "1"]) == 0
    assert main(["mesh", PLATE, "-o", "a.vtu", "--edge-length", "1"]) == 0
    import meshio

    mesh = trimesh.load_mesh("a.ply")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx((60 * 40 - math.pi * 36) * 8, rel=2e-4)
    labels = meshio.read("a.vtu").cell_data["face_id"][0]
    assert set(np.unique(labels)) == set(range(7))


def test_finer_face_on_request(capsys):
    assert main(["mesh", PLATE, "-o", "a.ply", *COARSE, "--json"]) == 0
    plain = json.loads(capsys.readouterr().out)[0]["triangles"]
    assert main(["mesh", PLATE, "-o", "b.ply", *COARSE, "--edge-length-on", ">Z=1", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)[0]["triangles"] > 2 * plain


def test_names_of_parts_never_collide():
    files = names_for_parts(Path("x/out.3mf"), ["nut", "Nut", "a/b", "a b", "..", "überlänge"])
    assert len({file.name.lower() for file in files}) == 6
    assert all(file.parent == Path("x") for file in files)
    assert names_for_parts(Path("one.stl"), ["whatever"]) == [Path("one.stl")]


@pytest.mark.parametrize(("length", "flatness"), list(zip(LENGTHS, CLASS_K, strict=True)))
def test_general_tolerance_by_row(length, flatness):
    assert general_tolerance(length) == flatness
    assert general_tolerance(length * 1.001) >= flatness
    assert general_tolerance(length / 2) <= flatness


@pytest.mark.parametrize("length", [0.0, -1.0, math.nan])
def test_general_tolerance_of_nothing(length):
    with pytest.raises(CadskinError):
        general_tolerance(length)


def test_parts_of_one_seed_have_streams_of_their_own():
    states = {tuple(seed_of_part(7, f"nut-{i}").generate_state(4)) for i in range(200)}
    assert len(states) == 200


SPEC = """
tolerances = [
  {flatness = 0.03, on = ">Z"},
  {parallelism = 0.06, on = ">Z", datums = "A"},
]
dimensions = [{size = 12, on = "%CYLINDER", fit = "H9"}]
[datums]
A = "<Z"
"""


def test_part_with_tolerances_is_the_first_of_simulate(capsys):
    from cadskin.export import open_run

    Path("plate.toml").write_text(SPEC)
    words = [PLATE, "--spec", "plate.toml", "--seed", "4", *COARSE]
    (record,) = convert(capsys, *words, "-o", "part.ply", "--no-picture")
    assert (record["tolerance_mm"], record["tolerances_met"]) == (None, 3)
    assert main(["simulate", *words, "-n", "1", "-o", "run", "--json"]) == 0
    capsys.readouterr()
    assert record["deviation_max_mm"] == float(open_run("run")[0].deviation.max())
    assert main(["verify", "run"]) == 0
    assert "11.99" not in capsys.readouterr().out  # H9: 12 to 12.043


def test_step_file_with_pmi_converts_inside_its_tolerances(capsys):
    import cadquery as cq

    import cadskin as cs
    from cadskin.verify.meshes import read_labelled_mesh

    spec = cs.Specification(
        cs.flatness(">Z", 0.02), cs.parallelism(">Z", 0.05, datums="A"), datums={"A": "<Z"}
    )
    cs.write_step("pmi.step", cq.Workplane().box(40, 30, 8), spec)
    (record,) = convert(capsys, "pmi.step", "-o", "made.npz", "--seed", "2", "--no-picture", *COARSE)
    assert record["tolerances_met"] == 2
    nominal = cs.nominal("pmi.step", edge_length=4.0)
    found = cs.verify(read_labelled_mesh("made.npz"), cs.read_pmi("pmi.step", nominal), nominal=nominal)
    assert found.conforming
    (wide,) = convert(capsys, "pmi.step", "-o", "wide.stl", "--tolerance", "0.4", "--no-picture", *COARSE)
    assert wide["tolerance_mm"] == 0.4


def test_tolerance_and_spec_exclude_each_other(capsys):
    Path("plate.toml").write_text(SPEC)
    assert main(["convert", PLATE, "-o", "a.stl", "--tolerance", "0.1", "--spec", "plate.toml"]) == 2
    assert "exclude each other" in capsys.readouterr().err
    assert main(["convert", HINGE, "-o", "a.stl", "--spec", "plate.toml", *COARSE]) == 2
    assert "choose one" in capsys.readouterr().err
