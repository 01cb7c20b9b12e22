"""``cadskin evaluate`` from outside: output, exit codes, messages."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest


def write_case(folder, points, **question):
    lines = ["feature,x,y,z", *(f"{label},{x!r},{y!r},{z!r}" for label, (x, y, z) in points)]
    (folder / "case.csv").write_text("\n".join(lines) + "\n")
    path = folder / "case.json"
    path.write_text(json.dumps({"csv": "case.csv", **question}))
    return path


def run(*words):
    command = [sys.executable, "-m", "cadskin.cli.main", "evaluate", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)


SQUARE = [("S", p) for p in [(0.0, 0.0, 0.0), (10.0, 0.0, 0.1), (10.0, 10.0, 0.0), (0.0, 10.0, 0.1)]]


def test_prints_value_quantity_and_certificate(tmp_path):
    done = run(write_case(tmp_path, SQUARE, characteristic="flatness"), "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["value"] == pytest.approx(0.1, abs=1e-14)
    assert found["quantity"] == "flatness"
    assert found["certified"] is True
    table = run(tmp_path / "case.json")
    assert table.returncode == 0
    assert "FLTt (MZPL)" in table.stdout


@pytest.mark.parametrize(
    ("points", "question", "code", "text"),
    [
        (SQUARE[:2], {"characteristic": "flatness"}, 2, "at least 3"),
        ([("S", (float(i), 0.0, 0.0)) for i in range(9)], {"characteristic": "flatness"}, 2, "collinear"),
        ([*SQUARE, ("S", (float("nan"), 0.0, 0.0))], {"characteristic": "flatness"}, 3, "NaN"),
        (SQUARE, {"characteristic": "loveliness"}, 2, "unknown characteristic"),
        (SQUARE, {"characteristic": "parallelism", "datums": []}, 2, "needs a datum"),
        (
            SQUARE,
            {"characteristic": "parallelism", "datums": [{"label": "A", "feature_type": "plane"}]},
            2,
            "no points of feature 'A'",
        ),
        (SQUARE, {"nothing": 1}, 3, "characteristic"),
    ],
)
def test_bad_input_has_a_reason_and_an_exit_code(tmp_path, points, question, code, text):
    done = run(write_case(tmp_path, points, **question))
    assert done.returncode == code, done.stderr
    assert text in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_none_exists_on_a_short_arc(tmp_path):
    angle = np.radians(np.linspace(0, 120, 40))
    points = [("S", (float(np.cos(a)), float(np.sin(a)), 0.0)) for a in angle]
    question = {"characteristic": "size", "feature_type": "circle", "association": "maximum inscribed (X)"}
    question["reference"] = {"quantity": "radius of the maximum inscribed circle"}
    done = run(write_case(tmp_path, points, **question))
    assert done.returncode == 2
    assert "none exists" in done.stderr


def test_missing_file_is_said(tmp_path):
    done = run(tmp_path / "nothing.json")
    assert done.returncode == 3
    assert "nothing.json" in done.stderr
