"""Karhunen-Loeve expansion, eigenfunctions, waves, spectra, fractal surfaces."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats
from surfaces import ball, covariance_at, covariance_of, plane, tube

from cadskin.deviation import (
    Fractal,
    FromSpectrum,
    GaussianField,
    KarhunenLoeve,
    Modes,
    VibrationModes,
    Waviness,
    from_dict,
)
from cadskin.deviation.modal import laplacian_modes
from cadskin.errors import DeviationError
from cadskin.shape.operators import lumped_mass


def test_eigenvalues_of_a_rectangle():
    """Free edges: (pi i / a)² + (pi j / b)²; fixed edges from i, j = 1 on."""
    part = plane((60.0, 40.0), h=2.0, jitter=0.15)
    points, triangles = part.surface.points, part.surface.triangles
    free, _ = laplacian_modes(points, triangles, 8)
    truth = np.sort([(np.pi * i / 60) ** 2 + (np.pi * j / 40) ** 2 for i in range(6) for j in range(6)])[:8]
    assert free[0] == pytest.approx(0, abs=1e-10)
    assert np.allclose(free[1:], truth[1:], rtol=0.01)
    fixed, functions = laplacian_modes(points, triangles, 3, edges="fixed")
    assert fixed[0] == pytest.approx((np.pi / 60) ** 2 + (np.pi / 40) ** 2, rel=0.01)
    on_edge = (points[:, 0] == 0) | (points[:, 1] == 40)
    assert (functions[:, on_edge] == 0).all()


def test_eigenfunctions_are_orthonormal():
    part = ball(10.0, 800)
    mass = lumped_mass(part.surface.points, part.surface.triangles)
    _, functions = laplacian_modes(part.surface.points, part.surface.triangles, 9)
    assert np.allclose((functions * mass) @ functions.T / mass.sum(), np.eye(9), atol=1e-8)


def test_modes_fixed_and_random():
    part = plane((60.0, 40.0), h=3.0)
    fixed = Modes([0.01, 0.0, 0.004], first=1)
    values = fixed.sample(part, size=2, rng=1)
    assert np.array_equal(values[0], values[1])
    mass = lumped_mass(part.surface.points, part.surface.triangles)[part.samples.vertex_ids]
    assert np.sqrt(np.average(values[0] ** 2, weights=mass)) == pytest.approx(np.hypot(0.01, 0.004), rel=1e-5)
    random = Modes([0.01, 0.004], first=1, random=True)
    covariance = covariance_of(random.prepare(part))
    assert np.average(np.diag(covariance), weights=mass) == pytest.approx(0.01**2 + 0.004**2, rel=1e-5)
    assert np.linalg.matrix_rank(covariance, tol=1e-9) == 2
    with pytest.raises(DeviationError, match="the mesh is too coarse"):
        Modes(np.ones(500)).sample(part)


def test_ranges_of_modes():
    """Amplitudes ~ k^-decay whose squares add up to that of the whole; given ones at their numbers."""
    part = plane((60.0, 40.0), h=3.0)
    decaying = Modes.over(range(2, 12), rms=0.02, decay=1.5, edges="free")
    amplitudes = np.array(decaying.amplitudes)
    assert decaying.first == 2
    assert np.allclose(amplitudes / amplitudes[0], np.arange(1, 11) ** -1.5)
    mass = lumped_mass(part.surface.points, part.surface.triangles)[part.samples.vertex_ids]
    assert np.sqrt(np.average(decaying.sample(part)[0] ** 2, weights=mass)) == pytest.approx(0.02, rel=1e-5)
    law = covariance_of(Modes.over(range(2, 12), rms=0.02, decay=1.5, random=True).prepare(part))
    assert np.average(np.diag(law), weights=mass) == pytest.approx(0.02**2, rel=1e-5)
    odd = Modes.over(range(1, 7, 2), amplitudes=[0.01, 0.02, 0.03])
    assert odd == Modes([0.01, 0.0, 0.02, 0.0, 0.03], first=1)
    assert from_dict(odd.to_dict()) == odd
    shell = VibrationModes.over([6, 8], rms=0.01, decay=0.0, thickness=2.0)
    assert shell == VibrationModes([0.01 / np.sqrt(2), 0.0, 0.01 / np.sqrt(2)], first=6, thickness=2.0)


@pytest.mark.parametrize(
    ("numbers", "options", "message"),
    [
        ([], {"rms": 0.1}, "must increase"),
        ([3, 3], {"rms": 0.1}, "must increase"),
        ([-1, 2], {"rms": 0.1}, "number of a mode must be a whole number of 0 or more"),
        (range(3), {}, "either amplitudes or rms"),
        (range(3), {"amplitudes": [0.1] * 3, "rms": 0.1}, "either amplitudes or rms"),
        (range(3), {"amplitudes": [0.1]}, "1 amplitudes for 3 modes"),
        (range(3), {"rms": -0.1}, "rms must be greater than 0"),
        (range(3), {"rms": 0.1, "decay": np.nan}, "decay must be finite"),
    ],
)
def test_bad_ranges_of_modes(numbers, options, message):
    with pytest.raises(DeviationError, match=message):
        Modes.over(numbers, **options)


def test_karhunen_loeve_is_the_best_expansion():
    """Its variance shares are the eigenvalues of the exact covariance in the area measure."""
    part = plane((60.0, 40.0), h=3.0)
    points = part.surface.points
    mass = lumped_mass(points, part.surface.triangles)
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    root = np.sqrt(mass / mass.sum())
    exact = np.linalg.eigvalsh(root[:, None] * np.exp(-(distance**2) / 800) * root)[::-1]
    for count in (3, 8):
        covariance = covariance_of(KarhunenLoeve(1.0, 20.0, count=count).prepare(part))
        held = (np.diag(covariance) * mass[part.samples.vertex_ids]).sum() / mass.sum()
        assert held == pytest.approx(exact[:count].sum(), rel=2e-3)
    full = covariance_of(KarhunenLoeve(1.0, 20.0, energy=1.0).prepare(part))
    assert np.abs(full - covariance_of(GaussianField(1.0, 20.0).prepare(part))).max() < 1e-4
    sampler = KarhunenLoeve(1.0, 20.0, energy=0.9).prepare(part)
    share = exact.cumsum() / exact.sum()
    assert sampler.latent == pytest.approx(np.searchsorted(share, 0.9) + 1, abs=1)


def test_waviness():
    part = plane((60.0, 40.0), h=2.0)
    x, y, _ = part.surface.points[part.samples.vertex_ids].T
    values = Waviness(0.01, wavelength=12.0).sample(part)[0]
    assert np.allclose(values, 0.005 * np.sin(2 * np.pi * (x - 30) / 12))
    values = Waviness(0.01, wavelength=12.0, angle=np.pi / 2).sample(part)[0]
    assert np.allclose(values, 0.005 * np.sin(2 * np.pi * (y - 20) / 12))


def test_spectrum_gives_its_covariance():
    """Covariance = integral of S(f) cos(2 pi f d), exactly, for the tabulated frequencies."""
    part = plane((60.0, 40.0), h=4.0)
    frequencies = np.linspace(0.01, 0.2, 60)
    psd = 1e-4 / (1 + (frequencies / 0.05) ** 4)
    model = FromSpectrum(frequencies, psd)
    covariance = covariance_of(model.prepare(part))
    x = part.surface.points[part.samples.vertex_ids][:, 0]
    lag = x[:, None] - x[None]
    truth = np.trapezoid(psd * np.cos(2 * np.pi * frequencies * lag[..., None]), frequencies, axis=-1)
    assert np.abs(covariance - truth).max() < 1e-5 * truth.max()
    assert model.variance == pytest.approx(np.trapezoid(psd, frequencies))
    assert from_dict(model.to_dict()) == model


@pytest.mark.parametrize(
    ("frequencies", "psd", "message"),
    [
        ([0.1], [1.0], "two or more"),
        ([0.2, 0.1], [1.0, 1.0], "increasing"),
        ([0.1, 0.2], [-1.0, 1.0], "0 or more"),
        ([0.1, 0.2], [0.0, 0.0], "more than 0 somewhere"),
    ],
)
def test_bad_spectra(frequencies, psd, message):
    with pytest.raises(DeviationError, match=message):
        FromSpectrum(frequencies, psd)


def test_fractal_has_its_exponent():
    """Structure function E (z(p) - z(q))² ~ d^(2 H) between the lengths: slope of the exact covariance."""
    part = plane((64.0, 16.0), h=1.0, jitter=0.0)
    points = part.surface.points[part.samples.vertex_ids]
    row = np.flatnonzero(np.abs(points[:, 1] - 8.0) < 1e-9)
    row = row[np.argsort(points[row, 0])]
    covariance = sum(
        covariance_at(term.prepare(part), row)
        for term in Fractal(1.0, 0.6, longest=64, shortest=4).octaves().terms
    )
    assert np.allclose(np.diag(covariance), 1, atol=1e-3)
    lags = np.array([6, 8, 12, 16, 24])
    structure = [np.mean([2 - 2 * covariance[i, i + lag] for i in range(len(row) - lag)]) for lag in lags]
    slope = np.polyfit(np.log(lags), np.log(structure), 1)[0]
    assert slope == pytest.approx(1.2, abs=0.15)


def line_of(part, y):
    """Samples along x at a height y, and their step [mm]."""
    points = part.surface.points[part.samples.vertex_ids]
    row = np.flatnonzero(np.abs(points[:, 1] - y) < 1e-9)
    row = row[np.argsort(points[row, 0])]
    return row, float(points[row[1], 0] - points[row[0], 0])


def structure_slopes(profiles, lags, batches):
    """Slope of log E (z(s + d) - z(s))² over log d, of each batch of profiles."""
    return np.array(
        [
            np.polyfit(np.log(lags), np.log([np.mean((z[:, lag:] - z[:, :-lag]) ** 2) for lag in lags]), 1)[0]
            for z in np.array_split(profiles, batches)
        ]
    )


@pytest.mark.parametrize("hurst", [0.3, 0.5, 0.8])
def test_self_affine_profiles_have_their_exponent(hurst):
    """Structure function of drawn profiles against its integral; false alarm 1e-4 by Student's t."""
    part = plane((128.0, 8.0), h=0.5, jitter=0.0)
    model = FromSpectrum.self_affine(0.01, hurst, longest=2000, shortest=1)
    row, step = line_of(part, 4.0)
    lags = np.array([6, 8, 12, 16, 24, 32])
    slopes = structure_slopes(model.sample(part, size=1200, rng=11)[:, row], lags, 40)
    f = np.geomspace(1 / 2000, 1, 200_001)
    psd = f ** -(1 + 2 * hurst)
    theory = [np.trapezoid(psd * (1 - np.cos(2 * np.pi * f * d * step)), f) for d in lags]
    expected = np.polyfit(np.log(lags), np.log(theory), 1)[0]
    assert expected == pytest.approx(2 * hurst, abs=0.2)  # the band has ends: 3 and 16 mm in 1 to 2000 mm
    error = slopes.std(ddof=1) / np.sqrt(40)
    assert abs(slopes.mean() - expected) < scipy.stats.t(39).ppf(1 - 0.5e-4) * error + 0.01
    assert error < 0.05
    assert model.variance == pytest.approx(1e-4, rel=1e-12)


