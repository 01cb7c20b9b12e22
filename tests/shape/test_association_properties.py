"""Properties that every association has, and a conic solver as oracle of those that are convex."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cadskin.errors import AssociationError
from cadskin.shape.association import associate, rotation

UP = np.array([0.0, 0.0, 1.0])


def cloud(kind, rng, n=120, arc=2 * np.pi, noise=0.01):
    """Points of a wavy feature along z."""
    u, v = rng.uniform(0, arc, n), rng.uniform(-15, 15, n)
    e = noise * (np.cos(3 * u) * np.cos(v / 6) + 0.5 * rng.standard_normal(n))
    if kind in ("plane", "profile line"):
        return np.column_stack([2 * v, np.zeros(n) if kind == "profile line" else 4 * u, e])
    if kind == "line":
        return np.column_stack([e, noise * rng.standard_normal(n), v])
    if kind == "sphere":
        w = rng.uniform(-1, 1, n)
        ring = np.sqrt(1 - w**2)
        return np.column_stack([ring * np.cos(u), ring * np.sin(u), w]) * (12 + e)[:, None]
    if kind == "torus":
        w = rng.uniform(0, 2 * np.pi, n)
        ring = 20 + (5 + e) * np.cos(w)
        return np.column_stack([ring * np.cos(u), ring * np.sin(u), (5 + e) * np.sin(w)])
    radius = 10 + e + (0.3 * v if kind == "cone" else 0.0)
    return np.column_stack([radius * np.cos(u), radius * np.sin(u), 0 * v if kind == "circle" else v])


def options(kind, turn=None):
    """Directions that fix signs and section planes, turned with the points."""
    turn = np.eye(3) if turn is None else turn
    if kind == "circle":
        return {"section_normal": turn @ UP}
    if kind == "profile line":
        return {"section_normal": turn @ np.array([0.0, 1.0, 0.0]), "axis": turn @ UP}
    return {"axis": turn @ UP}


KINDS = ("plane", "profile line", "line", "circle", "sphere", "cylinder", "cone", "torus")
ROUND = ("circle", "sphere", "cylinder")
ASSOCIATIONS = [
    (kind, criterion)
    for kind in KINDS
    for criterion in ("G", "C", "N", "X", "GE", "GI")
    if (criterion not in "NX" or kind in ROUND) and (kind != "line" or criterion in "GC")
]


def associations(criteria):
    """Every association with one of the criteria; cones and tori, which take long, are slow tests."""
    return [
        pytest.param(kind, criterion, marks=pytest.mark.slow if kind in ("cone", "torus") else ())
        for kind, criterion in ASSOCIATIONS
        if criterion in criteria
    ]


@pytest.mark.parametrize(("kind", "criterion"), associations(("G", "C", "N", "X", "GE", "GI")))
@given(seed=st.integers(0, 10**6))
@settings(max_examples=3, deadline=None)
def test_motion_order_and_duplicates_change_nothing(kind, criterion, seed):
    rng = np.random.default_rng(seed)
    points = cloud(kind, rng)
    found = associate(points, kind, criterion, **options(kind))
    assert found.certified
    turn, order = rotation(rng.standard_normal(3)), rng.permutation(len(points))
    moved = points[order] @ turn.T + rng.uniform(-300, 300, 3)
    again = associate(moved, kind, criterion, **options(kind, turn))
    assert again.value == pytest.approx(found.value, abs=5e-12)
    np.testing.assert_allclose(again.residuals, found.residuals[order], atol=2e-9)
    if criterion != "G" and not criterion.startswith("G"):  # sums of squares weigh a duplicate
        twice = associate(np.concatenate([points, points[::3]]), kind, criterion, **options(kind))
        assert twice.value == pytest.approx(found.value, abs=1e-12)


@pytest.mark.parametrize(("kind", "criterion"), associations("CNX"))
@given(seed=st.integers(0, 10**6))
@settings(max_examples=3, deadline=None)
def test_more_points_never_help(kind, criterion, seed):
    rng = np.random.default_rng(seed)
    points = cloud(kind, rng, n=160)
    sign = -1.0 if criterion == "X" else 1.0
    values = [sign * associate(points[:n], kind, criterion, **options(kind)).value for n in (60, 100, 160)]
    assert np.diff(values).min() >= -1e-12


@pytest.mark.parametrize(("kind", "criterion"), associations(("GE", "GI")))
@given(seed=st.integers(0, 10**6))
@settings(max_examples=3, deadline=None)
def test_constrained_squares_leave_no_point_on_the_wrong_side(kind, criterion, seed):
    points = cloud(kind, np.random.default_rng(seed))
    found = associate(points, kind, criterion, **options(kind))
    side = 1.0 if criterion == "GE" else -1.0
    assert (side * found.residuals).max() <= 1e-11
    assert (found.multipliers >= 0).all()
    free = associate(points, kind, "G", **options(kind))
    assert (found.residuals**2).sum() >= (free.residuals**2).sum()


@given(lobes=st.sampled_from([3, 4, 5, 7, 9]), phase=st.floats(0, 6), exponent=st.floats(-5, -1.5))
@settings(max_examples=12, deadline=None)
def test_lobed_circles_and_cylinders(lobes, phase, exponent):
    """Peaks and valleys at equal angles: roundness 2 A, circumscribed R + A, inscribed R - A."""
    amplitude, n = 10.0**exponent, 48 * lobes
    angle = 2 * np.pi * np.arange(n) / n
    radius = 20 + amplitude * np.cos(lobes * angle)
    turn = np.array([[np.cos(phase), -np.sin(phase), 0], [np.sin(phase), np.cos(phase), 0], [0, 0, 1.0]])
    ring = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle]) @ turn.T
    tube = np.concatenate([ring + z * UP for z in (-10.0, 0.0, 10.0)])
    for criterion, expected in (("C", 2 * amplitude), ("N", 20 + amplitude), ("X", 20 - amplitude)):
        for points, kind in ((ring, "circle"), (tube, "cylinder")):
            found = associate(points, kind, criterion, **options(kind))
            assert found.value == pytest.approx(expected, abs=1e-12)
            assert found.certified


TIGHT = {"tol_gap_abs": 1e-9, "tol_gap_rel": 1e-9, "tol_feas": 1e-10}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    "what", ["circle N", "sphere N", "cylinder N, fixed axis", "profile line C", "plane C"]
)
def test_conic_solver_agrees_on_convex_associations(what, seed):
    cvxpy = pytest.importorskip("cvxpy", reason="the conic oracle needs cvxpy with Clarabel")
    kind, criterion = what.split(",")[0].rsplit(" ", 1)
    points = cloud(kind, np.random.default_rng(seed), arc=2 * np.pi if seed else 2.5)
    extra = {"fixed_axis": UP} if "fixed" in what else options(kind)
    found = associate(points, kind, criterion, **extra)
    assert found.certified
    if criterion == "N":
        flat = points if kind == "sphere" else points[:, :2]
        centre, radius = cvxpy.Variable(flat.shape[1]), cvxpy.Variable()
        problem = cvxpy.Problem(cvxpy.Minimize(radius), [cvxpy.norm(flat - centre, axis=1) <= radius])
    else:
        local = found.pose.local(points)
        tilt, top, bottom = cvxpy.Variable(2), cvxpy.Variable(), cvxpy.Variable()
        height = local[:, 2] - local[:, :2] @ tilt
        problem = cvxpy.Problem(cvxpy.Minimize(top - bottom), [height <= top, height >= bottom])
    problem.solve(solver="CLARABEL", canon_backend="SCIPY", **TIGHT)
    assert found.value == pytest.approx(problem.value, abs=1e-7)


def on_z(values):
    return np.asarray(values, dtype=float)[:, None] * UP


@pytest.mark.parametrize(("kind", "criterion"), ASSOCIATIONS)
@pytest.mark.parametrize(
    "points",
    [np.zeros((0, 3)), np.zeros((1, 3)), np.zeros((50, 3)), on_z(range(50)), np.tile(np.eye(3), (20, 1))],
    ids=["none", "one", "coincident", "collinear", "three places"],
)
def test_degenerate_points_have_a_named_answer(kind, criterion, points):
    """A value that is certified, or an error that says what is wrong; never a traceback or a NaN."""
    try:
        found = associate(points, kind, criterion, **options(kind))
    except AssociationError:
        return
    assert np.isfinite(found.value)
    assert np.isfinite(found.residuals).all()
