"""Whole meshes: closed, labelled, on the surface; checked by trimesh and by the kernel's own integrals."""

import cadquery as cq
import numpy as np
import pytest
import trimesh

from cadskin.cad.meshing import mesh_shape
from cadskin.cad.meshing.check import face_areas
from cadskin.cad.meshing.exact import face_properties, shape_volume
from cadskin.errors import GeometryError, MeshingError

PARTS = {
    "plate_with_hole": lambda: cq.Workplane().box(30, 20, 10).faces(">Z").workplane().hole(6),
    "sphere": lambda: cq.Workplane().sphere(10),
    "cone": lambda: cq.Workplane(obj=cq.Solid.makeCone(10, 0, 20)),
    "torus": lambda: cq.Workplane(obj=cq.Solid.makeTorus(10, 3)),
    "loft": lambda: cq.Workplane().rect(20, 20).workplane(offset=15).circle(5).loft(),
    "filleted": lambda: cq.Workplane().box(30, 20, 10).edges().fillet(2),
    "revolved_spline": lambda: (
        cq.Workplane("XZ")
        .moveTo(2, 0)
        .spline([(3, 1), (5, 0), (6, 3)], includeCurrent=True)
        .lineTo(2, 3)
        .close()
        .revolve(360, (0, 0, 0), (0, 1, 0))
    ),
    "swept": lambda: cq.Workplane().rect(4, 2).sweep(cq.Workplane("XZ").spline([(0, 0), (5, 20), (0, 40)])),
}


def as_trimesh(mesh):
    return trimesh.Trimesh(mesh.points, mesh.triangles, process=False, validate=False)


@pytest.fixture(scope="module", params=sorted(PARTS))
def part(request):
    shape = PARTS[request.param]().val().wrapped
    return shape, mesh_shape(shape)


def test_is_closed_and_outward_by_an_independent_check(part):
    shape, mesh = part
    other = as_trimesh(mesh)
    assert mesh.closed
    assert other.is_watertight
    assert other.is_winding_consistent
    assert other.volume == pytest.approx(shape_volume(shape), rel=0.01)


def test_every_face_has_its_area(part):
    shape, mesh = part
    faces = cq.Shape.cast(shape).Faces()
    exact, _ = face_properties([face.wrapped for face in faces])
    found = face_areas(mesh.points, mesh.triangles, mesh.face_ids, len(faces))
    np.testing.assert_allclose(found, exact, rtol=0.02)


def test_wedges_are_the_pairs_of_face_and_vertex(part):
    _, mesh = part
    pairs = np.unique(np.stack([np.repeat(mesh.face_ids, 3), mesh.triangles.ravel()], axis=1), axis=0)
    np.testing.assert_array_equal(np.stack([mesh.wedge_faces, mesh.wedge_vertices], axis=1), pairs)
    np.testing.assert_allclose(np.linalg.norm(mesh.wedge_normals, axis=1), 1.0, atol=1e-12)


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan"), float("inf"), 1000.0])
def test_an_absurd_edge_length_is_refused(length):
    with pytest.raises(GeometryError, match="edge_length"):
        mesh_shape(cq.Workplane().box(1, 1, 1).val().wrapped, edge_length=length)


def test_too_many_triangles_are_refused_with_the_estimate():
    with pytest.raises(MeshingError, match=r"1\.39e\+07 triangles.*--force"):
        mesh_shape(cq.Workplane().box(1, 1, 1).val().wrapped, edge_length=0.001)
