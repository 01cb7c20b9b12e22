"""Fields by the Laplace-Beltrami operator: sphere, plane, thin walls; the sparse Cholesky."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.polynomial.legendre import legval
from scipy.special import j0
from surfaces import ball, correlation_rows, covariance_at, plane, rounded_slab, tube

from cadskin.deviation import GaussianField, _elements
from cadskin.deviation import _surface as surface_module
from cadskin.deviation._patches import is_thin, patch_points
from cadskin.deviation._probes import probe_groups
from cadskin.deviation._surface import SurfaceField, spectral_polynomial
from cadskin.deviation.kernels import smoothness
from cadskin.errors import DeviationError

RADIUS = 20.0


def sphere_correlation(cosine, length, kernel):
    """Sum over spherical harmonics: the operator's kernel on the sphere in closed form."""
    degree = np.arange(6000 if kernel == "exponential" else 400)
    s = degree * (degree + 1) / RADIUS**2 * length**2
    nu = smoothness(kernel)
    density = np.exp(-s / 2) if np.isinf(nu) else (1 + s / (2 * nu)) ** -(nu + 1)
    angle = np.linspace(0, np.pi, 1500)
    values = legval(np.cos(angle), (2 * degree + 1) * density)
    return np.interp(np.arccos(cosine), angle, values / ((2 * degree + 1) * density).sum())


