"""Datums with material requirements, composite frames, general tolerances, and what is refused by name."""

from __future__ import annotations

import numpy as np
import pytest
from support.parts import Arc, Line, extrude

from cadskin.skin import SkinEnsemble
from cadskin.spec import (
    Datum,
    Specification,
    as_selection,
    flatness,
    parallelism,
    perpendicularity,
    position,
    roundness,
    size,
    straightness,
    surface_profile,
)
from cadskin.verify import verify
from cadskin.verify.part_form import _per_length

TURN = 2 * np.pi


@pytest.fixture(scope="module")
def plate():
    """A plate 60 x 40 x 10 with holes of radius 5 at x = -20, 0 and 20; the names tell the faces."""
    x, y = 30.0, 20.0
    outline = [
        Line((-x, -y), (x, -y)), Line((x, -y), (x, y)), Line((x, y), (-x, y)), Line((-x, y), (-x, -y))
    ]  # fmt: skip
    holes = [[Arc((c, 0.0), 5.0, TURN, 0.0, name=f"hole {c:g}")] for c in (-20.0, 0.0, 20.0)]
    return extrude([outline, *holes], 10.0, 1.0)


def face(part, condition):
    """Return the index of the one face that fulfils a condition."""
    (found,) = [f.index for f in part.faces if condition(f)]
    return found


def hole(part, x):
    return face(part, lambda f: f.kind == "cylinder" and abs(f.ideal.origin[0] - x) < 1e-9)


def floor(part):
    return face(part, lambda f: f.kind == "plane" and f.normal[2] < -0.5)


def roof(part):
    return face(part, lambda f: f.kind == "plane" and f.normal[2] > 0.5)


def moved(part, shifts, radius=5.0):
    """Shift holes in x and y and set their radius: only the vertices of their walls move."""
    points = np.array(part.surface.points)
    for x, (dx, dy, r) in shifts.items():
        ids = part.feature_of(hole(part, x)).vertex_ids
        relative = part.surface.points[ids, :2] - [x, 0.0]
        points[ids, :2] = [x + dx, dy] + relative * (r / radius)
    return part.surface.with_points(points)


def system(part, text, *tolerances, dimensions=()):
    datums = [Datum("A", as_selection(floor(part))), Datum("B", as_selection(hole(part, -20.0)))]
    return Specification(*tolerances, datums=datums, dimensions=dimensions, checked=False)


def test_mobile_datum_gives_its_room_away(plate):
    """B at radius 5.05 in its boundary of 9.9: 0.1 of room. A hole displaced by 0.3 along x needs 0.2."""
    made = moved(plate, {-20.0: (0, 0, 5.05), 20.0: (0.3, 0, 5.0)})
    spec = system(
        plate,
        "A|B(M)",
        position(hole(plate, 20.0), 0.5, diameter=True, datums="A|B(M)"),
        dimensions=[size(hole(plate, -20.0), 10.0, (-0.1, 0.1), id="b")],
    )
    found = verify(made, spec, nominal=plate)
    assert not found.unresolved
    evaluation = found["position-1"]
    # The room is that of a cylinder among the sampled points of the hole: a little more than 0.1.
    sampling = 5.05 * (1 - np.cos(np.pi / 31))
    assert 2 * (0.2 - sampling) - 1e-9 <= evaluation.value <= 0.4 + 1e-9
    assert evaluation.certified
    assert "virtual boundaries 9.9" in " ".join(evaluation.operations)


