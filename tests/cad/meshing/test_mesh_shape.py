"""Whole meshes: closed, labelled, on the surface; checked by trimesh and by the kernel's own integrals."""

import cadquery as cq
import numpy as np
import pytest
import trimesh

from cadskin.cad.meshing import mesh_shape
from cadskin.cad.meshing.check import face_areas
from cadskin.cad.meshing.exact import face_properties, shape_volume
from cadskin.errors import Cancelled, GeometryError, MeshingError
from cadskin.shape.check import triangle_quality

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


def test_faces_are_numbered_as_cadquery_numbers_them():
    part = cq.Workplane().box(30, 20, 10).edges("|Z").fillet(3).faces(">Z").workplane().hole(6).val()
    mesh = mesh_shape(part.wrapped, edge_length=1.0)
    for index, face in enumerate(part.Faces()):
        corners = mesh.points[mesh.triangles[mesh.face_ids == index]]
        weights = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        centre = (corners.mean(axis=1) * weights[:, None]).sum(axis=0) / weights.sum()
        np.testing.assert_allclose(centre, face.Center().toTuple(), atol=0.1)


def test_errors_shrink_with_the_square_of_the_edge_length():
    shape = cq.Workplane(obj=cq.Solid.makeTorus(10, 4)).val().wrapped
    area, volume = 4 * np.pi**2 * 40, 2 * np.pi**2 * 160
    lengths = np.array([1.2, 0.6, 0.3])
    meshes = [as_trimesh(mesh_shape(shape, edge_length=length)) for length in lengths]
    for truth, found in ((area, [m.area for m in meshes]), (volume, [m.volume for m in meshes])):
        errors = np.abs(np.array(found) / truth - 1.0)
        rate = np.polyfit(np.log(lengths), np.log(errors), 1)[0]
        assert 1.8 < rate < 2.3


def test_a_plane_of_the_paper_has_its_number_of_points():
    plate = cq.Workplane().rect(100, 60).extrude(1).faces(">Z").val()
    mesh = mesh_shape(plate.wrapped, edge_length=1.74)
    assert not mesh.closed
    assert len(mesh.points) == pytest.approx(2392, rel=0.02)
    assert len(mesh.triangles) == pytest.approx(4550, rel=0.02)


def test_vertices_lie_on_their_surfaces(part):
    shape, mesh = part
    from cadskin.cad.surface import face_surface

    for index, face in enumerate(cq.Shape.cast(shape).Faces()):
        rows = mesh.wedge_faces == index
        on_surface = face_surface(face.wrapped).points(mesh.wedge_uv[rows])
        gap = np.linalg.norm(on_surface - mesh.points[mesh.wedge_vertices[rows]], axis=1)
        assert gap.max() < 2e-6


def test_triangles_are_good(part):
    _, mesh = part
    quality = triangle_quality(mesh.points, mesh.triangles)
    assert np.median(quality) > 0.96
    assert quality.min() > 0.2


@pytest.mark.parametrize("n_points", [100, 1000, 20_000])
def test_a_number_of_points_is_met(n_points):
    shape = cq.Workplane().box(30, 20, 10).faces(">Z").workplane().hole(8).val().wrapped
    assert len(mesh_shape(shape, n_points=n_points).points) == pytest.approx(n_points, rel=0.1)


def test_one_face_may_be_finer():
    shape = cq.Workplane().box(20, 20, 20).val().wrapped
    mesh = mesh_shape(shape, edge_length=4.0, face_edge_lengths={2: 0.5})
    counts = np.bincount(mesh.face_ids)
    assert mesh.closed
    assert counts[2] > 8 * np.delete(counts, 2).max()
    with pytest.raises(GeometryError, match="face 9"):
        mesh_shape(shape, face_edge_lengths={9: 1.0})


def test_an_open_shell_stays_open_and_manifold():
    box = cq.Workplane().box(10, 10, 10).val()
    shell = cq.Shell.makeShell(box.Faces()[:5])
    mesh = mesh_shape(shell.wrapped, edge_length=2.0)
    assert not mesh.closed
    assert len(np.unique(mesh.face_ids)) == 5
    assert as_trimesh(mesh).is_winding_consistent


def test_a_solid_with_a_missing_face_is_refused_unless_allowed():
    from OCP.BRep import BRep_Builder
    from OCP.TopoDS import TopoDS_Solid

    shell = cq.Shell.makeShell(cq.Workplane().box(10, 10, 10).val().Faces()[:5])
    solid, builder = TopoDS_Solid(), BRep_Builder()
    builder.MakeSolid(solid)
    builder.Add(solid, shell.wrapped)
    with pytest.raises(MeshingError, match=r"does not close at faces .*open edges"):
        mesh_shape(solid, edge_length=2.0)
    assert not mesh_shape(solid, edge_length=2.0, allow_open=True).closed


def test_the_caller_can_stop_it_and_it_can_run_out_of_time():
    shape = cq.Workplane().box(10, 10, 10).val().wrapped
    seen = []
    with pytest.raises(Cancelled):
        mesh_shape(shape, progress=lambda done, total: seen.append((done, total)) or done < 3)
    assert seen == [(0, 6), (1, 6), (2, 6), (3, 6)]
    with pytest.raises(MeshingError, match="ran out of time"):
        mesh_shape(shape, time_limit=0.0)


def test_the_same_mesh_comes_twice():
    shape = PARTS["loft"]().val().wrapped
    first, second = mesh_shape(shape), mesh_shape(shape)
    np.testing.assert_array_equal(first.points, second.points)
    np.testing.assert_array_equal(first.triangles, second.triangles)


def test_an_empty_shape_is_refused():
    from OCP.TopoDS import TopoDS_Shape

    with pytest.raises(GeometryError, match="nothing to mesh"):
        mesh_shape(TopoDS_Shape())
    with pytest.raises(GeometryError, match="n_points"):
        mesh_shape(cq.Workplane().box(1, 1, 1).val().wrapped, n_points=2)
    with pytest.raises(GeometryError, match="not both"):
        mesh_shape(cq.Workplane().box(1, 1, 1).val().wrapped, n_points=50, edge_length=0.5)
