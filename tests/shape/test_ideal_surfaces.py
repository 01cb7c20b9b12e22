"""Ideal surfaces: distances against points made from the definition."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cadskin.errors import GeometryError
from cadskin.shape import Cone, Cylinder, Plane, Sphere, Torus

ANGLES = st.floats(0, 2 * np.pi)
OFFSETS = st.floats(-0.5, 0.5)


@given(ANGLES, st.floats(-10, 10), OFFSETS)
def test_cylinder_distance_is_the_radial_offset(angle: float, height: float, offset: float) -> None:
    cylinder = Cylinder([1, 2, 3], [0, 0, 5], 2.0)
    point = np.array([[1 + (2 + offset) * np.cos(angle), 2 + (2 + offset) * np.sin(angle), height]])
    assert cylinder.distance(point)[0] == pytest.approx(offset, abs=1e-12)


@given(ANGLES, st.floats(2, 10), OFFSETS)
def test_cone_distance_is_the_offset_along_the_normal(angle: float, slant: float, offset: float) -> None:
    half = 0.4
    cone = Cone([0, 0, 0], [0, 0, 1], half)
    radial = np.array([np.cos(angle), np.sin(angle), 0])
    normal = np.cos(half) * radial - np.sin(half) * np.array([0, 0, 1])
    point = slant * (np.sin(half) * radial + np.cos(half) * np.array([0, 0, 1])) + offset * normal
    assert cone.distance(point[None])[0] == pytest.approx(offset, abs=1e-12)


def test_behind_the_apex_the_distance_is_to_the_apex() -> None:
    assert Cone([0, 0, 0], [0, 0, 1], 0.4).distance(np.array([[0, 0, -3.0]]))[0] == pytest.approx(3.0)


@given(ANGLES, ANGLES, OFFSETS)
def test_torus_and_sphere_distances(around: float, tube: float, offset: float) -> None:
    radius = 5 + (1 + offset) * np.cos(tube)
    point = np.array([[radius * np.cos(around), radius * np.sin(around), (1 + offset) * np.sin(tube)]])
    assert Torus([0, 0, 0], [0, 0, 1], 5, 1).distance(point)[0] == pytest.approx(offset, abs=1e-12)
    assert Sphere([0, 0, 0], 3).distance(point)[0] == pytest.approx(np.linalg.norm(point) - 3, abs=1e-12)


def test_plane_distance_is_signed() -> None:
    plane = Plane([0, 0, 1], [0, 0, 2])
    np.testing.assert_allclose(plane.distance(np.array([[5, 6, 3.0], [1, 1, 0.0]])), [2, -1])


@pytest.mark.parametrize(
    "make",
    [
        lambda: Plane([0, 0, 0], [0, 0, 0]),
        lambda: Cylinder([0, 0, 0], [0, 0, 1], 0.0),
        lambda: Cylinder([0, 0, 0], [0, 0, 1], np.nan),
        lambda: Cone([0, 0, 0], [0, 0, 1], np.pi / 2),
        lambda: Sphere([0, 0, np.inf], 1.0),
    ],
)
def test_parameters_without_meaning_are_refused(make: object) -> None:
    with pytest.raises(GeometryError):
        make()  # type: ignore[operator]
