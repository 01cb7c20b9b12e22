"""Composition, restriction, text and table forms, random streams."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest
from scipy import stats
from surfaces import plane, two_planes

from cadskin.deviation import (
    DeviationModel,
    GaussianField,
    Paraboloid,
    Randomised,
    WhiteNoise,
    from_dict,
    model_class,
    model_names,
    register,
    registry,
)
from cadskin.deviation.samplers import FixedSampler
from cadskin.errors import DeviationError, SelectionError

NOISE, FIELD, FORM = WhiteNoise(0.02), GaussianField(0.01, 15), Paraboloid(0.05)


@pytest.fixture(scope="module")
def wall():
    return two_planes()


def test_shape_and_reproducibility(wall):
    for model in (NOISE, FIELD, FORM, NOISE + FIELD, 2 * FORM):
        first = model.sample(wall, size=5, rng=7)
        assert first.shape == (5, wall.n_samples)
        assert first.dtype == np.float64
        assert np.array_equal(first, model.sample(wall, size=5, rng=7))
    assert not np.array_equal(FIELD.sample(wall, rng=7), FIELD.sample(wall, rng=8))


@pytest.mark.parametrize("model", [NOISE, FIELD, NOISE + FIELD, (NOISE + FIELD).on("low")], ids=str)
def test_sample_i_does_not_depend_on_the_batch(wall, model):
    many = model.sample(wall, size=70, rng=7)
    assert np.array_equal(many[:3], model.sample(wall, size=3, rng=7))
    seed = np.random.SeedSequence(7)
    children = seed.spawn(70)
    sampler = model.prepare(wall)
    assert np.array_equal(many[[69, 4]], sampler.draw([children[69], children[4]]))


def test_the_terms_of_a_sum_are_independent(wall):
    twice = (NOISE + NOISE).sample(wall, size=200, rng=1)
    assert twice.std() == pytest.approx(np.sqrt(2) * 0.02, rel=0.02)
    assert len((NOISE + FIELD + FORM).terms) == 3
    assert np.allclose((FORM - FORM).sample(wall), 0)


def test_scaling(wall):
    assert np.array_equal((3 * FIELD).sample(wall, rng=2), 3 * FIELD.sample(wall, rng=2))
    assert np.array_equal((-FIELD).sample(wall, rng=2), -FIELD.sample(wall, rng=2))
    with pytest.raises(DeviationError, match="finite"):
        float("nan") * FIELD
    with pytest.raises(TypeError):
        FIELD * FIELD


def test_restriction(wall):
    low = wall.feature("low")
    values = FIELD.on("low").sample(wall, size=2, rng=3)
    outside = np.ones(wall.n_samples, bool)
    outside[low.rows] = False
    assert (values[:, outside] == 0).all()
    assert (values[:, low.rows] != 0).all()
    assert np.array_equal(FORM.on("low").on("high").sample(wall), np.zeros((1, wall.n_samples)))
    with pytest.raises(SelectionError):
        FIELD.on("nonsense").sample(wall)


def test_text_form():
    assert str(FIELD) == "GaussianField(sigma=0.01 mm, length=15 mm)"
    assert str(GaussianField(0.01, 15, kernel="matern32")) == (
        "GaussianField(sigma=0.01 mm, length=15 mm, kernel='matern32')"
    )
    assert str(2 * (NOISE + FORM).on(">Z")) == (
        "2 * (WhiteNoise(sigma=0.02 mm) + Paraboloid(amplitude=0.05 mm)).on('>Z')"
    )


@pytest.mark.parametrize(
    "model",
    [
        NOISE,
        GaussianField(0.01, 12, kernel="matern52", method="vecchia"),
        Paraboloid(0.1, centre=(3.0, 4.0), rotation=0.3, ratio=-1.0),
        NOISE + FIELD,
        0.1 * FIELD.on(">Z", kind="plane") + FORM,
        GaussianField([0.01, 0.02], 12),
    ],
    ids=lambda model: str(model)[:40],
)
def test_table_form_round_trip(model):
    table = model.to_dict()
    again = from_dict(table)
    assert again == model
    assert again.to_dict() == table
    assert hash(again) == hash(model)


def test_table_form_is_plain():
    assert GaussianField(0.01, 12, kernel="matern32").to_dict() == {
        "field": {"sigma": 0.01, "length": 12.0, "kernel": "matern32"}
    }


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"fields": {}}, "no deviation model is called 'fields'; there are"),
        ({"field": {"sigma": 1, "lenght": 3}}, "no parameter 'lenght'; it has sigma, length"),
        ({"field": {"sigma": 1}}, "length"),
        ({"field": 3}, "must be a table"),
        ({}, "one table"),
        ({"noise": {"sigma": 0}}, "greater than 0"),
    ],
)
def test_bad_tables(table, message):
    with pytest.raises(DeviationError, match=message):
        from_dict(table)


def test_registry():
    assert {"field", "noise", "paraboloid", "sum", "scaled", "on"} <= set(model_names())
    assert model_class("field") is GaussianField
    with pytest.raises(DeviationError, match="taken"):

        @register
        @dataclass(frozen=True, eq=False)
        class Impostor(DeviationModel):
            name: ClassVar[str] = "field"


def test_negative_size(wall):
    with pytest.raises(DeviationError, match="size"):
        NOISE.sample(wall, size=-1)
    assert NOISE.sample(wall, size=0).shape == (0, wall.n_samples)


def test_models_are_not_equal_across_parameters():
    assert WhiteNoise(0.02) == NOISE
    assert WhiteNoise(0.03) != NOISE
    assert NOISE != FORM


def test_white_noise_law():
    part = plane(h=2.0)
    values = NOISE.sample(part, size=50, rng=1)
    n = values.size
    assert abs(values.mean()) < 4 * 0.02 / np.sqrt(n)
    assert abs(values.var() / 0.02**2 - 1) < 4 * np.sqrt(2 / n)
    spread = np.ptp(values, axis=1).mean() / 0.02
    assert 6.8 < spread < 7.2  # 2501 points; the paper's 2392 points have 6.98


def test_random_amplitudes(wall):
    """Factors follow the distribution (KS, level 1e-4) and do not depend on the batch."""
    model = Randomised(Paraboloid(0.02), "gamma", (4.0, 0.0, 0.25))
    values = model.sample(wall, size=2000, rng=3)
    factors = np.ptp(values[:, wall.feature("low").rows], axis=1) / 0.02
    assert stats.kstest(factors, stats.gamma(4.0, 0.0, 0.25).cdf).pvalue > 1e-4
    assert np.array_equal(values[:3], model.sample(wall, size=3, rng=3))
    assert from_dict(model.to_dict()) == model


@pytest.mark.parametrize(
    ("distribution", "arguments", "message"),
    [
        ("normal", (), "no continuous distribution"),
        ("gamma", (-1.0,), "does not take"),
        ("norm", (1, 2, 3, 4), "4 arg"),
    ],
)
def test_bad_distributions(distribution, arguments, message):
    with pytest.raises(DeviationError, match=message):
        Randomised(NOISE, distribution, arguments)


def test_workers_do_not_matter(wall):
    """Five samples at a time by four threads, in any order, give the same bits as one call."""
    sampler = (FIELD + NOISE).prepare(wall)
    children = np.random.SeedSequence(7).spawn(40)
    with ThreadPoolExecutor(4) as pool:
        parts = list(pool.map(sampler.draw, [children[k : k + 5] for k in range(0, 40, 5)]))
    assert np.array_equal(np.concatenate(parts), (FIELD + NOISE).sample(wall, size=40, rng=7))


def test_models_of_third_parties_are_found_by_their_entry_point(monkeypatch):
    @dataclass(frozen=True, eq=False, repr=False)
    class Foreign(DeviationModel):
        name: ClassVar[str] = "foreign"
        value: float = 1.0

        def prepare(self, nominal, features=None):
            return FixedSampler(np.full(nominal.n_samples, self.value))

    class Point:
        def load(self):
            return Foreign

    monkeypatch.setattr(registry, "entry_points", lambda group, name: [Point()] if name == "foreign" else [])
    monkeypatch.setattr(registry, "_REGISTRY", dict(registry._REGISTRY))
    assert from_dict({"foreign": {"value": 2.0}}) == Foreign(2.0)
