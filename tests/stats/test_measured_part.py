"""Deviation per nominal sample from scans of known deviation; what was not seen stays NaN."""

from __future__ import annotations

import numpy as np
import pytest
from support.scans import bracket, pose, scan

from cadskin.errors import StatisticsError
from cadskin.stats import MeasuredPart, StatisticalShapeModel, measure, nearest_samples, register


def wave(points, faces):
    """A smooth deviation, another one on each feature (faces 9 and 10 are one hole)."""
    return 0.05 * np.sin(points @ [0.08, 0.11, 0.05] + 0.7 * np.minimum(faces, 9))


def truth(part):
    return wave(part.surface.points[part.samples.vertex_ids], part.samples.face_ids)


def test_a_full_scan_gives_back_the_deviation():
    part = bracket()
    made = scan(part, 60_000, noise=0.01, outliers=0.02, partial=False, field=wave)
    found = measure(made.points, part)
    assert found.coverage > 0.99
    error = found.deviation - truth(part)
    seen = found.measured
    assert np.sqrt(np.mean(error[seen] ** 2)) < 0.006
    assert 0.7 < np.sqrt(np.mean((error[seen] / found.uncertainty[seen]) ** 2)) < 1.6
    assert (found.faces[made.faces < 0] < 0).mean() > 0.85
    right = found.faces[made.faces >= 0] == made.faces[made.faces >= 0]
    assert right.mean() > 0.98


def test_without_noise_the_reading_has_no_bias_worth_naming():
    part = bracket()
    found = measure(scan(part, 60_000, noise=0.0, outliers=0.0, partial=False, field=wave).points, part)
    error = (found.deviation - truth(part))[found.measured]
    assert np.median(np.abs(error)) < 1e-4  # 0.05 mm waves of 45 mm seen through a 2 mm window
    assert np.sqrt(np.mean(error**2)) < 1e-3  # at edges a few points belong to the other face


def test_what_the_scanner_did_not_see_is_nan():
    part = bracket()
    made = scan(part, 40_000, outliers=0.03)
    found = measure(made.points, part)
    bottom = part.feature(name="bottom")
    inner = part.surface.points[bottom.vertex_ids][:, 1] < 15
    assert np.isnan(found.deviation[bottom.rows][inner]).mean() > 0.95
    assert found.measured[part.feature(name="top").rows].mean() > 0.8
    with pytest.raises(StatisticsError, match="not measured"):
        found.skin_model()
    np.testing.assert_array_equal(np.isnan(found.deviation), found.counts == 0)


def test_measured_parts_are_a_population():
    """Register, measure, learn: three modes of thickness-like fields come back through the whole chain."""
    part = bracket()
    rng = np.random.default_rng(0)
    parts = []
    for i in range(6):
        level = 0.1 * rng.standard_normal()
        made = scan(
            part, 12_000, noise=0.005, outliers=0.01, seed=i, partial=False,
            field=lambda p, f, level=level: np.where(f == 1, level, 0.0),
        )  # fmt: skip
        true = pose(1.0, 1.0, seed=i)
        sides = [part.feature(name="bottom"), part.features[2], part.features[8]]
        found = register(true.apply(made.points), part, alignment="datum_frame", features=sides)
        parts.append(measure(true.apply(made.points), part, motion=found))
    assert parts[0].registration.alignment == "datum_frame"
    model = StatisticalShapeModel.fit(parts, features=part.feature(name="top"), modes=1)
    spread = np.std([np.nanmean(p.deviation[part.feature(name="top").rows]) for p in parts], ddof=1)
    assert model.sigmas[0] == pytest.approx(spread, rel=0.02)
    assert model.modes[0].std() < 0.05 * model.modes[0].mean()


def test_full_measured_part_becomes_a_skin_model():
    part = bracket()
    n = part.n_samples
    made = MeasuredPart(part, truth(part), np.zeros(n), np.ones(n), np.zeros(3), np.zeros(3))
    skin = made.skin_model()
    np.testing.assert_array_equal(skin.deviation, truth(part))
    assert skin.provenance.model == "measured"


def test_probed_points_name_their_samples():
    part = bracket()
    top = part.feature(name="top")
    inside = np.abs(top.points[:, :2] - [15, 25]).max(axis=1) < 8
    rows = top.start + np.flatnonzero(inside)[:2]
    points = part.surface.points[part.samples.vertex_ids[rows]] + [0, 0, 0.03]
    found, values = nearest_samples(part, points)
    np.testing.assert_array_equal(found, rows)
    np.testing.assert_allclose(values, 0.03, atol=1e-12)


def test_far_away_points_are_refused():
    with pytest.raises(StatisticsError, match="register the scan first"):
        measure(np.full((10, 3), 500.0), bracket(), limit=1.0)
