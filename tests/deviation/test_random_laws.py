"""The law of every random model by sampling: mean, variance, correlation, normality, independence.

The error level of every test is ALPHA = 1e-4, shared out evenly over all its comparisons (Bonferroni), with
fixed seeds: a right sampler fails one of ten thousand such tests. The truth is the exact mean and covariance
of the linear sampler, or what the model promises; Fisher's z is normal up to terms of 1 / COUNT.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from surfaces import covariance_of, plane, tube

from cadskin.deviation import (
    Fractal,
    FromArray,
    FromSpectrum,
    GaussianField,
    KarhunenLoeve,
    Modes,
    Paraboloid,
    Randomised,
    VibrationModes,
    WhiteNoise,
)

ALPHA = 1e-4
COUNT = 4000
SIGMA = 0.01

pytestmark = pytest.mark.filterwarnings("ignore:.*fewer than four vertices")

RANDOM = {
    "white noise": WhiteNoise(SIGMA),
    "dense": GaussianField(SIGMA, 12.0),
    "Karhunen-Loeve route": GaussianField(SIGMA, 12.0, method="karhunen_loeve"),
    "two levels": GaussianField(SIGMA, 12.0, method="two_level"),
    "Vecchia": GaussianField(SIGMA, 12.0, "matern32", method="vecchia"),
    "exponential": GaussianField(SIGMA, 12.0, "exponential"),
    "Matern 5/2": GaussianField(SIGMA, 12.0, "matern52"),
    "surface": GaussianField(SIGMA, 12.0, "whittle", metric="surface"),
    "varying sigma": GaussianField(lambda p: 0.01 + 1e-4 * np.abs(p[:, 0]), 12.0),
    "Karhunen-Loeve": KarhunenLoeve(SIGMA, 15.0, energy=0.9),
    "modes": Modes([0.01, 0.02, 0.005], first=1, random=True),
    "vibration": VibrationModes([0.01, 0.02], first=3, random=True),
    "spectrum": FromSpectrum([0.02, 0.05, 0.1], [1e-3, 2e-3, 5e-4], angle=0.5),
    "fractal": Fractal(SIGMA, 0.6, longest=40.0, shortest=10.0),
    "sum": 2 * WhiteNoise(SIGMA) + GaussianField(SIGMA, 12.0) + Paraboloid(0.05),
    "restricted": (WhiteNoise(SIGMA) + GaussianField(SIGMA, 12.0)).on(0),
}
FLAT_ONLY = {"vibration"}
CASES = [(name, "plane") for name in RANDOM] + [(n, "tube") for n in RANDOM if n not in FLAT_ONLY]


@pytest.fixture(scope="module")
def parts():
    return {"plane": plane((60.0, 40.0), h=5.0), "tube": tube(10.0, 25.0, h=4.5)}


@pytest.fixture(scope="module")
def drawn(parts):
    """Draws of each model, its exact covariance and mean; worked out once."""
    known = {}

    def of(name, shape):
        if (name, shape) not in known:
            sampler = RANDOM[name].prepare(parts[shape])
            draws = sampler.sample(size=COUNT, rng=20261125)
            mean = sampler.transform(np.zeros((1, sampler.latent)))[0]
            unit = sampler.transform(np.eye(sampler.latent)) - mean
            covariance = unit.T @ unit
            alive = np.flatnonzero(np.diag(covariance) > 1e-6 * np.diag(covariance).max())
            known[name, shape] = draws[:, alive], mean[alive], covariance[np.ix_(alive, alive)]
        return known[name, shape]

    return of


@pytest.mark.parametrize(("name", "shape"), CASES)
def test_mean(drawn, name, shape):
    draws, mean, covariance = drawn(name, shape)
    z = (draws.mean(axis=0) - mean) / np.sqrt(np.diag(covariance) / COUNT)
    assert np.abs(z).max() < stats.norm.isf(ALPHA / 2 / len(z))


@pytest.mark.parametrize(("name", "shape"), CASES)
def test_variance(drawn, name, shape):
    draws, mean, covariance = drawn(name, shape)
    squares = ((draws - mean) ** 2).sum(axis=0) / np.diag(covariance)
    low, high = stats.chi2(COUNT).ppf([ALPHA / 2 / len(squares), 1 - ALPHA / 2 / len(squares)])
    assert low < squares.min()
    assert squares.max() < high


@pytest.mark.parametrize(("name", "shape"), CASES)
def test_correlation(drawn, name, shape):
    """Fisher's z of every pair; pairs that depend on each other entirely are left out."""
    draws, mean, covariance = drawn(name, shape)
    del mean
    scale = np.sqrt(np.diag(covariance))
    truth = covariance / np.outer(scale, scale)
    first, second = np.triu_indices(len(scale), 1)
    pairs = np.abs(truth[first, second]) < 0.999
    first, second = first[pairs], second[pairs]
    found = np.corrcoef(draws.T)[first, second]
    z = (np.arctanh(found) - np.arctanh(truth[first, second])) * np.sqrt(COUNT - 3)
    assert np.abs(z).max() < stats.norm.isf(ALPHA / 2 / len(z))


