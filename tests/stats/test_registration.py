"""Scans of known pose: accuracy, labels, covariance, datums, ambiguity and wrong scans."""

from __future__ import annotations

import numpy as np
import pytest
from support.parts import box, cylinder, sphere
from support.scans import bracket, exact_points, irregular_tetrahedron, pose, pose_error, scan

from cadskin.errors import CadskinWarning, StatisticsError
from cadskin.stats import RigidMotion, register
from cadskin.stats._search import box_tree, closest_on_mesh
from cadskin.stats.surface_distance import contacts, signed_distances


def test_closest_points_are_those_of_brute_force():
    part = bracket()
    rng = np.random.default_rng(0)
    points = rng.uniform(-20, 100, (200, 3))
    feet = closest_on_mesh(box_tree(part.surface.points, part.surface.triangles), points)
    corners = part.surface.points[part.surface.triangles]
    lattice = np.array([[i, j, 8 - i - j] for i in range(9) for j in range(9 - i)]) / 8
    dense = np.einsum("qk,tkd->tqd", lattice, corners).reshape(-1, 3)
    upper = np.array([np.linalg.norm(dense - p, axis=1).min() for p in points])
    own = np.einsum("nk,nkd->nd", feet.weights, corners[feet.triangles])
    np.testing.assert_allclose(np.linalg.norm(points - own, axis=1), feet.distances, atol=1e-9)
    assert (feet.distances <= upper + 1e-9).all()
    assert (upper - feet.distances).max() < 0.2  # the lattice is 0.5 mm fine


def test_closest_point_against_trimesh():
    trimesh = pytest.importorskip("trimesh")
    part = bracket()
    rng = np.random.default_rng(1)
    points = rng.uniform(-5, 85, (300, 3)) * [1, 0.7, 0.2]
    mesh = trimesh.Trimesh(part.surface.points, part.surface.triangles, process=False)
    _, expected, _ = trimesh.proximity.closest_point_naive(mesh, points)
    found = closest_on_mesh(box_tree(part.surface.points, part.surface.triangles), points)
    np.testing.assert_allclose(found.distances, expected, atol=1e-9)
    few = closest_on_mesh(box_tree(part.surface.points, part.surface.triangles), points, limit=2.0)
    np.testing.assert_array_equal(few.triangles >= 0, expected < 2.0)


def test_signed_distance_is_exact_on_analytic_faces_with_holes_pointing_inwards():
    part = bracket()
    rng = np.random.default_rng(2)
    points, faces, normals = exact_points(part, 3000, rng)
    heights = rng.uniform(-0.2, 0.2, len(points))
    moved = points + heights[:, None] * normals
    where = contacts(part, moved)
    same = where.faces == faces
    assert same.mean() > 0.97
    np.testing.assert_allclose(signed_distances(part, moved, where)[same], heights[same], atol=1e-9)


