"""Robust means: bad parts and bad points, the Gram shortcuts against direct computation."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from cadskin.errors import StatisticsError
from cadskin.stats import minimum_covariance_determinant, pointwise_median, trimmed_mean
from cadskin.stats.robust import geometric_median_weights, tukey_weights

GRID = np.stack(np.meshgrid(np.linspace(-1, 1, 20), np.linspace(-1, 1, 20)), axis=-1).reshape(-1, 2)
DISH = 0.4 * (GRID**2).sum(axis=1)


def clean_parts(n, rng):
    """Five smooth modes of 0.06 to 0.004 mm on a 20 x 20 grid about a dished mean."""
    x, y = GRID.T
    modes = np.stack([x, y, x * y, np.cos(np.pi * x), np.cos(np.pi * y)])
    modes /= np.sqrt((modes**2).mean(axis=1, keepdims=True))
    mean = 0.1 * DISH
    return mean + (rng.standard_normal((n, 5)) * [0.06, 0.03, 0.015, 0.008, 0.004]) @ modes, mean


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


def weighted_mean(fields, weights):
    return weights @ fields / weights.sum()


def test_geometric_median_minimises_the_sum_of_distances():
    fields = clean_parts(7, np.random.default_rng(1))[0][:, ::37]
    weights = geometric_median_weights(fields @ fields.T)

    def cost(point):
        return np.linalg.norm(fields - point, axis=1).sum()

    best = minimize(cost, fields.mean(axis=0), method="BFGS", options={"gtol": 1e-10})
    np.testing.assert_allclose(weighted_mean(fields, weights), best.x, atol=1e-5)


def test_median_that_falls_on_a_part():
    fields = np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    weights = geometric_median_weights(fields @ fields.T)
    np.testing.assert_allclose(weighted_mean(fields, weights), 0, atol=1e-9)


def test_bad_batch_of_two_in_ten_stays_within_one_and_a_half_of_the_clean_error():
    """The goal: median error over 60 repeats; the plain mean is out by more than three times."""
    errors = {"clean": [], "plain": [], "tukey": [], "median": []}
    for repeat in range(60):
        fields, mean = clean_parts(10, np.random.default_rng(repeat))
        errors["clean"].append(rms(fields.mean(axis=0) - mean))
        fields[:2] += DISH
        gram = fields @ fields.T / fields.shape[1]
        errors["plain"].append(rms(fields.mean(axis=0) - mean))
        errors["tukey"].append(rms(weighted_mean(fields, tukey_weights(gram)) - mean))
        errors["median"].append(rms(weighted_mean(fields, geometric_median_weights(gram)) - mean))
    middle = {key: np.median(value) for key, value in errors.items()}
    assert middle["plain"] > 3 * middle["clean"]
    assert middle["tukey"] < 1.5 * middle["clean"]
    assert middle["median"] < 2 * middle["clean"]


def test_tukey_weights_cost_little_on_clean_parts():
    plain, robust = [], []
    for repeat in range(60):
        fields, mean = clean_parts(10, np.random.default_rng(1000 + repeat))
        plain.append(rms(fields.mean(axis=0) - mean))
        robust.append(rms(weighted_mean(fields, tukey_weights(fields @ fields.T)) - mean))
    assert np.median(robust) < 1.15 * np.median(plain)


def test_bad_points_are_a_matter_of_the_pointwise_means():
    rng = np.random.default_rng(4)
    fields, mean = clean_parts(10, rng)
    gross = rng.random(fields.shape) < 0.05
    fields = np.where(gross, fields + 0.5, fields)
    by_part = weighted_mean(fields, tukey_weights(fields @ fields.T))
    assert rms(pointwise_median(fields) - mean) < 0.7 * rms(by_part - mean)
    assert rms(trimmed_mean(fields, cut=0.2) - mean) < 0.8 * rms(by_part - mean)


def test_pointwise_means_against_numpy_and_scipy():
    from scipy.stats import trim_mean

    fields = np.random.default_rng(0).standard_normal((11, 30))
    np.testing.assert_allclose(trimmed_mean(fields, cut=2 / 11), trim_mean(fields, 2 / 11), atol=1e-14)
    np.testing.assert_allclose(trimmed_mean(fields, cut=0.0), fields.mean(axis=0), atol=1e-14)
    fields[3, 5] = fields[4, 5] = np.nan
    np.testing.assert_allclose(pointwise_median(fields), np.nanmedian(fields, axis=0), atol=1e-14)
    fields[:, 7] = np.nan
    assert np.isnan(pointwise_median(fields)[7])
    with pytest.raises(StatisticsError, match="sample 7"):
        trimmed_mean(fields, cut=0.1)
    with pytest.raises(StatisticsError, match="cut"):
        trimmed_mean(fields, cut=0.5)


def test_mcd_sees_through_a_fifth_of_bad_scores():
    rng = np.random.default_rng(2)
    truth = np.array([[4.0, 1.0], [1.0, 1.0]])
    scores = rng.multivariate_normal([0, 0], truth, size=400)
    scores[:80] += [12.0, -12.0]
    found = minimum_covariance_determinant(scores, rng=1)
    np.testing.assert_allclose(found.centre, 0, atol=0.4)  # 3.6 sigma of 320 scores
    np.testing.assert_allclose(found.covariance, truth, atol=1.0)
    assert not found.inliers[:80].any()
    assert found.inliers[80:].mean() > 0.93


def test_mcd_refuses_too_few_parts():
    with pytest.raises(StatisticsError, match="at least 2 t \\+ 1 = 11"):
        minimum_covariance_determinant(np.random.default_rng(0).standard_normal((10, 5)))


def test_identical_parts_keep_their_weight():
    np.testing.assert_array_equal(tukey_weights(np.zeros((4, 4))), 1.0)
