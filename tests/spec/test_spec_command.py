"""``cadskin spec``: what it prints, and what it says of bad inputs."""

import json

import pytest

import cadskin as cs
from cadskin.cli.main import main


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    """A plate with a hole and tolerances, and the same plate with a hole that is 1 mm to the side."""
    cq = pytest.importorskip("cadquery")
    folder = tmp_path_factory.mktemp("plates")
    spec = cs.Specification(
        cs.flatness(">Z", 0.02),
        cs.position("%CYLINDER", 0.1, datums="A|B-C", diameter=True, material="M", modifiers="F"),
        datums={"A": "<Z", "B": "<X", "C": ">X"},
        dimensions=[cs.size("%CYLINDER", 12, fit="H7")],
    )
    for name, place in (("plate.step", 0.0), ("again.step", 1.0)):
        shape = cq.Workplane().box(60, 40, 8).faces(">Z").workplane().center(place, 0).hole(12)
        cs.write_step(folder / name, shape, spec)
    return folder / "plate.step"


def run(capsys, *words):
    code = main([str(word) for word in words])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_json_has_the_promised_fields(capsys, plate):
    code, out, _ = run(capsys, "spec", plate, "--json")
    data = json.loads(out)
    assert code == 0
    flat, hole = data["tolerances"]
    assert (flat["type"], flat["value_mm"], flat["scope"]) == ("flatness", 0.02, "feature")
    assert hole["datums"] == ["A", "B-C"]
    assert hole["modifiers"] == ["FREE_STATE"]
    assert hole["material"] == "MMR"
    assert hole["zone"]["shape"] == "diameter"
    assert hole["step_faces"] == sorted(hole["step_faces"])
    assert len(hole["faces"]) == len(hole["step_faces"]) == 1
    assert hole["source"] == f"plate.step {hole['id']}"
    assert [datum["letter"] for datum in data["datums"]] == ["A", "B", "C"]
    assert data["dimensions"][0]["upper_limit"] == 12.018
    assert data["unresolved"] == []


def test_table_shows_the_frames(capsys, plate):
    code, out, _ = run(capsys, "spec", plate, "--table")
    assert code == 0
    assert "⌖ ⌀0.1 Ⓜ Ⓕ | A | B-C" in out
    assert "⏥ 0.02" in out
    assert "⌀12 H7" in out


def test_toml_is_the_default_and_reads_back(capsys, plate, tmp_path):
    code, out, _ = run(capsys, "spec", plate)
    assert code == 0
    file = tmp_path / "plate.spec.toml"
    file.write_text(out, encoding="utf-8")
    assert cs.read_spec(file) == cs.read_pmi(plate)
    assert run(capsys, "spec", file)[1] == out
    code, out, err = run(capsys, "spec", plate, "-o", tmp_path / "two.spec.toml")
    assert (code, out) == (0, "")
    assert "wrote" in err


def test_a_spec_file_moves_to_another_export(capsys, plate, tmp_path):
    file = tmp_path / "plate.spec.toml"
    cs.read_pmi(plate).save(file)
    code, out, err = run(capsys, "spec", file, "--on", plate.with_name("again.step"), "--json")
    assert code == 0
    assert "has moved or changed its outline" in err
    assert [t["type"] for t in json.loads(out)["tolerances"]] == ["flatness", "position"]
    other = tmp_path / "other.step"
    cs.write_step(other, __import__("cadquery").Workplane().box(60, 40, 8))
    code, _, err = run(capsys, "spec", file, "--on", other, "--table")
    assert code == 1
    assert "is not there any more" in err


@pytest.mark.parametrize(
    ("name", "content", "code", "message"),
    [
        ("missing.step", None, 3, "missing.step"),
        ("empty.step", b"", 3, "empty.step is empty"),
        ("text.step", b"hello", 3, "no STEP file"),
        ("cut.step", b"ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('X'));\nENDSEC;\nDATA;\n#1=A(", 3, "cut off"),
        ("bad.toml", b"flatness = [", 3, "no TOML"),
        ("wrong.toml", b"flatnes = {value = 1, on = 0}", 2, "wrong.toml:1: unknown key 'flatnes'"),
        ("unknown.toml", b"flatness = {value = 1, on = 0, datums = 'Q'}", 2, "datum Q, which is not defined"),
    ],
)
def test_bad_inputs_get_one_clear_line(capsys, tmp_path, name, content, code, message):
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    found, out, err = run(capsys, "spec", path)
    assert (found, out) == (code, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1


@pytest.mark.slow
def test_a_picture_has_a_tile_for_each_tolerance(capsys, plate, tmp_path):
    picture = tmp_path / "plate.png"
    code, _, err = run(capsys, "spec", plate, "--picture", picture)
    assert code == 0
    assert f"wrote {picture}" in err
    width, height = (int.from_bytes(picture.read_bytes()[i : i + 4], "big") for i in (16, 20))
    assert (width, height) in ((1280, 480), (640, 960))


def test_a_picture_needs_the_part(capsys, plate, tmp_path):
    file = tmp_path / "plate.spec.toml"
    cs.read_pmi(plate).save(file)
    code, _, err = run(capsys, "spec", file, "--picture", tmp_path / "no.png")
    assert code == 2
    assert "--on PART.step" in err


def test_table_and_json_exclude_each_other(capsys, plate):
    code, _, err = run(capsys, "spec", plate, "--table", "--json")
    assert code == 2
    assert "exclude each other" in err


def test_a_part_without_pmi_says_so(capsys, tmp_path):
    cq = pytest.importorskip("cadquery")
    path = cs.write_step(tmp_path / "bare.step", cq.Workplane().box(1, 2, 3))
    code, out, err = run(capsys, "spec", path)
    assert code == 0
    assert "no semantic PMI" in err
    assert "no semantic PMI" in out
