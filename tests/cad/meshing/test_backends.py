"""The other backends give the same kind of result."""

import sys

import cadquery as cq
import numpy as np
import pytest
import trimesh

from cadskin.cad.meshing import mesh_shape
from cadskin.cad.meshing.check import face_areas
from cadskin.cad.meshing.exact import face_properties
from cadskin.errors import GeometryError, MeshingError, MissingDependencyError


@pytest.fixture(scope="module")
def part():
    return cq.Workplane().box(20, 15, 8).faces(">Z").workplane().hole(6).edges("|Z").fillet(2).val()


def test_gmsh_meshes_are_labelled_closed_and_exact(part):
    pytest.importorskip("gmsh")
    mesh = mesh_shape(part.wrapped, edge_length=1.0, backend="gmsh")
    assert trimesh.Trimesh(mesh.points, mesh.triangles, process=False).is_watertight
    exact, _ = face_properties([face.wrapped for face in part.Faces()])
    np.testing.assert_allclose(
        face_areas(mesh.points, mesh.triangles, mesh.face_ids, len(exact)), exact, rtol=0.03
    )
    own = mesh_shape(part.wrapped, edge_length=1.0)
    for face in range(len(exact)):
        theirs, ours = (np.sort(m.wedge_curvatures[m.wedge_faces == face].mean(axis=0)) for m in (mesh, own))
        np.testing.assert_allclose(theirs, ours, atol=1e-6)
    assert not mesh.wedge_singular.any()


def test_gmsh_takes_other_sizes_for_single_faces(part):
    pytest.importorskip("gmsh")
    mesh = mesh_shape(part.wrapped, edge_length=2.0, face_edge_lengths={0: 0.5}, backend="gmsh")
    coarse = mesh_shape(part.wrapped, edge_length=2.0, backend="gmsh")
    assert (mesh.face_ids == 0).sum() > 4 * (coarse.face_ids == 0).sum()


def test_gmsh_is_stopped_in_time(part):
    pytest.importorskip("gmsh")
    with pytest.raises(MeshingError, match=r"stopped after|no time left"):
        mesh_shape(part.wrapped, edge_length=1.0, backend="gmsh", time_limit=0.05)


def test_pymeshlab_meshes_are_closed_and_labelled(part):
    pytest.importorskip("pymeshlab")
    mesh = mesh_shape(part.wrapped, edge_length=1.0, backend="pymeshlab")
    assert mesh.closed
    assert set(mesh.face_ids.tolist()) == set(range(len(part.Faces())))
    assert trimesh.Trimesh(mesh.points, mesh.triangles, process=False).volume == pytest.approx(
        part.Volume(), rel=0.01
    )


def test_pymeshlab_remeshes_what_has_no_cad():
    pytest.importorskip("pymeshlab")
    from cadskin.cad.meshing.pymeshlab_backend import remesh_triangles

    cube = trimesh.creation.box((10, 10, 10))
    points, triangles, source = remesh_triangles(
        np.asarray(cube.vertices), np.asarray(cube.faces, dtype=np.int64), edge_length=1.0
    )
    new = trimesh.Trimesh(points, triangles, process=False)
    assert new.is_watertight
    assert new.volume == pytest.approx(1000.0, rel=1e-6)
    np.testing.assert_allclose(
        np.einsum("ni,ni->n", new.face_normals, cube.face_normals[source]), 1.0, atol=1e-6
    )
    with pytest.raises(GeometryError, match="edge_length"):
        remesh_triangles(points, triangles, edge_length=0.0)


@pytest.mark.parametrize("backend", ["gmsh", "pymeshlab"])
def test_a_missing_backend_says_how_to_install_it(part, backend, monkeypatch):
    for name in (f"cadskin.cad.meshing.{backend}_backend",):
        module = __import__(name, fromlist=["find_spec"])
        monkeypatch.setattr(module, "find_spec", lambda _name: None)
    with pytest.raises(MissingDependencyError, match=rf"pip install \"cadskin\[{backend}\]\""):
        mesh_shape(part.wrapped, edge_length=2.0, backend=backend)


def test_an_unknown_backend_is_refused(part):
    with pytest.raises(GeometryError, match="netgen"):
        mesh_shape(part.wrapped, backend="netgen")


def test_neither_backend_is_imported_without_being_asked_for():
    assert "cadskin.cad.meshing" in sys.modules
    from cadskin.cad.meshing import api

    assert not hasattr(api, "gmsh")
    assert not hasattr(api, "pymeshlab")
