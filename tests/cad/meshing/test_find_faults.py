"""The checks find what they are there to find."""

import cadquery as cq
import numpy as np
import pytest
import trimesh

from cadskin.cad.meshing import mesh_shape
from cadskin.cad.meshing.check import face_areas, find_faults, half_edge_twins, mesh_volume
from cadskin.shape.check import edge_table, non_manifold_vertices

TET = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def test_a_closed_mesh_is_closed():
    found = find_faults(CORNERS, TET, np.arange(4))
    assert found.closed
    assert mesh_volume(CORNERS, TET) == 1 / 6


def test_a_hole_is_found_and_its_faces_are_named():
    found = find_faults(CORNERS, TET[:3], np.array([7, 8, 9]))
    assert (found.open_edges, found.manifold, found.closed) == (3, True, False)
    assert found.open_faces == (7, 8, 9)


def test_a_turned_triangle_is_found():
    turned = TET.copy()
    turned[0] = turned[0, ::-1]
    assert find_faults(CORNERS, turned, np.arange(4)).crowded_edges == 6


def test_a_fin_is_found():
    fin = np.concatenate([TET, [[0, 1, 4]]])
    found = find_faults(np.concatenate([CORNERS, [[0, 0, -1.0]]]), fin, np.arange(5))
    assert found.crowded_edges == 3
    assert not found.manifold


def test_two_tetrahedra_at_one_vertex_are_pinched():
    other = np.where(TET == 0, 0, TET + 3)
    points = np.concatenate([CORNERS, -CORNERS[1:]])
    found = find_faults(points, np.concatenate([TET, other]), np.zeros(8, dtype=np.int64))
    assert (found.open_edges, found.crowded_edges, found.pinched_vertices) == (0, 0, 1)


def test_twins_are_opposite_half_edges():
    mesh = mesh_shape(cq.Workplane().sphere(3).val().wrapped, edge_length=1.0)
    twin = half_edge_twins(mesh.triangles, len(mesh.points))
    start = mesh.triangles.ravel()
    end = np.roll(mesh.triangles, -1, axis=1).ravel()
    np.testing.assert_array_equal(start[twin], end)
    np.testing.assert_array_equal(end[twin], start)


def test_areas_and_volume_agree_with_trimesh():
    mesh = mesh_shape(cq.Workplane().box(3, 2, 1).edges().fillet(0.2).val().wrapped)
    other = trimesh.Trimesh(mesh.points, mesh.triangles, process=False)
    areas = face_areas(mesh.points, mesh.triangles, mesh.face_ids, 26)
    np.testing.assert_allclose(areas.sum(), other.area, rtol=1e-12)
    np.testing.assert_allclose(mesh_volume(mesh.points, mesh.triangles), other.volume, rtol=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_faults_are_those_of_the_general_check(seed):
    mesh = mesh_shape(cq.Workplane().box(3, 2, 1).val().wrapped, edge_length=0.8)
    rng = np.random.default_rng(seed)
    triangles = mesh.triangles[rng.random(len(mesh.triangles)) < 0.9]
    turned = rng.random(len(triangles)) < (0.0 if seed == 0 else 0.05)
    triangles = np.where(turned[:, None], triangles[:, ::-1], triangles)
    found = find_faults(mesh.points, triangles, np.zeros(len(triangles), dtype=np.int64))
    edges = edge_table(triangles)
    assert found.open_edges == (edges.count == 1).sum()
    assert found.crowded_edges == 2 * ((edges.count == 2) & (edges.balance != 0)).sum()
    if seed == 0:  # where triangles disagree the general check still joins them to one fan
        assert found.pinched_vertices == len(non_manifold_vertices(triangles, edges))
