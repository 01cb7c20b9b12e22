"""`info` and `faces` on the example parts: what they print is what was modelled."""

from __future__ import annotations

import csv
import io
import json
import math
from pathlib import Path

import pytest

from cadskin.cli.main import main

PARTS = Path(__file__).resolve().parents[2] / "examples" / "parts"
BRACKET, PLATE, HINGE = (str(PARTS / f"{name}.step") for name in ("bracket", "plate", "hinge"))


def told(capsys, *words) -> str:
    assert main(list(words)) == 0, capsys.readouterr().err
    return capsys.readouterr().out


def test_info_of_a_plate_has_its_exact_area_and_volume(capsys):
    data = json.loads(told(capsys, "info", PLATE, "--json"))
    (part,) = data["parts"]
    hole = math.pi * 36
    assert part["volume_mm3"] == pytest.approx((60 * 40 - hole) * 8, rel=1e-9)
    assert part["area_mm2"] == pytest.approx(
        2 * (60 * 40 - hole) + 2 * 8 * (60 + 40) + 2 * math.pi * 6 * 8, rel=1e-9
    )
    assert (part["faces"], part["solid"], part["valid"], data["units"]) == (7, True, True, "mm")


def test_info_lists_both_solids_by_name(capsys):
    text = told(capsys, "info", HINGE)
    assert "2 parts" in text
    assert "block" in text
    assert "pin" in text


def test_faces_finds_the_bore(capsys):
    (bore,) = json.loads(told(capsys, "faces", PLATE, "--select", "%CYLINDER", "--json"))
    assert bore["radius_mm"] == pytest.approx(6.0)
    assert bore["area_mm2"] == pytest.approx(2 * math.pi * 6 * 8)
    assert bore["internal"] is True


def test_faces_as_csv_reads_back(capsys):
    rows = list(csv.DictReader(io.StringIO(told(capsys, "faces", BRACKET, "--csv"))))
    assert [int(row["face"]) for row in rows] == list(range(16))
    top = max(rows, key=lambda row: float(row["centre_z"]))
    assert float(top["centre_z"]) == pytest.approx(30.0)
    assert float(top["normal_z"]) == pytest.approx(1.0)
    assert float(top["area_mm2"]) == pytest.approx(6 * 40)


def test_faces_table_is_not_cut_off_in_a_pipe(capsys):
    text = told(capsys, "faces", BRACKET)
    assert "…" not in text
    assert sum("cylinder (inside)" in line for line in text.splitlines()) == 6


def test_faces_of_one_part(capsys):
    records = json.loads(told(capsys, "faces", HINGE, "--part", "pin", "--json"))
    assert {record["part"] for record in records} == {"pin"}
    assert len(records) == 3


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--select", ">Q"], ">Q"),
        (["--select", "no such name"], "no such name"),
        (["--select", "99"], "99"),
        (["--part", "wheel"], "it has bracket"),
    ],
)
def test_unknown_selector_or_part_is_one_line(capsys, words, text):
    assert main(["faces", BRACKET, *words]) == 2
    out = capsys.readouterr()
    assert text in out.err
    assert out.err.count("\n") == 1
    assert out.out == ""