@pytest.mark.parametrize(("name", "shape"), CASES)
def test_marginals_are_normal(drawn, name, shape):
    """Kolmogorov-Smirnov on independent draws at twelve points, and on the mean of the field."""
    draws, mean, covariance = drawn(name, shape)
    chosen = np.unique(np.linspace(0, len(mean) - 1, 12).astype(int))
    average = np.full(len(mean), 1.0 / len(mean))
    laws = [(draws[:, i], mean[i], covariance[i, i]) for i in chosen]
    if average @ covariance @ average > 1e-3 * np.diag(covariance).mean():
        laws.append((draws @ average, mean @ average, average @ covariance @ average))
    for values, centre, variance in laws:
        assert stats.kstest((values - centre) / np.sqrt(variance), "norm").pvalue > ALPHA / len(laws)


@pytest.mark.parametrize(("name", "shape"), CASES)
def test_samples_are_independent(drawn, name, shape):
    """The correlation of each sample with the next, along the first direction of the covariance."""
    draws, mean, covariance = drawn(name, shape)
    direction = np.linalg.eigh(covariance)[1][:, -1]
    series = (draws - mean) @ direction
    for lag in (1, 2, 32):
        r = np.corrcoef(series[:-lag], series[lag:])[0, 1]
        assert abs(r) * np.sqrt(COUNT - lag) < stats.norm.isf(ALPHA / 2 / 3)


@pytest.mark.parametrize("name", ["white noise", "dense", "Vecchia", "exponential", "Matern 5/2", "fractal"])
@pytest.mark.parametrize("shape", ["plane", "tube"])
def test_the_promised_variance(parts, name, shape):
    """Exactly, not by sampling: sigma at every point within 1 %."""
    variance = np.diag(covariance_of(RANDOM[name].prepare(parts[shape])))
    assert np.abs(np.sqrt(variance) / SIGMA - 1).max() < 0.01


def test_the_promised_variance_of_spectra_and_modes(parts):
    """The integral of the spectrum; the mean square of the amplitudes over the area."""
    spectrum = RANDOM["spectrum"]
    variance = np.diag(covariance_of(spectrum.prepare(parts["plane"])))
    assert np.allclose(variance, spectrum.variance, rtol=1e-5)
    part = parts["plane"]
    area = np.bincount(part.surface.triangles.ravel(), np.repeat(part.surface.triangle_areas / 3, 3))
    for name in ("modes", "vibration"):
        variance = np.diag(covariance_of(RANDOM[name].prepare(part)))
        mean = variance @ area[part.samples.vertex_ids] / area.sum()
        assert mean == pytest.approx(sum(a**2 for a in RANDOM[name].amplitudes), rel=1e-5)


def test_random_amplitudes_have_their_distribution(parts):
    """Kolmogorov-Smirnov of the height over its nominal one."""
    for law in (stats.norm(1.0, 0.25), stats.lognorm(0.4), stats.uniform(0.5, 1.0)):
        heights = np.ptp(Randomised(Paraboloid(0.02), law).sample(parts["plane"], size=2000, rng=3), axis=1)
        assert stats.kstest(heights / 0.02, law.cdf).pvalue > ALPHA / 3


def test_rows_of_an_array_are_equally_likely(parts):
    n = parts["plane"].n_samples
    draws = FromArray(np.arange(10.0)[:, None] * np.ones(n)).sample(parts["plane"], size=3000, rng=4)
    found = np.bincount(draws[:, 0].astype(int), minlength=10)
    assert stats.chisquare(found).pvalue > ALPHA
