"""Fields along the surface do not feel its free edges: exact covariance up to edges and corners."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay
from surfaces import ball, covariance_of, model_of, plane, tube

from cadskin.deviation import GaussianField, correlation
from cadskin.deviation._collar import boundary_loops, make_collar
from cadskin.deviation._surface import SurfaceField
from cadskin.shape import Plane


def covariance_and_distance(part, length, kernel):
    points = part.surface.points[part.samples.vertex_ids]
    covariance = covariance_of(GaussianField(1.0, length, kernel, metric="surface").prepare(part))
    assert np.abs(np.diag(covariance) - 1).max() < 1e-5
    return covariance, np.linalg.norm(points[:, None] - points[None], axis=2), points


@pytest.mark.parametrize("kernel", ["squared_exponential", "matern52", "matern32", "whittle", "exponential"])
def test_a_plane_has_the_kernel_up_to_its_edges_and_corners(kernel):
    """Without the collar the error is 0.1 (rough) to 0.3 (smooth)."""
    covariance, distance, _ = covariance_and_distance(plane((40.0, 32.0), h=1.6, jitter=0.2), 20.0, kernel)
    limit = 3e-2 if kernel in ("whittle", "exponential") else 2e-2
    assert np.abs(covariance - correlation(distance, 20.0, kernel)).max() < limit


@pytest.mark.slow
@pytest.mark.parametrize("kernel", ["squared_exponential", "matern32"])
def test_the_error_at_edges_falls_with_the_mesh(kernel):
    errors = []
    for h in (2.0, 1.0):
        covariance, distance, _ = covariance_and_distance(plane((40.0, 40.0), h=h, jitter=0.2), 20.0, kernel)
        errors.append(np.abs(covariance - correlation(distance, 20.0, kernel)).max())
    assert errors[1] < 0.7 * errors[0]
    assert errors[1] < 1.2e-2


def sheet(h=1.5, *, hole=0.0, notch=False):
    """A square of 60 mm with a round hole in its middle, or without a quarter: an L."""
    grid = np.linspace(0, 60, round(60 / h) + 1)
    x, y = (a.ravel() for a in np.meshgrid(grid, grid))
    free = (x > 0) & (x < 60) & (y > 0) & (y < 60) & ~(notch & ((x == 30) | (y == 30)))
    shake = 0.2 * h * free * np.random.default_rng(1).uniform(-1, 1, (2, len(x)))
    flat = np.column_stack([x, y]) + shake.T
    if hole:
        turn = np.arange(round(2 * np.pi * hole / h)) * h / hole
        rim = 30 + hole * np.column_stack([np.cos(turn), np.sin(turn)])
        flat = np.concatenate([flat[np.linalg.norm(flat - 30, axis=1) > hole + 0.6 * h], rim])
    triangles = Delaunay(flat).simplices.astype(np.int64)
    centre = flat[triangles].mean(axis=1)
    keep = np.linalg.norm(centre - 30, axis=1) > 0.99 * hole
    if notch:
        keep &= ~((centre[:, 0] > 30) & (centre[:, 1] > 30))
    sides = flat[triangles[:, 1:]] - flat[triangles[:, :1]]
    turned = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    triangles[turned < 0] = triangles[turned < 0][:, ::-1]
    triangles = triangles[keep & (np.abs(turned) > 1e-6)]
    used, numbered = np.unique(triangles, return_inverse=True)
    points = np.column_stack([flat[used], np.zeros(len(used))])
    up = np.tile([0.0, 0, 1], (len(used), 1))
    return model_of([(points, numbered.reshape(-1, 3), up, Plane([0, 0, 0], [0, 0, 1]), "sheet")])


@pytest.mark.parametrize("kernel", ["squared_exponential", "matern32"])
@pytest.mark.parametrize(("hole", "notch", "limit"), [(8.0, False, 0.04), (0.0, True, 0.07)])
def test_holes_and_concave_corners(kernel, hole, notch, limit):
    """Between points that see each other the kernel holds; the limit is that of 7 vertices per length."""
    covariance, distance, points = covariance_and_distance(sheet(2.0, hole=hole, notch=notch), 14.0, kernel)
    edge = 30.0 if notch else 22.0
    left, low = points[:, 0] <= edge, points[:, 1] <= edge
    see = (left[:, None] & left) | (low[:, None] & low)
    assert np.abs(covariance - correlation(distance, 14.0, kernel))[see].max() < limit


@pytest.mark.parametrize(
    ("kernel", "limit"), [("squared_exponential", 0.02), ("matern32", 0.04), ("exponential", 0.04)]
)
def test_the_mantle_of_a_shaft_up_to_its_ends(kernel, limit):
    """Closed form: the kernel of the plane, wrapped around."""
    part = tube(12.0, 36.0, 1.8)
    covariance, _, points = covariance_and_distance(part, 9.0, kernel)
    angle = np.arctan2(points[:, 1], points[:, 0])
    around = 12.0 * np.angle(np.exp(1j * (angle[:, None] - angle)))
    along = points[:, 2][:, None] - points[:, 2]
    turns = 2 * np.pi * 12.0 * np.arange(-2, 3)
    truth = sum(correlation(np.hypot(around + turn, along), 9.0, kernel) for turn in turns)
    at_zero = sum(correlation(np.abs(turn), 9.0, kernel) for turn in turns)
    assert np.abs(covariance - truth / at_zero).max() < limit


def test_the_collar_of_a_rectangle_continues_the_plane():
    """Area of everything within a distance of a convex outline: length times distance + pi distance²."""
    part = plane((12.0, 8.0), h=1.0, jitter=0.0)
    points, triangles = part.surface.points, part.surface.triangles
    collar = make_collar(points, triangles, np.full(len(points), 3.0))
    _, mass, edge = collar.operators(len(points) + len(collar.origin))
    assert mass.sum() == pytest.approx(40 * 3 + np.pi * 9, rel=1e-9)
    assert edge.sum() == pytest.approx(40 + 2 * np.pi * 3, rel=1e-9)
    assert collar.offsets.max() == pytest.approx(3.0)


def test_the_collar_of_a_hole_fills_it():
    part = sheet(2.0, hole=8.0)
    points, triangles = part.surface.points, part.surface.triangles
    assert sorted(len(loop) for loop in boundary_loops(triangles)) == [25, 120]
    collar = make_collar(points, triangles, np.full(len(points), 20.0))
    inside = np.isin(collar.origin, np.flatnonzero(np.linalg.norm(points - [30, 30, 0], axis=1) < 8.5))
    assert collar.offsets[inside].max() < 8.0
    _, mass, _ = collar.operators(len(points) + len(collar.origin))
    filled = mass.sum() - (240 * 20 + np.pi * 400)
    assert filled == pytest.approx(np.pi * 64, rel=0.1)


def test_closed_and_branching_surfaces_have_no_collar():
    sphere = ball(5.0, 200)
    assert make_collar(sphere.surface.points, sphere.surface.triangles, np.ones(200)) is None
    fan = np.array([[0, 1, 2], [0, 3, 4]])  # two triangles that meet in a point
    assert boundary_loops(fan) == []
    square = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]])
    field = SurfaceField(square, fan, "whittle")
    assert field.latent == 5


def test_large_meshes_keep_the_standard_deviation(monkeypatch):
    """Probes and kriging, as for more than 8000 points, against the exact row norms."""
    part = plane((60.0, 60.0), h=2.0, jitter=0.2)
    for kernel in ("squared_exponential", "matern32", "exponential"):
        monkeypatch.setattr("cadskin.deviation._surface._ALL_PROBES", 10)
        sampler = GaussianField(1.0, 14.0, kernel, metric="surface").prepare(part)
        deviation = np.sqrt(np.diag(covariance_of(sampler)))
        assert np.quantile(np.abs(deviation - 1), 0.99) < 0.01, kernel
