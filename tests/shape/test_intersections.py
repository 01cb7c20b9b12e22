"""Triangle intersections against linear programming, and the box tree against all pairs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cadskin.shape.intersections import (
    facing_pairs,
    near_pairs,
    pairs_intersect,
    self_intersections,
    triangles_intersect,
)

TWO_APART = np.array([[0, 1, 2], [3, 4, 5]])


def meets_by_linear_programme(one, two):
    """Whether barycentric coordinates exist that give one point of both triangles."""
    equations = np.zeros((5, 6))
    equations[:3] = np.concatenate([one.T, -two.T], axis=1)
    equations[3, :3] = equations[4, 3:] = 1.0
    return linprog(np.zeros(6), A_eq=equations, b_eq=[0, 0, 0, 1, 1], bounds=(0, None)).status == 0


def test_random_triangles_against_a_linear_programme():
    rng = np.random.default_rng(1)
    seen = {True: 0, False: 0}
    for _ in range(300):
        one, two = rng.uniform(-1, 1, (2, 3, 3))
        expected = meets_by_linear_programme(one, two)
        assert triangles_intersect(one, two) is expected
        assert triangles_intersect(two, one) is expected
        seen[expected] += 1
    assert min(seen.values()) > 50


def test_random_coplanar_triangles_against_a_linear_programme():
    rng = np.random.default_rng(2)
    for _ in range(200):
        one, two = rng.uniform(-1, 1, (2, 3, 3)) * [1, 1, 0]
        two += [rng.uniform(-1, 1), 0, 0]
        assert triangles_intersect(one, two) is meets_by_linear_programme(one, two)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), shift=st.floats(-1e3, 1e3))
def test_rigid_motion_changes_nothing(seed, shift):
    rng = np.random.default_rng(seed)
    one, two = rng.uniform(-1, 1, (2, 3, 3))
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    assert triangles_intersect(one, two) == triangles_intersect(one @ turn + shift, two @ turn + shift)


@pytest.mark.parametrize(
    ("height", "tol", "expected"),
    [(0.1, 0.05, False), (0.1, 0.11, True), (0.0, 0.0, True), (1e-9, 0.0, False)],
)
def test_distance_counts_as_touching_below_the_tolerance(height, tol, expected):
    one = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    assert triangles_intersect(one, one + np.array([0.1, 0.1, height]), tol=tol) is expected


@pytest.mark.parametrize("n", [2, 9, 100, 300])
def test_tree_finds_what_all_pairs_find(n):
    rng = np.random.default_rng(n)
    points = (rng.uniform(0, 5, (n, 1, 3)) + rng.uniform(-1, 1, (n, 3, 3))).reshape(-1, 3)
    triangles = np.arange(3 * n).reshape(-1, 3)
    everyone = np.stack(np.triu_indices(n, 1), axis=1)
    expected = everyone[pairs_intersect(points, triangles, everyone)]
    np.testing.assert_array_equal(self_intersections(points, triangles), expected)
    assert n < 100 or len(expected) > 20
    assert len(self_intersections(points, triangles, limit=1)) == min(len(expected), 1)


SHARED_VERTEX = np.array([[0, 1, 2], [0, 3, 4]])


@pytest.mark.parametrize(
    ("third", "fourth", "expected"),
    [
        ([-1, 0, 0], [0, -1, 0], False),  # the other side
        ([0.5, 0.5, 1], [0.5, 0.5, -1], True),  # through the opposite side of the second
        ([1.5, 1.5, 1], [1.5, 1.5, -1], True),  # through the opposite side of the first
        ([0.5, 0.5, 1], [0.5, 0.5, 0.1], False),  # above
        ([0.2, 0.1, 0], [0.1, 0.2, 0], True),  # on it
        ([1, 0, 1], [0, 1, 1], False),  # a wedge
    ],
)
def test_triangles_with_a_common_vertex(third, fourth, expected):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], third, fourth], float)
    assert bool(pairs_intersect(points, SHARED_VERTEX, [[0, 1]])[0]) is expected
    assert len(self_intersections(points, SHARED_VERTEX)) == expected


@pytest.mark.parametrize(
    ("tip", "expected"), [([0.3, 0.7, 0], True), ([0.3, 0.7, 1e-3], False), ([0.3, -1, 0], False)]
)
def test_triangles_with_a_common_side(tip, expected):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], tip], float)
    assert bool(pairs_intersect(points, np.array([[0, 1, 2], [1, 0, 3]]), [[0, 1]])[0]) is expected


def test_empty_meshes():
    nothing = np.zeros((0, 3))
    assert self_intersections(nothing, nothing.astype(int)).shape == (0, 2)
    assert len(self_intersections(np.eye(3), np.array([[0, 1, 2]]))) == 0
    assert len(pairs_intersect(np.eye(3), np.array([[0, 1, 2]]), np.zeros((0, 2), int))) == 0


def sheets(gap, n=12):
    """Two parallel square sheets of triangles."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0), indexing="ij")
    sheet = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    i, j = (k.ravel() for k in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
    a = i * (n + 1) + j
    half = np.concatenate([np.stack([a, a + n + 1, a + n + 2], 1), np.stack([a, a + n + 2, a + 1], 1)])
    return np.concatenate([sheet, sheet + np.array([0.1, 0.2, gap])]), np.concatenate(
        [half, half + len(sheet)]
    )


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), size=st.floats(0.01, 0.7), gap=st.floats(0.1, 0.8))
def test_near_pairs_hold_every_pair_that_a_move_can_bring_together(seed, size, gap):
    points, triangles = sheets(gap, n=6)
    moves = size * np.random.default_rng(seed).uniform(-1, 1, points.shape)
    corners = moves[triangles]
    relative = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max()
    near = near_pairs(points, triangles, reach=np.linalg.norm(moves, axis=1).max(), relative_reach=relative)
    found = near[pairs_intersect(points + moves, triangles, near)]
    np.testing.assert_array_equal(found, self_intersections(points + moves, triangles))


def test_near_pairs_of_a_small_move_are_few():
    points, triangles = sheets(0.5)
    assert len(near_pairs(points, triangles, reach=0.1, relative_reach=0.1)) == 0
    assert len(near_pairs(points, triangles, reach=0.3, relative_reach=0.0)) > len(triangles) // 2


def test_agrees_with_pymeshlab():
    pymeshlab = pytest.importorskip("pymeshlab")
    points, triangles = sheets(0.2, n=8)
    points = points + 0.2 * np.random.default_rng(3).uniform(-1, 1, points.shape)
    pairs = self_intersections(points, triangles)
    meshes = pymeshlab.MeshSet()
    meshes.add_mesh(pymeshlab.Mesh(points, triangles))
    meshes.compute_selection_by_self_intersections_per_face()
    selected = np.flatnonzero(meshes.current_mesh().face_selection_array())
    np.testing.assert_array_equal(np.unique(pairs), selected)
    assert len(selected) > 10


def test_facing_pairs_are_the_two_sides_of_a_wall():
    points, triangles = sheets(0.5, n=6)
    half = len(triangles) // 2
    same = facing_pairs(points, triangles, reach=0.3)
    assert len(same) == 0  # both sheets look up
    triangles[half:] = triangles[half:, ::-1]
    pairs = facing_pairs(points, triangles, reach=0.3)
    assert (pairs[:, 0] < half).all()
    assert (pairs[:, 1] >= half).all()
    assert len(np.unique(pairs)) == len(triangles)
    assert len(facing_pairs(points, triangles, reach=0.2)) == 0
