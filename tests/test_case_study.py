"""The case study: its part, its skin models, the drawn parts that ship, and the solver where there is one."""

from __future__ import annotations

import json
import math
import shutil
import stat
import sys
from pathlib import Path

import numpy as np
import pytest

import cadskin as cs
from cadskin.cad.measured import read_frd

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
sys.path.insert(0, str(EXAMPLES))

from case_study import numbers, page, part, shapes, skins, training  # noqa: E402 - found by the line above
from case_study.fe_deck import write_deck  # noqa: E402
from case_study.fe_mesh import Elements, build_blank, build_tools  # noqa: E402
from case_study.fe_run import DivergedError, Drawn, draw, find_ccx  # noqa: E402
from case_study.process import CHECK, CHECK_PROCESS, MEDIUM, VARIED, DrawingProcess, latin_hypercube  # noqa: E402

HAS_CCX = shutil.which("ccx") is not None
WITHOUT_CCX = "CalculiX (ccx) is not installed: apt-get install calculix-ccx"


@pytest.fixture(scope="module")
def bottom():
    return part.bottom_plane()


@pytest.fixture(scope="module")
def analysis():
    _, parts = training.training_set()
    return shapes.analyse(list(parts.values()), shapes.inspected_plane())


def test_the_part_has_the_volume_of_bent_sheet():
    """Bottom, walls and flanges as slabs, bends as quarter rings."""
    p = DrawingProcess()
    ring = sum(math.pi / 4 * ((r + p.thickness) ** 2 - r**2) for r in (p.punch_radius, p.die_radius))
    wall = p.depth - p.punch_radius - p.thickness - p.die_radius
    flat = (50 - p.punch_radius - 25) + wall + p.flange_width
    expected = 50 * 50 * p.thickness + 4 * 50 * (ring + flat * p.thickness)
    solid = part.cross_part().val()
    assert solid.isValid()
    assert solid.Volume() == pytest.approx(expected, rel=1e-9)


def test_the_bottom_has_the_points_and_facets_of_figure_7(bottom):
    assert bottom.surface.n_points == pytest.approx(part.PAPER_POINTS, rel=0.02)
    assert bottom.surface.n_triangles == pytest.approx(part.PAPER_TRIANGLES, rel=0.02)
    np.testing.assert_allclose(bottom.features[0].normals, [[0, 0, -1]] * bottom.n_samples, atol=1e-12)


def test_gibbs_skins_have_flatness_0_3_and_the_pca_zone_is_wider(bottom):
    """Without the warning of chains that have not met (warnings are errors here)."""
    for skin in skins.gibbs_skins(bottom, 2):
        found = skins.zones(skin.surface.points)
        assert found.minimum == pytest.approx(0.3, abs=1e-6)
        assert found.minimum <= found.pca < 1.2 * found.minimum


def test_the_ellipsoid_and_the_noise_add_up(bottom):
    alone, both = skins.ellipsoid_skin(bottom), skins.ellipsoid_and_noise(bottom)
    assert np.ptp(alone.deviation) == pytest.approx(0.2, abs=1e-6)
    assert np.std(both.deviation - alone.deviation) == pytest.approx(0.01, rel=0.06)  # 4 sigma of 2362 values


def test_the_hypercube_fills_every_tenth_of_every_law():
    from scipy.stats import norm

    drawn = latin_hypercube(10)
    nominal = DrawingProcess()
    for name, sigma in VARIED.items():
        scores = [(getattr(p, name) - getattr(nominal, name)) / sigma for p in drawn]
        assert sorted(np.floor(10 * norm.cdf(scores)).astype(int)) == list(range(10)), name


def volume(corners):
    """Volume of a brick: six tetrahedra about its diagonal."""
    tets = [(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)]
    edges = np.array([[corners[b] - corners[a] for b in (i, j, k)] for a, i, j, k in tets])
    return float(np.linalg.det(edges).sum() / 6)


