"""Geometry that files have and that nobody wants: wrong parameter curves, tiny edges, inner edges."""

import cadquery as cq
import numpy as np
import pytest
import trimesh
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.Geom2d import Geom2d_Line
from OCP.gp import gp_Dir2d, gp_Pnt2d

from cadskin.cad.meshing import build, mesh_shape
from cadskin.cad.meshing.build import read_part
from cadskin.cad.meshing.domain import FaceProblem, face_domain
from cadskin.cad.meshing.edges import sample_edge, segments_for
from cadskin.cad.meshing.fallback import clip_ears, fill_from_boundary
from cadskin.cad.surface import face_surface


def is_watertight(mesh):
    return trimesh.Trimesh(mesh.points, mesh.triangles, process=False).is_watertight


def shaft_with_wrong_parameter_curve():
    """A cylinder whose upper circle has a parameter curve 0.7 mm too low."""
    shaft = cq.Workplane().cylinder(10, 3).val()
    side = next(face for face in shaft.Faces() if face.geomType() == "CYLINDER")
    circle = max((e for e in side.Edges() if e.geomType() == "CIRCLE"), key=lambda e: e.Center().z)
    curve = BRep_Tool.CurveOnSurface_s(circle.wrapped, side.wrapped, 0.0, 1.0)
    start, along = curve.Location(), curve.Direction()
    wrong = Geom2d_Line(gp_Pnt2d(start.X(), start.Y() - 0.7), gp_Dir2d(along.X(), along.Y()))
    BRep_Builder().UpdateEdge(circle.wrapped, wrong, side.wrapped, 1e-7)
    return shaft


def test_parameter_curves_that_disagree_with_their_edge_are_projected():
    shaft = shaft_with_wrong_parameter_curve()
    mesh = mesh_shape(shaft.wrapped, edge_length=0.6)
    assert is_watertight(mesh)
    assert not mesh.failed_faces
    assert any("projected onto the surface" in note for note in mesh.notes)
    area = trimesh.Trimesh(mesh.points, mesh.triangles, process=False).area
    assert area == pytest.approx(2 * np.pi * 3 * (10 + 3), rel=0.01)


def samples_of(part, length=1.0):
    return [
        sample_edge(curve, segments_for(curve, length, 0.5), length, part.topology.vertices)
        for curve in part.curves
    ]


@pytest.mark.parametrize("kind", ["PLANE", "CYLINDER"])
def test_a_face_can_be_closed_from_its_boundary_alone(kind):
    solid = cq.Workplane().box(10, 10, 4).faces(">Z").workplane().hole(4).val()
    part = read_part(solid.wrapped)
    faces = solid.Faces()
    index = max((i for i, f in enumerate(faces) if f.geomType() == kind), key=lambda i: faces[i].Area())
    samples = samples_of(part)
    mesh = fill_from_boundary(
        index, face_surface(faces[index].wrapped), part.topology.uses[index], part.curves, samples, "a test"
    )
    assert mesh.problem == "a test"
    if kind == "PLANE":
        polygon = 100 - 0.5 * 13 * 4 * np.sin(2 * np.pi / 13)
        assert mesh.area == pytest.approx(polygon, rel=1e-9)
    domain = face_domain(
        part.forward[index], part.surfaces[index], part.topology.uses[index], part.curves, samples
    )
    outer = {
        tuple(sorted(map(tuple, domain.points[list(segment)].round(9).tolist())))
        for segment, edge in zip(domain.segments, domain.segment_edges, strict=True)
        if (np.array([use.edge for use in part.topology.uses[index]]) == edge).sum() == 1
    }
    sides = {}
    for triangle in mesh.triangles:
        for a, b in zip(triangle, np.roll(triangle, -1), strict=True):
            key = tuple(sorted(map(tuple, mesh.points[[a, b]].round(9).tolist())))
            sides[key] = sides.get(key, 0) + 1
    assert {key for key, count in sides.items() if count == 1} == outer


