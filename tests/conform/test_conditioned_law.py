"""The conditioned law, against plain rejection by the independent evaluator."""

import numpy as np
import pytest
from scipy.stats import ks_2samp
from support.parts import box

from cadskin.conform import conditioned, prepare_conforming
from cadskin.conform.flat import flatness_bounds
from cadskin.deviation import GaussianField, WhiteNoise
from cadskin.skin import SkinEnsemble
from cadskin.spec import Specification, flatness, parallelism, perpendicularity, position, surface_profile
from cadskin.verify import verify

BOTTOM, TOP, RIGHT, LEFT = 0, 1, 3, 5
MODEL = GaussianField(0.01, 50.0)
COUNT = 200


@pytest.fixture(scope="module")
def part():
    return box((60.0, 40.0, 20.0), h=12.0)


def tilt(part, face):
    """Slope of the deviation of a face along its longest direction."""
    feature = part.feature_of(face)
    points = feature.points - feature.points.mean(axis=0)
    along = points[:, int(np.argmax(np.ptp(points, axis=0)))]
    return lambda field: float(along @ field[feature.rows] / (along @ along))


def mean(part, face):
    rows = part.feature_of(face).rows
    return lambda field: float(field[rows].mean())


def value(part, face):
    feature = part.feature_of(face)
    return lambda field: flatness_bounds(feature.points, feature.faces[0].normal, field[feature.rows])[1]


def statistics(part, *faces):
    made = {"mean": mean, "flatness": value, "tilt": tilt}
    return {f"{name} of {face}": make(part, face) for name, make in made.items() for face in faces}


@pytest.mark.parametrize(("limit", "low", "high"), [(0.01, 0.95, 1), (0.0047, 0.3, 0.7), (0.0027, 0.03, 0.2)])
def test_form(part, plain_rejection, conformed, same_law, limit, low, high):
    spec = Specification(flatness(TOP, limit))
    reference, share = plain_rejection(part, MODEL, spec, size=int(2 * COUNT / (low + high)), rng=1)
    assert low <= share <= high
    fields, made = conformed(prepare_conforming(part, MODEL, spec), size=COUNT, rng=2)
    same_law(fields, reference, statistics(part, TOP, BOTTOM))
    tried = sum(one.tally.attempts for one in made)
    assert COUNT / tried == pytest.approx(share, rel=0.3)
    assert all(one.tally.samplers == {"rejection"} for one in made)


@pytest.fixture(scope="module")
def oriented(part, plain_rejection):
    """A specification that couples three faces, and plain parts that meet it."""
    spec = Specification(
        flatness(BOTTOM, 0.006), parallelism(TOP, 0.016, datums="A"),
        perpendicularity(RIGHT, 0.009, datums="A"), datums={"A": BOTTOM},
    )  # fmt: skip
    reference, share = plain_rejection(part, MODEL, spec, size=600, rng=3)
    assert 0.1 < share < 0.6
    return spec, reference


@pytest.mark.parametrize("sampler", ["rejection", "blocks in turn"])
def test_orientation_and_form_with_a_datum(part, oriented, conformed, same_law, sampler):
    spec, reference = oriented
    tries = 200 if sampler == "rejection" else 0
    prepared = prepare_conforming(part, MODEL, spec, joint_tries=tries, sweeps=5)
    fields, made = conformed(prepared, size=80, rng=4)
    assert all(sampler in one.tally.samplers for one in made)
    same_law(fields, reference, statistics(part, TOP, BOTTOM, RIGHT))


@pytest.mark.parametrize("sampler", ["auto", pytest.param("hmc", marks=pytest.mark.slow)])
def test_form_inside_orientation_on_one_feature(part, plain_rejection, conformed, same_law, sampler):
    spec = Specification(
        flatness(TOP, 0.0045),
        parallelism(TOP, 0.016, datums="A"),
        flatness(BOTTOM, 0.006),
        datums={"A": BOTTOM},
    )
    reference, share = plain_rejection(part, MODEL, spec, size=700, rng=14)
    assert 0.05 < share < 0.5
    prepared = prepare_conforming(part, MODEL, spec, conform=conditioned(sampler=sampler))
    fields, made = conformed(prepared, size=100, rng=15)
    assert any(sampler in one.tally.samplers for one in made) or sampler == "auto"
    same_law(fields, reference, statistics(part, TOP, BOTTOM))