def test_the_blank_fills_the_developed_cross_and_no_tool_cuts_it():
    elements, process = Elements(), DrawingProcess()
    blank = build_blank(elements, process, MEDIUM)
    tools = build_tools(elements, process, MEDIUM)
    nodes = np.array(elements.nodes)
    volumes = [volume(nodes[np.array(brick) - 1]) for brick in elements.bricks]
    assert min(volumes) > 0
    sheet = sum(volumes[number - 1] for number in blank.bricks.values())
    length = process.blank_half_length
    assert sheet == pytest.approx(process.thickness * (2 * 25 * length - 25**2), rel=1e-9)
    heights = {name: nodes[np.array(tool.nodes) - 1, 2] for name, tool in tools.items()}
    for arm in "XY":
        assert heights[f"DIE{arm}"].max() <= 1e-12
        assert heights[f"PUNCH{arm}"].min() >= process.thickness - 1e-12
        assert heights[f"BINDER{arm}"].min() >= 1.05 * process.thickness - 1e-12


def test_ten_parts_ship_and_say_where_they_come_from():
    runs, parts = training.training_set()
    assert len(parts) == 10
    manifest = training.read_manifest()
    assert manifest["solver"].startswith("CalculiX 2.")
    assert sum(file.stat().st_size for file in training.DATA.iterdir()) < 1e6
    for k, drawn in parts.items():
        run = runs[k]
        assert manifest["runs"][run.name]["process"]["depth"] == run.process.depth
        flange = drawn.points[:, 0].argmax()
        assert drawn.displacements[flange, 2] == pytest.approx(run.process.depth, abs=1.5)  # springback


def test_mean_modes_and_prediction(analysis):
    """One symmetric bow, the mean dwarfs the spread, landmarks and mesh tell the same."""
    model = analysis.model
    assert (model.mean**2 * model.weights).sum() > 9 * model.total_variance
    assert model.variances[0] / model.total_variance > 0.8
    assert analysis.landmark_model.sigmas[0] == pytest.approx(model.sigmas[0], rel=0.1)
    flat = {b: analysis.flatness_of({1: b}) for b in (-2, 0, 2)}
    assert min(flat[-2], flat[2]) < flat[0] < max(flat[-2], flat[2])
    assert abs(flat[2] - flat[-2]) > np.std(analysis.flatness)
    assert analysis.left_out[1] < analysis.left_out[0]
    assert analysis.conformity.counted == (analysis.flatness <= skins.FLATNESS).sum()
    assert len(analysis.grid.cells) == 220


def test_the_bottom_is_read_right_at_its_nodes(analysis):
    """Where a node came to rest, the field is its height."""
    _, parts = training.training_set()
    _, moved = shapes.whole_side(parts[0])
    inner = np.abs(moved[:, :2]).max(axis=1) < 38
    found = shapes.bottom_heights(parts[0], moved[inner, :2])
    np.testing.assert_allclose(found, -moved[inner, 2], atol=1e-5)


def test_richardson_finds_order_and_limit_and_refuses_what_has_none():
    lengths = np.array([2.25, 1.5, 1.0])
    order, limit, uncertainty = numbers.richardson(0.4 - 0.02 * lengths**1.5)
    assert order == pytest.approx(1.5)
    assert limit == pytest.approx(0.4)
    assert uncertainty == pytest.approx(1.25 * 0.02 * 1.5**1.5)
    for values in ([0.3, 0.4, 0.35], [0.3, 0.4, 0.6]):
        assert numbers.richardson(np.array(values)) == (None, None, None)
        found = numbers.Convergence(dict(zip(numbers.FAMILY, values, strict=True)))
        assert "no meaning" in page.verdict(found, 0.05)
    assert "Without the coarse and fine mesh" in page.verdict(
        numbers.Convergence({"quick": 0.5, "medium": 0.4}), 0.05
    )
    assert "one mesh only" in page.verdict(numbers.Convergence({"medium": 0.4}), 0.05)


def test_the_page_and_its_pictures_are_there():
    text = (EXAMPLES.parent / "docs" / "case_study.md").read_text(encoding="utf-8")
    assert "{" not in text
    for line in text.splitlines():
        if line.startswith("!["):
            assert (EXAMPLES.parent / "docs" / line.split("(")[1].rstrip(")")).is_file(), line


@pytest.mark.skipif(not HAS_CCX, reason=WITHOUT_CCX)
def test_the_solver_gives_a_small_part_as_it_did(tmp_path):
    """Draw the part named check again (20 CPU seconds) and compare with the file that ships."""
    again = draw(CHECK_PROCESS, CHECK, tmp_path / "run")
    shipped = training.load("check")
    np.testing.assert_array_equal(again.grid, shipped.grid)
    flat = [np.ptp(shapes.whole_side(d)[1][_inner(d), 2]) for d in (again, shipped)]
    assert flat[0] == pytest.approx(flat[1], rel=0.02)
    assert np.abs(again.displacements - shipped.displacements).max() < 0.02
    assert len(read_frd(tmp_path / "run" / "draw.frd").times) == 4


