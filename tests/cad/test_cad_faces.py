"""Face records against closed forms."""

import cadquery as cq
import numpy as np
import pytest

from cadskin.cad import describe_faces
from cadskin.cad.faces import bounding_box, surface_area, volume
from cadskin.errors import GeometryError
from cadskin.shape import Cone, Cylinder, Freeform, Plane, Sphere, Torus

PI = np.pi


def only(faces, kind):
    (found,) = [face for face in faces if face.kind == kind]
    return found


def test_a_box_has_six_planes_with_exact_areas_centres_and_outward_normals():
    faces = describe_faces(cq.Workplane().box(2, 4, 6).val().wrapped)
    for face, cadquery_face in zip(faces, cq.Workplane().box(2, 4, 6).val().Faces(), strict=True):
        assert isinstance(face.ideal, Plane)
        assert face.area == pytest.approx(cadquery_face.Area(), rel=1e-12)
        np.testing.assert_allclose(face.centre, cadquery_face.Center().toTuple(), atol=1e-12)
        np.testing.assert_allclose(face.normal, np.sign(np.round(face.centre, 9)), atol=1e-12)
        np.testing.assert_allclose(face.ideal.distance(face.centre[None]), 0.0, atol=1e-12)
    assert sorted(round(face.area, 9) for face in faces) == [8, 8, 12, 12, 24, 24]


def test_a_shaft_is_external_and_a_bore_is_internal():
    tube = cq.Workplane().circle(5).circle(3).extrude(7)
    faces = describe_faces(tube.val().wrapped)
    outer = next(f for f in faces if f.radius == pytest.approx(5))
    inner = next(f for f in faces if f.radius == pytest.approx(3))
    assert isinstance(outer.ideal, Cylinder)
    assert not outer.internal
    assert inner.internal
    assert outer.area == pytest.approx(2 * PI * 5 * 7, rel=1e-9)
    assert inner.area == pytest.approx(2 * PI * 3 * 7, rel=1e-9)
    assert only([f for f in faces if f.normal[2] > 0.5], "plane").area == pytest.approx(PI * 16, rel=1e-9)
    np.testing.assert_allclose(inner.bounds, [[-3, -3, 0], [3, 3, 7]], atol=1e-6)


def test_a_cone_points_from_its_apex_into_the_material():
    cone = cq.Solid.makeCone(4, 1, 6, pnt=cq.Vector(1, 2, 3))
    face = only(describe_faces(cone.wrapped), "cone")
    assert isinstance(face.ideal, Cone)
    assert face.ideal.half_angle == pytest.approx(np.arctan2(3, 6), rel=1e-12)
    np.testing.assert_allclose(face.ideal.apex, [1, 2, 3 + 8], atol=1e-9)
    np.testing.assert_allclose(face.ideal.axis, [0, 0, -1], atol=1e-12)
    assert face.area == pytest.approx(PI * 5 * np.hypot(3, 6), rel=1e-9)
    assert not face.internal


def test_a_conical_hole_is_internal():
    block = cq.Workplane().box(20, 20, 6, centered=(True, True, False))
    drilled = block.cut(cq.Workplane(obj=cq.Solid.makeCone(2, 5, 6)))
    assert only(describe_faces(drilled.val().wrapped), "cone").internal


def test_a_ball_and_a_ring():
    ball = only(describe_faces(cq.Solid.makeSphere(3, angleDegrees1=-90).wrapped), "sphere")
    assert isinstance(ball.ideal, Sphere)
    assert ball.area == pytest.approx(4 * PI * 9, rel=1e-9)
    assert not ball.internal
    ring = only(describe_faces(cq.Solid.makeTorus(10, 2).wrapped), "torus")
    assert isinstance(ring.ideal, Torus)
    assert (ring.ideal.major_radius, ring.ideal.minor_radius) == pytest.approx((10, 2))
    assert ring.area == pytest.approx(4 * PI**2 * 20, rel=1e-9)
    assert not ring.internal


def test_a_fillet_between_wall_and_floor_is_internal():
    step = cq.Workplane().box(20, 20, 10).faces(">Z").workplane().circle(5).extrude(5)
    foot = cq.selectors.BoxSelector((-6, -6, 4), (6, 6, 6))
    filleted = step.edges(foot).edges("%CIRCLE").fillet(1)
    assert only(describe_faces(filleted.val().wrapped), "torus").internal
    rounded = step.faces(">Z").edges().fillet(1)
    assert not only(describe_faces(rounded.val().wrapped), "torus").internal


def test_a_spline_face_is_freeform():
    loft = cq.Workplane().rect(10, 10).workplane(offset=8).circle(3).loft()
    faces = describe_faces(loft.val().wrapped)
    assert {face.kind for face in faces} >= {"plane", "bspline"}
    assert all(isinstance(face.ideal, Freeform) for face in faces if face.kind == "bspline")
    assert all(face.radius is None for face in faces)


def test_records_move_with_the_location_of_the_shape():
    block = cq.Workplane().box(2, 2, 2).val()
    there = block.moved(cq.Location((10, 0, 0), (0, 0, 1), 90))
    for before, after in zip(describe_faces(block.wrapped), describe_faces(there.wrapped), strict=True):
        turned = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]) @ before.centre + [10, 0, 0]
        np.testing.assert_allclose(after.centre, turned, atol=1e-12)
        np.testing.assert_allclose(after.normal, np.sign(np.round(after.centre - [10, 0, 0], 9)), atol=1e-12)


def test_a_mirrored_part_keeps_outward_normals(plate):
    for face in describe_faces(plate.mirror("XY").val().wrapped):
        probe = face.centre if face.kind == "plane" else None
        if probe is not None and abs(face.normal[2]) < 0.5:
            assert probe @ face.normal > 0
        elif face.kind == "cylinder":
            assert face.internal


def test_areas_sum_to_the_whole_and_names_follow_the_order(plate):
    shape = plate.val().wrapped
    faces = describe_faces(shape, names=[f"n{i}" for i in range(7)])
    assert sum(face.area for face in faces) == pytest.approx(surface_area(shape), rel=1e-12)
    assert [face.name for face in faces] == [f"n{i}" for i in range(7)]
    assert volume(shape) == pytest.approx(60 * 40 * 8 - PI * 36 * 8, rel=1e-12)
    np.testing.assert_allclose(bounding_box(shape), [[-30, -20, -4], [30, 20, 4]], atol=1e-6)
    with pytest.raises(GeometryError, match="2 names given for 7 faces"):
        describe_faces(shape, names=["a", "b"])
