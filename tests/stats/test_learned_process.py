"""Parameters of known processes come back inside their intervals at the stated rate."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from support.parts import box, cylinder

import cadskin as cs
from cadskin.deviation import FromArray, correlation
from cadskin.deviation.coordinates import surface_coordinates
from cadskin.errors import DeviationError, StatisticsError
from cadskin.skin import simulate_ensemble
from cadskin.stats import (
    LearnedShape,
    StatisticalShapeModel,
    align_fields,
    fit_covariance,
    learn_process,
    process_model,
)

CORPUS = Path(os.environ.get("CADSKIN_CORPUS", Path(__file__).resolve().parents[3] / "shared" / "corpus"))


def drawn(n, places, rng, *, sigma, length, kernel="squared_exponential", nugget=0.0, stretch=1.0, angle=0.0):
    """Fields by a dense factorisation, independent of the package's samplers."""
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    scaled = (places @ turn) / [stretch, 1.0]
    distance = np.linalg.norm(scaled[:, None] - scaled[None], axis=2)
    covariance = sigma**2 * correlation(distance, length, kernel) + 1e-12 * sigma**2 * np.eye(len(places))
    values, vectors = np.linalg.eigh(covariance)
    fields = (rng.standard_normal((n, len(places))) * np.sqrt(np.maximum(values, 0))) @ vectors.T
    return fields + nugget * rng.standard_normal(fields.shape)


@pytest.mark.parametrize("kernel", ["squared_exponential", "matern32"])
def test_intervals_hold_the_truth_at_their_rate(kernel):
    """40 populations of 6 parts; 95 % intervals: at least 34 of 40 each (binomial, 0.3 % error)."""
    rng = np.random.default_rng(1)
    held = {"sigma": 0, "length": 0, "nugget": 0}
    truth = {"sigma": 0.01, "length": 9.0, "nugget": 0.002}
    for _ in range(40):
        places = rng.uniform(0, 1, (70, 2)) * [60, 40]
        fields = 0.1 + drawn(6, places, rng, kernel=kernel, **truth)
        fit = fit_covariance(fields, places, kernel=kernel)
        for name, value in truth.items():
            low, high = fit.intervals[name]
            held[name] += low <= value <= high
    assert min(held.values()) >= 34, held


def test_alignment_of_the_parts_is_taken_into_account():
    """Taking a plane off each part halves the apparent length; the contrasts put it right."""
    rng = np.random.default_rng(2)
    places = rng.uniform(0, 1, (80, 2)) * [60, 40]
    plane = np.column_stack([np.ones(80), places])
    right, wrong = [], []
    for _ in range(4):
        fields = drawn(60, places, rng, sigma=0.01, length=20.0, kernel="exponential", nugget=0.0005)
        fields = fields - fields @ (plane @ np.linalg.pinv(plane)).T
        right.append(fit_covariance(fields, places, kernel="exponential", removed=plane).length)
        wrong.append(fit_covariance(fields, places, kernel="exponential").length)
    assert np.median(right) == pytest.approx(20.0, rel=0.2)
    assert np.median(wrong) < 0.6 * np.median(right)


def test_anisotropy_and_its_direction():
    rng = np.random.default_rng(3)
    places = rng.uniform(0, 1, (100, 2)) * [60, 60]
    fields = drawn(10, places, rng, sigma=0.02, length=5.0, stretch=3.0, angle=0.5, nugget=0.001)
    fit = fit_covariance(fields, places, kernel="squared_exponential", anisotropic=True)
    for name, value in (("anisotropy", 3.0), ("angle", 0.5), ("length", 5.0), ("sigma", 0.02)):
        low, high = fit.intervals[name]
        margin = 0.25 * (high - low)  # 95 % interval widened to 99.7 %
        assert low - margin <= value <= high + margin, name
    assert fit.intervals["angle"][1] - fit.intervals["angle"][0] < 0.2


def test_the_kernel_of_the_greatest_likelihood_is_the_true_one():
    rng = np.random.default_rng(4)
    places = rng.uniform(0, 1, (90, 2)) * [40, 40]
    for kernel in ("squared_exponential", "exponential"):
        fields = drawn(12, places, rng, sigma=0.01, length=8.0, kernel=kernel, nugget=1e-4)
        assert fit_covariance(fields, places).kernel == kernel


