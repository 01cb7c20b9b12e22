"""Landmark grid, Procrustes and the alignment of fields, against closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from support.scans import bracket, pose

from cadskin.errors import StatisticsError
from cadskin.stats import align_fields, generalised_procrustes, landmark_grid
from cadskin.stats.field_alignment import rigid_basis
from cadskin.stats.measured import local_plane_at


def bowl(x, y):
    return 0.3 * (x / 50) ** 2 + 0.002 * y


def uneven_scan(rng, n=12_000):
    """More points to one side of each cell, 5 um noise, 1 % gross points."""
    xy = rng.uniform(0, 50, (n, 2))
    xy = 5 * np.floor(xy / 5) + 5 * ((xy / 5) % 1) ** 1.5
    z = bowl(*xy.T) + 0.005 * rng.standard_normal(n)
    z[rng.random(n) < 0.01] += 0.5
    return np.column_stack([xy, z])


def test_landmarks_by_planes_beat_the_cell_means():
    rng = np.random.default_rng(0)
    grid = landmark_grid(rng.uniform(0, 50, (40_000, 2)), 5.0)
    assert len(grid.cells) == 100
    expected = bowl(*grid.centres.T)
    errors = {}
    for reading in ("plane", "mean"):
        error = grid.heights(uneven_scan(rng), reading=reading) - expected
        errors[reading] = np.sqrt(np.mean(error**2))
    assert errors["plane"] < 1e-3
    assert errors["mean"] > 5 * errors["plane"]


def test_the_plane_reading_is_exact_on_a_plane_and_the_quadratic_on_a_bowl():
    rng = np.random.default_rng(1)
    grid = landmark_grid(rng.uniform(0, 50, (40_000, 2)), 5.0)
    xy = rng.uniform(0, 50, (5000, 2))
    flat = np.column_stack([xy, 0.01 * xy[:, 0] - 0.02 * xy[:, 1] + 1])
    np.testing.assert_allclose(
        grid.heights(flat), 0.01 * grid.centres[:, 0] - 0.02 * grid.centres[:, 1] + 1, atol=1e-10
    )
    few = xy[(xy % 5 < 2).all(axis=1)]  # one corner of every cell only: the 3 x 3 quadratic has to help
    curved = np.column_stack([few, bowl(*few.T)])
    inner = grid.trimmed()
    np.testing.assert_allclose(inner.heights(curved), bowl(*inner.centres.T), atol=1e-9)


def test_an_empty_cell_is_nan_and_the_rim_can_be_trimmed():
    rng = np.random.default_rng(2)
    grid = landmark_grid(rng.uniform(0, 50, (40_000, 2)), 5.0)
    points = uneven_scan(rng)
    hole = (points[:, 0] > 20) & (points[:, 0] < 25) & (points[:, 1] > 10) & (points[:, 1] < 15)
    heights = grid.heights(points[~hole])
    missing = np.flatnonzero(np.isnan(heights))
    assert grid.cells[missing].tolist() == [[4, 2]]
    assert len(grid.trimmed().cells) == 64
    assert len(grid.trimmed(2).cells) == 36
    with pytest.raises(StatisticsError, match="no cell is left"):
        grid.trimmed(5)
    half = landmark_grid(rng.uniform(0, 7.4, (40_000, 2)), 5.0, cover=0.3)
    np.testing.assert_allclose(
        sorted(half.areas), [0.25, 0.5, 0.5, 1.0][1:] if len(half.areas) == 3 else half.areas
    )
    for wrong in (0.0, np.nan):
        with pytest.raises(StatisticsError, match="size"):
            landmark_grid(points, wrong)


def test_procrustes_takes_off_the_pose_and_keeps_the_size():
    rng = np.random.default_rng(3)
    base = rng.uniform(0, 60, (40, 3))
    sizes = 1 + 0.001 * np.arange(-2, 3)
    moved = np.stack([pose(30 * k, 50, seed=k).apply(size * base) for k, size in enumerate(sizes)])
    moved[2, 7] = np.nan
    found = generalised_procrustes(moved)
    spread = found.aligned - np.nanmean(found.aligned, axis=1, keepdims=True)
    measured = np.sqrt(np.nanmean(spread**2, axis=(1, 2)))
    np.testing.assert_allclose(measured / measured[2], sizes / sizes[2], rtol=2e-3)
    np.testing.assert_allclose(found.aligned[0], moved[0], atol=1e-9)  # frame of the first
    for motion, before, after in zip(found.motions, moved, found.aligned, strict=True):
        np.testing.assert_allclose(motion.apply(before), after, atol=1e-9)
    same = generalised_procrustes(np.stack([pose(40 * k, 5, seed=k).apply(base) for k in range(4)]))
    assert np.abs(same.aligned - same.mean).max() < 1e-8
    with pytest.raises(StatisticsError, match="landmark 7 is missing"):
        generalised_procrustes(np.where(np.arange(40)[None, :, None] == 7, np.nan, moved))
    with pytest.raises(StatisticsError, match="must be"):
        generalised_procrustes(base)


@pytest.mark.parametrize("alignment", ["least_squares", "robust", "minimum_zone"])
def test_best_fits_take_a_rigid_motion_off_a_field(alignment):
    part = bracket()
    step = np.array([0.02, -0.01, 0.03, 0.01, 0.02, -0.015])
    field = rigid_basis(part) @ step
    np.testing.assert_allclose(align_fields([field], part, alignment=alignment), 0, atol=1e-9)
    np.testing.assert_array_equal(align_fields([field], part, alignment="none"), [field])


def test_datum_frame_of_a_field_zeroes_the_datums_only():
    part = bracket()
    top, bottom = part.feature(name="top"), part.feature(name="bottom")
    field = rigid_basis(part) @ np.array([0, 0, 0.02, 0.01, 0.0, 0.0])
    field[top.rows] += 0.05
    field[bottom.start] = np.nan
    aligned = align_fields([field], part, alignment="datum_frame", features=[bottom, part.features[2]])[0]
    np.testing.assert_allclose(aligned[top.rows], 0.05, atol=1e-9)
    assert np.isnan(aligned[bottom.start])
    best = align_fields([field], part, alignment="least_squares")[0]
    assert np.abs(best[top.rows]).max() < 0.04  # the best fit hides it
    with pytest.raises(StatisticsError, match="features"):
        align_fields([field], part, alignment="datum_frame")


def test_field_alignment_is_the_small_motion_of_the_points():
    """A field of a moved part: distances after a true rotation of 1 mrad agree to second order."""
    part = bracket()
    rows = part.samples.vertex_ids
    points, normals = part.surface.points[rows], part.samples.normals
    motion = pose(np.degrees(1e-4), 0.01, seed=4)
    field = np.einsum("nd,nd->n", motion.apply(points) - points, normals)
    assert np.abs(align_fields([field], part, alignment="least_squares")).max() < 1e-6


def test_local_plane_reads_at_the_place_and_refuses_extrapolation():
    rng = np.random.default_rng(5)
    offsets = rng.uniform(-1, 1, (3, 30, 2))
    offsets[1, :, 0] = np.abs(offsets[1, :, 0]) * 0.2 + 1.0  # all to one side
    values = 2.0 + offsets @ [0.3, -0.2]
    values[2, :5] += 10  # gross points
    values[2, 28:] = np.nan
    value, _, count = local_plane_at(offsets, values, 1.5)
    np.testing.assert_allclose(value[[0, 2]], 2.0, atol=1e-6)
    assert np.isnan(value[1])
    assert count[2] <= 23
    assert np.isnan(local_plane_at(offsets[:1, :4], values[:1, :4], 1.5)[0][0])


def test_points_in_a_row_tell_the_value_on_the_row():
    """The slope across is unknown; it must not be made up and carried to the place."""
    rng = np.random.default_rng(0)
    along, across = rng.uniform(-1, 1, (200, 20)), 1e-3 * rng.standard_normal((200, 20)) + 0.02
    values = 0.01 + 0.02 * along + 0.002 * rng.standard_normal(along.shape)
    found, uncertainty, _ = local_plane_at(np.stack([along, across], axis=2), values, 1.2)
    assert np.abs(found - 0.01).max() < 0.004
    assert 0.2e-3 < np.median(uncertainty) < 1e-3