def sphere_error(length, kernel, count):
    part = ball(RADIUS, count)
    sampler = GaussianField(1.0, length, kernel, metric="surface").prepare(part)
    rows = np.arange(0, count, max(1, count // 32))
    found = correlation_rows(sampler, rows)
    assert np.abs(found[np.arange(len(rows)), rows] - 1).max() < 1e-5
    points = part.surface.points[part.samples.vertex_ids]
    cosine = np.clip(points[rows] @ points.T / RADIUS**2, -1, 1)
    return np.abs(found - sphere_correlation(cosine, length, kernel)).max()


def test_rows_of_the_correlation_are_those_of_the_sampler():
    """The short way of these tests against the public one: the sampler applied to all unit vectors."""
    sampler = GaussianField(1.0, 20.0, "matern32", metric="surface").prepare(plane((16.0, 10.0), h=5.0))
    assert "quadratic" in sampler.notes[0]
    covariance = covariance_at(sampler, np.arange(sampler.n_samples))
    assert np.abs(correlation_rows(sampler, np.arange(sampler.n_samples)) - covariance).max() < 1e-5


# Largest error of the correlation that the goals allow, 1e-3 for smooth kernels and 1e-2 for rough ones.
GOALS = {
    "squared_exponential": 1e-3,
    "matern52": 1e-3,
    "matern32": 1e-2,
    "whittle": 1e-2,
    "exponential": 1e-2,
}


@pytest.mark.parametrize("kernel", GOALS)
def test_closed_form_on_the_sphere(kernel):
    """Five to six vertices per length."""
    assert sphere_error(20.0, kernel, 400) < GOALS[kernel]


@pytest.mark.slow
@pytest.mark.parametrize("kernel", GOALS)
@pytest.mark.parametrize(("length", "count"), [(20.0, 1200), (10.0, 800)])
def test_closed_form_on_finer_spheres(kernel, length, count):
    assert sphere_error(length, kernel, count) < GOALS[kernel]


def field_error(count, *, with_normals=True):
    """Error of the squared exponential, length 24 mm, at 32 points."""
    part = ball(RADIUS, count)
    points, triangles = part.surface.points, part.surface.triangles
    normals = points / RADIUS if with_normals else None
    field = SurfaceField(points / 24.0, triangles, "squared_exponential", normals=normals)
    place = field.place_of_point[:count].astype(int)
    loads = np.zeros((len(field.order), 32), dtype=np.float32)
    loads[place[:32], np.arange(32)] = 1.0
    response = field._coloured(field.mass @ field._coloured(loads))[place].T
    cosine = np.clip(points[:32] @ points.T / RADIUS**2, -1, 1)
    truth = sphere_correlation(cosine, 24.0, "squared_exponential")
    return np.abs(response * field.scale * field.scale[:32, None] - truth).max()


def test_the_error_falls_with_the_mesh():
    """Quadratic elements on curved triangles: 4 times more points leave less than a third of the error."""
    coarse, fine = field_error(80), field_error(320)
    assert coarse > 3e-3
    assert fine < 0.3 * coarse


def test_the_normals_tell_the_curvature_of_the_surface():
    """On facets alone the error is three times as large."""
    assert field_error(160, with_normals=False) > 3 * field_error(160)


@pytest.mark.parametrize(
    ("kernel", "limit"),
    [
        ("squared_exponential", 4e-4),
        ("matern52", 3e-4),
        ("matern32", 1.5e-3),
        ("whittle", 3e-4),
        ("exponential", 3e-3),
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


@pytest.mark.parametrize("per_length", [2.0, 4.0, 7.0, 14.0, 21.0, 30.0])
@pytest.mark.parametrize("kernel", GOALS)
def test_the_mesh_is_refined_until_it_is_enough(kernel, per_length):
    """Few vertices per length: quadratic elements, refined; many: linear ones."""
    level, quadratic, note = resolution_of(plane((20.0, 16.0), h=1.0, jitter=0.0), kernel, per_length)
    assert note == ""
    assert quadratic == (per_length < {"matern32": 13, "whittle": 17, "exponential": 54}.get(kernel, 25))
    least = {"exponential": 18.0 if level == 0 else 10.5, "whittle": 4.5, "matern52": 4.0}.get(kernel, 3.0)
    assert per_length * 2**level >= 0.9 * least
    if level and kernel != "exponential":
        assert per_length * 2 ** (level - 1) < 5.5


def resolution_of(part, kernel, per_length, local=1.0):
    points, triangles = part.surface.points / per_length, part.surface.triangles
    found = _elements._vertices_per_length(points, triangles, np.full(len(points), local))
    return _elements._resolution(found, len(triangles), kernel)


def test_a_mesh_too_large_to_refine_says_so(monkeypatch):
    part = plane((20.0, 16.0), h=1.0)
    monkeypatch.setattr(_elements, "_MOST", 8_000)
    level, quadratic, note = resolution_of(part, "exponential", 4.0)
    assert (level, quadratic) == (1, True)
    assert "less accurate" in note
    monkeypatch.setattr(_elements, "_MOST", 100)
    sampler = GaussianField(1.0, 8.0, "exponential", metric="surface").prepare(part)
    assert "linear elements (only 7." in sampler.notes[0]


def test_refinement_goes_by_the_local_length():
    assert resolution_of(plane((20.0, 16.0), h=1.0), "whittle", 7.0)[0] == 0
    assert resolution_of(plane((20.0, 16.0), h=1.0), "whittle", 7.0, local=0.5)[0] == 1


def test_probes_and_kriging_give_the_standard_deviation(monkeypatch):
    """The way of large meshes: exact at points some share of a length apart, kriged between."""
    monkeypatch.setattr(surface_module, "_WORK", 0)
    part = plane((60.0, 60.0), h=3.0, jitter=0.2)
    for kernel in ("squared_exponential", "matern52", "matern32", "whittle"):
        sampler = GaussianField(1.0, 20.0, kernel, metric="surface").prepare(part)
        (field,) = sampler.fields
        deviation = field.scale * np.sqrt(field._row_norms(np.arange(len(field.scale))))
        assert np.abs(deviation - 1).max() < 0.01, kernel


def test_a_thin_wall_with_round_edges_is_not_coupled():
    slab = rounded_slab(thickness=2.0, length=40.0, width=30.0, h=2.0)
    (patch,) = patch_points(slab)
    assert is_thin(patch, 8.0)
    points = slab.surface.points[slab.samples.vertex_ids]
    top, bottom = slab.feature("top"), slab.feature("bottom")
    middle_top = top.start + int(np.argmin(np.abs(top.points - [20, 14, 1]).sum(axis=1)))
    middle_bottom = bottom.start + int(np.argmin(np.linalg.norm(bottom.points - points[middle_top], axis=1)))
    (row,) = correlation_rows(GaussianField(1.0, 8.0).prepare(slab), [middle_top])
    assert abs(row[middle_bottom]) < 0.01
    euclidean = GaussianField(1.0, 8.0, metric="euclidean").prepare(slab)
    assert covariance_at(euclidean, [middle_top, middle_bottom])[0, 1] > 0.9


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
