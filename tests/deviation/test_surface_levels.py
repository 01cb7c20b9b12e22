"""Surface fields on fine meshes, made in a coarse space: log maps, law, variance, choice of route."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import eval_legendre
from surfaces import ball, covariance_at, plane, rounded_slab, tube

from cadskin.deviation import GaussianField, correlation
from cadskin.deviation._log_maps import spread_nodes, vertex_fans
from cadskin.deviation._surface import SurfaceField
from cadskin.deviation._surface_levels import SurfaceLevelsField, surface_field
from cadskin.deviation.kernels import smoothness

CARRIED = ["squared_exponential", "matern52", "matern32", "whittle"]


def log_maps(part, spacing):
    points, triangles = part.surface.points, part.surface.triangles
    corners = points[triangles]
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    fans = vertex_fans(len(points), triangles, sides)
    maps = spread_nodes(fans, np.full(len(points), spacing), np.zeros(len(points)))
    return maps, np.repeat(np.arange(len(points)), np.diff(maps.starts))


def test_log_maps_on_a_plane_are_exact():
    part = plane((40.0, 30.0), h=1.0)
    maps, vertex = log_maps(part, 3.0)
    points = part.surface.points
    distance = np.linalg.norm(points[vertex] - points[maps.nodes[maps.seen]], axis=1)
    assert np.abs(np.abs(maps.places) - distance).max() < 1e-12
    within = np.bincount(vertex[distance < 3.0], minlength=len(points))
    assert within.min() >= 1  # every vertex has a node within the spacing
    apart = np.linalg.norm(points[maps.nodes][:, None] - points[maps.nodes], axis=2)
    assert apart[apart > 0].min() >= 3.0


def test_log_maps_unroll_a_cylinder():
    part = tube(10.0, 30.0, 0.6)
    maps, vertex = log_maps(part, 3.0)
    angle = np.arctan2(part.surface.points[:, 1], part.surface.points[:, 0])
    node = maps.nodes[maps.seen]
    around = 10.0 * np.angle(np.exp(1j * (angle[vertex] - angle[node])))
    way = np.hypot(around, part.surface.points[vertex, 2] - part.surface.points[node, 2])
    assert np.abs(np.abs(maps.places) - way).max() < 5e-3


def test_log_maps_on_a_sphere_fall_with_the_mesh():
    errors = []
    for count in (2000, 8000):
        part = ball(10.0, count)
        maps, vertex = log_maps(part, 3.0)
        points = part.surface.points
        chord = np.linalg.norm(points[vertex] - points[maps.nodes[maps.seen]], axis=1)
        errors.append(np.sqrt(np.mean((np.abs(maps.places) - 20.0 * np.arcsin(chord / 20.0)) ** 2)))
    assert errors[1] < errors[0] < 3e-2


def test_log_maps_stay_on_one_side_of_a_thin_wall():
    part = rounded_slab(thickness=2.0, length=40.0, width=30.0, h=1.0)
    maps, vertex = log_maps(part, 3.0)
    height, run = part.surface.points[:, 2], part.surface.points[:, 0]
    node = maps.nodes[maps.seen]
    inside = np.abs(run[vertex] - 20.0) < 10.0
    assert (height[vertex] * height[node])[inside].min() > 0


def test_surfaces_that_are_no_manifold_have_no_fans():
    fan = np.array([[0, 1, 2], [0, 3, 4]])
    assert vertex_fans(5, fan, np.ones((2, 3))) is None
    book = np.array([[0, 1, 2], [0, 1, 3]])
    assert vertex_fans(4, book, np.ones((2, 3))) is None


def carried_field(part, length, kernel):
    sampler = GaussianField(1.0, length, kernel, metric="surface").prepare(part)
    (unit,) = sampler.fields
    assert isinstance(unit, SurfaceLevelsField)
    assert unit.latent < 0.5 * part.n_samples
    return sampler


@pytest.mark.parametrize(
    ("kernel", "limit"),
    [("squared_exponential", 1.5e-3), ("matern52", 1.5e-3), ("matern32", 1e-2), ("whittle", 1e-2)],
)
def test_closed_form_on_the_sphere(kernel, limit):
    part, radius, length = ball(20.0, 4000), 20.0, 18.0
    rows = np.arange(0, part.n_samples, 13)
    covariance = covariance_at(carried_field(part, length, kernel), rows)
    assert np.abs(np.diag(covariance) - 1).max() < 5e-3
    degree = np.arange(300)
    s, nu = degree * (degree + 1) / radius**2 * length**2, smoothness(kernel)
    density = np.exp(-s / 2) if np.isinf(nu) else (1 + s / (2 * nu)) ** -(nu + 1)
    points = part.surface.points[part.samples.vertex_ids][rows]
    cosine = np.clip(points @ points.T / radius**2, -1, 1)
    truth = sum((2 * k + 1) * density[k] * eval_legendre(k, cosine) for k in degree)
    truth /= ((2 * degree + 1) * density).sum()
    error = np.abs(covariance - truth)
    print(kernel, error.max())
    assert error.max() < limit


@pytest.mark.parametrize(
    ("kernel", "limit"),
    [("squared_exponential", 1.5e-3), ("matern52", 1.5e-3), ("matern32", 1e-2), ("whittle", 1e-2)],
)
def test_a_plane_has_the_kernel_up_to_its_edges_and_corners(kernel, limit):
    part, length = plane((40.0, 32.0), h=0.8, jitter=0.2), 14.0
    sampler = carried_field(part, length, kernel)
    rows = np.arange(0, part.n_samples, 3)
    covariance = covariance_at(sampler, rows)
    assert np.abs(np.diag(covariance) - 1).max() < 5e-3
    points = part.surface.points[part.samples.vertex_ids][rows]
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    error = np.abs(covariance - correlation(distance, length, kernel))
    print(kernel, error.max())
    assert error.max() < limit


@pytest.mark.parametrize(("kernel", "limit"), [("squared_exponential", 1.5e-3), ("matern32", 1e-2)])
def test_the_mantle_of_a_shaft_up_to_its_ends(kernel, limit):
    """Closed form: the kernel of the plane, wrapped around."""
    part, radius, length = tube(12.0, 36.0, 1.0), 12.0, 12.0
    rows = np.arange(0, part.n_samples, 4)
    covariance = covariance_at(carried_field(part, length, kernel), rows)
    points = part.surface.points[part.samples.vertex_ids][rows]
    angle = np.arctan2(points[:, 1], points[:, 0])
    around = radius * np.angle(np.exp(1j * (angle[:, None] - angle)))
    along = points[:, 2][:, None] - points[:, 2]
    turns = 2 * np.pi * radius * np.arange(-2, 3)
    truth = sum(correlation(np.hypot(around + turn, along), length, kernel) for turn in turns)
    truth /= sum(correlation(np.abs(turn), length, kernel) for turn in turns)
    print(kernel, np.abs(covariance - truth).max())
    assert np.abs(covariance - truth).max() < limit


def test_a_thin_wall_with_round_edges_is_not_coupled():
    slab = rounded_slab(thickness=2.0, length=40.0, width=30.0, h=0.9)
    sampler = carried_field(slab, 12.0, "squared_exponential")
    points = slab.surface.points[slab.samples.vertex_ids]
    top = slab.feature("top")
    bottom = slab.feature("bottom")
    row = top.start + int(np.argmin(np.abs(top.points - [20, 14, 1]).sum(axis=1)))
    below = bottom.start + int(np.argmin(np.linalg.norm(bottom.points - points[row], axis=1)))
    beside = top.start + int(np.argmin(np.abs(top.points - [24, 14, 1]).sum(axis=1)))
    covariance = covariance_at(sampler, np.array([row, below, beside]))
    assert abs(covariance[0, 1]) < 0.01
    step = np.linalg.norm(points[row] - points[beside])
    assert covariance[0, 2] == pytest.approx(float(correlation(np.array(step), 12.0)), abs=0.01)


def test_batch_independence():
    part = ball(20.0, 3000)
    model = GaussianField(0.01, 18, "matern32", metric="surface")
    many = model.sample(part, size=40, rng=3)
    assert np.array_equal(many[:2], model.sample(part, size=2, rng=3))
    assert np.array_equal(many[33:34], model.sample(part, size=34, rng=3)[33:])
    assert np.isfinite(many).all()


def test_coarse_meshes_and_the_exponential_keep_all_points():
    part = ball(20.0, 3000)
    points, triangles = part.surface.points, part.surface.triangles
    assert isinstance(surface_field(points / 18, triangles, "exponential"), SurfaceField)
    assert isinstance(surface_field(points / 4, triangles, "whittle"), SurfaceField)
    assert isinstance(surface_field(points / 18, triangles, "matern32"), SurfaceLevelsField)