def test_mobile_datum_value_is_the_best_over_all_frames(plate):
    """Against a search over the frame by another optimiser."""
    from scipy.optimize import minimize

    made = moved(plate, {-20.0: (0.02, -0.03, 5.03), 0.0: (0.05, 0.1, 5.0), 20.0: (-0.1, 0.15, 5.0)})
    holes = [hole(plate, 0.0), hole(plate, 20.0)]
    spec = system(
        plate,
        "A|B(M)",
        position(holes, 0.5, diameter=True, datums="A|B(M)"),
        dimensions=[size(hole(plate, -20.0), 10.0, (-0.04, 0.1), id="b")],
    )
    value = verify(made, spec, nominal=plate)["position-1"].value
    datum = made.points[plate.feature_of(hole(plate, -20.0)).vertex_ids][:, :2]
    centres = np.array([[0.05, 0.1], [20 - 0.1, 0.15]])

    def placed(x, points):
        c, s = np.cos(x[2] / 20), np.sin(x[2] / 20)
        return (points - x[:2]) @ np.array([[c, -s], [s, c]])

    def room(x):
        return np.linalg.norm(placed(x, datum) - [-20.0, 0.0], axis=1) - 4.98

    def reach(x):
        return np.linalg.norm(placed(x, centres) - [[0.0, 0.0], [20.0, 0.0]], axis=1)

    best = minimize(
        lambda z: z[3],
        np.array([0, 0, 0, 0.3]),
        constraints=[
            {"type": "ineq", "fun": lambda z: room(z[:3])},
            {"type": "ineq", "fun": lambda z: z[3] - reach(z[:3])},
        ],
        options={"ftol": 1e-14, "maxiter": 500},
    )
    assert value == pytest.approx(2 * best.fun, abs=1e-7)


def test_datum_outside_of_its_boundary_is_said(plate):
    made = moved(plate, {-20.0: (0, 0, 4.9)})
    spec = system(
        plate,
        "A|B(M)",
        position(hole(plate, 20.0), 0.5, diameter=True, datums="A|B(M)"),
        dimensions=[size(hole(plate, -20.0), 10.0, (-0.1, 0.1), id="b")],
    )
    found = verify(made, spec, nominal=plate)
    assert "violates its virtual boundary by 0.05" in dict(found.unresolved)["position-1"]
    assert not found.conforming


def test_own_tolerance_of_a_mobile_datum_enters_its_boundary(plate):
    made = moved(plate, {-20.0: (0, 0, 5.0), 20.0: (0.1, 0, 5.0)})
    spec = system(
        plate,
        "A|B(M)",
        perpendicularity(hole(plate, -20.0), 0.2, diameter=True, datums="A", material="MMR"),
        position(hole(plate, 20.0), 0.5, diameter=True, datums="A|B(M)"),
        dimensions=[size(hole(plate, -20.0), 10.0, (0.0, 0.1), id="b")],
    )
    found = verify(made, spec, nominal=plate)
    assert "virtual boundaries 9.8 mm" in " ".join(found["position-1"].operations)
    assert found["position-1"].value == pytest.approx(0.0, abs=0.06)
    # Perpendicular and of maximum material size: 0.1 of room on all sides.
    assert found["perpendicularity-1"].details["virtual_boundary_violation"] == pytest.approx(-0.1, abs=1e-3)
    assert found.conforming


def test_both_requirements_at_once(plate):
    """Feature and datum at maximum material: boundaries of both, stacked (a functional gauge)."""
    made = moved(plate, {-20.0: (0, 0, 5.05), 20.0: (0.3, 0, 5.05)})
    sizes = [size(hole(plate, x), 10.0, (0.0, 0.1), id=f"s{x}") for x in (-20.0, 20.0)]

    def conforms(value):
        tolerance = position(hole(plate, 20.0), value, diameter=True, datums="A|B(M)", material="MMR")
        return verify(made, system(plate, "", tolerance, dimensions=sizes), nominal=plate).conforming

    # Needed: 0.3 = 0.05 (datum) + 0.05 + t / 2; the gaps between sampled points give at most 0.06 more each.
    assert conforms(0.41)
    assert not conforms(0.1)


def test_composite_lower_segment_holds_the_pattern_only(plate):
    """All holes shifted together by 0.1: the upper segment sees it, the lower one does not."""
    made = moved(plate, dict.fromkeys((-20.0, 0.0, 20.0), (0.1, 0.0, 5.0)))
    holes = [hole(plate, x) for x in (-20.0, 0.0, 20.0)]
    side = face(plate, lambda f: f.kind == "plane" and f.normal[0] < -0.5)
    spec = Specification(
        position(holes, 0.5, diameter=True, datums="A|D", id="upper"),
        position(holes, 0.1, diameter=True, datums="A|D", id="lower", parent="upper"),
        datums={"A": floor(plate), "D": side},
        checked=False,
    )
    found = verify(made, spec, nominal=plate)
    assert found["upper"].value == pytest.approx(0.2, abs=1e-9)
    assert found["lower"].value == pytest.approx(0.0, abs=1e-9)


