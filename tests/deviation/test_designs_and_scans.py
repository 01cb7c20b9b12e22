"""Designs over parameters, and deviations read off a scan."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats
from surfaces import plane, tube, two_planes

from cadskin.deviation import (
    BasisForm,
    FromScan,
    GaussianField,
    Paraboloid,
    Randomised,
    WhiteNoise,
    parameter_design,
    with_parameter,
)
from cadskin.deviation._point_cells import point_cells
from cadskin.deviation.scan import _around_normal
from cadskin.errors import DeviationError
from cadskin.shape._tangents import fill_tangents

MODEL = Paraboloid(0.05).on(">Z") + 2 * GaussianField(0.01, 12)
RANGES = {
    "terms.0.model.amplitude": stats.uniform(0.01, 0.09),
    "terms.1.model.length": stats.lognorm(0.4, scale=12.0),
    "terms.1.factor": stats.norm(1.0, 0.1),
}


def test_a_latin_hypercube_has_one_run_in_every_stratum():
    design = parameter_design(MODEL, RANGES, size=50, rng=3)
    assert design.names == tuple(RANGES)
    for k, law in enumerate(RANGES.values()):
        strata = np.floor(law.cdf(design.values[:, k]) * 50 + 1e-9)
        assert sorted(strata) == list(range(50))
    for row, model in zip(design.values, design.models, strict=True):
        assert model.terms[0].model.amplitude == row[0]
        assert model.terms[1].model.length == row[1]
        assert model.terms[1].factor == row[2]


def test_a_sobol_design_is_more_even_than_chance():
    one, two = (
        parameter_design(MODEL, RANGES, size=64, method=method, rng=3) for method in ("sobol", "random")
    )
    defects = []
    for design in (one, two):
        unit = np.column_stack([law.cdf(design.values[:, k]) for k, law in enumerate(RANGES.values())])
        defects.append(stats.qmc.discrepancy(unit))
    assert defects[0] < 0.3 * defects[1]


def test_designs_repeat():
    runs = [parameter_design(MODEL, RANGES, size=10, method=m, rng=5) for m in ("sobol", "sobol")]
    assert np.array_equal(runs[0].values, runs[1].values)
    assert runs[0].models == runs[1].models
    assert len(runs[0]) == 10


def test_paths_into_tables():
    model = BasisForm("dct", {"1,0": 0.1, "2,2": 0.3})
    assert with_parameter(model, "coefficients.2,2", 0.5) == BasisForm("dct", {"1,0": 0.1, "2,2": 0.5})


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("lenght", "there is terms"),
        ("terms.2.model", "there is 0, 1"),
        ("terms.1.factor.x", "there is a number"),
    ],
)
def test_paths_that_lead_nowhere(path, message):
    with pytest.raises(DeviationError, match=message):
        with_parameter(MODEL, path, 1.0)


def test_bad_designs():
    with pytest.raises(DeviationError, match="method"):
        parameter_design(MODEL, RANGES, size=8, method="halton")
    with pytest.raises(DeviationError, match="one run"):
        parameter_design(MODEL, RANGES, size=0)
    with pytest.raises(DeviationError, match="one parameter"):
        parameter_design(MODEL, {}, size=4)
    with pytest.raises(DeviationError, match="sigma must be greater"):
        parameter_design(WhiteNoise(1.0), {"sigma": stats.norm(-5, 0.1)}, size=4)


def scan_of(part, deviation, count, rng, noise=0.0):
    """Points of the deviated surface at random places on the triangles."""
    corners = part.surface.points[part.surface.triangles[rng.integers(part.surface.n_triangles, size=count)]]
    points = np.einsum("ki,kij->kj", rng.dirichlet([1, 1, 1], size=count), corners)
    return deviation(points) + rng.normal(0.0, noise, (count, 1)) * np.array([0, 0, 1.0])


def test_a_scanned_plane():
    part = plane((40.0, 30.0), h=2.0)

    def wave(points):
        return points + np.array([0, 0, 0.1]) * np.sin(points[:, :1] / 5.0)

    points = scan_of(part, wave, 20_000, np.random.default_rng(1))
    values = FromScan(points, reach=0.5).sample(part)[0]
    x = part.surface.points[part.samples.vertex_ids][:, 0]
    assert np.abs(values - 0.1 * np.sin(x / 5.0)).max() < 2e-4
    noisy = scan_of(part, wave, 20_000, np.random.default_rng(1), noise=0.01)
    few, many = (
        np.std(FromScan(noisy, reach=0.5, neighbours=k).sample(part)[0] - 0.1 * np.sin(x / 5.0))
        for k in (12, 60)
    )
    assert many < 0.7 * few < 0.01


def test_a_scanned_shaft():
    """The cloud lies on an exact cylinder of another radius: the deviation is the difference."""
    part = tube(10.0, 20.0, 1.5)
    rng = np.random.default_rng(2)
    angle, z = rng.uniform(0, 2 * np.pi, 20_000), rng.uniform(-0.5, 20.5, 20_000)
    points = np.column_stack([10.2 * np.cos(angle), 10.2 * np.sin(angle), z])
    assert np.allclose(FromScan(points, reach=0.5).sample(part)[0], 0.2, atol=1e-4)


def test_the_other_side_of_a_wall_is_left_out_and_gaps_are_told():
    wall = two_planes()
    rng = np.random.default_rng(3)
    points = scan_of(wall, lambda p: p, 20_000, rng)
    values = FromScan(points, reach=0.4).sample(wall)[0]
    assert np.abs(values).max() < 1e-9
    half = points[points[:, 0] < 30.0]
    with pytest.raises(DeviationError, match=r"does not cover \d+ of \d+ samples of low"):
        FromScan(half, reach=0.4).sample(wall)
    with pytest.raises(DeviationError, match="does not cover"):
        FromScan(np.zeros((20, 3)), reach=0.4).sample(wall)
    high_only = points[points[:, 2] > 0.5]
    assert np.abs(FromScan(high_only, reach=0.4).on("high").sample(wall)).max() < 1e-9


@pytest.mark.parametrize(("reach", "radius"), [(0.5, 0.1), (0.05, 0.3), (20.0, 0.2)])
def test_the_cells_miss_no_point(reach, radius):
    """All points of the cylinder about a normal, in any direction, against brute force."""
    rng = np.random.default_rng(6)
    points = rng.uniform(-1, 1, (5000, 3)) * [1.0, 2.0, 0.5]
    cloud = point_cells(points, 2 * radius)
    arrays = (cloud.points, cloud.grid, cloud.counts, cloud.starts, cloud.keys, cloud.cells)
    normals = [np.eye(3)[0], -np.eye(3)[1], np.array([0.6, 0.8, 0.0])]
    normals += [vector / np.linalg.norm(vector) for vector in rng.normal(size=(40, 3))]
    for normal in normals:
        axes, seen = np.zeros((3, 3)), np.zeros((10, 4))
        axes[2] = normal
        fill_tangents(normal, axes[0], axes[1])
        assert np.allclose(np.linalg.det(axes), 1.0)
        point = rng.uniform(-1.1, 1.1, 3)
        count = _around_normal(point, axes, arrays, np.array([reach, radius]), seen)
        local = (points - point) @ axes.T
        squared = (local[:, :2] ** 2).sum(axis=1)
        inside = (np.abs(local[:, 2]) <= reach) & (squared <= radius**2)
        assert count == inside.sum()
        nearest = np.sort(squared[inside])[:10]
        assert np.allclose(seen[: len(nearest), 0], nearest)


def test_a_dense_scan_is_fitted_exactly_where_it_is_a_quadric():
    """Second degree is in the fit: the deviation of a parabolic sheet comes back to rounding."""
    part = plane(h=4.0)
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-5, 125, 40_000), rng.uniform(-5, 85, 40_000)
    height = 0.05 + 1e-5 * (x - 60) ** 2 - 2e-5 * (y - 40) * (x - 60)
    found = FromScan(np.column_stack([x, y, height]), reach=0.3).sample(part)[0]
    u, v = part.surface.points[part.samples.vertex_ids, :2].T
    assert np.abs(found - (0.05 + 1e-5 * (u - 60) ** 2 - 2e-5 * (v - 40) * (u - 60))).max() < 1e-9


@pytest.mark.parametrize(
    ("frozen", "same"),
    [
        (stats.norm(1.0, 0.25), ("norm", (1.0, 0.25))),
        (stats.gamma(2.0, scale=0.5), ("gamma", (2.0, 0.0, 0.5))),
    ],
)
def test_frozen_distributions_are_named(frozen, same):
    """A spec file holds the name and the numbers."""
    given, named = Randomised(WhiteNoise(0.01), frozen), Randomised(WhiteNoise(0.01), *same)
    assert given == named
    assert np.array_equal(given.sample(plane(), size=3, rng=1), named.sample(plane(), size=3, rng=1))
    with pytest.raises(DeviationError, match="has its arguments already"):
        Randomised(WhiteNoise(0.01), frozen, (1.0,))
