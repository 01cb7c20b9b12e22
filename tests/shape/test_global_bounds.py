"""Global certificates against brute force: a search over everything never beats what is claimed global."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.shape.association import Pose, associate, frame_about
from cadskin.shape.association.minimax import minimax
from cadskin.shape.association.models import SurfaceModel
from cadskin.shape.association.slabs import least_margin, tilt_proof, tilts_excluded
from cadskin.shape.association.widths import hull_width, width_in_plane


def directions(count):
    k = np.arange(count) + 0.5
    height, angle = k / count, np.pi * (1 + 5**0.5) * k
    ring = np.sqrt(1 - height**2)
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), height], axis=1)


def least_width(points, normals):
    heights = points @ normals.T
    return float((heights.max(axis=0) - heights.min(axis=0)).min())


@pytest.mark.parametrize("thickness", [1e-3, 0.3, 5.0, 40.0])
def test_no_slab_is_narrower_than_the_one_claimed(thickness):
    """From thin plates to lumps: 20,000 directions over the half sphere, and the exact width of the hull."""
    normals = directions(20_000)
    for seed in range(12):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-1, 1, (60, 3)) * [40.0, 25.0, thickness / 2]
        found = associate(points, "plane")
        assert found.certificate.scope == "global"
        assert found.value == pytest.approx(hull_width(points)[0], abs=1e-12)
        assert found.value <= least_width(points, normals) + 1e-12


def nearly_symmetric(name, noise, *, ticks=30):
    """Fields that are level along a line, or all around, but for some noise: many contacts tie."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-1, 1, ticks)]))
    height = {
        "bow": 0.3 * x**2,
        "dish": 0.3 * x**2 + 0.1 * y**2,
        "round dish": 0.2 * (x**2 + y**2),
        "saddle": 0.3 * (x**2 - y**2),
        "waves": 0.3 * np.cos(np.pi * x) * np.cos(np.pi * y),
        "gutter": 0.3 * x**2 + 0.05 * np.sin(3 * x),
    }[name]
    height = height + noise * np.random.default_rng(0).standard_normal(len(x))
    return np.column_stack([30 * x, 30 * y, height])


@pytest.mark.parametrize("noise", [0.0, 1e-12, 1e-9, 1e-6, 1e-3])
@pytest.mark.parametrize("name", ["bow", "dish", "round dish", "saddle", "waves", "gutter"])
def test_nearly_symmetric_fields_are_settled_in_few_steps_and_proved(name, noise):
    points = nearly_symmetric(name, noise)
    flat = Pose(points.mean(axis=0), frame_about(np.array([0, 0, 1.0])), np.zeros(2))
    found = minimax(SurfaceModel(0, points), flat, (3, 4), "zone")
    assert found.certified
    assert found.iterations <= 12
    proof, angle = tilt_proof(points, found, "plane")
    assert proof is not None or angle < 0.05  # of the tilts there is little left for the hull
    result = associate(points, "plane")
    assert result.certified
    assert result.certificate.scope == "global"
    assert result.value - 1e-11 <= result.certificate.bound <= result.value
    assert result.value <= least_width(points, tilted(5000, 0.05)) + 1e-12


def tilted(count, angle):
    """Normals (count, 3) all over a cone about z."""
    k = np.arange(count) + 0.5
    tilt, turn = angle * np.sqrt(k / count), np.pi * (1 + 5**0.5) * k
    return np.stack([np.sin(tilt) * np.cos(turn), np.sin(tilt) * np.sin(turn), np.cos(tilt)], axis=1)


