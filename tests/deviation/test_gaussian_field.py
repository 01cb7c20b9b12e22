"""Gaussian fields: the exact covariance of the linear sampler against the kernel."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import covariance_at, covariance_of, plane, rounded_slab, tube, two_planes

from cadskin.deviation import GaussianField, correlation
from cadskin.errors import CadskinWarning, DeviationError

SIGMA = 0.01


def expected(points, length, kernel):
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    return SIGMA**2 * correlation(distance, length, kernel)


def relative_error(model, part):
    sampler = model.prepare(part)
    points = part.surface.points[part.samples.vertex_ids]
    rows = np.unique(np.linspace(0, part.n_samples - 1, 400).astype(int))
    found = covariance_at(sampler, rows)
    return np.abs(found - expected(points[rows], model.length, model.kernel)).max() / SIGMA**2


@pytest.fixture(scope="module")
def coarse():
    return plane((60.0, 40.0), h=2.5)


@pytest.fixture(scope="module")
def fine():
    return plane((60.0, 40.0), h=1.0)


@pytest.mark.parametrize("kernel", ["squared_exponential", "matern52", "matern32", "whittle", "exponential"])
def test_dense_route_is_exact(coarse, kernel):
    assert relative_error(GaussianField(SIGMA, 12, kernel), coarse) < 2e-6


@pytest.mark.parametrize(
    ("method", "kernel", "length", "limit"),
    [
        ("karhunen_loeve", "squared_exponential", 12.0, 2e-4),
        ("karhunen_loeve", "matern52", 30.0, 2e-4),
        ("grid", "squared_exponential", 12.0, 1e-3),
        ("two_level", "squared_exponential", 12.0, 1e-3),
        ("two_level", "matern52", 12.0, 5e-3),
        ("vecchia", "squared_exponential", 8.0, 1e-2),
    ],
)
def test_large_routes(fine, method, kernel, length, limit):
    model = GaussianField(SIGMA, length, kernel, method=method)
    assert relative_error(model, fine) < limit


@pytest.mark.parametrize("kernel", ["squared_exponential", "matern52", "matern32", "exponential"])
def test_the_chosen_route_keeps_the_promise(fine, kernel):
    """Standard deviation within 1 %, correlations within 1e-2, 1e-3 for the smoothest kernel."""
    model = GaussianField(SIGMA, 10.0, kernel)
    assert relative_error(model, fine) < (1e-3 if kernel == "squared_exponential" else 1e-2)
    sampler = model.prepare(fine)
    variance = np.diag(covariance_at(sampler, np.arange(0, fine.n_samples, 7)))
    assert np.abs(np.sqrt(variance) / SIGMA - 1).max() < 0.01


@pytest.mark.parametrize(
    ("kernel", "limit"), [("matern52", 1.6e-3), ("matern32", 6e-3), ("whittle", 6e-3), ("exponential", 1e-2)]
)
@pytest.mark.parametrize(("h", "length"), [(0.5, 12.0), (1.0, 4.0)])
def test_many_and_few_vertices_per_length(kernel, limit, h, length):
    """The sequential sampler asks few neighbours where the points are close, many where they are not."""
    part = plane((60.0, 40.0), h=h)
    model = GaussianField(SIGMA, length, kernel)
    assert "Vecchia" in model.prepare(part).notes[0]
    assert relative_error(model, part) < limit


def test_the_cylinder_has_the_chord_distance():
    part = tube(radius=20.0, height=30.0, h=3.0)
    assert relative_error(GaussianField(SIGMA, 12.0), part) < 2e-4
    found = covariance_of(GaussianField(SIGMA, 30.0).prepare(part))
    points = part.surface.points[part.samples.vertex_ids]
    other = int(np.argmin(points[:, 0]))  # the far side
    angle = np.arctan2(points[0, 1], points[0, 0]) - np.arctan2(points[other, 1], points[other, 0])
    squared = (2 * 20.0 * np.sin(angle / 2)) ** 2 + (points[0, 2] - points[other, 2]) ** 2
    assert found[0, other] == pytest.approx(SIGMA**2 * np.exp(-squared / 1800), rel=1e-4)


def test_a_wall_is_not_crossed_and_a_round_is():
    wall = two_planes()
    covariance = covariance_of(GaussianField(SIGMA, 15).prepare(wall))
    low, high = (wall.feature(name).rows for name in ("low", "high"))
    assert np.abs(covariance[low, high]).max() == 0.0
    slab = rounded_slab(thickness=20.0, h=4.0)
    field = GaussianField(SIGMA, 15).sample(slab, size=20, rng=1)
    top, left = slab.feature("top"), slab.feature("left")
    shared = np.intersect1d(top.vertex_ids, left.vertex_ids)
    assert len(shared) > 5
    for vertex in shared:
        a = top.start + int(np.flatnonzero(top.vertex_ids == vertex)[0])
        b = left.start + int(np.flatnonzero(left.vertex_ids == vertex)[0])
        assert np.array_equal(field[:, a], field[:, b])


def test_statistics_of_samples(coarse):
    """Monte Carlo on top of the exact check: error level 1e-4 per number (4 standard errors, fixed seed)."""
    count = 4000
    values = GaussianField(SIGMA, 12, "matern32").sample(coarse, size=count, rng=5)
    assert np.abs(values.mean(axis=0)).max() < 5 * SIGMA / np.sqrt(count)
    assert np.abs(values.var(axis=0) / SIGMA**2 - 1).max() < 5 * np.sqrt(2 / count)
    standard = values[:, ::97].ravel() / SIGMA
    assert abs((standard**4).mean() - 3) < 0.4


def test_sigma_per_sample_and_by_function(coarse):
    sigma = np.linspace(0.01, 0.03, coarse.n_samples)
    by_array = covariance_of(GaussianField(sigma, 12).prepare(coarse))
    assert np.allclose(np.sqrt(np.diag(by_array)), sigma, rtol=1e-5)
    by_function = covariance_of(GaussianField(lambda points: 0.01 + points[:, 0] * 1e-4, 12).prepare(coarse))
    x = coarse.surface.points[coarse.samples.vertex_ids][:, 0]
    assert np.allclose(np.sqrt(np.diag(by_function)), 0.01 + x * 1e-4, rtol=1e-5)


def test_restricted_to_a_feature_the_law_stays(coarse):
    wall = two_planes()
    covariance = covariance_of(GaussianField(SIGMA, 15).prepare(wall, [wall.feature("low")]))
    points = wall.feature("low").points
    assert (
        np.abs(
            covariance[wall.feature("low").rows, wall.feature("low").rows]
            - expected(points, 15, "squared_exponential")
        ).max()
        < 1e-9
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"sigma": 0, "length": 15}, "sigma must be greater than 0"),
        ({"sigma": -1, "length": 15}, "sigma must be greater than 0, got -1 mm"),
        ({"sigma": np.nan, "length": 15}, "sigma must be finite"),
        ({"sigma": 0.01, "length": 0}, "length must be greater than 0"),
        ({"sigma": 0.01, "length": np.inf}, "length must be finite"),
        ({"sigma": 0.01, "length": "wide"}, "must be a number"),
        ({"sigma": 0.01, "length": 15, "kernel": "gauss"}, "kernel 'gauss' is not known; there are squared"),
        ({"sigma": 0.01, "length": 15, "metric": "taxi"}, "metric must be one of"),
        ({"sigma": 0.01, "length": 15, "method": "magic"}, "method must be one of"),
        ({"sigma": [0.0, 0.0], "length": 15}, "more than 0 somewhere"),
    ],
)
def test_bad_parameters(arguments, message):
    with pytest.raises(DeviationError, match=message):
        GaussianField(**arguments)


def test_sigma_of_wrong_length(coarse):
    with pytest.raises(DeviationError, match="sigma has 3 values, the part has"):
        GaussianField([1.0, 2.0, 3.0], 12).sample(coarse)


def test_geodesic_squared_exponential_is_refused_on_curved_patches(coarse):
    with pytest.raises(DeviationError, match="not positive definite on a curved patch; use metric"):
        GaussianField(SIGMA, 15, metric="geodesic").sample(tube())
    assert GaussianField(SIGMA, 15, metric="geodesic").sample(coarse).shape == (1, coarse.n_samples)


def test_warnings_of_scale(coarse):
    with pytest.warns(CadskinWarning, match="acts as a shift"):
        values = GaussianField(SIGMA, 10_000).sample(coarse, rng=1)
    assert np.ptp(values) < 0.02 * SIGMA
    with pytest.warns(CadskinWarning, match=r"fewer than four vertices.*use edge_length=0.75"):
        GaussianField(SIGMA, 3.0).sample(coarse)


def test_anisotropy(coarse):
    """Three times longer along y: the kernel of the compressed distance."""
    model = GaussianField(SIGMA, 9.0, "matern32", anisotropy=3.0, direction=(0, 2, 0))
    found = covariance_of(model.prepare(coarse))
    points = coarse.surface.points[coarse.samples.vertex_ids] / [1, 3, 1]
    assert np.abs(found - expected(points, 9.0, "matern32")).max() < 1e-5 * SIGMA**2
    assert str(model).endswith("anisotropy=3, direction=(0.0, 2.0, 0.0))")
    with pytest.raises(DeviationError, match="direction must be three numbers"):
        GaussianField(SIGMA, 9.0, anisotropy=2.0, direction=(0, 0, 0))
    with pytest.raises(DeviationError, match="needs metric='euclidean'"):
        GaussianField(SIGMA, 9.0, anisotropy=2.0, metric="surface")
