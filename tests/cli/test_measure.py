"""`measure`: a scan in any pose becomes deviations and verdicts; what was not seen is not judged."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import cadskin as cs
from cadskin.cli.main import main

BRACKET = Path(__file__).resolve().parents[2] / "examples" / "parts" / "bracket.step"
SPEC = BRACKET.with_name("bracket.spec.toml")
COARSE = ["--edge-length", "2"]


@pytest.fixture(scope="module")
def scanned(tmp_path_factory):
    """A made part whose top (face 0) the scanner did not see; the points have 2 um noise and lie anywhere."""
    folder = tmp_path_factory.mktemp("scan")
    part = cs.nominal(BRACKET, edge_length=2.0)
    skin = cs.simulate(part, cs.GaussianField(sigma=0.01, length=20), rng=3)
    rng = np.random.default_rng(1)
    surface = skin.surface
    triangles = rng.choice(surface.n_triangles, 25_000, p=surface.triangle_areas / surface.area)
    weights = rng.dirichlet([1, 1, 1], len(triangles))
    points = np.einsum("nk,nkd->nd", weights, surface.points[surface.triangles[triangles]])
    points = points[part.surface.face_ids[triangles] != 0]
    points += 0.002 * rng.standard_normal(points.shape)
    turn = Rotation.from_rotvec([0.02, -0.03, 0.01]).as_matrix()
    np.savetxt(folder / "scan.xyz", points @ turn.T + [0.5, -0.3, 0.4])
    np.savetxt(folder / "inch.xyz", (points @ turn.T + [0.5, -0.3, 0.4]) / 25.4)
    return folder, skin


def measured(capsys, folder, *words):
    code = main(["measure", str(folder), "--of", str(BRACKET), *COARSE, *words, "--json"])
    return code, json.loads(capsys.readouterr().out)


def test_flatness_of_a_scan_is_that_of_the_part(capsys, scanned, tmp_path):
    folder, skin = scanned
    out, png = tmp_path / "made.npz", tmp_path / "made.png"
    words = ["--align", "datum_frame", "--spec", str(SPEC), "-o", str(out), "--picture", str(png)]
    code, found = measured(capsys, folder / "scan.xyz", *words)
    assert code == 1  # face 0 was not seen: its parallelism is not evaluated, so the part is not accepted
    table = found["verification"]["evaluations"]
    true = cs.verify(skin, cs.read_spec(SPEC))
    assert {"flatness-1", "perpendicularity-1", "position-1"} <= set(table)
    for name in ("flatness-1", "perpendicularity-1"):  # the hole was scanned on chords of a coarse mesh
        assert table[name]["value"] == pytest.approx(true[name].value, abs=0.006)
    assert [item["tolerance"] for item in found["verification"]["unresolved"]] == ["parallelism-1"]
    assert found["features"][0]["measured"] == "0 %"
    assert 0.6 < found["coverage"] < 0.95
    assert png.stat().st_size > 10_000
    with np.load(out) as mesh:
        assert set(np.unique(mesh["face_ids"])) == set(range(1, 16))
    assert main(["verify", str(out), "--of", str(BRACKET), "--spec", str(SPEC)]) == 1
    assert "parallelism-1" in capsys.readouterr().out


def test_without_tolerances_deviations_alone(capsys, scanned):
    folder, _ = scanned
    code, found = measured(capsys, folder / "inch.xyz", "--align", "robust", "--unit", "inch")
    assert code == 0
    assert found["verification"] is None
    assert max(abs(float(row["mean_um"] or 0)) for row in found["features"]) < 60


def test_verify_aligns_a_scan_with_the_same_options_and_words(capsys, scanned):
    folder, _ = scanned
    scan, words = str(folder / "scan.xyz"), ["--of", str(BRACKET), "--align", "robust", "--on", "3"]
    assert main(["measure", scan, *words]) == 0
    measured = capsys.readouterr().err
    assert main(["verify", scan, *words, "--spec", str(SPEC)]) == 1  # the top was not scanned
    said = capsys.readouterr()
    alignment = next(line for line in measured.splitlines() if "alignment robust: turned by" in line)
    assert alignment in said.err.splitlines()
    assert "cadskin: not conforming" in said.err.splitlines()
    assert "flatness-1" in said.out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["scan.xyz", "--align", "best"], "--align must be one of none, datum_frame"),
        (["scan.xyz", "--align", "robust", "--unit", "feet"], "--unit must be one of mm"),
        (["inch.xyz", "--align", "robust"], "looks like in inch"),
        (["scan.xyz", "--align", "datum_frame"], "no tolerance of the part names any"),
    ],
)
def test_wrong_requests_are_named(capsys, scanned, words, message):
    folder, _ = scanned
    assert main(["measure", str(folder / words[0]), *words[1:], "--of", str(BRACKET), *COARSE]) == 2
    assert message in capsys.readouterr().err
