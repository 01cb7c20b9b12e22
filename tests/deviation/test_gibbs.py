"""Gibbs sampling: law against the exact one, truncation against rejection, diagnostics, reproducibility."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from surfaces import covariance_of, plane, two_planes

from cadskin.deviation import Gibbs, from_dict
from cadskin.deviation._gibbs_kernels import _normal_quantile, colours, truncated_normal
from cadskin.deviation._patches import patch_points
from cadskin.deviation._surface import SurfaceField
from cadskin.deviation.diagnostics import (
    diagnose,
    effective_sample_size,
    split_rhat,
    tail_effective_sample_size,
)
from cadskin.deviation.field import PatchwiseSampler
from cadskin.errors import CadskinWarning, DeviationError

SIGMA = 0.01
coarse_on_purpose = pytest.mark.filterwarnings("ignore:.*fewer than four vertices")


@pytest.fixture(scope="module")
def part():
    return plane((30.0, 20.0), h=3.0)


def exact_sampler(part, length):
    """The exact sampler of surface fields, here without what lies beyond the free edges."""
    patches = patch_points(part)
    fields = [SurfaceField(p.points / length, p.triangles, "whittle", collar=False) for p in patches]
    return PatchwiseSampler(patches, fields, np.full(part.n_samples, SIGMA))


@coarse_on_purpose
@pytest.mark.parametrize("order", ["sequential", "chromatic"])
def test_the_law_is_that_of_the_exact_sampler(part, order):
    """Covariance of 800 independent chains against the exact matrix: z-scores of all entries, level 1e-4."""
    model = Gibbs(SIGMA, 4.0, sweeps=800, order=order)
    draws = model.sample(part, size=800, rng=1)
    exact = covariance_of(exact_sampler(part, 4.0))
    found = draws.T @ draws / len(draws)
    error = np.sqrt((np.outer(np.diag(exact), np.diag(exact)) + exact**2) / len(draws))
    z = (found - exact) / error
    assert np.abs(z).max() < 5.5  # 3003 different entries
    assert 0.8 < np.sqrt((z**2).mean()) < 1.2
    assert stats.kstest(draws[:, ::9].ravel()[::7] / SIGMA, "norm").pvalue > 1e-4


def test_the_start_is_forgotten(part):
    """Two far apart starts give the same law: means within 4.5 standard errors at every point."""
    size = 640
    high = Gibbs(SIGMA, 4.0, sweeps=800, start=30.0).sample(part, size=size, rng=2)
    low = Gibbs(SIGMA, 4.0, sweeps=800, start=-30.0).sample(part, size=size, rng=3)
    z = (high.mean(axis=0) - low.mean(axis=0)) / (SIGMA * np.sqrt(2 / size))
    assert np.abs(z).max() < 4.5
    with pytest.warns(CadskinWarning, match="chains from far apart starts have not met"):
        stuck = Gibbs(SIGMA, 12.0, sweeps=10, start=30.0).prepare(part)
    assert stuck.sample(size=5, rng=1).mean() > SIGMA


@coarse_on_purpose
def test_truncated_law_against_rejection(part):
    """Limits +-1.2 sigma on a small part: exact samples that fit are the truth (two-sample KS, 1e-4)."""
    small = plane((6.0, 4.0), h=1.3)
    limit = 1.2 * SIGMA
    exact = exact_sampler(small, 4.0).sample(size=60_000, rng=4)
    truth = exact[(np.abs(exact) <= limit).all(axis=1)]
    assert len(truth) > 2000
    drawn = Gibbs(SIGMA, 4.0, sweeps=800, lower=-limit, upper=limit).sample(small, size=960, rng=5)
    assert np.abs(drawn).max() <= limit
    for column in range(0, small.n_samples, 3):
        assert stats.ks_2samp(truth[:, column], drawn[:, column]).pvalue > 1e-4
    mean_truth, mean_drawn = truth.mean(axis=1), drawn.mean(axis=1)
    assert stats.ks_2samp(mean_truth, mean_drawn).pvalue > 1e-4


def test_one_sided_and_per_sample_limits(part):
    lower = np.full(part.n_samples, -np.inf)
    lower[:10] = 0.5 * SIGMA
    drawn = Gibbs(SIGMA, 4.0, sweeps=800, lower=lower).sample(part, size=40, rng=1)
    assert (drawn[:, :10] >= 0.5 * SIGMA - 1e-9).all()
    assert (drawn[:, 10:] < 0).any()


@pytest.mark.parametrize("p", [1e-280, 1e-100, 1e-20, 1e-5, 0.02, 0.3, 0.5, 0.9, 1 - 1e-9])
def test_normal_quantile(p):
    assert _normal_quantile(p) == pytest.approx(stats.norm.ppf(p), rel=1e-13, abs=1e-15)


@pytest.mark.parametrize(
    ("low", "high"), [(-1, 2), (-3, 0.5), (2, 3), (-9, -8), (8, np.inf), (-np.inf, -6), (45, 46), (-60, -50)]
)
def test_truncated_normal(low, high):
    u = (np.arange(2000) + 0.5) / 2000
    drawn = np.array([truncated_normal(v, float(low), float(high)) for v in u])
    assert ((drawn >= low) & (drawn <= high)).all()
    assert (np.diff(drawn) > 0).all()
    if min(abs(low), abs(high)) < 38:
        truth = stats.truncnorm(low, high).ppf(u)
        assert np.allclose(drawn, truth, rtol=1e-9, atol=1e-9)
    else:
        edge = min(abs(low), abs(high))
        assert np.mean(np.abs(drawn) - edge) == pytest.approx(1 / edge, rel=0.02)


def test_colours_are_a_colouring(part):
    sampler = Gibbs(SIGMA, 4.0, sweeps=800, order="chromatic").prepare(part)
    (chain,) = sampler.patches
    colour = colours(chain.starts, chain.columns)
    rows = np.repeat(np.arange(len(colour)), np.diff(chain.starts))
    assert (colour[rows] != colour[chain.columns]).all()
    assert colour.max() + 1 < 25


def test_chains_are_reproducible_and_independent_of_the_batch():
    wall = two_planes(h=8.0)
    model = Gibbs(SIGMA, 4.0, sweeps=800)
    many = model.sample(wall, size=40, rng=9)
    assert np.array_equal(many[:3], model.sample(wall, size=3, rng=9))
    low, high = (wall.feature(name).rows for name in ("low", "high"))
    assert abs(np.corrcoef(many[:, low].mean(axis=1), many[:, high].mean(axis=1))[0, 1]) < 0.6
    assert from_dict(model.to_dict()) == model


def test_run_keeps_traces(part):
    sampler = Gibbs(SIGMA, 4.0, sweeps=800).prepare(part)
    run = sampler.run(np.random.SeedSequence(1).spawn(4), sweeps=1700, burn_in=200, thinning=30)
    assert run.states.shape == (4, part.n_samples)
    assert run.traces["patch 0 mean"].shape == (4, 50)
    diagnostics = run.diagnostics()["patch 0 mean"]
    assert diagnostics.rhat < 1.1
    assert 20 < diagnostics.bulk < 4 * 50 * 2.5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sweeps": 0}, "sweeps must be a whole number of 1 or more, got 0"),
        ({"order": "random"}, "order must be one of sequential, chromatic"),
        ({"lower": np.nan}, "lower holds NaN"),
    ],
)
def test_bad_parameters(arguments, message):
    with pytest.raises(DeviationError, match=message):
        Gibbs(SIGMA, 4.0, **arguments)


def test_limits_that_exclude_everything(part):
    with pytest.raises(DeviationError, match=r"is not below the upper one 0\.01 mm: nothing is left"):
        Gibbs(SIGMA, 4.0, lower=0.02, upper=0.01).sample(part)
    with pytest.raises(DeviationError, match="lower has 3 values"):
        Gibbs(SIGMA, 4.0, lower=[0.0, 0.0, 0.0]).sample(part)


def autoregressive(rho, chains, draws, seed=0):
    rng = np.random.default_rng(seed)
    x = np.zeros((chains, draws))
    x[:, 0] = rng.standard_normal(chains)
    for t in range(1, draws):
        x[:, t] = rho * x[:, t - 1] + np.sqrt(1 - rho**2) * rng.standard_normal(chains)
    return x


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_effective_sample_size_of_an_autoregressive_chain(rho):
    """AR(1): draws (1 - rho) / (1 + rho)."""
    traces = autoregressive(rho, 8, 4000)
    expected = traces.size * (1 - rho) / (1 + rho)
    assert effective_sample_size(traces) == pytest.approx(expected, rel=0.15)
    assert tail_effective_sample_size(traces) < 1.1 * traces.size
    assert split_rhat(traces) < 1.01


def test_rhat_sees_shift_and_scale():
    traces = autoregressive(0.0, 4, 1000)
    shifted = traces + np.arange(4)[:, None]
    scaled = traces * np.array([1, 1, 1, 4.0])[:, None]
    assert split_rhat(shifted) > 1.2
    assert split_rhat(scaled) > 1.05
    assert diagnose(traces).rhat < 1.01
    with pytest.raises(DeviationError, match="4 or more draws"):
        split_rhat(np.zeros((2, 3)))
