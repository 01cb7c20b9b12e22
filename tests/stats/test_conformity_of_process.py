"""The probability of conforming against the normal law, its interval against its rate."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from cadskin.errors import StatisticsError
from cadskin.stats import StatisticalShapeModel, conformity, counted_interval


def thickness_parts(n, rng):
    """Plates of even thickness: one mode, deviation N(0.02, 0.01²) everywhere."""
    return (0.02 + 0.01 * rng.standard_normal((n, 1))) * np.ones((1, 12))


def thickness(fields):
    return fields.mean(axis=1)


def test_interval_holds_the_true_share_at_its_rate():
    """60 populations of 10 parts, 90 % interval: 46 to 60 of them (binomial, 1 %)."""
    rng = np.random.default_rng(1)
    truth = norm.cdf(1.0)
    held = 0
    for i in range(60):
        model = StatisticalShapeModel.fit(thickness_parts(10, rng))
        found = conformity(model, thickness, 0.03, draws=100, size=200, rng=i)
        held += found.low <= truth <= found.high
    assert 46 <= held <= 60


def test_many_parts_give_the_true_share_and_a_narrow_interval():
    model = StatisticalShapeModel.fit(thickness_parts(800, np.random.default_rng(2)), modes=1)
    found = conformity(model, thickness, 0.03, draws=100, size=2000)
    assert found.probability == pytest.approx(norm.cdf(1.0), abs=0.03)
    assert found.high - found.low < 0.06
    assert found.counted_low < norm.cdf(1.0) < found.counted_high
    assert "of 800 parts conform" in str(found)


def test_two_modes_have_the_joint_law():
    """Sum of two independent modes: the covariance drawn is that of both together."""
    rng = np.random.default_rng(3)
    x = np.linspace(0, 1, 50)
    shapes = np.stack([np.ones(50), np.sqrt(3) * (2 * x - 1)])
    fields = (rng.standard_normal((400, 2)) * [0.02, 0.01]) @ shapes
    model = StatisticalShapeModel.fit(fields, modes=2)
    found = conformity(model, lambda f: f[:, -1], 0.0264575, draws=60, size=2000)
    assert found.probability == pytest.approx(norm.cdf(1.0), abs=0.04)  # sqrt(0.02² + 3 * 0.01²)


def test_counted_interval_is_clopper_pearson():
    from scipy.stats import binomtest

    for count, n in ((0, 5), (5, 10), (10, 10), (3, 12)):
        expected = binomtest(count, n).proportion_ci(confidence_level=0.9)
        np.testing.assert_allclose(counted_interval(count, n), [expected.low, expected.high], atol=1e-9)


def test_what_makes_no_sense_is_refused():
    model = StatisticalShapeModel.fit(np.random.default_rng(0).standard_normal((5, 30)))
    with pytest.raises(StatisticsError, match="truncate"):
        conformity(model, thickness, 1.0)
    few = model.truncate(modes=1)
    with pytest.raises(StatisticsError, match="200 values"):
        conformity(few, lambda fields: fields, 1.0)
    with pytest.raises(StatisticsError, match="level"):
        conformity(few, thickness, 1.0, level=0)
