"""`simulate`, `verify` of a run and `export`: one line in, conforming parts out, bad requests named."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from cadskin.cli.main import main
from cadskin.export import open_run

PARTS = Path(__file__).resolve().parents[2] / "examples" / "parts"
PLATE, HINGE = str(PARTS / "plate.step"), str(PARTS / "hinge.step")
COARSE = ["--edge-length", "6"]
SPEC = """
tolerances = [
  {flatness = 0.05, on = ">Z"},
  {parallelism = 0.08, on = ">Z", datums = "A"},
]
[datums]
A = "<Z"
"""


@pytest.fixture(autouse=True)
def in_its_own_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("plate.spec.toml").write_text(SPEC)


def simulate(capsys, *words) -> dict:
    assert main(["simulate", *words, *COARSE, "--json"]) == 0, capsys.readouterr().err
    return json.loads(capsys.readouterr().out)


def refused(capsys, *words) -> str:
    assert main(list(words)) == 2
    return capsys.readouterr().err


def test_run_conforms_and_is_exported(capsys):
    record = simulate(capsys, PLATE, "--spec", "plate.spec.toml", "-n", "3", "--seed", "5", "-o", "run")
    assert record["parts"] == 3
    assert [item["characteristic"] for item in record["tolerances"]] == ["flatness", "parallelism"]
    assert all(item["within"] == 3 for item in record["tolerances"])
    assert record["unsupported"] == []
    assert main(["verify", "run"]) == 0
    assert "3 of 3" in capsys.readouterr().out
    assert main(["export", "run", "--only", "1", "-o", "part.stl", "--certificate"]) == 0
    assert json.loads(Path("part.certificate.json").read_text())["conforming"] is True
    mesh = trimesh.load_mesh("part.stl")
    assert mesh.is_watertight
    run = open_run("run")
    points = run[1].points
    np.testing.assert_allclose(mesh.bounds, [points.min(axis=0), points.max(axis=0)], atol=1e-5)
    capsys.readouterr()
    assert main(["export", "run", "-o", "all.ply", "--json"]) == 0
    names = [item["file"] for item in json.loads(capsys.readouterr().out)]
    assert names == ["all_00000.ply", "all_00001.ply", "all_00002.ply"]


def test_same_seed_goes_on_with_the_same_bits(capsys):
    words = [PLATE, "--spec", "plate.spec.toml", "--seed", "5"]
    simulate(capsys, *words, "-n", "1", "-o", "a")
    simulate(capsys, *words, "-n", "2", "-o", "a")
    simulate(capsys, *words, "-n", "2", "-o", "b")
    np.testing.assert_array_equal(open_run("a").ensemble().deviations, open_run("b").ensemble().deviations)
    assert main(["simulate", *words[:-1], "6", "-n", "2", "-o", "a", *COARSE]) == 3
    assert "holds another run" in capsys.readouterr().err


def test_run_that_does_not_conform_has_exit_code_1(capsys):
    record = simulate(
        capsys, PLATE, "--spec", "plate.spec.toml", "-n", "2", "--seed", "5", "-o", "raw",
        "--conform", "none", "--model", "field", "--sigma", "0.05",
    )  # fmt: skip
    assert any(item["within"] < 2 for item in record["tolerances"])
    assert main(["verify", "raw"]) == 1
    assert "not conforming" in capsys.readouterr().err
    Path("wide.toml").write_text(SPEC.replace("0.05", "2.0").replace("0.08", "2.0"))
    assert main(["verify", "raw", "--spec", "wide.toml", "--csv", "table.csv"]) == 0
    assert Path("table.csv").read_text().count("2 of 2") == 2


def test_part_without_tolerances_gets_the_general_one(capsys):
    assert main(["simulate", PLATE, "-o", "run", "--seed", "1", *COARSE]) == 0
    said = capsys.readouterr()
    assert "every face gets a profile of 0.2 mm" in said.err
    assert "surface_profile" in said.out
    assert main(["verify", "run"]) == 0


def test_value_of_a_tolerance_can_be_chosen(capsys):
    simulate(
        capsys, PLATE, "--spec", "plate.spec.toml", "-n", "2", "--seed", "5", "-o", "run",
        "--conform", "flatness-1=0.031",
    )  # fmt: skip
    np.testing.assert_allclose(open_run("run").values[:, 0], 0.031, atol=1e-12)


def test_capability_sets_the_spread(capsys):
    Path("flat.toml").write_text('tolerances = [{flatness = 0.05, on = ">Z"}]')
    words = [PLATE, "--spec", "flat.toml", "-n", "4", "--seed", "5"]
    simulate(capsys, *words, "--cpk", "0.6", "-o", "poor")
    simulate(capsys, *words, "--cpk", "1.6", "-o", "good")
    poor, good = (open_run(name).ensemble().deviations.std() for name in ("poor", "good"))
    assert 1.5 < poor / good < 3.5  # the tails of a form value are wider than those of a normal number


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--cpk", "-1"], "--cpk"),
        (["--cpk", "inf"], "--cpk"),
        (["--cpk", "1.33", "--model", "field"], "leave out --model"),
        (["--sigma", "0.1"], "--sigma is for a --model"),
        (["--model", "field"], "needs --sigma"),
        (["--model", "fild"], "fild"),
        (["--conform", "clip"], "is none of"),
        (["--conform", "target"], "needs values"),
        (["--conform", "flatness-9=0.1"], "no tolerance has the id 'flatness-9'"),
        (["--spec", "nothing.toml"], "nothing.toml"),
    ],
)
def test_wrong_requests_are_named(capsys, words, message):
    spec = [] if "--spec" in words else ["--spec", "plate.spec.toml"]
    code = main(["simulate", PLATE, *spec, *words, "-o", "run", *COARSE])
    assert code in (2, 3)
    assert message in capsys.readouterr().err
    assert not Path("run").exists()


def test_wrong_places(capsys):
    assert main(["simulate", PLATE, "-o", "nowhere/run"]) == 3
    assert "there is no folder" in capsys.readouterr().err
    assert main(["simulate", PLATE, "-o", "plate.spec.toml"]) == 3
    assert "is a file" in capsys.readouterr().err
    assert main(["export", "nothing", "-o", "part.stl"]) == 3
    assert "is no folder" in capsys.readouterr().err
    assert "choose one with --part" in refused(capsys, "simulate", HINGE, "-o", "run", *COARSE)
    Path("part.ply").write_text("ply")
    assert "name the CAD file" in refused(capsys, "verify", "part.ply")


def test_parts_of_a_run_are_counted_from_zero(capsys):
    simulate(capsys, PLATE, "--spec", "plate.spec.toml", "-n", "1", "--seed", "5", "-o", "run")
    assert "parts 0 to 0, not 1" in refused(capsys, "export", "run", "--only", "1", "-o", "part.stl")


def test_worst_part(capsys):
    Path("top.toml").write_text(
        'tolerances = [{surface_profile = 0.2, on = ">Z", datums = "A"}]\n[datums]\nA = "<Z"\n'
    )
    words = ["worst", PLATE, "--spec", "top.toml", *COARSE]
    assert main([*words, "--measure", "mean(>Z)", "--json", "-o", "worst.stl"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["value"] == pytest.approx(0.1, rel=1e-6)
    assert trimesh.load_mesh("worst.stl").is_watertight
    assert "no measure is written" in refused(capsys, *words, "--measure", "weight")
    assert "no tolerance bounds" in refused(capsys, *words, "--measure", "volume")
