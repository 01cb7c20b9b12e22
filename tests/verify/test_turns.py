"""Planes that may turn about a datum: the least distance of all turns, also around a speck."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull

from cadskin.verify import DatumFeature, establish, orientation
from cadskin.verify.turns import closest_turn

TICKS = np.linspace(-40, 40, 7)
FLOOR = np.column_stack([*(a.ravel() for a in np.meshgrid(TICKS, TICKS)), np.zeros(49)])


def strip_width(flat):
    """Least distance of two parallel lines around points (n, 2): one of them lies on a side of the hull."""
    corners = flat[ConvexHull(flat).vertices]
    sides = np.roll(corners, -1, axis=0) - corners
    normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / np.linalg.norm(sides, axis=1)[:, None]
    return np.ptp(corners @ normals.T, axis=0).min()


@given(st.integers(0, 10**6), st.floats(-4, 1.5), st.integers(4, 40))
@settings(max_examples=60, deadline=None)
def test_planes_along_the_datum_are_the_narrowest_strip(seed, exponent, n):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (n, 3)) * [10.0**exponent, 5.0, 20.0]
    turn, bound = closest_turn(points, np.pi / 2)
    assert np.ptp(points @ [np.cos(turn), np.sin(turn), 0.0]) == pytest.approx(
        strip_width(points[:, :2]), abs=1e-11
    )
    assert bound == pytest.approx(strip_width(points[:, :2]), abs=1e-11)


@given(st.integers(0, 10**6), st.floats(0.1, 1.5))
@settings(max_examples=40, deadline=None)
def test_no_turn_of_a_fine_grid_is_better(seed, angle):
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (25, 3)) * 10.0 ** rng.uniform(-3, 1.5, 3)
    turn, bound = closest_turn(points, angle)
    turns = np.append(np.linspace(0, 2 * np.pi, 20_001), turn)
    normals = np.stack(
        [np.sin(angle) * np.cos(turns), np.sin(angle) * np.sin(turns), np.full(20_002, np.cos(angle))]
    )
    widths = np.ptp(points @ normals, axis=0)
    assert widths[-1] <= widths.min() + 1e-12
    assert widths[-1] - bound <= 1e-10


@pytest.mark.parametrize("seed", range(6))
def test_median_line_upright_between_two_planes(seed):
    """The zone of two planes perpendicular to A around a bent axis: a speck of random points from above."""
    rng = np.random.default_rng(seed)
    line = np.column_stack([0.05 * rng.uniform(-1, 1, (15, 2)), np.linspace(0, 30, 15)])
    datum = establish([DatumFeature("A", "plane", FLOOR, hint=np.array([0, 0, -1.0]))])
    found = orientation(line, "perpendicularity", datum, feature="line", zone="planes")
    assert found.value == pytest.approx(strip_width(line[:, :2]), abs=1e-12)
    assert found.certified


@pytest.mark.parametrize("angle", [90.0, 30.0])
def test_a_secondary_datum_holds_the_turn_of_the_zone(angle):
    """A face that is flat and at its angle to A, but turned by 1 mrad against B: 0.08 over its 80 mm."""
    wall = np.column_stack([FLOOR[:, 0], np.full(49, -50.0), FLOOR[:, 1] + 40.0])
    floor = DatumFeature("A", "plane", FLOOR, hint=np.array([0, 0, -1.0]))
    side = DatumFeature("B", "plane", wall, hint=np.array([0, -1.0, 0]))
    radian = np.radians(angle)
    normal = np.array([np.sin(radian), 0.0, np.cos(radian)])
    along = np.array([np.cos(radian), 0.0, -np.sin(radian)])
    across, depth = FLOOR[:, 1], 0.001 * FLOOR[:, 1]
    face = np.outer(FLOOR[:, 0], along) + np.outer(across, [0, 1.0, 0]) + np.outer(depth, normal) + 60.0
    for datums, expected in (([floor], 0.0), ([floor, side], 0.08)):
        found = orientation(face, "angularity", establish(datums), normal_angle=radian)
        assert found.value == pytest.approx(expected, abs=1e-4 if len(datums) == 1 else 1e-12)