def _inner(drawn):
    return np.abs(shapes.whole_side(drawn)[0][:, :2]).max(axis=1) < 43


def test_a_missing_solver_is_named_with_the_way_to_get_it(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("CCX", "no-such-solver")
    with pytest.raises(cs.CadskinError, match="apt-get install calculix-ccx"):
        find_ccx()
    assert training.main(["--only", "check", "--data", str(tmp_path)]) == 2
    assert "calculix-ccx" in capsys.readouterr().err


def fake_solver(tmp_path, monkeypatch, words):
    path = tmp_path / "fake_ccx"
    path.write_text(f"#!/bin/sh\necho ' {words}'\nexit 201\n")
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setenv("CCX", str(path))


def test_a_part_that_diverged_is_listed_and_not_dropped(monkeypatch, tmp_path, capsys):
    fake_solver(tmp_path, monkeypatch, "*ERROR: too many cutbacks")
    data = tmp_path / "data"
    with pytest.raises(DivergedError, match=r"step time 0 of 4.*too many cutbacks.*depth=12"):
        draw(CHECK_PROCESS, CHECK, tmp_path / "run")
    assert training.main(["--only", "check", "--data", str(data)]) == 1
    assert "diverged: check" in capsys.readouterr().err
    entry = json.loads((data / "manifest.json").read_text())["runs"]["check"]
    assert "too many cutbacks" in entry["diverged"]
    assert entry["process"]["depth"] == 12
    with pytest.raises(cs.CadskinError, match=r"check has no result.*cutbacks"):
        training.load("check", data)


def drawn_by_nobody(process, mesh, folder):
    return Drawn(np.zeros((1, 3), int), np.zeros((1, 3)), np.full((1, 3), process.depth), 1.0)


def test_a_run_that_was_killed_goes_on_with_what_is_missing(monkeypatch, tmp_path):
    runs = training.planned()[1:5]
    made = []

    def killed_at_the_third(process, mesh, folder):
        if len(made) == 2:
            raise KeyboardInterrupt
        made.append(process)
        return drawn_by_nobody(process, mesh, folder)

    monkeypatch.setattr(training, "ccx_version", lambda: "2.20")
    monkeypatch.setattr(training, "draw", killed_at_the_third)
    with pytest.raises(KeyboardInterrupt):
        list(training.make(runs, tmp_path))
    monkeypatch.setattr(training, "draw", drawn_by_nobody)
    assert [name for name, _ in training.make(runs, tmp_path)] == [run.name for run in runs[2:]]
    assert list(training.make(runs, tmp_path)) == []
    (tmp_path / f"{runs[0].name}.npz").write_bytes(b"half a file")
    with pytest.raises(cs.CadskinError, match="is not the file of the manifest"):
        training.load(runs[0].name, tmp_path)
    assert [name for name, _ in training.make(runs, tmp_path)] == [runs[0].name]


def test_other_parameters_make_a_run_new(monkeypatch, tmp_path):
    monkeypatch.setattr(training, "ccx_version", lambda: "2.20")
    monkeypatch.setattr(training, "draw", drawn_by_nobody)
    list(training.make([training.Run("one", MEDIUM, DrawingProcess())], tmp_path))
    changed = training.Run("one", MEDIUM, DrawingProcess(depth=17.0))
    assert [name for name, _ in training.make([changed], tmp_path)] == ["one"]


def test_the_deck_moves_the_tools_and_releases_them_in_turn(tmp_path):
    write_deck(tmp_path / "draw.inp", DrawingProcess(depth=17.5), CHECK)
    text = (tmp_path / "draw.inp").read_text()
    assert text.count("*STEP, NLGEOM") == 4
    assert "DIEX,3,3,17.5" in text
    steps = text.split("*STEP, NLGEOM")
    assert "INNERX,ONBINDERX" in steps[2]
    assert "OUTERX,ONDIEX" in steps[3]
    assert "PAD,P1,1e-4" in steps[4]
