"""Batch evaluation of surfaces against closed forms and against the geometry kernel's own point by point."""

import math

import cadquery as cq
import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.BRepTools import BRepTools
from OCP.Geom import Geom_OffsetSurface
from OCP.GeomLProp import GeomLProp_SLProps

from cadskin.cad.surface import face_surface, ideal_surface, principal_curvatures, unit_normals


def offset_face():
    loft = cq.Workplane().rect(4, 4).workplane(offset=3).circle(1).loft()
    side = loft.faces("%BSPLINE").vals()[0]
    surface = Geom_OffsetSurface(face_surface(side.wrapped).geometry, 0.3)
    return BRepBuilderAPI_MakeFace(surface, 1e-6).Face()


def spline_profile(plane="XY"):
    return (
        cq.Workplane(plane)
        .moveTo(2, 0)
        .spline([(3, 1), (5, 0), (6, 3)], includeCurrent=True)
        .lineTo(2, 3)
        .close()
    )


FACES = {
    "bspline": lambda: (
        cq.Workplane().rect(4, 4).workplane(offset=3).circle(1).loft().faces("%BSPLINE").val().wrapped
    ),
    "extrusion": lambda: spline_profile().extrude(5).faces("%EXTRUSION").val().wrapped,
    "revolution": lambda: (
        spline_profile("XZ").revolve(200, (0, 0, 0), (0, 1, 0)).faces("%REVOLUTION").val().wrapped
    ),
    "offset": offset_face,
    "torus": lambda: cq.Solid.makeTorus(5, 1).Faces()[0].wrapped,
    "cone": lambda: cq.Workplane(obj=cq.Solid.makeCone(5, 1, 4)).faces("%CONE").val().wrapped,
    "reversed cylinder": lambda: (
        cq.Workplane().box(9, 9, 9).faces(">Z").hole(4).faces("%CYLINDER").val().wrapped
    ),
}


@pytest.mark.parametrize("name", sorted(FACES))
def test_agrees_with_the_geometry_kernel(name):
    face = FACES[name]()
    surface = face_surface(face)
    assert surface.kind == name.split()[-1]
    u0, u1, v0, v1 = BRepTools.UVBounds_s(face)
    uv = np.random.default_rng(3).uniform((u0, v0), (u1, v1), (60, 2))
    values = surface.derivatives(uv)
    normals = unit_normals(values, reversed=surface.reversed)
    curvatures, _ = principal_curvatures(values, normals)
    sign = -1.0 if surface.reversed else 1.0
    for row, (u, v) in enumerate(uv.tolist()):
        truth = GeomLProp_SLProps(surface.geometry, u, v, 2, 1e-9)
        point, normal = truth.Value(), truth.Normal()
        np.testing.assert_allclose(values[row, 0], (point.X(), point.Y(), point.Z()), atol=1e-12)
        np.testing.assert_allclose(
            normals[row], sign * np.array([normal.X(), normal.Y(), normal.Z()]), atol=1e-12
        )
        bends = sorted((sign * truth.MinCurvature(), sign * truth.MaxCurvature()), reverse=True)
        np.testing.assert_allclose(curvatures[row], bends, atol=1e-11)


def test_directions_are_those_of_the_curvatures():
    surface = face_surface(FACES["bspline"]())
    uv = np.random.default_rng(4).uniform(0.1, 0.9, (20, 2))
    values = surface.derivatives(uv)
    normals = unit_normals(values)
    curvatures, directions = principal_curvatures(values, normals)
    for row in range(len(uv)):
        frame = values[row, 1:3]
        for k in range(2):
            a, b = np.linalg.lstsq(frame.T, directions[row, k], rcond=None)[0]
            second = values[row, 3:6] @ normals[row]
            bend = a * a * second[0] + 2 * a * b * second[1] + b * b * second[2]
            assert bend == pytest.approx(curvatures[row, k], abs=1e-12)


def test_ideal_surfaces_have_their_parameters():
    cone = ideal_surface(FACES["cone"]())
    assert cone.half_angle == pytest.approx(math.atan(1.0))
    np.testing.assert_allclose(cone.apex, (0, 0, 5), atol=1e-12)
    np.testing.assert_allclose(cone.axis, (0, 0, -1), atol=1e-12)
    torus = ideal_surface(FACES["torus"]())
    assert (torus.major_radius, torus.minor_radius) == (5.0, 1.0)
    assert ideal_surface(FACES["reversed cylinder"]()).radius == pytest.approx(2.0)
    for face in cq.Workplane().box(2, 4, 6).faces().vals():
        plane = ideal_surface(face.wrapped)
        np.testing.assert_allclose(plane.normal, face.normalAt().toTuple(), atol=1e-12)
    assert ideal_surface(FACES["revolution"]()).kind == "revolution"


@pytest.mark.parametrize("sign", [1, -1])
def test_a_cone_points_into_itself_whatever_its_axis(sign):
    face = cq.Workplane(obj=cq.Solid.makeCone(3, 1, 2, cq.Vector(1, 2, 3), cq.Vector(0, 0, sign))).faces(
        "%CONE"
    )
    cone = ideal_surface(face.val().wrapped)
    inside = np.array(face.val().Center().toTuple()) - cone.apex
    assert inside @ cone.axis > 0
    edge = np.array([v.toTuple() for v in face.vertices().vals()])
    np.testing.assert_allclose(cone.distance(edge), 0.0, atol=1e-9)