def test_the_width_of_many_edges_does_not_need_their_pairs_in_python():
    """4,000 corners, 12,000 edges: the cone that the proof leaves holds few pairs, the answer is the same."""
    points = nearly_symmetric("round dish", 1e-9, ticks=64)
    near = hull_width(points, about=np.array([0, 0, 1.0]), angle=0.03)
    assert near is not None
    assert near[0] == pytest.approx(associate(points, "plane").value, abs=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_width_of_a_hull_within_a_cone_is_that_of_all_directions_there(seed):
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((80, 3)) * [20.0, 15.0, 10.0 ** rng.uniform(-3, 1)]
    width, direction = hull_width(points)
    axis = direction + 0.05 * rng.standard_normal(3)
    axis /= np.linalg.norm(axis)
    inside = hull_width(points, about=axis, angle=np.arccos(abs(axis @ direction)) + 1e-6)
    assert inside[0] == pytest.approx(width, abs=1e-13)
    assert np.ptp(points @ direction) == pytest.approx(width, abs=1e-12)
    beside = np.cross(direction, [1.0, 0, 0])
    elsewhere = hull_width(points, about=beside / np.linalg.norm(beside), angle=1e-3)
    assert elsewhere is None or elsewhere[0] > width


@pytest.mark.parametrize("seed", range(8))
def test_tilts_that_two_sets_exclude(seed):
    """Every slab tilted by an excluded angle holds the sets only when it is wider than the target."""
    rng = np.random.default_rng(seed)
    depth = float(rng.uniform(-0.2, 1.0))
    upper, lower = rng.uniform(-5, 5, (2, 6, 2))
    target = depth + float(rng.uniform(0, 0.3))
    if target <= 0:
        target = 0.1
    margin = least_margin(upper, lower)
    least, most = tilts_excluded(depth, margin, target)
    high = np.column_stack([upper, depth + rng.uniform(0, 0.1, 6)])
    low = np.column_stack([lower, -rng.uniform(0, 0.1, 6)])
    for tangent in np.linspace(least, min(most, 1.0), 40) if least <= min(most, 1.0) else ():
        phi = 2 * np.arctan(tangent)
        turn = np.linspace(0, 2 * np.pi, 90)
        normals = np.stack(
            [np.sin(phi) * np.cos(turn), np.sin(phi) * np.sin(turn), np.full(90, np.cos(phi))], axis=1
        )
        assert ((high @ normals.T).max(axis=0) - (low @ normals.T).min(axis=0)).min() >= target - 1e-12


def test_no_strip_is_narrower_than_the_one_claimed():
    angle = np.linspace(0, np.pi, 20_001)
    for seed in range(20):
        rng = np.random.default_rng(seed)
        width = float(10.0 ** rng.uniform(-3, 1.6))
        points = np.column_stack(
            [rng.uniform(-20, 20, 40), rng.uniform(-width / 2, width / 2, 40), np.zeros(40)]
        )
        found = associate(points, "profile line", section_normal=[0, 0, 1.0])
        heights = points[:, :2] @ np.stack([np.cos(angle), np.sin(angle)])
        brute = np.ptp(heights, axis=0).min()
        assert width_in_plane(points, np.array([0, 0, 1.0])) <= brute + 1e-12
        if found.certificate.scope == "global":
            assert found.value <= brute + 1e-12


@pytest.mark.parametrize("side", ["GE", "GI"])
@pytest.mark.parametrize("kind", ["plane", "profile line", "circle", "sphere", "cylinder", "cone", "torus"])
def test_constrained_squares_of_large_sets_equal_those_of_the_reference_solver(kind, side):
    """More than 4,000 points take the sampled curvature: the answer is the same as scipy's, on both sides."""
    from scipy.optimize import minimize

    from cadskin.shape.association._kernels import distances

    kernel, free = {
        "plane": (0, (3, 4, 6)),
        "profile line": (0, (3, 6)),
        "circle": (1, (0, 1, 6)),
        "sphere": (2, (0, 1, 2, 6)),
        "cylinder": (1, (0, 1, 3, 4, 6)),
        "cone": (3, (0, 1, 3, 4, 6, 7)),
        "torus": (4, (0, 1, 2, 3, 4, 6, 7)),
    }[kind]
    points = surface(kind, 6000, np.random.default_rng(3))
    found = associate(
        points, kind, side, axis=[0, 0, 1.0], section_normal=[0, 0, 1.0] if kind == "circle" else None
    )
    assert found.certified
    scale = np.array([1, 1, 1, 0.05, 0.05, 0.05, 1, 0.05])[list(free)]
    sign = 1.0 if side == "GE" else -1.0
    near = np.argsort(-sign * found.residuals)[:300]
    base = found.pose

    def at(step, cloud):
        full = np.zeros(8)
        full[list(free)] = step * scale
        moved = base.moved(full)
        return distances(cloud, kernel, moved.origin, moved.axes, moved.shape)

    start = np.zeros(len(free))
    close = np.ascontiguousarray(points[near])
    best = minimize(
        lambda x: float((at(x, points) ** 2).mean()) * 1e4,
        start,
        method="SLSQP",
        constraints={"type": "ineq", "fun": lambda x: -sign * at(x, close) * 1e2},
        options={"ftol": 1e-15, "maxiter": 200},
    )
    beyond = max(0.0, float((sign * at(best.x, points)).max()))  # what it left outside is moved in
    slope = np.cos(base.shape[1]) if kind == "cone" else 1.0
    best.x[free.index(6)] += sign * beyond / slope
    theirs = float((at(best.x, points) ** 2).mean())
    assert float((found.residuals**2).mean()) <= theirs * (1 + 1e-7)


def surface(kind, n, rng):
    u, v = rng.uniform(0, 2 * np.pi, n), rng.uniform(-20, 20, n)
    e = 0.02 * np.sin(3 * u) * np.cos(v / 5) + 0.002 * rng.standard_normal(n)
    if kind in ("plane", "profile line"):
        return np.column_stack([2 * v, np.zeros(n) if kind == "profile line" else 5 * u, e])
    if kind == "sphere":
        d = rng.standard_normal((n, 3))
        return d / np.linalg.norm(d, axis=1)[:, None] * (12 + e)[:, None]
    if kind == "torus":
        w = rng.uniform(0, 2 * np.pi, n)
        ring = 20 + (5 + e) * np.cos(w)
        return np.column_stack([ring * np.cos(u), ring * np.sin(u), (5 + e) * np.sin(w)])
    radius = 10 + e + (0.3 * v if kind == "cone" else 0.0)
    return np.column_stack([radius * np.cos(u), radius * np.sin(u), 0 * v if kind == "circle" else v])


def every_centre(points):
    """All points where two pairs of points, or three points, are equally far: the optima are among them."""
    i, j = np.triu_indices(len(points), 1)
    side, level = points[j] - points[i], 0.5 * ((points[j] ** 2).sum(axis=1) - (points[i] ** 2).sum(axis=1))
    a, b = np.triu_indices(len(side), 1)
    det = side[a, 0] * side[b, 1] - side[a, 1] * side[b, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        x = (level[a] * side[b, 1] - side[a, 1] * level[b]) / det
        y = (side[a, 0] * level[b] - level[a] * side[b, 0]) / det
    centres = np.stack([x, y], axis=1)
    return centres[np.isfinite(centres).all(axis=1)]


@pytest.mark.parametrize("seed", range(4))
def test_zones_of_circles_against_every_possible_centre(seed):
    """Exact enumeration: the minimum zone is found, and "global" is claimed for most of them."""
    rng, claimed = np.random.default_rng(seed), 0
    for _ in range(40):
        n, spread = int(rng.integers(5, 14)), 10.0 ** rng.uniform(-4, -0.1)
        angle, radius = rng.uniform(0, 2 * np.pi, n), 10 * (1 + spread * rng.uniform(-0.5, 0.5, n))
        points = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1)
        distance = np.linalg.norm(every_centre(points)[:, None] - points[None], axis=2)
        best = float(np.ptp(distance, axis=1).min())
        found = associate(np.column_stack([points, np.zeros(n)]), "circle", "C", section_normal=[0, 0, 1.0])
        assert found.value >= best - 1e-10
        if found.certificate.scope == "global":
            claimed += 1
            assert found.value <= best + 1e-10
    assert claimed > 20


def test_inscribed_circle_is_the_largest_among_the_points():
    rng, claimed = np.random.default_rng(1), 0
    for _ in range(60):
        n, spread = int(rng.integers(6, 30)), 10.0 ** rng.uniform(-3, -0.3)
        angle, radius = rng.uniform(0, 2 * np.pi, n), 10 * (1 + spread * rng.uniform(-0.5, 0.5, n))
        points = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
        if np.diff(np.sort(angle), append=np.sort(angle)[0] + 2 * np.pi).max() > 0.95 * np.pi:
            continue
        found = associate(points, "circle", "X", section_normal=[0, 0, 1.0])
        if found.certificate.scope == "global":
            claimed += 1
            centres = rng.uniform(-1, 1, (3000, 2)) * radius.max()
            centres = centres[np.linalg.norm(centres, axis=1) < radius.min()]
            reach = np.linalg.norm(centres[:, None] - points[None, :, :2], axis=2).min(axis=1)
            assert found.value >= reach.max() - 1e-12
    assert claimed > 20


def test_zone_of_a_sphere_is_proved_all_around_and_not_on_a_cap():
    rng = np.random.default_rng(2)
    ball = surface("sphere", 800, rng)
    assert associate(ball, "sphere").certificate.scope == "global"
    assert associate(ball[ball[:, 2] > 8.0], "sphere").certificate.scope == "local"


def test_constrained_plane_of_a_lump_claims_no_more_than_it_can():
    """Thin clouds are quasi-convex: 20,000 normals find nothing better; a cube is not claimed."""
    normals = directions(20_000)
    normals = np.concatenate([normals, -normals])
    for seed, thickness in enumerate((0.01, 1.0, 10.0, 30.0, 60.0)):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-1, 1, (60, 3)) * [30.0, 25.0, thickness / 2]
        found = associate(points, "plane", "GE", axis=[0, 0, 1.0])
        upper = normals[normals @ found.pose.axis > 0]
        heights = points @ upper.T
        squares = ((heights.max(axis=0) - heights) ** 2).sum(axis=0)
        if found.certificate.scope == "global":
            assert (found.residuals**2).sum() <= squares.min() + 1e-9
        assert (found.certificate.scope == "global") == (thickness < 20.0)
