"""Normals and curvatures at the wedges against closed forms, poles and apexes included."""

import cadquery as cq
import numpy as np
import pytest
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace
from OCP.Geom import Geom_ConicalSurface
from OCP.gp import gp_Ax3
from support.wedges import assert_wedges_agree_with_the_mesh

from cadskin.cad.meshing import mesh_shape


def wedges_of(mesh, face):
    return mesh.wedge_faces == face


def face_index(shape, kind):
    return next(i for i, face in enumerate(shape.Faces()) if face.geomType() == kind)


def test_a_shaft_bends_away_from_its_normal():
    shaft = cq.Workplane().cylinder(10, 2.5).val()
    mesh = mesh_shape(shaft.wrapped, edge_length=1.0)
    rows = wedges_of(mesh, face_index(shaft, "CYLINDER"))
    points = mesh.points[mesh.wedge_vertices[rows]]
    radial = points * (1, 1, 0) / 2.5
    np.testing.assert_allclose(mesh.wedge_normals[rows], radial, atol=1e-12)
    np.testing.assert_allclose(mesh.wedge_curvatures[rows], np.array([[0.0, -0.4]] * rows.sum()), atol=1e-12)
    np.testing.assert_allclose(np.abs(mesh.wedge_directions[rows, 0]), [[0, 0, 1]] * rows.sum(), atol=1e-12)


def test_a_hole_bends_towards_its_normal():
    plate = cq.Workplane().box(10, 10, 4).faces(">Z").hole(4).val()
    mesh = mesh_shape(plate.wrapped, edge_length=0.5)
    rows = wedges_of(mesh, face_index(plate, "CYLINDER"))
    np.testing.assert_allclose(mesh.wedge_curvatures[rows], np.array([[0.5, 0.0]] * rows.sum()), atol=1e-12)
    inward = -mesh.points[mesh.wedge_vertices[rows]] * (1, 1, 0) / 2.0
    np.testing.assert_allclose(mesh.wedge_normals[rows], inward, atol=1e-12)


def test_a_sphere_has_exact_normals_at_its_poles_too():
    mesh = mesh_shape(cq.Workplane().sphere(5).val().wrapped, edge_length=1.0)
    np.testing.assert_allclose(mesh.wedge_normals, mesh.points[mesh.wedge_vertices] / 5.0, atol=1e-12)
    np.testing.assert_allclose(mesh.wedge_curvatures, -0.2, atol=1e-12)
    assert not mesh.wedge_singular.any()
    assert np.isclose(mesh.points[:, 2].max(), 5.0)


def test_a_torus_by_its_closed_form():
    mesh = mesh_shape(cq.Solid.makeTorus(10, 3).wrapped, edge_length=1.5)
    x, y, _ = mesh.points[mesh.wedge_vertices].T
    cosine = (np.hypot(x, y) - 10.0) / 3.0
    along = -cosine / (10.0 + 3.0 * cosine)
    truth = np.stack([np.maximum(along, -1 / 3), np.minimum(along, -1 / 3)], axis=1)
    np.testing.assert_allclose(mesh.wedge_curvatures, truth, atol=1e-12)


def test_the_apex_of_a_cone_is_flagged():
    cone = cq.Solid.makeCone(10, 0, 20)
    mesh = mesh_shape(cone.wrapped, edge_length=1.0)
    assert mesh.wedge_singular.sum() == 1
    row = int(np.flatnonzero(mesh.wedge_singular)[0])
    np.testing.assert_allclose(mesh.points[mesh.wedge_vertices[row]], (0, 0, 20), atol=1e-9)
    assert mesh.wedge_normals[row] @ (0, 0, 1) > 0.97
    others = wedges_of(mesh, mesh.wedge_faces[row]) & ~mesh.wedge_singular
    np.testing.assert_allclose(mesh.wedge_normals[others, 2], 1 / np.sqrt(5), atol=1e-12)
    radius = np.linalg.norm(mesh.points[mesh.wedge_vertices[others], :2], axis=1)
    np.testing.assert_allclose(mesh.wedge_curvatures[others, 1], -2 / np.sqrt(5) / radius, rtol=1e-9)


@pytest.mark.parametrize("kind", ["loft", "filleted"])
def test_frames_are_orthonormal_and_curvatures_ordered(kind):
    part = {
        "loft": lambda: cq.Workplane().rect(8, 8).workplane(offset=6).circle(2).loft(),
        "filleted": lambda: cq.Workplane().box(8, 8, 8).edges().fillet(2),
    }[kind]()
    mesh = mesh_shape(part.val().wrapped)
    frames = np.concatenate([mesh.wedge_normals[:, None], mesh.wedge_directions], axis=1)
    gram = np.einsum("nai,nbi->nab", frames, frames)
    np.testing.assert_allclose(gram, np.broadcast_to(np.eye(3), gram.shape), atol=1e-9)
    assert (mesh.wedge_curvatures[:, 0] >= mesh.wedge_curvatures[:, 1]).all()


@pytest.mark.parametrize("axis", ["|Z", ""])
def test_poles_of_fillet_spheres_point_out_of_the_material(axis):
    box = cq.Workplane().box(30, 20, 20).edges(axis or None).fillet(4).val()
    mesh = mesh_shape(box.wrapped, edge_length=1.5)
    assert_wedges_agree_with_the_mesh(mesh)
    assert not mesh.wedge_singular.any()
    on_sphere = np.isin(mesh.wedge_faces, [i for i, f in enumerate(box.Faces()) if f.geomType() == "SPHERE"])
    np.testing.assert_allclose(mesh.wedge_curvatures[on_sphere], -0.25, atol=1e-9)


def test_an_apex_that_the_file_misses_is_flagged():
    half_angle = np.pi / 6
    cone = Geom_ConicalSurface(gp_Ax3(), half_angle, 2.0)
    end = (9e-6 - 2.0) / np.sin(half_angle)  # the radius there is 9 nm
    face = BRepBuilderAPI_MakeFace(cone, 0.0, 2 * np.pi, end, 0.0, 1e-4).Face()
    mesh = mesh_shape(face, edge_length=0.5)
    assert mesh.wedge_singular.sum() == 1
    assert_wedges_agree_with_the_mesh(mesh)
