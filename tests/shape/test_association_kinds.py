"""Associations against closed forms, planted optima and an independent linear program."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from cadskin.errors import AssociationError, GeometryError
from cadskin.shape.association import CompositeModel, Patch, Pose, associate, minimax, rotation
from cadskin.shape.association._kernels import PLANE, linear_program


def lobed_circle(lobes, amplitude=0.01, radius=20.0, n=360, phase=0.0):
    angle = 2 * np.pi * np.arange(n) / n
    r = radius + amplitude * np.cos(lobes * angle + phase)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), np.zeros(n)])


def wavy_cylinder(rng, n=600, radius=10.0, length=40.0, noise=0.01):
    angle, height = rng.uniform(0, 2 * np.pi, n), rng.uniform(-length / 2, length / 2, n)
    r = radius + noise * (rng.standard_normal(n) + np.cos(3 * angle) + height / length)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), height])


def wavy_cone(rng, n=600, noise=0.005, half_angle=0.3):
    height, angle = rng.uniform(10, 40, n), rng.uniform(0, 2 * np.pi, n)
    r = height * np.tan(half_angle) + noise * rng.standard_normal(n)
    return np.column_stack([r * np.cos(angle), r * np.sin(angle), height])


def wavy_torus(rng, n=800, major=20.0, minor=5.0, noise=0.01):
    u, v = rng.uniform(0, 2 * np.pi, n), rng.uniform(0, 2 * np.pi, n)
    r = minor + noise * rng.standard_normal(n)
    ring = major + r * np.cos(v)
    return np.column_stack([ring * np.cos(u), ring * np.sin(u), r * np.sin(v)])


def wavy_sphere(rng, n=500, radius=12.0, noise=0.01):
    direction = rng.standard_normal((n, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    return direction * (radius + noise * rng.standard_normal(n))[:, None]


def wavy_plane(rng, n=500, noise=0.02):
    xy = rng.uniform(-50, 50, (n, 2))
    return np.column_stack([xy, 0.001 * xy[:, 0] + noise * rng.standard_normal(n)])


def flatness_by_linear_program(points):
    """Least range of z - a x - b y (equal to the flatness up to the tilt, which the caller iterates away)."""
    n = len(points)
    ones = np.ones((n, 1))
    up = np.column_stack([-points[:, :2], -ones, np.zeros((n, 1))])
    down = np.column_stack([points[:, :2], np.zeros((n, 1)), ones])
    found = linprog(
        [0, 0, 1, -1],
        A_ub=np.concatenate([up, down]),
        b_ub=np.concatenate([-points[:, 2], points[:, 2]]),
        bounds=(None, None),
        method="highs",
    )
    return found.fun / np.sqrt(1 + found.x[0] ** 2 + found.x[1] ** 2), found.x


@pytest.mark.parametrize("seed", range(8))
def test_flatness_equals_the_linear_program(seed):
    points = wavy_plane(np.random.default_rng(seed))
    found = associate(points, "plane")
    # The linear program measures along z; from the optimal plane's own frame both agree to second order.
    frame = found.pose.local(points)
    expected, tilt = flatness_by_linear_program(frame)
    assert abs(tilt[:2]).max() < 1e-9
    assert found.value == pytest.approx(expected, abs=1e-9)
    assert found.certified
    assert found.certificate.scope == "global"


@pytest.mark.parametrize("lobes", [2, 3, 5, 8, 15])
def test_lobed_circle_has_its_closed_form(lobes):
    n = 24 * lobes
    points = lobed_circle(lobes, n=n)
    for criterion, expected in [("C", 0.02), ("N", 20.01)]:
        found = associate(points, "circle", criterion, section_normal=[0, 0, 1])
        assert found.value == pytest.approx(expected, abs=1e-13)
        assert found.certified
        np.testing.assert_allclose(found.feature.centre, 0, atol=1e-7 if lobes == 2 else 1e-12)
    # Of two lobes, two opposite valleys carry the inscribed circle and the next points bind.
    inscribed = associate(points, "circle", "X", section_normal=[0, 0, 1])
    assert inscribed.value == pytest.approx(19.99, abs=1e-6 if lobes == 2 else 1e-13)
    squares = associate(points, "circle", "G", section_normal=[0, 0, 1])
    assert squares.radius == pytest.approx(20.0, abs=1e-12)
    assert squares.value == pytest.approx(0.01 / np.sqrt(2), abs=1e-12)


CASES = {
    "plane": (wavy_plane, "C"),
    "circle": (lambda rng: wavy_sphere(rng) * [1, 1, 0], None),
    "cylinder": (wavy_cylinder, "C"),
    "cylinder N": (wavy_cylinder, "N"),
    "cylinder X": (wavy_cylinder, "X"),
    "sphere": (wavy_sphere, "C"),
    "sphere N": (wavy_sphere, "N"),
    "sphere X": (wavy_sphere, "X"),
    "cone": (wavy_cone, "C"),
    "torus": (wavy_torus, "C"),
}


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case[1]])
def test_rigid_motion_order_and_offset_change_nothing(name):
    make, criterion = CASES[name]
    rng = np.random.default_rng(11)
    points = make(rng)
    kind = name.split()[0]
    found = associate(points, kind, criterion)
    assert found.certified
    assert found.certificate.kkt < 1e-9
    turned = points[rng.permutation(len(points))] @ rotation(rng.standard_normal(3)).T + [70.0, -30.0, 500.0]
    again = associate(turned, kind, criterion)
    assert again.value == pytest.approx(found.value, abs=2e-12)
    far = associate(points + np.array([1e5, -1e5, 1e5]), kind, criterion)
    assert far.value == pytest.approx(found.value, abs=1e-10)  # the coordinates are rounded to 1.5e-11


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case[1]])
def test_more_points_never_narrow_the_zone(name):
    make, criterion = CASES[name]
    points = make(np.random.default_rng(5))
    kind = name.split()[0]
    sign = -1.0 if criterion == "X" else 1.0
    values = [sign * associate(points[:n], kind, criterion).value for n in (100, 200, 400, len(points))]
    assert np.diff(values).min() >= -1e-12


@pytest.mark.parametrize("name", ["cylinder", "cone", "torus", "sphere"])
def test_minimum_zone_is_not_beaten_by_small_motions(name):
    make, _ = CASES[name]
    rng = np.random.default_rng(3)
    points = make(rng)
    found = associate(points, name, "C")
    distance = type(found.feature).distance
    assert np.ptp(distance(found.feature, points)) == pytest.approx(found.value, abs=1e-12)
    assert found.value < associate(points, name, "G").width
    from cadskin.shape.association._kernels import distances

    kernel = {"cylinder": 1, "sphere": 2, "cone": 3, "torus": 4}[name]
    for size in (1e-2, 1e-4, 1e-6):
        for _ in range(50):
            step = size * rng.standard_normal(8) * [1, 1, 1, 0.05, 0.05, 0.05, 0, 0]
            moved = found.pose.moved(step)
            width = np.ptp(distances(points, kernel, moved.origin, moved.axes, moved.shape))
            assert width >= found.value - 1e-12


@given(st.integers(0, 10**6), st.integers(2, 6), st.integers(8, 40))
@settings(max_examples=40, deadline=None)
def test_dual_simplex_equals_highs(seed, k, m):
    rng = np.random.default_rng(seed)
    matrix, right = rng.standard_normal((m, k)), rng.uniform(0.1, 1, m)
    cost = rng.standard_normal(k)
    z, _, multipliers, status = linear_program(matrix, right, cost, np.ones(k), 1e-13)
    expected = linprog(cost, A_ub=matrix, b_ub=right, bounds=(-1, 1), method="highs")
    assert status == 0
    assert cost @ z == pytest.approx(expected.fun, abs=1e-9)
    assert (matrix @ z <= right + 1e-9).all()
    assert (multipliers >= 0).all()


def test_three_points_are_a_perfect_plane():
    found = associate([[0, 0, 0], [1, 0, 0], [0, 1, 0.3]], "plane")
    assert found.value == 0.0
    assert found.certified


@pytest.mark.parametrize("kind", ["plane", "cylinder", "sphere", "cone", "torus"])
def test_perfect_surfaces_have_the_value_zero(kind):
    rng = np.random.default_rng(0)
    make = {
        "plane": lambda: wavy_plane(rng, noise=0.0),
        "cylinder": lambda: wavy_cylinder(rng, noise=0.0),
        "sphere": lambda: wavy_sphere(rng, noise=0.0),
        "cone": lambda: wavy_cone(rng, noise=0.0),
        "torus": lambda: wavy_torus(rng, noise=0.0),
    }[kind]
    found = associate(make() @ rotation(np.array([0.3, 0.2, 0.9])).T, kind)
    assert found.value == 0.0
    assert found.certified


def test_ten_degree_arc_of_a_cylinder():
    rng = np.random.default_rng(2)
    angle, height = rng.uniform(0, np.radians(10), 800), rng.uniform(0, 30, 800)
    r = 50 + 0.005 * rng.standard_normal(800)
    points = np.column_stack([r * np.cos(angle), r * np.sin(angle), height])
    found = associate(points, "cylinder")
    assert found.certified
    assert found.value <= 0.005 * 8
    with pytest.raises(AssociationError, match="none exists"):
        associate(points, "cylinder", "X")


@pytest.mark.parametrize(
    ("points", "kind", "error", "text"),
    [
        ([[0, 0, 0], [1, 0, 0]], "plane", AssociationError, "at least 3"),
        ([[0, 0, 0]] * 9, "plane", AssociationError, "at least 3"),
        ([[i, 2 * i, 0] for i in range(9)], "plane", AssociationError, "collinear"),
        ([[i, 0, 0] for i in range(9)], "circle", AssociationError, "collinear"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [np.nan, 1, 1]], "plane", GeometryError, "row 3"),
        ([[0, 0], [1, 0]], "plane", GeometryError, "shape"),
        (
            [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0], [5, 2, 0]],
            "cylinder",
            AssociationError,
            "one plane",
        ),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0]], "pyramid", AssociationError, "unknown kind"),
    ],
)
def test_bad_input_is_refused_with_the_reason(points, kind, error, text):
    with pytest.raises(error, match=text):
        associate(points, kind)


def test_duplicates_change_nothing():
    points = wavy_cylinder(np.random.default_rng(9))
    twice = np.concatenate([points, points, points[:50]])
    assert associate(twice, "cylinder").value == pytest.approx(associate(points, "cylinder").value, abs=1e-13)


def test_large_set_equals_its_hull():
    """A working set smaller than the cloud finds the same optimum as all points that can matter."""
    rng = np.random.default_rng(4)
    points = wavy_plane(rng, n=60_000)
    points[:, 2] += 0.05 * np.sin(points[:, 0] / 9) * np.cos(points[:, 1] / 7)
    from scipy.spatial import ConvexHull

    hull = points[ConvexHull(points * [1, 1, 1000]).vertices]
    assert associate(points, "plane").value == pytest.approx(associate(hull, "plane").value, abs=1e-13)


def test_not_unique_is_said():
    """A plane against itself may slide and turn in itself without loss; a third face stops it."""
    rng = np.random.default_rng(1)
    base = Pose(np.zeros(3), np.eye(3), np.zeros(2))
    cloud = wavy_plane(rng)
    flat = CompositeModel((Patch(PLANE, base),), cloud, np.zeros(len(cloud), dtype=int))
    assert not minimax(flat, base, (0, 1, 2, 3, 4, 5), "symmetric").unique
    assert minimax(flat, base, (2, 3, 4), "symmetric").unique


@pytest.mark.parametrize("name", ["cylinder", "cone", "sphere", "torus"])
def test_no_linear_program_improves_the_minimum_zone(name):
    """HiGHS on distances linearised by finite differences: an oracle that shares no code with the kernel."""
    make, _ = CASES[name]
    points = make(np.random.default_rng(21))
    found = associate(points, name, "C")
    pose, h = found.pose, 1e-6
    kernel, free = {
        "cylinder": (1, (0, 1, 3, 4)),
        "sphere": (2, (0, 1, 2)),
        "cone": (3, (0, 1, 3, 4, 7)),
        "torus": (4, (0, 1, 2, 3, 4, 7)),
    }[name]
    from cadskin.shape.association._kernels import distances

    def at(step):
        moved = pose.moved(step)
        return distances(points, kernel, moved.origin, moved.axes, moved.shape)

    columns = [(at(h * e) - at(-h * e)) / (2 * h) for e in np.eye(8)[list(free)]]
    jacobian, value = np.column_stack(columns), at(np.zeros(8))
    one, zero = np.ones((len(points), 1)), np.zeros((len(points), 1))
    solved = linprog(
        np.r_[np.zeros(len(free)), 1, -1],
        A_ub=np.concatenate([np.hstack([jacobian, -one, zero]), np.hstack([-jacobian, zero, one])]),
        b_ub=np.concatenate([-value, value]),
        bounds=[(-0.01, 0.01)] * len(free) + [(None, None)] * 2,
        method="highs",
    )
    assert solved.fun == pytest.approx(found.value, abs=1e-8)


TIGHT = {"tol_gap_abs": 1e-11, "tol_gap_rel": 1e-11, "tol_feas": 1e-11}


@pytest.mark.parametrize("side", ["GE", "GI"])
def test_conic_solver_agrees_on_the_tangent_plane(side):
    """The plane of least squares that has every point below it (GE) or above it (GI) along its normal."""
    cvxpy = pytest.importorskip("cvxpy", reason="the conic oracle needs cvxpy with Clarabel")
    points = wavy_plane(np.random.default_rng(9))
    sign = 1.0 if side == "GE" else -1.0
    found = associate(points, "plane", side)
    assert found.certified
    assert (sign * found.residuals).max() <= 1e-12
    local = found.pose.local(points)
    # Two steps of the exact problem: heights over a tilt that is small about the answer are distances.
    tilt, level = cvxpy.Variable(2), cvxpy.Variable()
    height = local[:, 2] - local[:, :2] @ tilt - level
    problem = cvxpy.Problem(cvxpy.Minimize(cvxpy.sum_squares(height)), [sign * height <= 0])
    problem.solve(solver="CLARABEL", canon_backend="SCIPY", **TIGHT)
    assert (found.residuals**2).sum() == pytest.approx(problem.value, rel=1e-6)
    np.testing.assert_allclose(tilt.value, 0.0, atol=1e-6)


@pytest.mark.parametrize("kind", ["cylinder", "sphere", "cone"])
def test_both_material_sides(kind):
    """GI is the mirror of GE: nothing outside, nothing inside, and the two enclose the plain fit."""
    rng = np.random.default_rng(10)
    angle, v = rng.uniform(0, 2 * np.pi, 500), rng.uniform(-1, 1, 500)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * v])
    up = np.array([0.0, 0.0, 1.0])
    bump = 0.01 * rng.standard_normal(500)[:, None]
    points = {
        "cylinder": (10 + bump) * ring + 20 * v[:, None] * up,
        "sphere": (10 + bump) * (np.sqrt(1 - v**2)[:, None] * ring + v[:, None] * up),
        "cone": (10 + 3 * v[:, None] + bump) * ring + 10 * v[:, None] * up,
    }[kind]
    outer, inner = (associate(points, kind, side, axis=up) for side in ("GE", "GI"))
    assert outer.certified
    assert inner.certified
    assert outer.residuals.max() <= 1e-11
    assert inner.residuals.min() >= -1e-11
    squares = (associate(points, kind, "G", axis=up).residuals ** 2).sum()
    for found in (outer, inner):
        assert (found.residuals**2).sum() > squares
        assert found.multipliers.min() > 0
    hole = associate(points, kind, "GE", axis=up, internal=True)
    np.testing.assert_array_equal(hole.residuals, inner.residuals)


@pytest.mark.parametrize("kind", ["plane", "sphere"])
def test_conic_solver_agrees(kind):
    """Clarabel through cvxpy: minimum circumscribed sphere (second-order cones), flatness (linear)."""
    cvxpy = pytest.importorskip("cvxpy", reason="the conic oracle needs cvxpy with Clarabel")
    rng = np.random.default_rng(8)
    if kind == "sphere":
        points = wavy_sphere(rng, n=200)
        centre, radius = cvxpy.Variable(3), cvxpy.Variable()
        problem = cvxpy.Problem(cvxpy.Minimize(radius), [cvxpy.norm(points - centre, axis=1) <= radius])
        problem.solve(solver="CLARABEL", canon_backend="SCIPY", **TIGHT)
        assert associate(points, "sphere", "N").value == pytest.approx(problem.value, abs=1e-7)
        return
    found = associate(wavy_plane(rng), "plane")
    local = found.pose.local(wavy_plane(np.random.default_rng(8)))
    tilt, top, bottom = cvxpy.Variable(2), cvxpy.Variable(), cvxpy.Variable()
    height = local[:, 2] - local[:, :2] @ tilt
    problem = cvxpy.Problem(cvxpy.Minimize(top - bottom), [height <= top, height >= bottom])
    problem.solve(solver="CLARABEL", canon_backend="SCIPY", **TIGHT)
    assert found.value == pytest.approx(problem.value, abs=1e-7)
