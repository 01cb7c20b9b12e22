"""Rigid and low-order defects, and deviations from outside."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import ball, plane, tube, two_planes

from cadskin.deviation import (
    Bend,
    FromArray,
    FromFE,
    FromFunction,
    Shift,
    SizeOffset,
    Taper,
    Thermal,
    Tilt,
    Torsor,
    Twist,
    from_dict,
)
from cadskin.errors import DeviationError


@pytest.fixture(scope="module")
def shaft():
    return tube(radius=20.0, height=60.0, h=4.0)


def rows_of(part):
    return part.surface.points[part.samples.vertex_ids], part.samples.normals


def test_shift_and_torsor(shaft):
    _, normals = rows_of(shaft)
    assert np.allclose(Shift((0.01, 0.02, 0.03)).sample(shaft)[0], normals @ [0.01, 0.02, 0.03])
    both = Torsor((0.01, 0, 0), (0, 1e-3, 0), centre=(0, 0, 30)).sample(shaft)
    apart = Shift((0.01, 0, 0)) + Tilt(1e-3, (0, 1, 0), centre=(0, 0, 30))
    assert np.allclose(both, apart.sample(shaft))


def test_tilt_of_a_plane_turns_about_its_centroid():
    sheet = plane((120.0, 80.0))
    points, _ = rows_of(sheet)
    assert np.allclose(Tilt(1e-3, (0, 1, 0)).sample(sheet)[0], -1e-3 * (points[:, 0] - 60))


def test_a_rotation_about_its_axis_leaves_a_cylinder(shaft):
    assert np.abs(Tilt(0.01, (0, 0, 1)).sample(shaft)).max() < 1e-15
    assert np.abs(Twist(0.01, (0, 0, 1)).sample(shaft)).max() < 1e-15
    assert np.abs(Tilt(0.01, (0, 0, 1), centre=(1, 0, 0)).sample(shaft)).max() > 1e-3


def test_size_and_taper(shaft):
    assert (SizeOffset(-0.02).sample(shaft) == -0.02).all()
    points, _ = rows_of(shaft)
    assert np.allclose(Taper(0.06).sample(shaft)[0], 0.001 * (points[:, 2] - 30))


def test_bend_is_a_bow(shaft):
    points, normals = rows_of(shaft)
    values = Bend(0.1, axis=(0, 0, 1), direction=(1, 0, 0)).sample(shaft)[0]
    s = (points[:, 2] - 30) / 60
    assert np.allclose(values, normals[:, 0] * 0.1 * (1 - 4 * s**2))


def test_twist_of_a_plane():
    sheet = plane((120.0, 80.0))
    points, _ = rows_of(sheet)
    values = Twist(0.002, (1, 0, 0)).sample(sheet)[0]
    assert np.allclose(values, 0.002 * (points[:, 0] - 60) / 120 * (points[:, 1] - 40))


def test_thermal_growth_of_a_ball():
    part = ball(20.0, 300)
    assert np.allclose(Thermal(50, alpha=1e-5, centre=(0, 0, 0)).sample(part), 20 * 50e-5)


def test_thermal_gradient_bends_a_plate_to_the_known_curvature():
    """A through-thickness gradient g gives the curvature alpha g, and no stress: strain = alpha T."""
    model = Thermal(0, alpha=1e-5, gradient=(0, 0, 2.0), centre=(0, 0, 0))
    step = 1e-4
    for p in (np.array([3.0, -2.0, 1.0]), np.array([0.0, 4.0, -2.0])):
        jacobian = np.stack(
            [
                (
                    model.displacement((p + step * e)[None], np.zeros(3))
                    - model.displacement((p - step * e)[None], np.zeros(3))
                )[0]
                / (2 * step)
                for e in np.eye(3)
            ],
            axis=1,
        )
        strain = 0.5 * (jacobian + jacobian.T)
        assert np.allclose(strain, 1e-5 * 2.0 * p[2] * np.eye(3), atol=1e-12)
    line = np.column_stack([np.linspace(-10, 10, 3), np.zeros(3), np.zeros(3)])
    z = model.displacement(line, np.zeros(3))[:, 2]
    assert (z[0] - 2 * z[1] + z[2]) / 100 == pytest.approx(-1e-5 * 2.0)


def test_from_function(shaft):
    model = FromFunction(lambda points, normals: 1e-3 * points[:, 2])
    points, _ = rows_of(shaft)
    assert np.allclose(model.sample(shaft)[0], 1e-3 * points[:, 2])
    with pytest.raises(DeviationError, match="on mantle the function returned"):
        FromFunction(lambda points, normals: np.zeros(3)).sample(shaft)
    with pytest.raises(DeviationError, match="cannot be written"):
        model.to_dict()


def test_from_array(shaft):
    values = np.arange(shaft.n_samples, dtype=float)
    assert np.array_equal(FromArray(values).sample(shaft, size=2), [values, values])
    several = FromArray(np.stack([values, -values])).sample(shaft, size=50, rng=1)
    assert {tuple(np.sign(row[1:2])) for row in several} == {(1.0,), (-1.0,)}
    with pytest.raises(DeviationError, match="3 values, the part has"):
        FromArray([1.0, 2, 3]).sample(shaft)
    assert from_dict(FromArray([1.0, 2.0]).to_dict()) == FromArray([1.0, 2.0])


def test_from_finite_elements(shaft):
    moved = np.random.default_rng(0).standard_normal((shaft.surface.n_points, 3))
    _, normals = rows_of(shaft)
    truth = (normals * moved[shaft.samples.vertex_ids]).sum(axis=1)
    assert np.allclose(FromFE(moved).sample(shaft)[0], truth)
    with pytest.raises(DeviationError, match="the mesh has"):
        FromFE(moved[:5]).sample(shaft)


def test_restriction_moves_the_centre():
    wall = two_planes()
    values = Tilt(1e-3, (0, 1, 0)).on("high").sample(wall)[0]
    assert (values[wall.feature("low").rows] == 0).all()
    assert abs(values[wall.feature("high").rows].max() + values[wall.feature("high").rows].min()) < 1e-12


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: Shift((1, 2)), "vector must be three numbers"),
        (lambda: Tilt(0.1, (0, 0, 0)), "axis must not be zero"),
        (lambda: Thermal(np.nan), "delta_T must be finite"),
        (lambda: FromArray([np.nan]), "NaN"),
        (lambda: Bend(0.1, direction=(0, np.inf, 0)), "direction must be finite"),
    ],
)
def test_bad_parameters(build, message):
    with pytest.raises(ValueError, match=message):
        build()


@pytest.mark.parametrize(
    "model",
    [
        Shift((0.0, 0.0, 0.1)),
        Tilt(1e-3, (1, 1, 0)),
        Torsor((1, 0, 0), (0, 0, 1e-3), (1, 2, 3)),
        SizeOffset(0.1),
        Taper(0.1),
        Bend(0.1),
        Twist(0.1),
        Thermal(10, gradient=(0, 0, 1.0)),
    ],
    ids=lambda m: type(m).__name__,
)
def test_round_trip(model):
    assert from_dict(model.to_dict()) == model
