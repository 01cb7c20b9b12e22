"""The weld against closed forms and against what it promises."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.parts import (
    Arc,
    Line,
    bent_plate,
    box,
    cone,
    cylinder,
    extrude,
    filleted_box,
    open_box,
    plate_with_hole,
    pyramid,
    sphere,
    thin_wall,
    wedge,
)  # fmt: skip

from cadskin.errors import GeometryError
from cadskin.shape import smooth_patches, triangle_normals
from cadskin.shape.check import check_mesh, inverted_triangles
from cadskin.skin import weld, weld_report
from cadskin.skin.weld import prepare_weld

PARTS = {
    "box": box(),
    "cylinder": cylinder(),
    "plate": plate_with_hole(),
    "fillet": filleted_box(),
    "sharp": wedge(np.pi / 6),
    "bent": bent_plate(np.deg2rad(20)),
    "thin": thin_wall(),
    "tetrahedron": pyramid(3),
    "pyramid": pyramid(4),
    "hexagonal pyramid": pyramid(6),
    "cone": cone(),
    "sphere": sphere(),
}
EXACT = [name for name in PARTS if name not in ("pyramid", "hexagonal pyramid")]


def local_edge_length(part):
    """Shortest edge at the vertex of each sample (n_c,)."""
    ends = part.surface.edges
    length = np.linalg.norm(part.surface.points[ends[:, 0]] - part.surface.points[ends[:, 1]], axis=1)
    shortest = np.full(part.surface.n_points, np.inf)
    np.minimum.at(shortest, ends.ravel(), np.repeat(length, 2))
    return shortest[part.samples.vertex_ids]


def continuous(part, field):
    """The same field with one value where features meet tangentially."""
    nodes = smooth_patches(part).node_of_sample
    _, first = np.unique(nodes, return_index=True)
    return field[first][nodes]


def noise(part, seed, amplitude):
    """White noise of ``amplitude`` times the local edge length."""
    values = np.random.default_rng(seed).uniform(-1, 1, part.n_samples)
    return continuous(part, amplitude * values * local_edge_length(part))


def by_feature(part, **values):
    """A constant deviation per feature, zero on those not named."""
    field = np.zeros(part.n_samples)
    for name, value in values.items():
        field[part.feature(name=name).rows] = value
    return field


def skin_of(part, field):
    return part.surface.with_points(part.surface.points + weld(part, field))


@pytest.mark.parametrize("scale", [-1.0, 0.2, 1.0, 4.0])
def test_box_with_shifted_faces_is_the_bigger_box(scale):
    part = box((6.0, 4.0, 3.0), 0.5)
    shifts = {"top": 0.3, "bottom": 0.1, "front": 0.2, "back": -0.15, "left": 0.05, "right": 0.25}
    shifts = {name: scale * value for name, value in shifts.items()}
    skin = skin_of(part, by_feature(part, **shifts))
    low, high = skin.points.min(axis=0), skin.points.max(axis=0)
    np.testing.assert_allclose(low, [-shifts["left"], -shifts["front"], -shifts["bottom"]], atol=1e-12)
    np.testing.assert_allclose(high, [6 + shifts["right"], 4 + shifts["back"], 3 + shifts["top"]], atol=1e-12)
    assert skin.volume == pytest.approx(np.prod(high - low), rel=1e-12)
    assert skin.area == pytest.approx(2 * np.sum((high - low) * np.roll(high - low, 1)), rel=1e-12)
    assert check_mesh(skin).watertight


def test_edge_vertices_of_a_bigger_box_stay_evenly_spaced():
    part = box((6.0, 4.0, 3.0), 1.0)
    skin = skin_of(part, by_feature(part, right=3.0))
    edge = (part.surface.points[:, 1] == 0) & (part.surface.points[:, 2] == 0)
    np.testing.assert_allclose(np.diff(np.sort(skin.points[edge, 0])), 1.5, atol=1e-12)


@pytest.mark.parametrize("growth", [0.01, 0.5, -1.0])
def test_cylinder_with_a_radius_offset(growth):
    part = cylinder(radius=3.0, height=5.0)
    skin = skin_of(part, by_feature(part, mantle=growth, top=0.25))
    mantle = part.feature(name="mantle").vertex_ids
    np.testing.assert_allclose(np.hypot(*skin.points[mantle, :2].T), 3.0 + growth, atol=1e-12)
    top = part.feature(name="top").vertex_ids
    np.testing.assert_allclose(skin.points[top, 2], 5.25, atol=1e-12)
    bigger = part.surface.volume * ((3 + growth) / 3) ** 2 * 5.25 / 5
    assert skin.volume == pytest.approx(bigger, rel=1e-12)
    assert check_mesh(skin).watertight


def test_hole_grows_into_the_material():
    part = plate_with_hole(radius=2.0)
    hole = part.feature(name="hole")
    skin = skin_of(part, by_feature(part, hole=-0.8))
    np.testing.assert_allclose(np.hypot(*skin.points[hole.vertex_ids, :2].T), 2.8, atol=1e-12)
    assert check_mesh(skin).watertight
    assert not inverted_triangles(skin.points, part.surface.points, skin.triangles).any()


def test_wedge_edge_is_the_intersection_of_the_offset_planes():
    angle = np.pi / 6
    part = wedge(angle)
    skin = skin_of(part, by_feature(part, a=0.1, b=-0.2))
    edge = np.hypot(*part.surface.points[:, :2].T) < 1e-9
    lines = np.array([[0.0, -1.0], [-np.sin(angle), np.cos(angle)]])  # normals of a and b
    meeting = np.linalg.solve(lines, [0.1, -0.2])
    np.testing.assert_allclose(skin.points[edge, :2], np.tile(meeting, (edge.sum(), 1)), atol=1e-12)


def test_fillet_stays_smooth():
    """A field that is continuous across tangent faces gives one surface without a step at their edges."""
    part = filleted_box(radius=1.5, h=0.15)
    points = part.surface.points[part.samples.vertex_ids]
    field = 0.05 * np.sin(points[:, 0] + 2 * points[:, 2]) * np.cos(points[:, 1])
    names = ("front", "fillet", "left")
    for name in {f.name for f in part.features} - set(names):
        field[part.feature(name=name).rows] = 0.0
    displacement = weld(part, field)
    report = weld_report(part, field, displacement)
    assert report.max_residual < 1e-12
    assert report.max_disagreement < 1e-12
    skin = part.surface.points + displacement
    before = _angles_across(part, part.surface.points, names)
    after = _angles_across(part, skin, names)
    assert np.abs(after - before).max() < 0.05  # slope 0.15 over steps of 0.15: 0.02 from the field itself


def _angles_across(part, points, names):
    """Angle between the normals of the two triangles at every mesh edge inside of the named features."""
    ids = np.concatenate([part.feature(name=name).triangle_ids for name in names])
    normals = triangle_normals(points, part.surface.triangles)
    from cadskin.shape.check import edge_table

    pairs = edge_table(part.surface.triangles).triangles
    pairs = pairs[np.isin(pairs, ids).all(axis=1)]
    return np.arccos(np.clip(np.einsum("ij,ij->i", normals[pairs[:, 0]], normals[pairs[:, 1]]), -1, 1))


def test_tangent_features_share_the_mean_and_the_report_says_so():
    part = filleted_box()
    field = by_feature(part, fillet=0.02)
    displacement = weld(part, field)
    realised = prepare_weld(part).realised(displacement)
    fillet, front = part.feature(name="fillet"), part.feature(name="front")
    common = np.intersect1d(fillet.vertex_ids, front.vertex_ids)
    for feature in (fillet, front):
        np.testing.assert_allclose(
            realised[feature.rows][np.isin(feature.vertex_ids, common)], 0.01, atol=1e-12
        )
    report = weld_report(part, field, displacement)
    assert report.max_disagreement == pytest.approx(0.01)
    assert report.n_disagreeing == 4 * len(common)
    assert report.n_overdetermined == 0


@pytest.mark.parametrize("angle", [1.0, 5.0, 9.0, 11.0, 20.0])
def test_nearly_tangent_planes_do_not_blow_up(angle):
    part = bent_plate(np.deg2rad(angle))
    displacement = weld(part, by_feature(part, a=0.01, b=-0.01))
    longest = np.linalg.norm(displacement, axis=1).max()
    exact = 0.01 / np.sin(np.deg2rad(angle) / 2)
    assert longest <= (exact * (1 + 1e-9) if angle > 10 else 0.0101)


@pytest.mark.parametrize("n_sides", [4, 5, 6])
def test_tip_of_a_pyramid_is_the_least_squares_point(n_sides):
    part = pyramid(n_sides)
    rng = np.random.default_rng(n_sides)
    values = {f"side {k}": v for k, v in enumerate(rng.uniform(-0.1, 0.1, n_sides))}
    displacement = weld(part, by_feature(part, **values))
    tip = int(np.argmax(part.surface.points[:, 2]))
    rows = part.samples.vertex_ids == tip
    normals, wanted = part.samples.normals[rows], by_feature(part, **values)[rows]
    best = np.linalg.lstsq(normals, wanted)[0]
    np.testing.assert_allclose(displacement[tip], best, atol=1e-12)
    report = weld_report(part, by_feature(part, **values), displacement)
    assert report.max_residual == pytest.approx(np.abs(normals @ best - wanted).max(), abs=1e-12)
    assert report.n_overdetermined == n_sides


def test_an_even_offset_of_a_pyramid_has_no_residual():
    part = pyramid(6)
    field = np.full(part.n_samples, 0.1)
    assert weld_report(part, field, weld(part, field)).max_residual < 1e-12


def test_apex_of_a_cone_moves_as_the_offset_cone():
    part = cone(radius=3.0, height=4.0, h=0.1)
    displacement = weld(part, by_feature(part, mantle=0.1))
    tip = int(np.argmax(part.surface.points[:, 2]))
    # The offset of a cone by delta moves its apex by delta / sin(half angle), here 0.1 / 0.6.
    np.testing.assert_allclose(displacement[tip], [0, 0, 0.1 / 0.6], atol=2e-4)


def test_sphere_offset():
    part = sphere(radius=2.0)
    skin = skin_of(part, np.full(part.n_samples, 0.3))
    np.testing.assert_allclose(np.linalg.norm(skin.points, axis=1), 2.3, atol=1e-12)


@pytest.mark.parametrize("name", EXACT)
@pytest.mark.parametrize("seed", range(3))
def test_white_noise_of_a_third_of_the_local_edge_length(name, seed):
    part = PARTS[name]
    field = noise(part, seed, 1 / 3)
    displacement = weld(part, field)
    report = weld_report(part, field, displacement)
    assert report.n_inverted == 0
    assert report.max_residual < 1e-12
    assert check_mesh(part.surface.with_points(part.surface.points + displacement)).problems() == ()


@pytest.mark.parametrize("name", ["pyramid", "hexagonal pyramid"])
def test_white_noise_on_an_overdetermined_corner(name):
    part = PARTS[name]
    field = noise(part, 5, 1 / 3)
    displacement = weld(part, field)
    wrong = np.abs(prepare_weld(part).realised(displacement) - field) > 1e-12
    tip = int(np.argmax(part.surface.points[:, 2]))
    assert (part.samples.vertex_ids[wrong] == tip).all()
    assert weld_report(part, field, displacement).n_inverted == 0


@pytest.mark.parametrize("name", ["box", "plate", "fillet", "bent"])
def test_rough_fields_beyond_it_are_unfolded_and_still_exact(name):
    part = PARTS[name]
    field = noise(part, 1, 0.9)
    linear = prepare_weld(part).displacement(field)
    points, triangles = part.surface.points, part.surface.triangles
    assert inverted_triangles(points + linear, points, triangles, tol=0.02).any()
    report = weld_report(part, field, weld(part, field))
    assert report.n_inverted == 0
    assert report.max_residual < 1e-12


def test_larger_deviations_drag_their_neighbours():
    """The top of a box sinks by 3 edge lengths: the rows of its sides close up, none passes another."""
    part = box((4.0, 4.0, 6.0), 0.5)
    skin = skin_of(part, by_feature(part, top=-1.5, left=1.2))
    assert not inverted_triangles(skin.points, part.surface.points, skin.triangles).any()
    levels = np.unique(
        np.round(skin.points[(part.surface.points[:, 0] == 4) & (part.surface.points[:, 1] == 0), 2], 9)
    )
    np.testing.assert_allclose(np.diff(levels), 4.5 / 12, atol=1e-9)
    assert check_mesh(skin).quality_min > 0.5


@settings(max_examples=25, deadline=None)
@given(
    name=st.sampled_from(sorted(PARTS)),
    seed=st.integers(0, 2**32 - 1),
    factors=st.tuples(st.floats(-3, 3), st.floats(-3, 3)),
)
def test_the_weld_is_linear(name, seed, factors):
    part = PARTS[name]
    a, b = 0.02 * np.random.default_rng(seed).uniform(-1, 1, (2, part.n_samples))
    operator = prepare_weld(part)
    together = operator.displacement(factors[0] * a + factors[1] * b)
    apart = factors[0] * operator.displacement(a) + factors[1] * operator.displacement(b)
    np.testing.assert_allclose(together, apart, atol=1e-12)


@settings(max_examples=25, deadline=None)
@given(name=st.sampled_from(EXACT), seed=st.integers(0, 2**32 - 1), amplitude=st.floats(0, 1 / 3))
def test_any_noise_is_realised_without_folds(name, seed, amplitude):
    part = PARTS[name]
    field = noise(part, seed, amplitude)
    report = weld_report(part, field, weld(part, field))
    assert report.n_inverted == 0
    assert report.max_residual < 1e-12


@settings(max_examples=15, deadline=None)
@given(
    move=st.tuples(*[st.floats(-0.1, 0.1)] * 3),
    name=st.sampled_from(["box", "fillet", "tetrahedron", "pyramid"]),
)
def test_a_translation_is_found_at_edges_and_corners(move, name):
    """delta = n . t is a rigid translation: corners move by t, edges by t across their direction."""
    part = PARTS[name]
    field = part.samples.normals @ np.array(move)
    displacement = weld(part, field)
    constraints = prepare_weld(part).constraints
    corner = constraints.rank == 3
    np.testing.assert_allclose(displacement[corner], np.tile(move, (corner.sum(), 1)), atol=1e-12)
    assert weld_report(part, field, displacement).max_residual < 1e-12


def test_wrong_input_is_refused():
    part = PARTS["box"]
    with pytest.raises(GeometryError, match="deviation has shape"):
        weld(part, np.zeros(3))
    bad = np.zeros(part.n_samples)
    bad[4] = np.nan
    with pytest.raises(GeometryError, match="NaN or infinity, first in row 4"):
        weld(part, bad)


def test_operator_is_prepared_once():
    part = box()
    assert prepare_weld(part) is prepare_weld(part)


def test_an_open_shell_keeps_its_border():
    part = open_box()
    field = by_feature(part, front=0.2, right=-0.3, bottom=0.1)
    displacement = weld(part, field)
    skin = part.surface.with_points(part.surface.points + displacement)
    assert weld_report(part, field, displacement).max_residual < 1e-12
    assert not inverted_triangles(skin.points, part.surface.points, skin.triangles).any()
    check, before = check_mesh(skin), check_mesh(part.surface)
    np.testing.assert_array_equal(check.open_edges, before.open_edges)
    assert check.problems(solid=False) == ()
    low, high = skin.points.min(axis=0), skin.points.max(axis=0)
    np.testing.assert_allclose(low, [0, -0.2, -0.1], atol=1e-12)
    np.testing.assert_allclose(high[:2], [5.7, 4.0], atol=1e-12)


def test_the_report_tells_what_a_slide_on_a_curved_face_costs():
    """The flat of a half cylinder moves by t: its edge slides along a tangent, t² / (2 R) off the mantle."""
    mantle, flat = Arc((0, 0), 2.0, 0.0, np.pi, "mantle"), Line((-2, 0), (2, 0), "flat")
    part = extrude([[mantle, flat]], 3.0, 0.4)
    field = by_feature(part, flat=0.1)
    displacement = weld(part, field)
    skin = part.surface.points + displacement
    radius = np.hypot(*skin[part.feature(name="mantle").vertex_ids, :2].T)
    report = weld_report(part, field, displacement)
    assert report.max_residual < 1e-12
    assert report.max_slide_error == pytest.approx((radius - 2.0).max(), rel=2e-3)
    assert report.max_slide_error == pytest.approx(0.1**2 / (2 * 2.0), rel=1e-9)
    upwards = weld(part, by_feature(part, top=0.1))  # along the mantle's axis a slide costs nothing
    assert weld_report(part, by_feature(part, top=0.1), upwards).max_slide_error < 1e-15