def test_freeform_distance_converges_with_the_third_power_of_the_edge():
    errors = []
    for subdivide in (2, 3, 4):
        part = sphere(radius=20.0, subdivide=subdivide)
        directions = np.random.default_rng(3).standard_normal((2000, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        points = 20.1 * directions
        where = contacts(part, points)
        errors.append(np.sqrt(np.mean((signed_distances(part, points, where) - 0.1) ** 2)))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    assert (rates > 2.8).all()
    assert errors[-1] < 1e-3


def test_pose_and_labels_of_a_noisy_partial_scan():
    """Goal: 103k points, 20 um noise, 3 % outliers, partial coverage: 0.5 um and 99.5 % of the labels."""
    part = bracket()
    made = scan(part, 103_000)
    true = pose(3.9, 4.4, seed=1)
    found = register(true.apply(made.points), part, alignment="robust")
    assert pose_error(part, found.motion, true) < 0.5e-3
    assert found.scale == pytest.approx(0.02, rel=0.05)
    assert found.inliers == pytest.approx(0.97, abs=0.01)
    where = contacts(part, made.points)
    inlier = (made.faces >= 0) & ~where.on_edge
    assert (where.faces[inlier] == made.faces[inlier]).mean() > 0.995
    assert found.free.shape == (0, 6)


def test_covariance_of_the_pose_covers_the_error():
    """Squared Mahalanobis errors of 40 scans: mean of chi-square with 6 degrees, 4 sigma of it."""
    part = bracket()
    squared = []
    for seed in range(40):
        made = scan(part, 1000, seed=seed, outliers=0.0)
        found = register(made.points, part, alignment="least_squares")
        motion = found.motion
        turn = motion.rotation - motion.rotation.T
        step = np.concatenate(
            [
                motion.apply(found.centre[None])[0] - found.centre,
                0.5 * np.array([turn[2, 1], turn[0, 2], turn[1, 0]]),
            ]
        )
        squared.append(step @ np.linalg.solve(found.covariance, step))
    assert abs(np.mean(squared) - 6) < 4 * np.sqrt(12 / 40)


def test_form_deviation_moves_a_best_fit_by_what_the_form_covariance_says():
    """With 50 um of form per face the fit moves by far more than its noise covariance admits."""
    part = bracket()
    ratios, noise_ratios = [], []
    for seed in range(8):
        heights = 0.05 * np.random.default_rng(seed).standard_normal(len(part.faces))
        made = scan(
            part,
            4000,
            noise=0.002,
            outliers=0.0,
            seed=seed,
            partial=False,
            field=lambda _, f, h=heights: h[f],
        )
        found = register(made.points, part, alignment="least_squares")
        shift = found.motion.apply(found.centre[None])[0] - found.centre
        ratios.append(shift**2 / np.diag(found.form_covariance)[:3])
        noise_ratios.append(shift**2 / np.diag(found.covariance)[:3])
    assert np.median(noise_ratios) > 20
    assert 0.1 < np.median(ratios) < 5


def test_minimum_zone_has_the_least_largest_distance():
    part = bracket()
    made = scan(part, 3000, outliers=0.0, noise=0.01, seed=4)
    largest = {}
    for alignment in ("least_squares", "minimum_zone"):
        found = register(made.points, part, alignment=alignment)
        points = found.motion.apply(made.points)
        where = contacts(part, points)
        rest = np.abs(signed_distances(part, points, where))
        largest[alignment] = np.sort(rest[~where.on_edge])[-1]
    assert largest["minimum_zone"] < 0.97 * largest["least_squares"]


def test_datum_frame_keeps_what_a_position_tolerance_is_about():
    """The hole is 15 um off in x; a best fit shares the error out, the datum frame does not."""
    part = bracket()
    hole = part.feature(kind="cylinder", internal=True)
    made = scan(part, 20_000, noise=0.005, outliers=0.0, partial=False)
    points = made.points.copy()
    points[np.isin(made.faces, hole.face_indices)] += [0.015, 0.0, 0.0]
    true = pose(1.0, 1.0, seed=3)
    datums = [part.feature(name="bottom"), part.features[8], part.features[2]]
    found = register(true.apply(points), part, alignment="datum_frame", features=datums)
    assert pose_error(part, found.motion, true) < 1e-3
    best = register(true.apply(points), part, alignment="least_squares")
    assert pose_error(part, best.motion, true) > 3 * pose_error(part, found.motion, true)


def test_primary_datum_is_not_moved_by_the_secondary():
    """Tilt the secondary face: the primary plane must fit as well as alone."""
    part = bracket()
    made = scan(part, 20_000, noise=0.003, outliers=0.0, partial=False)
    bottom, side = part.feature(name="bottom"), part.features[2]
    points = made.points.copy()
    own = np.isin(made.faces, side.face_indices)
    points[own, 1] += 0.01 * (points[own, 2] - 6.0)
    both = register(points, part, alignment="datum_frame", features=[bottom, side, part.features[8]])
    lowest = both.motion.apply(points[made.faces == 0])[:, 2]
    slope = np.polyfit(points[made.faces == 0][:, 1], lowest, 1)[0]
    assert abs(slope) < 2e-5
    assert abs(lowest.mean()) < 2e-4


def test_no_alignment_leaves_the_points_where_they_are():
    part = bracket()
    made = scan(part, 2000, outliers=0.0)
    found = register(made.points + np.array([0.05, 0, 0]), part, alignment="none")
    np.testing.assert_array_equal(found.motion.rotation, np.eye(3))
    np.testing.assert_array_equal(found.motion.translation, 0)


def test_probe_centres_are_taken_back_by_the_radius():
    part = bracket()
    rng = np.random.default_rng(5)
    points, _, normals = exact_points(part, 4000, rng)
    centres = points + 2.0 * normals
    where = contacts(part, centres)
    true = pose(0.5, 0.5, seed=2)
    found = register(true.apply(centres[~where.on_edge]), part, alignment="robust", probe_radius=2.0)
    assert pose_error(part, found.motion, true) < 1e-3
    with pytest.raises(StatisticsError, match="does not fit"):  # 2 mm are two hundredths of the part
        register(true.apply(centres[~where.on_edge]), part, alignment="robust")


@pytest.mark.parametrize("seed", range(2))
def test_any_start_pose_is_found_by_the_search(seed):
    part = bracket()
    made = scan(part, 4000, seed=seed)
    true = RigidMotion(pose(170, 0, seed=seed).rotation, pose(0, 300, seed=seed).translation)
    found = register(true.apply(made.points), part, alignment="robust", start="search")
    assert pose_error(part, found.motion, true) < 0.01


@pytest.mark.slow
def test_a_hundred_random_start_poses_are_all_recovered():
    part = bracket()
    made = scan(part, 4000, seed=7)
    for seed in range(100):
        rng = np.random.default_rng(seed)
        true = RigidMotion(pose(rng.uniform(0, 180), 0, seed=seed).rotation, rng.uniform(-300, 300, 3))
        found = register(true.apply(made.points), part, alignment="robust", start="search")
        assert pose_error(part, found.motion, true) < 0.01, seed


def test_a_shaft_can_turn_and_the_user_is_told():
    part = cylinder(radius=10, height=30, h=2.0)
    points, _, _ = exact_points(part, 3000, np.random.default_rng(0))
    with pytest.warns(CadskinWarning, match="ambiguous pose: 1 motions"):
        found = register(points + np.array([0.1, 0.05, -0.02]), part, alignment="robust")
    assert found.free.shape == (1, 6)
    np.testing.assert_allclose(np.abs(found.free[0]), [0, 0, 0, 0, 0, 1], atol=0.02)
    np.testing.assert_allclose(found.motion.apply([[0.1, 0.05, -0.02]]), 0, atol=1e-6)


def test_a_symmetric_part_has_several_poses_and_the_user_is_told():
    part = box((30, 20, 10), 3.0)
    points, _, _ = exact_points(part, 2000, np.random.default_rng(0))
    found = register(points, part, alignment="robust", start="search")
    assert any("ambiguous" in note and "180°" in note for note in found.notes)


def test_wrong_scans_are_refused_with_a_reason():
    part = bracket()
    points = scan(part, 1500).points
    for factor, said in ((1 / 25.4, "inch"), (1e-3, "in m"), (0.1, "in cm")):
        with pytest.raises(StatisticsError, match=said):
            register(points * factor, part, alignment="robust", start="search")
    with pytest.raises(StatisticsError, match="looks like in inch"):  # so small that it would fit on any face
        register(points / 25.4 + np.array([30, 20, 30.0]), part, alignment="robust")
    chiral = irregular_tetrahedron()
    twisted, _, _ = exact_points(chiral, 2000, np.random.default_rng(1))
    with pytest.raises(StatisticsError, match="mirrored"):
        register(twisted * [1, -1, 1], chiral, alignment="robust", start="search")
    with pytest.raises(StatisticsError, match="does not fit"):
        register(scan(part, 1500, outliers=0.9).points, part, alignment="robust")
    other, _, _ = exact_points(sphere(40.0, 3), 1000, np.random.default_rng(0))
    with pytest.raises(StatisticsError, match=r"does not fit|mirrored|not a scan"):
        register(other, part, alignment="robust", start="search")
    with pytest.raises(StatisticsError, match="fewer than 6"):
        register(np.tile(points[:2], (500, 1)), part, alignment="robust")
    with pytest.raises(StatisticsError, match="alignment must be one of"):
        register(points, part, alignment="best")
    with pytest.raises(StatisticsError, match="datum_frame"):
        register(points, part, alignment="datum_frame")
    with pytest.raises(StatisticsError, match="probe_radius"):
        register(points, part, alignment="robust", probe_radius=-1)


def test_duplicate_points_and_nan_do_no_harm():
    part = bracket()
    made = scan(part, 3000, outliers=0.0)
    points = np.concatenate([made.points, made.points[:500], np.full((10, 3), np.nan)])
    true = pose(2.0, 2.0, seed=5)
    assert pose_error(part, register(true.apply(points), part, alignment="robust").motion, true) < 0.005


def test_rigid_motions():
    a, b = pose(40, 10, seed=1), pose(70, 3, seed=2)
    points = np.random.default_rng(0).standard_normal((5, 3))
    np.testing.assert_allclose(a.after(b).apply(points), a.apply(b.apply(points)))
    np.testing.assert_allclose(a.inverse.apply(a.apply(points)), points)
    assert a.angle == pytest.approx(np.radians(40))
    with pytest.raises(StatisticsError, match="without scale or mirror"):
        RigidMotion(np.diag([1, 1, -1.0]))
    with pytest.raises(StatisticsError, match="without scale or mirror"):
        RigidMotion(1.01 * np.eye(3))
