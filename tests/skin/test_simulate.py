"""Simulation: the law of the streams, provenance, progress and faults."""

from __future__ import annotations

import numpy as np
import pytest
from support.parts import box, plate_with_hole, thin_wall

from cadskin.deviation import GaussianField, Paraboloid, WhiteNoise
from cadskin.errors import Cancelled, DeviationError, GeometryError
from cadskin.skin import simulate, simulate_ensemble

MODEL = WhiteNoise(sigma=0.01)


@pytest.fixture(scope="module")
def part():
    return plate_with_hole()


def test_sample_i_depends_on_seed_and_i_alone(part):
    few = simulate_ensemble(part, MODEL, size=3, rng=7)
    many = simulate_ensemble(part, MODEL, size=40, rng=7)
    np.testing.assert_array_equal(few.deviations, many.deviations[:3])
    np.testing.assert_array_equal(simulate(part, MODEL, rng=7).deviation, few.deviations[0])
    np.testing.assert_array_equal(MODEL.sample(part, size=3, rng=7), few.deviations)
    assert not np.array_equal(few.deviations[0], few.deviations[1])
    assert not np.array_equal(simulate(part, MODEL, rng=8).deviation, few.deviations[0])


def test_provenance_makes_the_sample_again(part):
    skin = simulate_ensemble(part, MODEL, size=3, rng=7)[2]
    told = skin.provenance
    assert told.model == str(MODEL)
    seed = np.random.SeedSequence(told.seed[0], spawn_key=told.spawn_key)
    again = simulate_ensemble(part, MODEL, size=told.index + 1, rng=seed)
    np.testing.assert_array_equal(again.deviations[told.index], skin.deviation)


def test_a_generator_gives_a_recorded_seed(part):
    skin = simulate(part, MODEL, rng=np.random.default_rng(5))
    seed = np.random.SeedSequence(skin.provenance.seed)
    np.testing.assert_array_equal(simulate(part, MODEL, rng=seed).deviation, skin.deviation)


@pytest.mark.parametrize(
    "model",
    [
        MODEL,
        GaussianField(sigma=0.01, length=3.0),
        Paraboloid(0.02).on("top"),
        MODEL + GaussianField(sigma=0.01, length=4.0),
    ],
)
def test_models_give_closed_skins(part, model):
    skin = simulate(part, model, rng=1)
    assert skin.closed
    assert np.abs(skin.deviation).max() > 0.001
    np.testing.assert_allclose(skin.realised_deviation, skin.deviation, atol=1e-12)


def test_an_array_is_a_model(part):
    field = 0.01 * np.arange(part.n_samples) / part.n_samples
    skin = simulate(part, field)
    np.testing.assert_array_equal(skin.deviation, field)
    assert skin.provenance.seed is None
    assert len(simulate_ensemble(part, field, size=2)) == 2


def test_progress_and_cancelling(part):
    seen = []
    simulate_ensemble(part, MODEL, size=3, rng=1, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(0, 3), (1, 3), (2, 3), (3, 3)]
    with pytest.raises(Cancelled):
        simulate_ensemble(part, MODEL, size=3, rng=1, progress=lambda done, total: done < 2)


@pytest.mark.parametrize("model", ["noise", object(), [[1, 2], [3]]])
def test_what_is_no_model_is_refused(part, model):
    with pytest.raises(DeviationError, match="must be a DeviationModel or"):
        simulate(part, model)


def test_wrong_numbers_are_refused(part):
    with pytest.raises(GeometryError, match="deviation has shape"):
        simulate(part, np.zeros(7))
    with pytest.raises(DeviationError, match="size must be zero or more"):
        simulate_ensemble(part, MODEL, size=-1)


def test_a_wall_thinner_than_the_deviation_says_where():
    wall = thin_wall(thickness=0.2)
    field = np.zeros(wall.n_samples)
    for name in ("front", "back"):
        field[wall.feature(name=name).rows] = -0.15
    with pytest.raises(GeometryError, match=r"the skin model .*-?0\.15 mm"):
        simulate(wall, field)
    assert simulate(wall, field, check=False).closed
    assert simulate(wall, field / 2).closed


def test_a_box_may_grow_without_a_complaint():
    part = box()
    assert simulate(part, np.full(part.n_samples, 2.0)).surface.volume == pytest.approx(10 * 8 * 7)