def test_measured_spectrum_has_the_slope_of_the_law():
    """Periodogram at the harmonics of the face: -(1 + 2 H) within 4 standard errors (false alarm 6e-5)."""
    part = plane((64.0, 4.0), h=0.5, jitter=0.0)
    row, _ = line_of(part, 2.0)
    harmonics = np.arange(2, 41)
    frequencies = harmonics / 64.0
    model = FromSpectrum(frequencies, 1e-5 * frequencies ** -(1 + 2 * 0.7))
    drawn = model.sample(part, size=1000, rng=4)[:, row[:-1]]  # one period
    power = np.mean(np.abs(np.fft.rfft(drawn, axis=1)[:, harmonics]) ** 2, axis=0)
    design = np.stack([np.ones(len(harmonics) - 2), np.log(frequencies[1:-1])], axis=1)  # full weights inside
    slope = np.linalg.lstsq(design, np.log(power[1:-1]))[0][1]
    error = np.sqrt(np.linalg.inv(design.T @ design)[1, 1] / 1000)  # log of the mean of 1000 exponentials
    assert abs(slope + 2.4) < 4 * error
    assert error < 0.01


@pytest.mark.parametrize("hurst", [0.4, 0.8])
def test_measured_fractals_have_their_exponent(hurst):
    """Drawn fields against the structure function of the octaves' kernels; false alarm 1e-4."""
    part = plane((96.0, 8.0), h=1.0, jitter=0.0)
    row, step = line_of(part, 4.0)
    model = Fractal(0.01, hurst, longest=128, shortest=4)
    lags = np.array([12, 16, 24, 32])
    slopes = structure_slopes(model.sample(part, size=1200, rng=8)[:, row], lags, 40)
    octaves = [(term.sigma, term.length) for term in model.octaves().terms]
    theory = [
        sum(s**2 * (1 - np.exp(-0.5 * (d * step / length) ** 2)) for s, length in octaves) for d in lags
    ]
    expected = np.polyfit(np.log(lags), np.log(theory), 1)[0]
    assert expected == pytest.approx(2 * hurst, abs=0.2)
    error = slopes.std(ddof=1) / np.sqrt(40)
    assert abs(slopes.mean() - expected) < scipy.stats.t(39).ppf(1 - 0.5e-4) * error + 0.01
    assert error < 0.05


@pytest.mark.parametrize(
    "options",
    [
        {"hurst": 1.0},
        {"hurst": 0.0},
        {"longest": 1.0},
        {"count": 1},
        {"sigma": 0.0},
        {"shortest": -1.0},
    ],
)
def test_bad_self_affine_profiles(options):
    with pytest.raises(DeviationError, match=r"^FromSpectrum"):
        FromSpectrum.self_affine(**({"sigma": 0.01, "hurst": 0.5, "longest": 40, "shortest": 1} | options))


def test_textures_on_curved_features():
    shaft = tube(20.0, 40.0, h=3.0)
    for model in (
        Waviness(0.01, 10.0, angle=1.0),
        FromSpectrum([0.01, 0.05], [1e-4, 1e-5]),
        Modes([0.01], first=2),
    ):
        assert np.isfinite(model.sample(shaft, size=2, rng=1)).all()
