"""Fields by the Laplace-Beltrami operator: sphere, plane, thin walls; the sparse Cholesky."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import eval_legendre, j0
from surfaces import ball, covariance_at, covariance_of, plane, rounded_slab, tube

from cadskin.deviation import GaussianField, correlation
from cadskin.deviation import _surface as surface_module
from cadskin.deviation._patches import is_thin, patch_points
from cadskin.deviation._probes import probe_groups
from cadskin.deviation._surface import SurfaceField, spectral_polynomial
from cadskin.deviation.kernels import smoothness
from cadskin.errors import DeviationError

RADIUS = 20.0


def sphere_correlation(cosine, length, kernel):
    """Sum over spherical harmonics: the operator's kernel on the sphere in closed form."""
    degree = np.arange(300)
    s = degree * (degree + 1) / RADIUS**2 * length**2
    nu = smoothness(kernel)
    density = np.exp(-s / 2) if np.isinf(nu) else (1 + s / (2 * nu)) ** -(nu + 1)
    terms = [(2 * k + 1) * density[k] * eval_legendre(k, cosine) for k in degree]
    return sum(terms) / ((2 * degree + 1) * density).sum()


def sphere_error(length, kernel, count):
    part = ball(RADIUS, count)
    sampler = GaussianField(1.0, length, kernel, metric="surface").prepare(part)
    covariance = covariance_of(sampler)
    assert np.abs(np.diag(covariance) - 1).max() < 1e-5
    points = part.surface.points[part.samples.vertex_ids]
    cosine = np.clip(points[:5] @ points.T / RADIUS**2, -1, 1)
    return np.abs(covariance[:5] - sphere_correlation(cosine, length, kernel)).max()


@pytest.mark.parametrize("kernel", ["squared_exponential", "matern52", "matern32", "whittle"])
def test_closed_form_on_the_sphere(kernel):
    assert sphere_error(20.0, kernel, 1200) < 1.6e-2


def test_the_error_falls_with_the_mesh():
    """Linear elements: second order in the edge length, 4 times more points -> 4 times less error."""
    coarse, fine = (sphere_error(15.0, "squared_exponential", count) for count in (300, 1200))
    assert fine < 0.35 * coarse


@pytest.mark.parametrize(
    ("kernel", "limit"),
    [
        ("squared_exponential", 8e-4),
        ("matern52", 6e-4),
        ("matern32", 1.5e-3),
        ("whittle", 1e-3),
        ("exponential", 6e-3),
    ],
)
def test_spectral_polynomial_gives_the_kernel_of_the_plane(kernel, limit):
    """Correlation by the Hankel transform of the fitted density, against the kernel's own density."""
    pole, coefficients = spectral_polynomial(kernel)
    k = np.linspace(1e-4, 60, 60_000)
    w = 1 / (1 + pole * k**2)
    fitted = w * np.polynomial.chebyshev.chebval(2 * w - 1, coefficients)
    nu = smoothness(kernel)
    density = np.exp(-(k**2) / 2) if np.isinf(nu) else (1 + k**2 / (2 * nu)) ** -(nu + 1)
    waves = j0(np.outer(np.linspace(0, 5, 40), k)) * k
    found, truth = waves @ fitted**2, waves @ density
    assert np.abs(found / found[0] - truth / truth[0]).max() < limit


def test_inside_a_plane_it_is_the_kernel():
    part = plane((60.0, 60.0), h=1.5)
    points = part.surface.points[part.samples.vertex_ids]
    inside = np.flatnonzero((np.abs(points[:, :2] - 30) < 14).all(axis=1))[::7]
    for kernel, limit in (("squared_exponential", 1.5e-2), ("matern32", 4e-2)):
        covariance = covariance_at(GaussianField(1.0, 8.0, kernel, metric="surface").prepare(part), inside)
        distance = np.linalg.norm(points[inside][:, None] - points[inside][None], axis=2)
        assert np.abs(covariance - correlation(distance, 8.0, kernel)).max() < limit


def test_variance_is_even_up_to_edges_and_corners(monkeypatch):
    part = plane((60.0, 60.0), h=2.0)
    covariance = covariance_of(GaussianField(1.0, 10.0, "whittle", metric="surface").prepare(part))
    assert np.abs(np.diag(covariance) - 1).max() < 1e-5  # 2 at edges and 4 at corners without the cure
    monkeypatch.setattr(surface_module, "_ALL_PROBES", 10)
    sampler = GaussianField(1.0, 20.0, metric="surface").prepare(part)
    deviation = np.sqrt(np.diag(covariance_of(sampler)))
    assert np.quantile(np.abs(deviation - 1), 0.99) < 0.01
    assert np.abs(deviation - 1).max() < 0.03


def test_a_thin_wall_with_round_edges_is_not_coupled():
    slab = rounded_slab(thickness=2.0, length=40.0, width=30.0, h=2.0)
    (patch,) = patch_points(slab)
    assert is_thin(patch, 8.0)
    covariance = covariance_of(GaussianField(1.0, 8.0).prepare(slab))
    points = slab.surface.points[slab.samples.vertex_ids]
    top, bottom = slab.feature("top"), slab.feature("bottom")
    middle_top = top.start + int(np.argmin(np.abs(top.points - [20, 14, 1]).sum(axis=1)))
    middle_bottom = bottom.start + int(np.argmin(np.linalg.norm(bottom.points - points[middle_top], axis=1)))
    assert abs(covariance[middle_top, middle_bottom]) < 0.01
    euclidean = covariance_of(GaussianField(1.0, 8.0, metric="euclidean").prepare(slab))
    assert euclidean[middle_top, middle_bottom] > 0.9


def test_a_shaft_is_not_thin():
    (shaft,) = patch_points(tube(radius=5.0, height=40.0, h=1.5))
    assert not is_thin(shaft, 15.0)
    (sheet,) = patch_points(plane())
    assert not is_thin(sheet, 15.0)


def test_surface_metric_has_its_own_method():
    with pytest.raises(DeviationError, match="has its own method"):
        GaussianField(0.01, 15, metric="surface", method="vecchia").sample(plane())


def test_probe_groups_part_the_points():
    rng = np.random.default_rng(0)
    probes, points = rng.uniform(0, 40, (300, 3)), rng.uniform(0, 40, (2000, 3))
    groups = probe_groups(probes)
    assert (np.diff(groups.family) >= 0).all()
    for group in range(groups.count):
        mine = np.flatnonzero(groups.group == group)
        of_probe, of_point = groups.boxes(groups.family[group], points)
        assert len(set(of_probe[mine])) == len(mine)
        distance = np.linalg.norm(points[:, None] - probes[mine][None], axis=2)
        near = np.flatnonzero(distance.min(axis=1) < 3.0)
        assert np.array_equal(of_point[near], of_probe[mine][distance[near].argmin(axis=1)])


def test_batch_independence_on_the_surface():
    part = ball(20.0, 700)
    model = GaussianField(0.01, 15, metric="surface")
    many = model.sample(part, size=40, rng=3)
    assert np.array_equal(many[:2], model.sample(part, size=2, rng=3))


def test_field_needs_an_area():
    with pytest.raises(Exception, match="degenerate"):
        SurfaceField(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]), "whittle")
