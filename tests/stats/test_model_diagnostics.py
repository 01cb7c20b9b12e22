"""Leave-one-out, posterior, missing data and the measures of a model, against brute force and coverage."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.errors import StatisticsError
from cadskin.stats import (
    StatisticalShapeModel,
    compactness,
    influence,
    leave_one_out,
    membership,
    parallel_analysis,
    specificity,
)

SIGMAS = np.array([0.06, 0.03, 0.015])


def parts(n, d, rng, noise=0.002):
    x = (np.arange(d) + 0.5) / d
    modes = np.sqrt(2) * np.cos(np.pi * np.outer([1, 2, 3], x))
    return 0.3 * x + (rng.standard_normal((n, 3)) * SIGMAS) @ modes + noise * rng.standard_normal((n, d))


def brute_force_leave_one_out(fields, weights, most):
    errors = np.zeros((len(fields), most + 1))
    for i, left in enumerate(fields):
        others = np.delete(fields, i, axis=0)
        mean = others.mean(axis=0)
        _, _, right = np.linalg.svd((others - mean) * np.sqrt(weights), full_matrices=False)
        for t in range(most + 1):
            away = (left - mean) * np.sqrt(weights)
            away = away - right[:t].T @ (right[:t] @ away)
            errors[i, t] = np.sqrt((away**2).sum())
    return errors


def test_leave_one_out_from_the_gram_matrix_is_brute_force():
    rng = np.random.default_rng(1)
    fields = parts(9, 200, rng)
    weights = rng.uniform(0.5, 1, 200)
    weights /= weights.sum()
    found = leave_one_out(StatisticalShapeModel.fit(fields, weights=weights))
    expected = brute_force_leave_one_out(fields, weights, 7)
    np.testing.assert_allclose(found.parts[:, :8], expected, rtol=1e-6)
    np.testing.assert_allclose(found.error[:8], np.sqrt((expected**2).mean(axis=0)), rtol=1e-6)
    assert found.modes(gain=0.2) == 3


def test_large_populations_leave_tenths_out():
    model = StatisticalShapeModel.fit(parts(300, 40, np.random.default_rng(1)), modes=3)
    assert leave_one_out(model).error[3] == pytest.approx(0.002, rel=0.1)


def test_parallel_analysis_finds_the_number_of_modes():
    rng = np.random.default_rng(2)
    fields = parts(15, 120, rng)
    model = StatisticalShapeModel.fit(fields)
    assert parallel_analysis(model, fields, repeats=60, rng=1) in (2, 3)
    white = rng.standard_normal((15, 120))
    assert parallel_analysis(StatisticalShapeModel.fit(white), white, repeats=60, rng=1) <= 1
    with pytest.raises(StatisticsError, match="15 parts of 120"):
        parallel_analysis(model, fields[:, :60])


def test_compactness_specificity_and_influence():
    rng = np.random.default_rng(3)
    fields = parts(12, 150, rng)
    model = StatisticalShapeModel.fit(fields)
    shares = compactness(model)
    assert shares[-1] == pytest.approx(1.0, abs=1e-9)
    assert (np.diff(shares) >= 0).all()
    few = model.truncate(modes=2)
    drawn = few.sample(size=300, rng=0, noise=False)
    distance = np.sqrt(((drawn[:, None] - fields[None]) ** 2).mean(axis=2)).min(axis=1)
    assert specificity(few, size=300, rng=0) == pytest.approx(distance.mean(), rel=1e-9)
    moved = [np.sqrt(np.mean((np.delete(fields, i, 0).mean(0) - fields.mean(0)) ** 2)) for i in range(12)]
    np.testing.assert_allclose(influence(model), moved, rtol=1e-9)


def test_membership_p_values_are_uniform_for_members():
    """Rejections at 5 % among 400 new parts of a normal law: binomial, 3.5 sigma."""
    rng = np.random.default_rng(4)
    rejected = 0
    for _ in range(400):
        fields = rng.standard_normal((13, 2)) * [2.0, 1.0]
        model = StatisticalShapeModel.fit(fields[:12])
        rejected += membership(model, fields[12]).p_value < 0.05
    assert abs(rejected / 400 - 0.05) < 3.5 * np.sqrt(0.05 * 0.95 / 400)
    model = StatisticalShapeModel.fit(parts(12, 60, rng)).truncate(modes=3)
    assert membership(model, model.instance({1: 8})).p_value < 1e-3
    stranger = membership(model, model.mean + np.where(np.arange(60) % 2, 0.1, -0.1))
    assert stranger.residual > 10 * model.noise


def test_posterior_is_the_gaussian_conditional():
    """Against the d x d formula with the dense covariance."""
    rng = np.random.default_rng(5)
    model = StatisticalShapeModel.fit(parts(10, 40, rng)).truncate(modes=3)
    rows, values, sigma = np.array([3, 17, 30]), np.array([0.1, 0.12, 0.25]), 0.002
    prior = 1.1 * (model.modes.T * model.variances) @ model.modes + model.noise**2 * np.eye(40)
    smooth = prior - model.noise**2 * np.eye(40)
    seen = prior[np.ix_(rows, rows)] + sigma**2 * np.eye(3)
    gain = smooth[:, rows] @ np.linalg.inv(seen)
    found = model.posterior(rows, values, noise=sigma)
    np.testing.assert_allclose(found.mean, model.mean + gain @ (values - model.mean[rows]), atol=1e-10)
    variance = np.diag(smooth - gain @ smooth[rows]) + model.noise**2
    np.testing.assert_allclose(found.std, np.sqrt(variance), atol=1e-10)
    nothing = model.posterior([3], [np.nan], noise=sigma)
    np.testing.assert_allclose(nothing.mean, model.mean)


def test_posterior_bands_cover_and_a_few_points_tell_the_whole_face():
    rng = np.random.default_rng(6)
    covered, alone, conditioned = [], [], []
    for _ in range(150):
        fields = parts(11, 100, rng)
        model = StatisticalShapeModel.fit(fields[:10]).truncate(modes=3)
        rows = rng.choice(100, 5, replace=False)
        found = model.posterior(rows, fields[10, rows] + 0.001 * rng.standard_normal(5), noise=0.001)
        low, high = found.band(0.95)
        covered.append(((fields[10] >= low) & (fields[10] <= high)).mean())
        alone.append(np.mean((fields[10] - model.mean) ** 2))
        conditioned.append(np.mean((fields[10] - found.mean) ** 2))
    assert 0.93 < np.mean(covered) < 0.985
    assert np.sqrt(np.mean(conditioned)) < 0.15 * np.sqrt(np.mean(alone))


def test_posterior_refuses_what_makes_no_sense():
    model = StatisticalShapeModel.fit(parts(6, 20, np.random.default_rng(0)))
    for arguments, noise in (
        (([20], [0.0]), 0.1),
        (([0.5], [0.0]), 0.1),
        (([0, 1], [0.0]), 0.1),
        (([0], [0.0]), -1),
    ):
        with pytest.raises(StatisticsError):
            model.posterior(*arguments, noise=noise)
    with pytest.raises(StatisticsError, match="level"):
        model.posterior([0], [0.0], noise=0.1).band(1.0)


def test_missing_data_come_close_to_the_complete_fit():
    rng = np.random.default_rng(7)
    fields = parts(30, 80, rng)
    complete = StatisticalShapeModel.fit(fields, modes=3)
    holes = fields.copy()
    for i, start in enumerate(rng.integers(0, 60, 30)):
        holes[i, start : start + 20] = np.nan  # a quarter of each part, in one piece
    model = StatisticalShapeModel.fit(holes, modes=3)
    np.testing.assert_allclose(model.sigmas, complete.sigmas, rtol=0.03)
    assert model.noise == pytest.approx(0.002, rel=0.1)
    overlap = np.abs((model.modes * model.weights) @ complete.modes.T)
    np.testing.assert_allclose(np.diag(overlap), 1, atol=2e-3)
    assert np.sqrt(np.mean((model.mean - complete.mean) ** 2)) < 0.001
    naive = np.nanmean(holes, axis=0)
    assert np.sqrt(np.mean((naive - complete.mean) ** 2)) > 4 * np.sqrt(
        np.mean((model.mean - complete.mean) ** 2)
    )
    np.testing.assert_allclose(model.scores @ np.diag(np.sign(np.diag(
        (model.modes * model.weights) @ complete.modes.T))), complete.scores, atol=0.15)  # fmt: skip
    assert model.notes == ("25 % of the values missing, modes by EM",)
    c = model.coefficients(holes[2])
    np.testing.assert_allclose(c, model.coefficients(fields[2]), atol=0.15)
    with pytest.raises(StatisticsError, match="missing data"):
        leave_one_out(model)


def test_missing_data_with_one_hole_is_almost_the_complete_fit():
    fields = parts(20, 50, np.random.default_rng(8))
    complete = StatisticalShapeModel.fit(fields, modes=3)
    fields[4, 10] = np.nan
    model = StatisticalShapeModel.fit(fields, modes=3)
    np.testing.assert_allclose(model.sigmas, complete.sigmas, rtol=3e-3)
    np.testing.assert_allclose(model.mean, complete.mean, atol=2e-3)


def test_what_nobody_observed_is_refused():
    fields = parts(6, 20, np.random.default_rng(9))
    fields[:, 3] = np.nan
    with pytest.raises(StatisticsError, match="first is 3"):
        StatisticalShapeModel.fit(fields)
    fields = parts(6, 20, np.random.default_rng(9))
    fields[2] = np.nan
    with pytest.raises(StatisticsError, match="part 2 has no observed"):
        StatisticalShapeModel.fit(fields)
    fields[2] = 0.0
    fields[2, 0] = np.nan
    with pytest.raises(StatisticsError, match="1 to 4 modes"):
        StatisticalShapeModel.fit(fields, modes=5)
    with pytest.raises(StatisticsError, match="arithmetic"):
        StatisticalShapeModel.fit(fields, center="tukey")
