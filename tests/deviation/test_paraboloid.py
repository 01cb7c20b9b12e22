"""The paraboloid: closed form, peak-to-valley, frame of the face."""

from __future__ import annotations

import numpy as np
import pytest
from surfaces import plane, tube

from cadskin.deviation import Paraboloid
from cadskin.deviation.coordinates import area_frame, surface_coordinates
from cadskin.errors import DeviationError


@pytest.fixture(scope="module")
def part():
    return plane((120.0, 80.0), h=4.0)


def points_of(part):
    return part.surface.points[part.samples.vertex_ids]


def test_closed_form_on_a_rectangle(part):
    x, y, _ = (points_of(part) - [60, 40, 0]).T
    values = Paraboloid(0.05).sample(part)[0]
    assert np.allclose(values, 0.05 * ((x**2 + y**2) - (x**2 + y**2).min()) / 5200.0, atol=2e-5)
    assert np.ptp(values) == pytest.approx(0.05, rel=1e-14)
    assert np.ptp(Paraboloid(-0.05).sample(part)) == pytest.approx(0.05, rel=1e-14)
    assert Paraboloid(-0.05).sample(part).max() < 1e-4


def test_ratio_centre_and_rotation(part):
    x, y, _ = (points_of(part) - [60, 40, 0]).T
    saddle = Paraboloid(0.1, ratio=-1.0).sample(part)[0]
    assert np.allclose(saddle, 0.1 * (x**2 - y**2) / np.ptp(x**2 - y**2), atol=1e-12)
    turned = Paraboloid(0.1, ratio=0.0, rotation=np.pi / 2).sample(part)[0]
    assert np.allclose(turned, 0.1 * y**2 / np.ptp(y**2), atol=1e-12)
    shifted = Paraboloid(0.1, ratio=0.0, centre=(10.0, 5.0)).sample(part)[0]
    assert np.allclose(shifted, 0.1 * (x - 10) ** 2 / np.ptp((x - 10) ** 2), atol=1e-12)


def test_on_a_cylinder_the_coordinates_are_arc_lengths():
    shaft = tube(radius=20.0, height=60.0, h=3.0, turn=np.pi / 2)
    coordinates = surface_coordinates(shaft.features[0])
    assert np.ptp(coordinates[:, 0]) == pytest.approx(20 * np.pi / 2)
    assert np.ptp(coordinates[:, 1]) == pytest.approx(60.0)
    assert np.abs(coordinates.max(axis=0) + coordinates.min(axis=0)).max() < 1e-9
    assert np.ptp(Paraboloid(0.05).sample(shaft)) == pytest.approx(0.05, rel=1e-14)


def test_a_full_turn_is_continuous_over_the_seam():
    shaft = tube(radius=20.0, height=20.0, h=1.0)
    values = Paraboloid(0.05).sample(shaft)[0]
    a, b = shaft.surface.edges.T
    assert np.abs(values[a] - values[b]).max() < 0.005  # 1 mm of 63 mm half turn


def test_the_frame_comes_from_area_not_from_vertices():
    """A mesh that is much finer in one corner has the same frame (its vertices have another mean)."""
    coarse = plane((120.0, 80.0), h=8.0)
    points = coarse.surface.points
    triangles = coarse.surface.triangles
    near = np.flatnonzero((points[triangles].mean(axis=1)[:, :2] < 30).all(axis=1))
    fine_points, fine_triangles = points, triangles
    for t in near:
        corner = len(fine_points)
        fine_points = np.vstack([fine_points, points[triangles[t]].mean(axis=0)])
        a, b, c = triangles[t]
        fine_triangles = np.vstack([fine_triangles, [[a, b, corner], [b, c, corner], [c, a, corner]]])
    fine_triangles = np.delete(fine_triangles, near, axis=0)
    frame = area_frame(fine_points, fine_triangles, np.array([0.0, 0, 1]))
    assert np.allclose(frame.centroid, [60, 40, 0], atol=1e-9)
    assert np.allclose(frame.axes, np.eye(3), atol=1e-9)
    assert frame.area == pytest.approx(9600)
    assert np.linalg.norm(fine_points.mean(axis=0) - frame.centroid) > 1.0


def test_a_square_has_the_global_axes():
    frame = area_frame(*plane_arrays((50.0, 50.0)), np.array([0.0, 0, 1]))
    assert np.allclose(frame.axes, np.eye(3), atol=1e-9)


def plane_arrays(size):
    part = plane(size, h=5.0)
    return part.surface.points, part.surface.triangles


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"amplitude": np.nan}, "amplitude must be finite"),
        ({"amplitude": 0.1, "centre": (1.0,)}, "centre must be two numbers"),
        ({"amplitude": 0.1, "ratio": np.inf}, "ratio must be finite"),
        ({"amplitude": 0.1, "rotation": "left"}, "rotation must be a number"),
    ],
)
def test_bad_parameters(arguments, message):
    with pytest.raises(DeviationError, match=message):
        Paraboloid(**arguments)
