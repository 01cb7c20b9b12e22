"""The quick flatness test: against linear programming, and as bounds that never decide wrongly."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cadskin.conform.flat import flat_places, flatness_bounds
from cadskin.errors import AssociationError

UP = np.array([0.0, 0.0, 1.0])


def by_linear_program(points, heights):
    """The width of the narrowest band, by HiGHS on all points."""
    plane = np.column_stack([np.ones(len(points)), points[:, :2] / np.abs(points).max()])
    scale = np.abs(heights).max()
    tall = np.ones((len(points), 1))
    found = linprog(
        [0, 0, 0, 1],
        A_ub=np.block([[plane, -tall], [-plane, -tall]]),
        b_ub=np.concatenate([heights, -heights]) / scale,
        bounds=[(None, None)] * 4,
        method="highs",
    )
    return 2 * found.fun * scale


@pytest.mark.parametrize("seed", range(20))
def test_agrees_with_a_linear_program(seed):
    rng = np.random.default_rng(seed)
    points = np.column_stack([rng.uniform(-50, 50, (300, 2)), np.zeros(300)])
    heights = rng.normal(0, 0.01, 300) + 0.02 * np.sin(points[:, 0] / 9)
    lower, upper = flatness_bounds(points, UP, heights)
    assert lower == pytest.approx(upper, rel=2e-9)
    assert lower <= upper
    assert upper == pytest.approx(by_linear_program(points, heights), rel=1e-7)


@settings(max_examples=60, deadline=None)
@given(
    st.lists(st.tuples(*[st.integers(-6, 6)] * 3), min_size=5, max_size=40, unique_by=lambda p: p[:2]),
    st.floats(-0.5, 0.5),
    st.floats(0.01, 3.0),
)
def test_is_a_norm_that_no_plane_changes(rows, slope, factor):
    values = np.array(rows, dtype=float)
    points = np.column_stack([values[:, :2], np.zeros(len(values))])
    if np.linalg.matrix_rank(points[:, :2] - points[0, :2]) < 2:
        with pytest.raises(AssociationError, match="one line"):
            flat_places(points, UP)
        return
    lower, upper = flatness_bounds(points, UP, values[:, 2])
    moved = factor * values[:, 2] + slope * values[:, 0] - 3 * slope * values[:, 1] + 7
    again = flatness_bounds(points, UP, moved)
    assert lower <= upper + 1e-12
    assert again[1] == pytest.approx(factor * upper, abs=1e-7)
    assert upper <= np.ptp(values[:, 2]) + 1e-12


def test_points_in_rows_of_three():
    """Three places of every reference on one line: the exchange stops, and the linear program goes on."""
    places = np.array([(0, 0), (0, 1), (1, 0), (2, 0), (2, -1)], dtype=float)
    heights = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    lower, upper = flatness_bounds(np.column_stack([places, np.zeros(5)]), UP, heights)
    assert lower == pytest.approx(upper)
    assert upper == pytest.approx(1.0)  # (0, 0), (1, 0), (2, 0): half of the hump on either side


@pytest.mark.parametrize("share", [0.2, 0.9, 0.999, 1.001, 1.1, 5.0])
def test_early_bounds_decide_as_the_value_does(share):
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(0, 10, (500, 2)), np.zeros(500)])
    places = flat_places(points, UP)
    for _ in range(20):
        heights = rng.normal(size=500)
        exact = places.bounds(heights)[1]
        lower, upper = places.bounds(heights, limit=share * exact)
        assert lower <= exact * (1 + 1e-9)
        assert upper >= exact * (1 - 1e-9)
        assert (upper <= share * exact) == (share > 1)
