"""Kinds of questions beyond the corpus: each answer is a closed form of the points that are made here."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.errors import SpecificationError
from cadskin.shape.association import rotation
from cadskin.verify import evaluate_case
from cadskin.verify.cases import Case

TURN = rotation(np.array([0.4, -0.7, 0.3]))
SHIFT = np.array([12.0, -35.0, 48.0])


def world(points):
    return np.asarray(points, dtype=float) @ TURN.T + SHIFT


def ask(characteristic, features, *, quantity=None, **question):
    placed = {label: world(points) for label, points in features.items()}
    return evaluate_case(Case("own", characteristic, question, placed, quantity))


def floor(n=9, size=50.0):
    """A plane z = 0 with its outward normal along -z."""
    ticks = np.linspace(-size, size, n)
    x, y = (a.ravel() for a in np.meshgrid(ticks, ticks))
    return np.column_stack([x, y, np.zeros(n * n)])


def tube(radius, heights, centre=lambda z: (0.0, 0.0), n=48, lobes=0, amplitude=0.0):
    angle = 2 * np.pi * np.arange(n) / n
    rings = []
    for z in heights:
        r = radius + amplitude * np.cos(lobes * angle)
        x, y = centre(z)
        rings.append(np.column_stack([x + r * np.cos(angle), y + r * np.sin(angle), np.full(n, z)]))
    return np.concatenate(rings)


PLANE_A = {"label": "A", "feature_type": "plane", "outward_normal_hint": (TURN @ [0, 0, -1.0]).tolist()}
AXIS_A = {"label": "A", "feature_type": "cylinder, external", "axis_hint": (TURN @ [0, 0, 1.0]).tolist()}
HEIGHTS = np.linspace(0, 40, 9)


def test_parallelism_of_an_axis_to_an_axis():
    """The median line runs from (20, 0) to (20.03, 0.04): 0.05 aside over its length."""
    line = np.column_stack([20 + 0.03 * HEIGHTS / 40, 0.04 * HEIGHTS / 40, HEIGHTS])
    found = ask(
        "parallelism",
        {"A": tube(10.0, HEIGHTS), "T": line},
        datums=[AXIS_A],
        zone="cylinder (diameter) parallel to A",
        toleranced={"feature": "T", "type": "median line"},
    )
    assert found.value == pytest.approx(0.05, abs=1e-9)


@pytest.mark.parametrize(
    ("characteristic", "tilt"), [("perpendicularity", "z"), ("parallelism", "x")], ids=["across", "along"]
)
def test_planes_and_a_datum_axis(characteristic, tilt):
    """A face across the axis that rises by 0.06; a face along the axis that leans by 0.06."""
    ticks = np.linspace(-30, 30, 7)
    u, v = (a.ravel() for a in np.meshgrid(ticks, ticks))
    rising, leaning = (u, v, 50 + 0.001 * u), (25 + 0.001 * v, u, v)
    face = np.column_stack(rising if tilt == "z" else leaning)
    found = ask(
        characteristic,
        {"A": tube(10.0, HEIGHTS), "T": face},
        datums=[AXIS_A],
        zone="two parallel planes",
        toleranced={"feature": "T", "type": "plane"},
    )
    assert found.value == pytest.approx(0.06, abs=1e-7 if tilt == "x" else 1e-9)


def test_angularity_of_an_axis_to_a_plane():
    """An axis at 60 degrees to A, bent by 0.02 across the plane of the angle."""
    s = np.linspace(-1, 1, 21)
    direction = np.array([np.cos(np.radians(60)), 0, np.sin(np.radians(60))])
    line = 20 * s[:, None] * direction + np.outer(0.02 * (1 - s**2), [0, 1.0, 0])
    found = ask(
        "angularity",
        {"A": floor(), "T": line},
        datums=[PLANE_A],
        zone="cylinder (diameter) at 60 deg to A",
        TED_angle_deg=60.0,
        toleranced={"feature": "T", "type": "median line"},
    )
    assert found.value == pytest.approx(0.02, abs=1e-6)


def test_coaxiality_without_a_given_median_line():
    """Sections of the toleranced cylinder are centred 0.03 beside the datum axis."""
    found = ask(
        "coaxiality",
        {"A": tube(10.0, HEIGHTS), "T": tube(6.0, HEIGHTS + 50, lambda z: (0.03, 0.0))},
        datums=[AXIS_A],
        toleranced={"feature": "T", "type": "cylinder, external", "sections": 9},
    )
    assert found.value == pytest.approx(0.06, abs=1e-9)


@pytest.mark.parametrize(
    ("characteristic", "expected"),
    [("circular run-out (radial)", 0.06), ("total run-out (radial)", 0.06 + 0.02)],
)
def test_radial_runouts(characteristic, expected):
    """Eccentric by 0.03 with a taper of 0.02 in radius: each circle 0.06, the whole 0.08."""
    rings = np.concatenate([tube(6.0 + 0.02 * k / 8, [50.0 + k], lambda z: (0.03, 0.0)) for k in range(9)])
    found = ask(
        characteristic,
        {"A": tube(10.0, HEIGHTS), "T": rings},
        datums=[AXIS_A],
        toleranced={"feature": "T", "type": "cylinder, external", "sections": 9},
    )
    assert found.value == pytest.approx(expected, abs=1e-6)


def test_axial_runouts():
    """A face that wobbles by 0.001 r cos: the largest circle decides both."""
    angle = 2 * np.pi * np.arange(60) / 60
    face = np.concatenate(
        [
            np.column_stack([r * np.cos(angle), r * np.sin(angle), 60 + 0.001 * r * np.cos(angle)])
            for r in (2, 5, 9)
        ]
    )
    for characteristic in ("circular run-out (axial)", "total run-out (axial)"):
        found = ask(
            characteristic,
            {"A": tube(10.0, HEIGHTS), "face": face},
            datums=[AXIS_A],
            toleranced={"feature": "face", "type": "plane"},
        )
        assert found.value == pytest.approx(0.018, abs=1e-9)


def test_position_of_a_sphere_in_three_planes():
    walls = {
        "A": floor(),
        "B": np.column_stack([floor()[:, 0], np.zeros(81), floor()[:, 1]]),
        "C": np.column_stack([np.zeros(81), floor()[:, 0], floor()[:, 1]]),
    }
    rng = np.random.default_rng(0)
    d = rng.standard_normal((200, 3))
    ball = np.array([20.03, 15.0, 10.04]) + 5 * d / np.linalg.norm(d, axis=1)[:, None]
    normals = {"A": [0, 0, -1.0], "B": [0, -1.0, 0], "C": [-1.0, 0, 0]}
    found = ask(
        "position",
        {**walls, "T": ball},
        datums=[
            {"label": k, "feature_type": "plane", "outward_normal_hint": (TURN @ v).tolist()}
            for k, v in normals.items()
        ],
        TED=[20.0, 15.0, 10.0],
        TED_axes="x from C, y from B",
        toleranced={"feature": "T", "type": "sphere"},
    )
    assert found.value == pytest.approx(2 * 0.05, abs=1e-9)


WALLS = {
    "A": floor(),
    "B": np.column_stack([floor()[:, 0], np.zeros(81), floor()[:, 1]]),
    "C": np.column_stack([np.zeros(81), floor()[:, 0], floor()[:, 1]]),
}
OUTWARD = {"A": [0, 0, -1.0], "B": [0, -1.0, 0], "C": [-1.0, 0, 0]}
PLANES = [
    {"label": label, "feature_type": "plane", "outward_normal_hint": (TURN @ np.array(normal)).tolist()}
    for label, normal in OUTWARD.items()
]


@pytest.mark.parametrize(("ted", "datums"), [(40.0, 1), ([40.0], 1), ([0.0, 0.0, 40.0], 3)])
def test_position_of_a_plane(ted, datums):
    """A face at 40 over A, out by 0.03 at one corner: the zone is centred on its exact place."""
    ticks = np.linspace(-30, 30, 7)
    u, v = (a.ravel() for a in np.meshgrid(ticks, ticks))
    face = np.column_stack([u, v, 40.0 + 0.03 * (u == 30) * (v == 30)])
    found = ask(
        "position",
        {**WALLS, "T": face},
        datums=PLANES[:datums],
        TED=ted,
        toleranced={"feature": "T", "type": "plane"},
    )
    assert found.value == pytest.approx(0.06, abs=1e-12)


def test_position_of_an_axis_across_another_datum():
    """A hole drilled from the side B, at x = 20 and z = 12."""
    y = np.linspace(0, 15, 7)
    line = np.column_stack([np.full(7, 20.03), y, np.full(7, 12.0) - 0.04])
    found = ask(
        "position",
        {**WALLS, "T": line},
        datums=PLANES,
        TED=[20.0, 0.0, 12.0],
        TED_axes="x from C, y from B, axis direction = inward normal of B",
        toleranced={"feature": "T", "type": "median line"},
    )
    assert found.value == pytest.approx(0.1, abs=1e-12)


def pose():
    return {"axes": TURN.tolist(), "origin": SHIFT.tolist()}


@pytest.mark.parametrize("kind", ["cone", "torus"])
def test_profile_of_cone_and_torus(kind):
    rng = np.random.default_rng(1)
    d = rng.uniform(-0.05, 0.05, 300)
    d[:2] = 0.05, -0.03
    u, v = rng.uniform(0, 2 * np.pi, 300), rng.uniform(0, 2 * np.pi, 300)
    if kind == "cone":
        alpha, h = np.radians(20.0), rng.uniform(10, 30, 300)
        radius, height = h * np.tan(alpha) + d * np.cos(alpha), h - d * np.sin(alpha)
        nominal = {"type": "cone", "apex": [0, 0, 0], "axis": [0, 0, 1], "half_angle_deg": 20.0}
    else:
        radius, height = 20 + (5 + d) * np.cos(v), (5 + d) * np.sin(v)
        nominal = {
            "type": "torus",
            "center": [0, 0, 0],
            "axis": [0, 0, 1],
            "major_radius": 20,
            "minor_radius": 5,
        }
    points = np.column_stack([radius * np.cos(u), radius * np.sin(u), height])
    found = ask("profile of a surface", {"S": points}, nominal=[nominal], start_pose=pose(), free_dof=[])
    assert found.value == pytest.approx(2 * max(0.05, np.abs(d).max()), abs=1e-12)
    offset = ask(
        "profile of a surface",
        {"S": points},
        nominal=[nominal],
        start_pose=pose(),
        free_dof=[],
        zone_offset_UZ=0.02,
    )
    assert offset.value == pytest.approx(2 * np.abs(d - 0.02).max(), abs=1e-12)
    free = ask(
        "profile of a surface", {"S": points}, nominal=[nominal], start_pose=pose(), free_dof=[], zone="OZ"
    )
    assert free.value == pytest.approx(np.ptp(d), abs=1e-12)


def test_concave_surfaces_count_towards_the_axis():
    angle = np.linspace(0.2, 2.0, 50)
    d = 0.04 * np.cos(7 * angle)
    points = np.column_stack([(10 - d) * np.cos(angle), (10 - d) * np.sin(angle), 0 * angle])
    nominal = {
        "type": "cylinder",
        "axis_point": [0, 0, 0],
        "axis": [0, 0, 1],
        "radius": 10.0,
        "outward": "towards the axis",
    }
    found = ask(
        "profile of a surface",
        {"S": points},
        nominal=[nominal],
        start_pose=pose(),
        free_dof=[],
        zone_offset_UZ=0.01,
    )
    assert found.value == pytest.approx(2 * np.abs(d - 0.01).max(), abs=1e-12)


def test_pattern_of_points_in_space():
    """Four centres, all displaced by the same vector: free translations take it away."""
    exact = np.array([[0, 0, 0], [40, 0, 0], [0, 30, 5], [40, 30, 9.0]])
    shift = np.array([0.1, -0.2, 0.05])
    features = {f"p{i}": (row + shift)[None, :] for i, row in enumerate(exact)}
    ted = [{"feature": f"p{i}", "xyz": row.tolist()} for i, row in enumerate(exact)]
    held = ask("position", features, TED=ted, start_pose=pose(), free_dof=[])
    assert held.value == pytest.approx(2 * np.linalg.norm([0.1, -0.2, 0.05]), abs=1e-12)
    free = ask("position", features, TED=ted, start_pose=pose(), free_dof=["tx", "ty", "tz"])
    assert free.value == pytest.approx(0.0, abs=1e-9)


def test_symmetry_about_an_internal_width():
    """A datum slot of 20 wide about x = 0 and a tab whose middle lies at 0.02."""
    ticks = np.linspace(-20, 20, 9)
    y, z = (a.ravel() for a in np.meshgrid(ticks, ticks))

    def wall(x):
        return np.column_stack([np.full(81, x), y, z])

    found = ask(
        "symmetry",
        {"A1": wall(10.0), "A2": wall(-10.0), "tab1": wall(4.02), "tab2": wall(-3.98)},
        datums=[{"label": "A", "feature_type": "two opposite parallel planes, internal"}],
        toleranced={"features": ["tab1", "tab2"]},
    )
    assert found.value == pytest.approx(0.04, abs=1e-9)


def test_two_point_sizes_of_an_odd_lobed_circle():
    points = tube(20.0, [0.0], n=360, lobes=3, amplitude=0.01)
    for quantity in ("two_point_size", "largest (max) two-point size LP"):
        found = ask(
            "roundness", {"S": points}, quantity=quantity, section_plane_normal=(TURN @ [0, 0, 1.0]).tolist()
        )
        assert found.value == pytest.approx(40.0, abs=1e-9)


@pytest.mark.parametrize(("letters", "side"), [("GE", 1.0), ("GI", -1.0)])
def test_letters_with_a_material_constraint(letters, side):
    """The least-squares plane on one side of the material: here the plain one, moved to the last point."""
    ticks = np.linspace(-40, 40, 9)
    x, y = (a.ravel() for a in np.meshgrid(ticks, ticks))
    bump = np.outer([0, 1, 0, -1, 0, 1, 0, -1, 0], [0, 1, 0, -1, 0, 1, 0, -1, 0]).ravel()
    points = np.column_stack([x, y, 0.01 * (bump - bump.mean())])
    words = f"least squares, constrained ({letters})"
    hint = (TURN @ [0, 0, 1.0]).tolist()
    found = ask("flatness", {"S": points}, association=words, outward_normal_hint=hint)
    assert found.quantity == f"FLTt ({letters})"
    assert found.certified
    peak, valley = (
        ask("flatness", {"S": points}, quantity=f"FLT{p} ({letters})", outward_normal_hint=hint).value
        for p in "pv"
    )
    assert min(peak, valley) == pytest.approx(0.0, abs=1e-12)
    assert max(peak, valley) == pytest.approx(found.value, abs=1e-12)
    assert (peak < valley) == (side > 0)
    zone = ask("flatness", {"S": points}, association="minimax, external to material (CE)")
    assert zone.value == pytest.approx(0.02, abs=1e-12)


def test_short_wave_filter_keeps_the_ripple():
    points = tube(20.0, [0.0], n=720, lobes=100, amplitude=0.01)
    given = {"type": "FALG: Gaussian, closed profile, short-wave-pass", "cutoff_UPR": 50}
    found = ask("roundness", {"S": points}, filter=given, section_plane_normal=(TURN @ [0, 0, 1.0]).tolist())
    assert found.value == pytest.approx(0.02 * (1 - 2.0**-4), abs=1e-6)


@pytest.mark.parametrize(
    ("characteristic", "question", "text"),
    [
        ("position", {"datums": [PLANE_A], "TED": [{"feature": "S"}], "start_pose": pose()}, "xy"),
        ("profile of a surface", {}, "nominal"),
        ("profile of a surface", {"nominal": [{"type": "banana"}]}, "banana"),
        ("profile of a surface", {"nominal": [{"type": "sphere", "center": [0, 0, 0]}]}, "radius"),
        ("angularity", {"datums": [{"label": "S"}], "toleranced": {"feature": "S"}}, "angle"),
        ("size", {"feature_type": "banana"}, "banana"),
        ("position", {"datums": [{"label": "S"}]}, "TED"),
    ],
)  # fmt: skip
def test_incomplete_questions_say_what_is_missing(characteristic, question, text):
    with pytest.raises(SpecificationError, match=text):
        ask(characteristic, {"S": floor()}, **question)