def test_lower_segment_still_holds_rotation(plate):
    made = moved(plate, {-20.0: (0, 0.1, 5.0), 0.0: (0, 0, 5.0), 20.0: (0, -0.1, 5.0)})
    holes = [hole(plate, x) for x in (-20.0, 0.0, 20.0)]
    side = face(plate, lambda f: f.kind == "plane" and f.normal[0] < -0.5)
    spec = Specification(
        position(holes, 0.5, diameter=True, datums="A|D", id="upper"),
        position(holes, 0.1, diameter=True, datums="A|D", id="lower", parent="upper"),
        position(holes, 0.1, diameter=True, datums="A", id="loose", parent="upper"),
        datums={"A": floor(plate), "D": side},
        checked=False,
    )
    found = verify(made, spec, nominal=plate)
    assert found["lower"].value == pytest.approx(0.2, abs=1e-9)
    assert found["loose"].value < 1e-3  # without D the pattern may turn


def test_orientation_only_datum(plate):
    """A datum >< holds no translation: the raised roof is in place."""
    points = np.array(plate.surface.points)
    points[plate.feature_of(roof(plate)).vertex_ids, 2] += 0.1
    made = plate.surface.with_points(points)
    spec = Specification(
        surface_profile(roof(plate), 0.3, datums="A"),
        surface_profile(roof(plate), 0.3, datums="A(ORIENTATION)"),
        datums={"A": floor(plate)},
    )
    found = verify(made, spec, nominal=plate)
    assert found["surface_profile-1"].value == pytest.approx(0.2, abs=1e-12)
    assert found["surface_profile-2"].value == pytest.approx(0.0, abs=1e-12)


def test_common_zone_of_profiles_moves_together(plate):
    """Floor and roof 0.1 apart too far: each alone is perfect, together each is off by 0.05."""
    points = np.array(plate.surface.points)
    points[plate.feature_of(roof(plate)).vertex_ids, 2] += 0.1
    made = plate.surface.with_points(points)
    both = [floor(plate), roof(plate)]
    spec = Specification(surface_profile(both, 0.3), surface_profile(both, 0.3, combined=True), checked=False)
    found = verify(made, spec, nominal=plate)
    assert found["surface_profile-1"].value == pytest.approx(0.0, abs=1e-9)
    assert found["surface_profile-2"].value == pytest.approx(0.1, abs=1e-9)


def test_tangent_plane_forgives_what_lies_below(array_box):
    """A dish on a level rim: the tangent plane is the rim; a dome touches at one place and leans freely."""
    points = np.array(array_box.surface.points)
    top = np.isclose(points[:, 2], 10.0)
    x, y = points[top, 0] / 30, points[top, 1] / 20
    points[top, 2] += -0.1 * (1 - x**2) * (1 - y**2) + 0.02 * x
    made = array_box.surface.with_points(points)
    spec = Specification(
        parallelism(5, 0.2, datums="A"),
        parallelism(5, 0.2, datums="A", modifiers=["TANGENT_PLANE"]),
        datums={"A": 4},
    )
    found = verify(made, spec, nominal=array_box)
    assert found["parallelism-2"].value == pytest.approx(0.04, abs=1e-9)
    assert found["parallelism-1"].value > 0.1


def test_flatness_of_a_median_surface(array_box):
    """Both faces bent the same way: the middle is bent as much; bent against each other: it is flat."""
    spec = Specification(flatness([4, 5], 0.1, derived="median_plane"))
    for sign, value in ((1.0, 0.02), (-1.0, 0.0)):
        points = np.array(array_box.surface.points)
        bow = 0.02 * (1 - (points[:, 1] / 20) ** 2)
        points[:, 2] += np.where(points[:, 2] > 0, bow, sign * bow) * np.isclose(abs(points[:, 2]), 10)
        found = verify(array_box.surface.with_points(points), spec, nominal=array_box)
        assert not found.unresolved
        assert found["flatness-1"].value == pytest.approx(value, abs=1e-9)


def test_straightness_per_length(array_box):
    """z = c x^2 over any 15 mm deviates by c 15^2 / 4, over the whole 60 mm by c 60^2 / 4."""
    curve = 1e-4
    points = np.array(array_box.surface.points)
    top = np.isclose(points[:, 2], 10.0)
    points[top, 2] += curve * points[top, 0] ** 2
    spec = Specification(straightness(5, 0.1), straightness(5, 0.1, per_length=15.0))
    found = verify(array_box.surface.with_points(points), spec, nominal=array_box)
    assert found["straightness-1"].value == pytest.approx(curve * 60**2 / 4, rel=1e-3)
    # Where the lines cross mesh edges the height is that of the edge, not of the parabola.
    assert found["straightness-2"].value == pytest.approx(curve * 15**2 / 4, rel=0.1)


