"""Datum targets and common datums of several surfaces: closed forms and rigid motions."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.errors import SpecificationError
from cadskin.shape.association import Patch, Pose, frame_about, rotation
from cadskin.shape.association._kernels import CYLINDER, PLANE, SPHERE
from cadskin.spec import (
    Datum,
    DatumTarget,
    Specification,
    as_selection,
    circular_runout,
    parallelism,
    surface_profile,
)
from cadskin.verify import prepare, verify
from cadskin.verify.group_datums import DatumGroup, GroupSurface, establish_groups

# Faces of the box 60 x 40 x 20 about the origin: -x 0, +x 1, -y 2, +y 3, -z 4, +z 5.
FLOOR = -10.0


def points_of(*places, faces=(4,)):
    feature = as_selection([*faces]) if faces else as_selection(None)
    return tuple(
        DatumTarget(f"A{k}", origin=place, axis=(0.0, 0, 1), feature=feature)
        for k, place in enumerate(places, start=1)
    )


def lifted(part, height, *, at=FLOOR):
    points = np.array(part.surface.points)
    floor = np.isclose(points[:, 2], at)
    points[floor, 2] += height(*points[floor, :2].T)
    return part.surface.with_points(points)


THREE = ((-20.0, -10.0, FLOOR), (20.0, -10.0, FLOOR), (0.0, 15.0, FLOOR))


@pytest.mark.parametrize("faces", [(4,), ()])
def test_three_points_carry_the_part(array_box, faces):
    """The floor leans by 1 in 1000 along x; a dent far from the targets is not felt."""
    made = lifted(array_box, lambda x, y: 0.001 * x + np.where((x > 25) & (y > 15), -0.5, 0.0))
    spec = Specification(
        parallelism(5, 0.1, datums="A"),
        datums=[Datum("A", targets=points_of(*THREE, faces=faces))],
        checked=False,
    )
    found = verify(made, spec, nominal=array_box)["parallelism-1"]
    assert found.value == pytest.approx(60 * np.sin(np.arctan(0.001)), abs=1e-9)
    assert any("contacts of targets" in step for step in found.operations)


def test_lines_and_areas_carry_the_part_too(array_box):
    made = lifted(array_box, lambda x, y: 0.001 * x + 0 * y)
    line = DatumTarget("A1", "line", (-20.0, 0.0, FLOOR), (0, 0, 1.0), (0, 1.0, 0), length=20.0)
    area = DatumTarget("A2", "rectangle", (20.0, 0.0, FLOOR), (0, 0, 1.0), (1.0, 0, 0), length=8.0, width=8.0)
    circle = DatumTarget("A1", "circle", (0.0, 0.0, FLOOR), (0, 0, 1.0), (1.0, 0, 0), diameter=12.0)
    for targets in ((line, area), (circle,)):
        spec = Specification(
            parallelism(5, 0.1, datums="A"), datums=[Datum("A", targets=targets)], checked=False
        )
        found = verify(made, spec, nominal=array_box)["parallelism-1"]
        assert found.value == pytest.approx(60 * np.sin(np.arctan(0.001)), abs=1e-9)


def test_three_two_one_targets_locate_the_part(array_box):
    """Six points: the part shifted as a whole is where it should be; a wall shifted by 0.1 is 0.2 off."""
    datums = [
        Datum("A", targets=points_of(*THREE)),
        Datum("B", targets=points_of((-20.0, -20.0, 0.0), (20.0, -20.0, 0.0), faces=(2,))),
        Datum("C", targets=points_of((-30.0, 0.0, 0.0), faces=(0,))),
    ]
    spec = Specification(surface_profile(1, 0.5, datums="A|B|C"), datums=datums, checked=False)
    prepared = prepare(array_box, spec)
    turn, shift = rotation(np.array([0.01, -0.02, 0.03])), np.array([0.3, -0.2, 0.1])
    assert prepared.evaluate(array_box.surface.points @ turn.T + shift)["surface_profile-1"].value < 1e-9
    points = np.array(array_box.surface.points)
    points[np.isclose(points[:, 0], 30.0), 0] += 0.1
    found = prepared.evaluate(points @ turn.T + shift)["surface_profile-1"]
    assert found.value == pytest.approx(0.2, abs=1e-9)


def test_a_movable_target_is_refused(array_box):
    target = DatumTarget("A1", origin=(0, 0, FLOOR), movable=True)
    spec = Specification(
        parallelism(5, 0.1, datums="A"), datums=[Datum("A", targets=(target,))], checked=False
    )
    assert "movable" in verify(array_box.surface, spec, nominal=array_box).unresolved[0][1]


def test_a_lone_point_is_no_primary_datum(array_box):
    spec = Specification(
        parallelism(5, 0.1, datums="A"), datums=[Datum("A", targets=points_of(THREE[0]))], checked=False
    )
    assert "add a datum before it" in verify(array_box.surface, spec, nominal=array_box).unresolved[0][1]


def test_runout_about_a_secondary_axis(array_shaft):
    """Datum A is the end face, B the round surface: run-out is about B, perpendicular to A."""
    spec = Specification(circular_runout(0, 0.1, datums="A|B"), datums={"A": 2, "B": 0}, checked=False)
    found = verify(array_shaft.surface, spec, nominal=array_shaft)
    assert found["circular_runout-1"].value == pytest.approx(0, abs=1e-9)


def surface(kind, origin, axis, radius, cloud, *, internal=False, motion=None):
    patch = Patch(kind, Pose(np.asarray(origin, float), frame_about(np.asarray(axis, float)),
                             np.array([radius, 0.0])), -1.0 if internal else 1.0)  # fmt: skip
    made = cloud if motion is None else cloud @ motion[0].T + motion[1]
    return GroupSurface(patch, cloud, made, internal)


def ball(centre, radius, rng):
    direction = rng.standard_normal((200, 3))
    return np.asarray(centre) + radius * direction / np.linalg.norm(direction, axis=1)[:, None]


def tube(origin, radius, length, rng):
    turn, z = rng.uniform(0, 2 * np.pi, 200), rng.uniform(0, length, 200)
    return np.asarray(origin) + np.column_stack([radius * np.cos(turn), radius * np.sin(turn), z])


def sheet(centre, first, second, rng):
    return np.asarray(centre) + rng.uniform(-10, 10, (100, 2)) @ np.array([first, second], dtype=float)


MOTION = (rotation(np.array([0.02, -0.01, 0.015])), np.array([0.4, -0.3, 0.2]))


def case(name, rng, motion):
    if name == "two spheres":
        return [surface(SPHERE, (x, 0, 0), (0, 0, 1), 8.0, ball((x, 0, 0), 8.0, rng), motion=motion)
                for x in (0.0, 60.0)]  # fmt: skip
    if name == "plane and cylinder":
        return [
            surface(
                PLANE, (0, 0, 0), (0, 0, 1), 0.0, sheet((0, 0, 0), (1, 0, 0), (0, 1, 0), rng), motion=motion
            ),
            surface(CYLINDER, (3, 0, 0), (0, 0, 1), 5.0, tube((3, 0, 0), 5.0, 20.0, rng), motion=motion),
        ]  # fmt: skip
    if name == "hole and shaft of one axis":
        return [
            surface(CYLINDER, (0, 0, 0), (0, 0, 1), 5.0, tube((0, 0, 0), 5.0, 20.0, rng), motion=motion),
            surface(CYLINDER, (0, 0, 0), (0, 0, 1), 9.0, tube((0, 0, 40), 9.0, 20.0, rng), internal=True,
                    motion=motion),
        ]  # fmt: skip
    if name == "four holes":
        return [
            surface(CYLINDER, (x, y, 0), (0, 0, 1), 3.0, tube((x, y, 0), 3.0, 10.0, rng), internal=True,
                    motion=motion)
            for x in (0, 30) for y in (0, 20)
        ]  # fmt: skip
    return [
        surface(PLANE, (0, 0, 0), n, 0.0, sheet((0, 0, 0), np.roll(n, 1), np.roll(n, 2), rng), motion=motion)
        for n in np.eye(3)
    ]


@pytest.mark.parametrize(
    ("name", "free", "kind"),
    [
        ("two spheres", ("rz",), "cylinder"),
        ("plane and cylinder", ("rz",), "cylinder"),
        ("hole and shaft of one axis", ("tz", "rz"), "cylinder"),
        ("four holes", ("tz",), "complex"),
        ("three planes", (), "complex"),
    ],
)
def test_a_perfect_group_is_followed(name, free, kind):
    """A part moved as a whole: the frame moves with it, and the free motions are those of the group."""
    group = DatumGroup("A-B", tuple(case(name, np.random.default_rng(5), MOTION)))
    nominal, actual = establish_groups([group], standard="ISO 5459:2011")
    assert actual.free == free
    assert actual.datums[0].kind == kind
    assert actual.certified
    along = actual.axes.T @ MOTION[0] @ nominal.axes
    where = actual.axes.T @ (MOTION[0] @ nominal.origin + MOTION[1] - actual.origin)
    if "rz" in free:
        assert abs(along[2, 2]) == pytest.approx(1.0, abs=1e-12)
    else:
        np.testing.assert_allclose(along, np.eye(3), atol=1e-9)
    held = [k for k, word in enumerate(("tx", "ty", "tz")) if word not in free]
    np.testing.assert_allclose(where[held], 0.0, atol=1e-9)


def test_planes_of_a_group_lie_outside_of_the_material():
    """A plane in two pieces with a pit: the datum touches the tops."""
    rng = np.random.default_rng(2)
    first = sheet((0, 0, 0), (1, 0, 0), (0, 1, 0), rng)
    second = first + np.array([40.0, 0, 5.0])
    dented = first - [0, 0, 1.0] * rng.uniform(0, 0.02, (100, 1))
    dented[:3] = first[:3]
    pieces = [
        GroupSurface(Patch(PLANE, Pose(np.array([0, 0, h]), np.eye(3), np.zeros(2))), cloud, made, False)
        for h, cloud, made in ((0.0, first, dented), (5.0, second, second))
    ]
    _, actual = establish_groups([DatumGroup("A-B", tuple(pieces))], standard="ISO 5459:2011")
    datum = actual.datums[0]
    heights = np.concatenate(
        [(p - datum.point) @ datum.direction for p in (dented, second - np.array([0, 0, 5.0]))]
    )
    assert datum.kind == "plane"
    assert np.ptp(heights) <= 0.021
    assert actual.free == ("tx", "ty", "rz")


def test_a_group_that_holds_nothing_more_is_refused():
    rng = np.random.default_rng(1)
    planes = case("three planes", rng, None)
    groups = [DatumGroup("A", tuple(planes)), DatumGroup("B", (planes[0],))]
    with pytest.raises(SpecificationError, match="holds no motion"):
        establish_groups(groups, standard="ISO 5459:2011")