def test_position_of_a_plane_in_a_datum_system(part, plain_rejection, conformed, same_law):
    spec = Specification(position(TOP, 0.04, datums="A"), surface_profile(RIGHT, 0.05, datums="A|B"),
                         datums={"A": BOTTOM, "B": LEFT})  # fmt: skip
    reference, share = plain_rejection(part, MODEL, spec, size=500, rng=5)
    assert 0.15 < share < 0.7
    fields, _ = conformed(prepare_conforming(part, MODEL, spec), size=COUNT // 2, rng=6)
    same_law(fields, reference, statistics(part, TOP, BOTTOM, LEFT, RIGHT))


def test_slice_sampling_where_rejection_is_cut_off(part, plain_rejection, conformed, same_law):
    spec = Specification(flatness(TOP, 0.003))
    reference, share = plain_rejection(part, MODEL, spec, size=1500, rng=7)
    assert share < 0.25
    prepared = prepare_conforming(part, MODEL, spec, conform=conditioned(sampler="slice"))
    fields, made = conformed(prepared, size=COUNT, rng=8)
    assert all(one.tally.samplers == {"slice"} for one in made)
    same_law(fields, reference, statistics(part, TOP))


def test_the_comparison_has_power(part, plain_rejection, same_law):
    """Rescaling what is outside gives another law, and these statistics see it."""
    limit = 0.003
    spec = Specification(flatness(TOP, limit))
    reference, _ = plain_rejection(part, MODEL, spec, size=1500, rng=7)
    raw = MODEL.sample(part, size=COUNT, rng=8)
    values = np.array([value(part, TOP)(field) for field in raw])
    scaled = raw * np.minimum(1.0, limit / values)[:, None]
    with pytest.raises(AssertionError, match="flatness"):
        same_law(scaled, reference, statistics(part, TOP))


def test_far_beyond_rejection(part, conformed):
    """Sigma twenty times too large: no raw sample meets the flatness, the chain still conforms."""
    spec = Specification(flatness(TOP, 0.005))
    prepared = prepare_conforming(part, GaussianField(0.2, 50.0), spec, max_tries=20)
    fields, made = conformed(prepared, size=5, rng=9)
    found = verify(SkinEnsemble(part, fields), spec)
    assert found.conforming.all()
    assert found.values.min() > 0.003  # a typical sample lies near the edge of the zone
    assert all(one.tally.samplers == {"hmc"} for one in made)
    rows = part.feature_of(TOP).rows
    assert np.abs(fields[:, rows].mean(axis=1)).max() > 0.02  # the level of the face is free


def test_white_noise_is_conditioned_too(part, plain_rejection, conformed, same_law):
    spec = Specification(flatness(TOP, 0.032))
    model = WhiteNoise(0.01)
    reference, share = plain_rejection(part, model, spec, size=500, rng=10)
    assert 0.2 < share < 0.9
    fields, _ = conformed(prepare_conforming(part, model, spec), size=COUNT, rng=11)
    row = part.feature_of(TOP).start
    corner = {"corner": lambda field: float(field[row])}
    same_law(fields, reference, statistics(part, TOP) | corner)


def test_untouched_features_keep_the_raw_law(part, conformed):
    spec = Specification(flatness(TOP, 0.003))
    fields, _ = conformed(prepare_conforming(part, MODEL, spec), size=COUNT, rng=12)
    raw = MODEL.sample(part, size=COUNT, rng=13)
    for name, statistic in statistics(part, LEFT, BOTTOM).items():
        p_value = ks_2samp([statistic(f) for f in fields], [statistic(f) for f in raw]).pvalue
        assert p_value > 1e-5, name
