"""Rejection to a profile zone: the right law, the right place in the message."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from support.parts import box, filleted_box, pyramid

from cadskin.deviation import GaussianField, WhiteNoise
from cadskin.errors import ConformityError, DeviationError, SpecificationError
from cadskin.shape import smooth_patches
from cadskin.skin import simulate, simulate_in_profile_zone
from cadskin.skin.weld import prepare_weld


@pytest.fixture(scope="module")
def part():
    return filleted_box()


@pytest.mark.parametrize("model", [WhiteNoise(sigma=0.02), GaussianField(sigma=0.02, length=4.0)])
def test_every_deviation_lies_in_the_zone(part, model):
    for seed in range(5):
        skin = simulate_in_profile_zone(part, model, 0.1, rng=seed)
        assert np.abs(skin.deviation).max() <= 0.05
        assert np.abs(skin.deviation).max() > 0.02
        assert skin.closed


def test_the_same_seed_gives_the_same_skin(part):
    model = GaussianField(sigma=0.02, length=3.0)
    one, two = (simulate_in_profile_zone(part, model, 0.08, rng=4) for _ in range(2))
    np.testing.assert_array_equal(one.deviation, two.deviation)
    assert one.provenance == two.provenance
    assert one.provenance.options["profile_zone"] == 0.08
    assert one.provenance.options["law"] == "rejection per smooth patch"
    assert one.provenance.options["tries"] >= 1
    assert one.provenance.index == 0


def test_white_noise_becomes_the_truncated_normal_law(part):
    """Kolmogorov-Smirnov at the level 0.1 %, fixed seed; nodes are independent."""
    skin = simulate_in_profile_zone(part, WhiteNoise(sigma=0.03), 0.06, rng=11)
    patches = smooth_patches(part)
    _, first = np.unique(patches.node_of_sample, return_index=True)
    law = stats.truncnorm(-1, 1, scale=0.03)
    assert len(first) > 500
    assert stats.kstest(skin.deviation[first], law.cdf).pvalue > 0.001


def test_rejection_per_patch_and_as_a_whole_follow_one_law():
    """The peak of the top face, by either route: two samples, Kolmogorov-Smirnov at the level 0.1 %."""
    part = box(h=1.0)
    model = GaussianField(sigma=0.02, length=6.0)
    top = part.feature(name="top").rows

    def peaks(whole):
        return [
            np.abs(
                simulate_in_profile_zone(part, model, 0.07, rng=seed, whole=whole, check=False).deviation[top]
            ).max()
            for seed in range(1000 * whole, 1000 * whole + 150)
        ]

    assert stats.ks_2samp(peaks(False), peaks(True)).pvalue > 0.001


def test_a_zone_that_is_too_tight_names_the_feature(part):
    with pytest.raises(
        ConformityError, match=r"none of 20 fields .* within ±0\.001 mm on 7 of 7 features; on \w+"
    ):
        simulate_in_profile_zone(part, GaussianField(sigma=0.02, length=3.0), 0.002, rng=1, max_tries=20)


def test_only_the_feature_that_does_not_fit_is_named(part):
    model = GaussianField(sigma=0.001, length=3.0) + GaussianField(sigma=0.5, length=3.0).on("top")
    with pytest.raises(ConformityError, match=r"on 1 of 7 features; on top the best"):
        simulate_in_profile_zone(part, model, 0.02, rng=1, max_tries=10)


@pytest.mark.parametrize("tolerance", [0.0, -1.0, np.nan, np.inf])
def test_a_tolerance_without_meaning_is_refused(part, tolerance):
    with pytest.raises(SpecificationError, match="positive and finite"):
        simulate_in_profile_zone(part, WhiteNoise(sigma=0.01), tolerance)


def test_wrong_requests_are_refused(part):
    with pytest.raises(DeviationError, match="must be a DeviationModel"):
        simulate_in_profile_zone(part, np.zeros(part.n_samples), 0.1)
    with pytest.raises(DeviationError, match="max_tries"):
        simulate_in_profile_zone(part, WhiteNoise(sigma=0.01), 0.1, max_tries=0)


def test_progress_counts_the_patches(part):
    seen = []
    simulate_in_profile_zone(
        part, GaussianField(sigma=0.01, length=5.0), 0.1, rng=1, progress=lambda *state: seen.append(state)
    )
    n_patches = smooth_patches(part).n_patches
    assert seen[0] == (0, n_patches)
    assert seen[-1] == (n_patches, n_patches)


def test_a_wide_zone_changes_nothing_in_the_law(part):
    """With a zone of 20 sigma the first field fits everywhere, and is as long as one without a zone."""
    model = GaussianField(sigma=0.01, length=3.0)
    inside = simulate_in_profile_zone(part, model, 0.2, rng=2)
    assert inside.provenance.options["tries"] == 1
    assert inside.deviation.std() == pytest.approx(simulate(part, model, rng=2).deviation.std(), rel=0.5)


def test_what_a_corner_of_six_features_realises_lies_in_the_zone_too():
    """Of fields inside, about 3 % leave the zone at the tip by least squares: those are drawn anew."""
    part, model, half = pyramid(6), WhiteNoise(sigma=0.2), 0.05
    operator = prepare_weld(part)
    n_outside = 0
    for seed in range(60):
        alone = _first_fits(part, model, half, seed)
        n_outside += np.abs(operator.realised(operator.displacement(alone))).max() > half
        skin = simulate_in_profile_zone(part, model, 2 * half, rng=seed, check=False)
        assert np.abs(skin.deviation).max() <= half
        assert np.abs(skin.realised_deviation).max() <= half * (1 + 1e-9)
    assert 0 < n_outside < 10


def _first_fits(part, model, half, seed):
    """The first try inside of the zone at each node of a white noise field, whatever the weld makes of it."""
    tries = model.sample(part, size=200, rng=np.random.SeedSequence(seed, spawn_key=(0,)))
    first = np.argmax(np.abs(tries) <= half, axis=0)
    return tries[first, np.arange(part.n_samples)]