def test_intersection_plane_says_which_lines(array_box):
    """A roof bent along y only: lines along x are straight, lines along y are bent by the whole bow."""
    points = np.array(array_box.surface.points)
    top = np.isclose(points[:, 2], 10.0)
    points[top, 2] += 0.02 * (1 - (points[top, 1] / 20) ** 2)
    spec = Specification(
        straightness(5, 0.03, intersection_plane="parallel B"),
        straightness(5, 0.03, intersection_plane="perpendicular B"),
        straightness(5, 0.03),
        parallelism(5, 0.03, datums="B", orientation_plane="parallel B", id="turned"),
        datums={"B": 3},
        checked=False,
    )
    found = verify(array_box.surface.with_points(points), spec, nominal=array_box)
    assert found["straightness-1"].value == pytest.approx(0.0, abs=1e-9)
    assert found["straightness-2"].value == pytest.approx(0.02, rel=2e-2)
    assert found["straightness-3"].value == pytest.approx(0.0, abs=1e-9)  # the longer side is x
    assert "orientation plane" in dict(found.unresolved)["turned"]


def test_worst_length_is_found():
    """A bump of 0.02 within 10 mm of a straight line 100 mm long."""
    x = np.linspace(0, 100, 201)
    z = 0.0005 * x + 0.02 * np.maximum(0, 1 - ((x - 40) / 5) ** 2)
    line = np.column_stack([x, 0 * x, z])[np.random.default_rng(0).permutation(201)]
    found = _per_length(line, np.array([0, 1.0, 0]), 20.0)
    assert found.value == pytest.approx(0.02 / np.hypot(1, 0.0005), rel=1e-5)
    assert _per_length(line, np.array([0, 1.0, 0]), 2.0).value < 0.004


def test_general_tolerance_holds_where_there_is_no_other(array_box):
    general = surface_profile(None, 0.1, datums="A|B|C")
    spec = Specification(flatness(5, 0.01), datums={"A": 4, "B": 2, "C": 0}, default=general)
    points = np.array(array_box.surface.points)
    points[np.isclose(points[:, 0], 30.0), 0] += 0.2
    found = verify(array_box.surface.with_points(points), spec, nominal=array_box)
    names = [name for name, _ in found.evaluations]
    assert len(names) == 6
    assert not any(str(5) in name for name in names if name.startswith("general"))
    failed = [name for name, evaluation in found.evaluations if not evaluation.ok]
    assert failed == [f"general@{array_box.feature_of(1).name.replace(' ', '')}"]


def test_general_form_concerns_the_features_that_have_it(array_shaft):
    spec = Specification(roundness(None, 0.1), checked=False)
    found = verify(array_shaft.surface, spec, nominal=array_shaft)
    assert [evaluation.characteristic for _, evaluation in found.evaluations] == ["roundness"]
    assert not found.unresolved


def test_common_datum_of_stepped_planes(plate):
    """Floor and roof turned round are no step; two faces at different heights are taken at their heights."""
    from cadskin.verify import DatumFeature, establish

    rng = np.random.default_rng(3)
    low = np.column_stack([rng.uniform(-30, 0, 50), rng.uniform(-20, 20, 50), -rng.uniform(0, 0.02, 50)])
    high = np.column_stack([rng.uniform(10, 30, 50), rng.uniform(-20, 20, 50), 5 - rng.uniform(0, 0.02, 50)])
    low[:3] = [[-30, -20, 0], [-30, 20, 0], [-15, 0, 0]]
    high[:3] = [[30, -20, 5], [30, 20, 5], [20, 0, 5]]
    points = np.concatenate([low, high])
    levels = np.repeat([0.0, 5.0], 50)
    frame = establish([DatumFeature("A-B", "plane", points, hint=[0, 0, 1.0], levels=levels)])
    flat = establish([DatumFeature("A", "plane", points - levels[:, None] * [0, 0, 1.0], hint=[0, 0, 1.0])])
    np.testing.assert_allclose(frame.axes[:, 2], flat.axes[:, 2], atol=1e-9)
    assert frame.certified