def test_a_face_that_cannot_be_meshed_is_filled_and_flagged(monkeypatch):
    real = build.mesh_face

    def fails_on_face_0(index, *arguments, **options):
        if index == 0:
            raise FaceProblem("a test says so")
        return real(index, *arguments, **options)

    monkeypatch.setattr(build, "mesh_face", fails_on_face_0)
    mesh = mesh_shape(cq.Workplane().box(10, 8, 6).edges().fillet(1).val().wrapped, edge_length=1.0)
    assert mesh.failed_faces == (0,)
    assert any("face 0" in note and "a test says so" in note for note in mesh.notes)
    assert is_watertight(mesh)
    rows = mesh.wedge_faces == 0
    assert mesh.wedge_singular[rows].all()
    np.testing.assert_allclose(np.linalg.norm(mesh.wedge_normals[rows], axis=1), 1.0, atol=1e-12)


def test_ears_fill_a_polygon_that_is_not_convex():
    angle = np.pi / 5 * np.arange(10)
    star = np.where(np.arange(10) % 2, 1.0, 3.0)[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    triangles = clip_ears(list(range(10)), star, np.column_stack([star, np.zeros(10)]))
    a, b, c = (star[triangles[:, k]] for k in range(3))
    areas = 0.5 * ((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    assert len(triangles) == 8
    assert (areas > 0).all()
    assert areas.sum() == pytest.approx(0.5 * 10 * 3 * np.sin(np.pi / 5))


def test_an_arc_and_its_chord_do_not_share_their_triangles():
    """Two edges with the same ends and one segment each need a point between them."""
    sliver = cq.Workplane().moveTo(0, 0).threePointArc((5, 0.05), (10, 0)).close().extrude(3).val()
    mesh = mesh_shape(sliver.wrapped, edge_length=10.0)
    assert is_watertight(mesh)


def test_an_edge_inside_a_face_is_left_out():
    face = cq.Workplane().rect(10, 10).extrude(1).faces(">Z").val()
    inner = cq.Edge.makeLine(cq.Vector(-2, 0, 1), cq.Vector(2, 0, 1)).wrapped
    from OCP.TopAbs import TopAbs_Orientation
    from OCP.TopoDS import TopoDS_Wire

    builder, wire = BRep_Builder(), TopoDS_Wire()
    builder.MakeWire(wire)
    builder.Add(wire, inner.Oriented(TopAbs_Orientation.TopAbs_INTERNAL))
    face.wrapped.Free(True)
    builder.Add(face.wrapped, wire)
    mesh = mesh_shape(face.wrapped, edge_length=1.0)
    assert any("bound nothing" in note for note in mesh.notes)
    assert trimesh.Trimesh(mesh.points, mesh.triangles, process=False).area == pytest.approx(100.0)


def test_surfaces_without_values_are_guarded():
    from cadskin.cad.meshing.face import finite_derivatives

    class HoleInTheMiddle:
        def derivatives(self, uv):
            values = np.ones((len(uv), 6, 3))
            values[np.linalg.norm(uv, axis=1) < 1e-6] = np.nan
            return values

    uv = np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 1.0]])
    assert np.isfinite(finite_derivatives(HoleInTheMiddle(), uv)).all()

    class Nowhere:
        def derivatives(self, uv):
            return np.full((len(uv), 6, 3), np.nan)

    with pytest.raises(FaceProblem, match="no value"):
        finite_derivatives(Nowhere(), uv)


def test_parts_that_touch_in_a_point_are_closed_each():
    touching = cq.Workplane().box(4, 4, 4).union(cq.Workplane().box(4, 4, 4).translate((4, 4, 4))).val()
    corner = [v for v in touching.Vertices() if v.Center().toTuple() == pytest.approx((2, 2, 2))]
    assert len(corner) == 1
    mesh = mesh_shape(touching.wrapped, edge_length=1.0)
    assert mesh.closed
    assert any("touches itself" in note for note in mesh.notes)
    assert np.isclose(mesh.points, 2.0).all(axis=1).sum() == 2
    assert trimesh.Trimesh(mesh.points, mesh.triangles, process=False).volume == pytest.approx(128.0)
    pairs = np.unique(np.stack([np.repeat(mesh.face_ids, 3), mesh.triangles.ravel()], axis=1), axis=0)
    np.testing.assert_array_equal(np.stack([mesh.wedge_faces, mesh.wedge_vertices], axis=1), pairs)
