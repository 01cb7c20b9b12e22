"""Karhunen-Loeve expansion, eigenfunctions, waves, spectra, fractal surfaces."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import ball, covariance_at, covariance_of, plane, tube

from cadskin.deviation import Fractal, FromSpectrum, GaussianField, KarhunenLoeve, Modes, Waviness, from_dict
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


def test_textures_on_curved_features():
    shaft = tube(20.0, 40.0, h=3.0)
    for model in (
        Waviness(0.01, 10.0, angle=1.0),
        FromSpectrum([0.01, 0.05], [1e-4, 1e-5]),
        Modes([0.01], first=2),
    ):
        assert np.isfinite(model.sample(shaft, size=2, rng=1)).all()