def test_measure_ten_parts_simulate_many_and_learn_the_same_again():
    part = box((60.0, 40.0, 10.0), 3.0)
    top = part.feature(name="top")
    bow = np.zeros(part.n_samples)
    coordinates = surface_coordinates(top)
    half = np.ptp(coordinates[:, 0]) / 2
    bow[top.rows] = 0.05 * (2 * (coordinates[:, 0] / half) ** 2 - 1)
    truth = cs.GaussianField(0.01, 13.0).on(top) + cs.WhiteNoise(0.001).on(top) + FromArray(bow)
    measured = simulate_ensemble(part, truth, size=10, rng=5, check=False)
    (found,) = learn_process(measured, top, kernel="squared_exponential")
    for name, value in (("sigma", 0.01), ("length", 13.0), ("nugget", 0.001)):
        low, high = found.covariance.intervals[name]
        assert low - 0.25 * (high - low) <= value <= high + 0.25 * (high - low), name
    forms = {term.name: term for term in found.forms}
    assert forms["bow x"].significant
    assert forms["bow x"].amplitude == pytest.approx(0.05, abs=4 * forms["bow x"].standard_error)
    assert not forms["twist"].significant
    model = process_model([found], part)
    simulated = simulate_ensemble(part, model, size=60, rng=6, check=False)
    assert np.abs(simulated.deviations[:, : top.start]).max(initial=0) == 0
    (again,) = learn_process(simulated, top, kernel="squared_exponential")
    assert again.covariance.sigma == pytest.approx(found.covariance.sigma, rel=0.12)
    assert again.covariance.length == pytest.approx(found.covariance.length, rel=0.08)
    np.testing.assert_allclose(again.mean, found.mean, atol=5 * 0.011 / np.sqrt(60))


def test_lobes_of_a_shaft_are_named():
    part = cylinder(radius=10.0, height=30.0, h=2.0)
    mantle = part.feature(kind="cylinder")
    angle = surface_coordinates(mantle)[:, 0] / 10.0
    lobes = np.zeros(part.n_samples)
    lobes[mantle.rows] = 0.02 * np.cos(3 * angle + 0.4)
    truth = FromArray(lobes) + cs.GaussianField(0.004, 8.0).on(mantle)
    measured = simulate_ensemble(part, truth, size=8, rng=1, check=False)
    (found,) = learn_process(measured, mantle, kernel="squared_exponential")
    forms = {term.name: term for term in found.forms}
    assert forms["lobe 3"].amplitude == pytest.approx(0.02, abs=4 * forms["lobe 3"].standard_error)
    assert [name for name, term in forms.items() if term.significant] == ["lobe 3"]


def test_aligned_fields_of_a_part_are_learned_as_such():
    part = box((60.0, 40.0, 10.0), 3.0)
    truth = cs.GaussianField(0.01, 14.0) + cs.WhiteNoise(0.0005)
    measured = simulate_ensemble(part, truth, size=8, rng=2, check=False)
    fields = align_fields(measured, part, alignment="least_squares", features=part.feature(name="top"))
    (found,) = learn_process(fields, ">Z", nominal=part, kernel="squared_exponential", aligned=True)
    low, high = found.covariance.intervals["length"]
    assert low - 0.25 * (high - low) < 14.0 < high + 0.25 * (high - low)


def test_learned_shape_is_a_deviation_model():
    part = box((60.0, 40.0, 10.0), 4.0)
    measured = simulate_ensemble(part, cs.GaussianField(0.01, 25.0), size=9, rng=3, check=False)
    model = StatisticalShapeModel.fit(measured, features=">Z")
    skins = simulate_ensemble(part, LearnedShape(model), size=200, rng=4, check=False)
    rows = part.feature(">Z").rows
    outside = np.delete(skins.deviations, np.arange(rows.start, rows.stop), axis=1)
    assert not outside.any()
    spread = skins.deviations[:, rows].var(axis=0).mean()
    assert spread == pytest.approx(measured.deviations[:, rows].var(axis=0, ddof=1).mean(), rel=0.25)
    assert cs.simulate(part, LearnedShape(model, law="kde", noise=True), rng=1, check=False).closed
    with pytest.raises(StatisticsError, match="not learned on this"):
        cs.simulate(box((60.0, 40.0, 10.0), 5.0), LearnedShape(model))
    with pytest.raises(DeviationError, match="save it"):
        LearnedShape(model).to_dict()