@pytest.mark.parametrize(
    ("tolerance", "text"),
    [
        (flatness(5, 0.1, modifiers=["RECIPROCITY_REQUIREMENT"]), "RECIPROCITY_REQUIREMENT"),
        (position(5, 0.1, datums="A", projected=10.0), "projected"),
        (flatness(5, 0.1, per_length=10.0), "per length"),
        (position(5, 0.1, datums="A(TRANSLATION)"), "TRANSLATION of datum A"),
        (parallelism(5, 0.1, datums="A(M)"), "material requirement"),
        (surface_profile(5, 0.1, datums="A", material="MMR"), "MMR"),
    ],
)
def test_what_would_be_passed_over_is_refused(array_box, tolerance, text):
    spec = Specification(tolerance, datums={"A": 4}, checked=False)
    found = verify(array_box.surface, spec, nominal=array_box)
    assert not found.evaluations
    assert text in found.unresolved[0][1]
    assert not found.conforming


def test_form_parameters(array_box):
    points = np.array(array_box.surface.points)
    points[np.argmin(np.linalg.norm(points - [0, 0, 10.0], axis=1)), 2] += 0.06
    made = array_box.surface.with_points(points)
    words = ("PEAK_HEIGHT", "VALLEY_DEPTH", "STANDARD_DEVIATION")
    spec = Specification(*(flatness(5, 0.1, modifiers=[word]) for word in words), checked=False)
    found = verify(made, spec, nominal=array_box)
    values = [evaluation.value for _, evaluation in found.evaluations]
    # About the minimum zone plane of a flat grid with one peak: half above, half below.
    assert values[:2] == pytest.approx([0.03, 0.03], abs=1e-9)
    assert values[2] == pytest.approx(0.03, abs=1e-9)


def test_ensemble_takes_the_verdict_of_the_boundary(array_shaft):
    """A shaft of radius 10.02 in its boundary of 20.14: the value alone would fail, the requirement holds."""
    fields = np.zeros((2, array_shaft.n_samples))
    round_ = array_shaft.feature_of(0)
    rows = array_shaft.feature_ids() == round_.id
    fields[:, rows] = [[0.02], [0.2]]
    spec = Specification(
        position(0, 0.04, diameter=True, datums="A", material="MMR"),
        datums={"A": 2},
        dimensions=[size(0, 20.0, (-0.1, 0.1), id="d")],
        checked=False,
    )
    found = verify(SkinEnsemble(array_shaft, fields), spec)
    assert found.conforming.tolist() == [True, False]


def test_sizes_of_a_barrel(array_shaft):
    """Radius 10 + 0.04 (1 - ((z - 20) / 20)^2), oval by 0.01: sizes up to 20.1 in the middle."""
    points = np.array(array_shaft.surface.points)
    angle, radius = np.arctan2(points[:, 1], points[:, 0]), np.linalg.norm(points[:, :2], axis=1)
    grow = 0.04 * (1 - ((points[:, 2] - 20) / 20) ** 2) + 0.01 * np.cos(2 * angle)
    points[:, :2] *= (1 + grow * (radius > 9) / np.maximum(radius, 1))[:, None]
    made = array_shaft.surface.with_points(points)

    def found(lower, upper):
        spec = Specification(
            roundness(0, 0.1), dimensions=[size(0, 20.0, (lower, upper), id="d")], checked=False
        )
        return verify(made, spec, nominal=array_shaft, sizes=True, sections=41)

    good = found(-0.05, 0.2)["d"]
    assert good.details["largest"] == pytest.approx(20.1, abs=2e-3)
    # The first section is at 5 % of the length.
    assert good.details["smallest"] == pytest.approx(20 + 0.08 * (1 - 0.9**2) - 0.02, abs=2e-3)
    assert good.ok
    assert found(-0.05, 0.08)["d"].ok is False
    assert found(0.05, 0.2)["d"].ok is False
    assert not found(0.05, 0.2).conforming
    plain = Specification(roundness(0, 0.1), dimensions=[size(2, 40.0, (-1, 1), id="length")], checked=False)
    assert "cylinders" in verify(made, plain, nominal=array_shaft, sizes=True).unresolved[0][1]
