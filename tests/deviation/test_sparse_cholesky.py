"""The sparse Cholesky factor of matrices on meshes and of others, against dense linear algebra."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import block_diag, csr_array, eye_array, random_array
from surfaces import ball, plane, rounded_slab, tube

from cadskin.deviation._cholesky import SparseCholesky
from cadskin.deviation._dissection import dissect, halves_of, nested_dissection, renumbered
from cadskin.deviation._linear import COLUMNS
from cadskin.errors import DeviationError
from cadskin.shape.operators import cotangent_laplacian

MESHES = {
    "plane": plane((20, 12), h=1.0),
    "irregular": plane((60, 60), h=1.5, jitter=0.3),
    "ball": ball(5.0, 400),
    "tube": tube(5, 10, h=1.0),
    "thin slab": rounded_slab(thickness=1.0, length=30.0, width=20.0, h=1.5),
}


def matrix_of(part, weight=0.3):
    laplacian = csr_array(cotangent_laplacian(part.surface.points, part.surface.triangles))
    return csr_array(laplacian + weight * eye_array(part.surface.n_points)), part.surface.points


def solve_error(matrix, points):
    """Largest error of the solution of random right sides, over the largest entry of it."""
    solver = SparseCholesky(matrix, points)
    assert np.array_equal(np.sort(solver.order), np.arange(len(points)))
    right = np.random.default_rng(1).standard_normal((len(points), COLUMNS)).astype(np.float32)
    columns = right[solver.order].copy()
    solver.solve_columns(columns)
    truth = np.linalg.solve(matrix.toarray(), right.astype(float))[solver.order]
    return np.abs(columns - truth).max() / np.abs(truth).max()


def kept_numbers(solver):
    return len(solver._panels.values)


@pytest.mark.parametrize("name", MESHES)
def test_it_solves_on_meshes(name):
    assert solve_error(*matrix_of(MESHES[name])) < 2e-6


@pytest.mark.parametrize("power", [2, 3])
def test_it_solves_with_many_entries_in_a_row(power):
    matrix, points = matrix_of(MESHES["irregular"], 2.0)
    dense = csr_array(np.linalg.matrix_power(matrix.toarray(), power))
    assert dense.nnz > 18 * len(points)
    condition = np.linalg.cond(dense.toarray())
    assert solve_error(dense, points) < 2e-7 * condition**0.5


def test_it_solves_a_full_matrix():
    rng = np.random.default_rng(2)
    root = rng.standard_normal((150, 150))
    full = csr_array(root @ root.T + 150 * np.eye(150))
    assert solve_error(full, rng.uniform(size=(150, 3))) < 2e-6


def test_parts_that_do_not_hang_together():
    (one, places), (other, more) = matrix_of(MESHES["plane"]), matrix_of(MESHES["ball"])
    both = csr_array(block_diag([one, other, eye_array(40)]))
    points = np.concatenate([places, more, np.zeros((40, 3))])
    assert solve_error(both, points) < 2e-6
    assert kept_numbers(SparseCholesky(csr_array(eye_array(500)), np.zeros((500, 2)))) < 4 * 500 + 20


@settings(max_examples=60, deadline=None)
@given(
    count=st.integers(1, 120),
    density=st.floats(0.0, 0.3),
    levels=st.integers(1, 50),
    axes=st.integers(1, 3),
    seed=st.integers(0, 2**32 - 1),
)
def test_any_graph_with_any_points(count, density, levels, axes, seed):
    """Points that coincide or say nothing about the graph cost fill, never correctness."""
    rng = np.random.default_rng(seed)
    lower = random_array((count, count), density=density, rng=rng)
    matrix = csr_array(lower @ lower.T + eye_array(count))
    points = rng.integers(0, levels, (count, axes)) / levels
    assert solve_error(matrix, points) < 3e-6


@pytest.mark.parametrize("count", [1, 2, 5])
def test_tiny_matrices(count):
    matrix = csr_array(np.eye(count) * 3 - np.ones((count, count)) / count)
    assert solve_error(matrix, np.zeros((count, 3))) < 2e-6
    assert solve_error(matrix, np.random.default_rng(0).uniform(size=(count, 3))) < 2e-6


def test_parts_of_a_dissection_meet_in_later_parts_only():
    """Each part is a separator of a tree: going up from it, its neighbours are in parts above it."""
    matrix, points = matrix_of(MESHES["irregular"])
    halves = halves_of(points)
    order, parts = dissect(renumbered(matrix, halves.order), halves)
    order = halves.order[order]
    assert np.array_equal(np.sort(order), np.arange(len(points)))
    assert np.array_equal(order, nested_dissection(matrix, points))
    assert parts[0] == 0
    assert parts[-1] == len(points)
    assert (np.diff(parts) > 0).all()
    part_of = np.zeros(len(points), dtype=int)
    part_of[order] = np.repeat(np.arange(len(parts) - 1), np.diff(parts))
    factor = np.linalg.cholesky(matrix.toarray()[np.ix_(order, order)])
    filled = np.abs(factor) > 1e-14
    blocks = np.zeros((len(parts) - 1, len(parts) - 1), dtype=bool)
    i, j = np.nonzero(filled)
    blocks[part_of[order[i]], part_of[order[j]]] = True
    assert blocks.mean() < 0.06  # a path through the tree, not all later parts


def test_dissection_keeps_the_fill_low():
    """Little more is kept than the factor has, and that grows as n log n."""
    matrix, points = matrix_of(plane((60, 60), h=1.0, jitter=0.3), 1.0)
    solver = SparseCholesky(matrix, points)
    exact = np.count_nonzero(
        np.abs(np.linalg.cholesky(matrix.toarray()[np.ix_(solver.order, solver.order)])) > 1e-300
    )
    assert exact < 2.2 * len(points) * np.log2(len(points))
    assert kept_numbers(solver) < 1.6 * exact  # squares on the diagonal, groups of rows filled up


def test_two_sides_of_a_thin_wall_are_not_filled_together():
    """Cuts go through both sides, whose separators hang together at the rim only: 1.72 if they were one."""
    matrix, points = matrix_of(rounded_slab(thickness=1.0, length=60.0, width=40.0, h=1.5))
    solver = SparseCholesky(matrix, points)
    factor = np.linalg.cholesky(matrix.toarray()[np.ix_(solver.order, solver.order)])
    assert kept_numbers(solver) < 1.45 * np.count_nonzero(np.abs(factor) > 1e-300)


def test_points_on_a_grid_or_in_any_order_make_no_difference():
    """Rows of equal coordinates are cut beside, and the numbering of the mesh plays no role for the fill."""
    matrix, points = matrix_of(MESHES["irregular"])
    shuffled = np.random.default_rng(0).permutation(len(points))
    one = kept_numbers(SparseCholesky(matrix, points))
    other = kept_numbers(SparseCholesky(csr_array(matrix[shuffled][:, shuffled]), points[shuffled]))
    assert abs(one - other) < 0.03 * one
    even, places = matrix_of(plane((60, 60), h=1.5, jitter=0.0))
    assert kept_numbers(SparseCholesky(even, places)) < 1.1 * one


def test_columns_do_not_depend_on_each_other():
    matrix, points = matrix_of(MESHES["ball"])
    solver = SparseCholesky(matrix, points)
    columns = np.random.default_rng(1).standard_normal((len(points), COLUMNS)).astype(np.float32)
    turned = columns[:, ::-1].copy()
    solver.solve_columns(columns)
    solver.solve_columns(turned)
    assert np.array_equal(columns, turned[:, ::-1])


@pytest.mark.parametrize("count", [1, 30, 500])
def test_a_matrix_that_is_not_positive_definite_is_refused(count):
    points = np.random.default_rng(0).uniform(size=(count, 3))
    for last in (0.0, -1.0, np.nan):
        diagonal = np.ones(count)
        diagonal[count // 2] = last
        with pytest.raises(DeviationError, match="not positive definite"):
            SparseCholesky(
                csr_array(np.diag(diagonal) + 1e-3 * np.eye(count, k=1) + 1e-3 * np.eye(count, k=-1)), points
            )
    matrix, places = matrix_of(MESHES["plane"], -5.0)
    with pytest.raises(DeviationError, match="not positive definite"):
        SparseCholesky(matrix, places)
