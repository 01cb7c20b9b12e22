"""Capability: quantiles far out in the tail, against closed forms and against large plain populations."""

import numpy as np
import pytest
from scipy.stats import norm
from support.parts import box

from cadskin.conform import (
    capability_scale,
    capable_model,
    fraction_outside,
    prepare_conforming,
    tail_quantile,
)
from cadskin.conform.flat import flat_places
from cadskin.deviation import GaussianField, Paraboloid
from cadskin.errors import CadskinWarning, ConformityError, SpecificationError
from cadskin.skin import simulate_ensemble
from cadskin.spec import Specification, flatness, parallelism, position
from cadskin.verify import verify

BOTTOM, TOP = 0, 1
MODEL = GaussianField(0.01, 50.0)


@pytest.fixture(scope="module")
def part():
    return box((60.0, 40.0, 20.0), h=12.0)


@pytest.mark.parametrize("cpk", [0.5, 1.0, 1.33, 1.67])
def test_quantile_of_a_normal_number(part, cpk):
    """The deviation of one point: its quantile is known."""
    probability = fraction_outside(cpk)
    row = part.feature_of(TOP).start
    found = tail_quantile(
        MODEL.prepare(part), lambda field: float(field[row]), probability, population=1500, rng=1
    )
    assert found / 0.01 == pytest.approx(norm.isf(probability), rel=0.04)


def test_quantile_of_a_flatness_against_plain_simulation(part):
    feature = part.feature_of(TOP)
    places = flat_places(feature.points, feature.faces[0].normal)

    def value(field):
        return places.bounds(np.ascontiguousarray(field[feature.rows]))[1]

    sampler = MODEL.prepare(part)
    plain = np.sort([value(field) for field in sampler.sample(size=40_000, rng=2)])
    probability = 1e-3
    # 40 of 40 000 lie beyond; the order statistics 22 and 62 hold the quantile with an error of 1e-3
    low, high = plain[-62], plain[-22]
    found = tail_quantile(sampler, value, probability, population=1000, rng=3)
    assert low * 0.97 < found < high * 1.03


def test_mean_of_the_model_is_kept(part):
    row = part.feature_of(TOP).start
    model = MODEL + Paraboloid(0.05)
    mean = model.sample(part, size=1, rng=1)[0] - MODEL.sample(part, size=1, rng=1)[0]
    sampler = model.prepare(part)
    centre = sampler.sample(size=4000, rng=2).mean(axis=0)
    found = tail_quantile(sampler, lambda f: float(f[row]), 1e-4, mean=centre, population=1500, rng=4)
    assert found == pytest.approx(centre[row] + 0.01 * norm.isf(1e-4), rel=0.05)
    assert np.abs(mean).max() > 0.01


def test_scaled_model_misses_its_tolerance_as_often_as_stated(part):
    spec = Specification(flatness(TOP, 0.02), parallelism(TOP, 0.2, datums="A"), datums={"A": BOTTOM})
    cpk = 0.5  # 6.7 % outside: seen in a plain population
    scale = capability_scale(prepare_conforming(part, MODEL, spec), cpk, population=800)
    raw = simulate_ensemble(part, scale * MODEL, size=600, rng=5, check=False)
    feature = part.feature_of(TOP)
    places = flat_places(feature.points, feature.faces[0].normal)
    values = np.array([places.bounds(np.ascontiguousarray(f[feature.rows]))[1] for f in raw.deviations])
    outside = int((values > 0.02).sum())
    # binomial(600, 0.0668): 40 +- 6.1; four standard deviations, and 10 % for the error of the scale
    assert abs(outside - 600 * fraction_outside(cpk)) < 4 * 6.1 + 4


@pytest.mark.parametrize("cpk", [0.67, 1.0, 1.33, 1.67])
def test_scale_of_a_flatness_in_closed_form(cpk):
    """Four corners: the flatness is half the difference of the sums over the diagonals, a normal number."""
    length, limit = 50.0, 0.02
    coarse = box((60.0, 40.0, 20.0), h=100.0)
    corners = coarse.feature_of(TOP).points
    assert len(corners) == 4
    apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    signs = np.where(np.isin(np.arange(4), [0, int(np.argmax(apart[0]))]), 0.5, -0.5)
    sigma = np.sqrt(signs @ np.exp(-0.5 * (apart / length) ** 2) @ signs) * 0.01
    exact = limit / (sigma * norm.isf(fraction_outside(cpk) / 2))
    model = GaussianField(0.01, length)
    with pytest.warns(CadskinWarning, match="fewer than four vertices"):
        sampler = prepare_conforming(coarse, model, Specification(flatness(TOP, limit)))
    # relative error of the quantile about 0.4 / sqrt(1600) = 1 %
    assert capability_scale(sampler, cpk, rng=1) == pytest.approx(exact, rel=0.03)


def test_default_process_is_capable_of_its_tolerances(part):
    spec = Specification(
        flatness(BOTTOM, 0.02), parallelism(TOP, 0.05, datums="A"), position(3, 0.02, datums="A|B"),
        datums={"A": BOTTOM, "B": 5},
    )  # fmt: skip
    model = capable_model(part, spec, length=50.0)
    raw = simulate_ensemble(part, model, size=60, rng=6, check=False)
    assert verify(raw, spec).conforming.mean() > 0.8
    assert model == capable_model(part, spec, length=50.0)


@pytest.mark.parametrize("cpk", [0.0, -1.0, float("inf"), float("nan"), 4.0])
def test_meaningless_capabilities(part, cpk):
    sampler = prepare_conforming(part, MODEL, Specification(flatness(TOP, 0.02)))
    with pytest.raises(SpecificationError, match="Cpk"):
        capability_scale(sampler, cpk)


def test_capability_of_what_does_not_vary(part):
    spec = Specification(flatness(TOP, 0.2))
    with pytest.raises(ConformityError, match="no toleranced feature"):
        capability_scale(prepare_conforming(part, MODEL.on(BOTTOM), spec), 1.0)
    with pytest.raises(SpecificationError, match="between 0 and 1"):
        tail_quantile(MODEL.prepare(part), lambda field: 1.0, 0.0)
    with pytest.raises(SpecificationError, match="scale of a process"):
        capable_model(part, spec, scale=-1.0)
