"""Which faces are one feature."""

import cadquery as cq
import numpy as np
import pytest

from cadskin.cad import describe_faces, partition
from cadskin.cad.partitioning import face_neighbours


def parts(workplane):
    shape = workplane.val().wrapped
    faces = describe_faces(shape)
    return faces, partition(shape, faces)


def test_two_half_cylinders_are_one_hole(half_cylinder_plate):
    faces, groups = parts(half_cylinder_plate)
    holes = [group for group in groups if faces[group[0]].kind == "cylinder"]
    assert [len(group) for group in holes] == [2]
    assert all(faces[i].internal for i in holes[0])
    assert len(faces) == 8
    assert len(groups) == 7


def test_every_face_is_in_exactly_one_feature(half_cylinder_plate):
    faces, groups = parts(half_cylinder_plate)
    assert sorted(i for group in groups for i in group) == list(range(len(faces)))
    assert [group[0] for group in groups] == sorted(group[0] for group in groups)


def test_two_separate_coplanar_pads_stay_two():
    pads = cq.Workplane().box(40, 10, 4).faces(">Z").workplane().pushPoints([(-12, 0), (12, 0)]).rect(6, 6)
    faces, groups = parts(pads.extrude(3))
    tops = [g for g in groups if faces[g[0]].kind == "plane" and faces[g[0]].centre[2] == pytest.approx(5)]
    assert [len(g) for g in tops] == [1, 1]


def test_coplanar_faces_that_share_an_edge_are_one():
    two = (
        cq.Workplane()
        .box(10, 10, 10)
        .union(cq.Workplane().box(10, 10, 10).translate((10, 0, 0)), clean=False)
    )
    faces, groups = parts(two)
    assert len(faces) == 10
    assert len(groups) == 6
    assert sorted(len(group) for group in groups) == [1, 1, 2, 2, 2, 2]


def test_equal_cylinders_with_material_on_opposite_sides_are_two():
    # An S-shaped wall: a convex and a concave quarter cylinder of one radius meet along a line.
    outline = (
        cq.Workplane()
        .moveTo(0, 0)
        .lineTo(20, 0)
        .lineTo(20, 10)
        .threePointArc((20 - 5 + 5 * np.cos(np.pi / 4), 5 + 5 + 5 * np.sin(np.pi / 4)), (15, 15))
        .threePointArc((15 - 5 * np.sin(np.pi / 4), 20 - 5 * np.cos(np.pi / 4)), (10, 20))
        .lineTo(0, 20)
        .close()
        .extrude(5)
    )
    faces, groups = parts(outline)
    curved = [group for group in groups if faces[group[0]].kind == "cylinder"]
    assert [len(group) for group in curved] == [1, 1]
    assert {faces[group[0]].internal for group in curved} == {True, False}


def test_a_step_between_coaxial_cylinders_parts_them():
    shaft = cq.Workplane().circle(5).extrude(10).faces(">Z").workplane().circle(4.99).extrude(10)
    faces, groups = parts(shaft)
    assert sum(faces[group[0]].kind == "cylinder" for group in groups) == 2


@pytest.mark.parametrize(
    ("half", "kind"),
    [
        (cq.Solid.makeSphere(5, angleDegrees1=-90, angleDegrees3=180), "sphere"),
        (cq.Solid.makeCone(5, 2, 6, angleDegrees=180), "cone"),
        (cq.Solid.makeCylinder(5, 6, angleDegrees=180), "cylinder"),
        (cq.Workplane().center(9, 0).circle(2).revolve(180, (-9, 0), (-9, 1)).val(), "torus"),
    ],
)
def test_two_halves_of_one_surface_are_joined(half, kind):
    axis = cq.Vector(0, 1, 0) if kind == "torus" else cq.Vector(0, 0, 1)
    other = half.rotate(cq.Vector(0, 0, 0), axis, 180)
    faces, groups = parts(cq.Workplane(obj=half).union(cq.Workplane(obj=other), clean=False))
    curved = [group for group in groups if faces[group[0]].kind == kind]
    assert [len(group) for group in curved] == [2]


def test_spline_faces_are_never_joined():
    loft = cq.Workplane().rect(10, 10).workplane(offset=8).circle(3).loft()
    faces, groups = parts(loft)
    assert all(len(group) == 1 for group in groups)
    assert len(groups) == len(faces)


def test_neighbours_of_a_box():
    pairs = face_neighbours(cq.Workplane().box(1, 1, 1).val().wrapped)
    assert len(pairs) == 12
    assert all(a < b for a, b in pairs)