@pytest.mark.corpus
@pytest.mark.parametrize(("number", "column"), [("010", 2)])
def test_a_real_mirror_profile_can_be_fitted(number, column):
    """DABAM: residual heights of an X-ray mirror; the file says how long and how rough it is."""
    path = CORPUS / "measured" / f"dabam-{number}.dat"
    if not path.is_file():
        pytest.skip(f"no corpus at {CORPUS} (CADSKIN_CORPUS)")
    data = np.loadtxt(path, skiprows=1)
    x, heights = data[::3, 0], data[::3, column] * 1e-6  # mm
    trend = np.column_stack([np.ones_like(x), x / np.ptp(x)])
    fit = fit_covariance(heights[None], x[:, None], removed=trend, free_mean=False)
    assert fit.nugget < fit.sigma
    assert np.ptp(x) / 100 < fit.length < np.ptp(x)
    step = 0.5 * np.mean(np.diff(heights) ** 2)  # the variogram at the shortest lag
    there = correlation(np.array(x[1] - x[0]), fit.length, fit.kernel)
    assert fit.sigma**2 * (1 - there) + fit.nugget**2 == pytest.approx(step, rel=0.5)
    low, high = fit.intervals["length"]
    assert low < fit.length < high


def test_what_cannot_be_learned_is_refused():
    part = box((60.0, 40.0, 10.0), 5.0)
    fields = np.random.default_rng(0).standard_normal((4, part.n_samples))
    with pytest.raises(StatisticsError, match="at least three"):
        learn_process(fields[:2], ">Z", nominal=part)
    with pytest.raises(StatisticsError, match="nominal"):
        learn_process(fields, ">Z")
    holes = fields.copy()
    holes[0, part.feature(">Z").rows] = np.nan
    with pytest.raises(StatisticsError, match="0 samples were measured on all"):
        learn_process(holes, ">Z", nominal=part)
    with pytest.raises(StatisticsError, match="do not vary"):
        fit_covariance(np.ones((3, 30)), np.zeros((30, 2)))
    with pytest.raises(StatisticsError, match="at least two"):
        fit_covariance(np.ones((1, 30)), np.zeros((30, 2)))
    with pytest.raises(StatisticsError, match="two coordinates"):
        fit_covariance(fields[:, :30], np.zeros((30, 3)), anisotropic=True)
    with pytest.raises(StatisticsError, match="no process"):
        process_model([], part)
    shaft = cylinder(radius=10.0, height=30.0, h=2.0)
    noise = np.random.default_rng(1).standard_normal((4, shaft.n_samples))
    with pytest.raises(StatisticsError, match="planes"):
        learn_process(noise, shaft.feature(kind="cylinder"), nominal=shaft, anisotropic=True)


def test_smooth_fields_without_noise_are_not_told_too_exactly():
    """Directions without energy say nothing of the length: the stated 95 % holds."""
    rng = np.random.default_rng(3)
    places = rng.uniform(0, [60, 40], (120, 2))
    squared = ((places[:, None] - places[None]) ** 2).sum(axis=2)
    values, vectors = np.linalg.eigh(1e-4 * np.exp(-squared / (2 * 25.0**2)))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    held = np.zeros(2)
    for _ in range(20):
        fields = (root @ rng.standard_normal((120, 10))).T
        fit = fit_covariance(fields, places, kernel="squared_exponential")
        held += [
            fit.intervals["sigma"][0] <= 0.01 <= fit.intervals["sigma"][1],
            fit.intervals["length"][0] <= 25.0 <= fit.intervals["length"][1],
        ]
        assert fit.nugget == 0.0
    assert (held >= 15).all()  # at 95 % fewer than 15 of 20 happens once in 3,000; at 80 % in two of ten
