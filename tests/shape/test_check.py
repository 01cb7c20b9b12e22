"""The mesh check on meshes with one known fault each."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.shape import DiscreteShape
from cadskin.shape.check import (
    check_mesh,
    edge_table,
    inverted_triangles,
    non_manifold_vertices,
    triangle_quality,
)

TET = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
TET_TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


def shape(points, triangles):
    return DiscreteShape(points, triangles, np.zeros(len(triangles), dtype=int))


def test_a_tetrahedron_is_watertight():
    check = check_mesh(shape(TET, TET_TRIANGLES))
    assert check.watertight
    assert (check.closed, check.manifold, check.oriented) == (True, True, True)
    assert check.problems() == ()
    assert (check.n_points, check.n_edges, check.n_triangles, check.euler_number) == (4, 6, 4, 2)
    assert check.volume == pytest.approx(1 / 6)
    assert check.area == pytest.approx(1.5 + np.sqrt(3) / 2)
    assert (check.edge_length_min, check.edge_length_max) == pytest.approx((1.0, np.sqrt(2)))
    assert check.n_components == 1


def test_a_missing_triangle_leaves_three_open_edges():
    check = check_mesh(shape(TET, TET_TRIANGLES[:-1]))
    assert not check.closed
    assert not check.watertight
    assert sorted(map(tuple, check.open_edges)) == [(0, 2), (0, 3), (2, 3)]
    assert check.problems() == ("3 open edges",)
    assert check.problems(solid=False) == ()


def test_a_flipped_triangle_is_misoriented():
    triangles = TET_TRIANGLES.copy()
    triangles[0] = triangles[0, ::-1]
    check = check_mesh(shape(TET, triangles))
    assert sorted(map(tuple, check.misoriented_edges)) == [(0, 1), (0, 2), (1, 2)]
    assert not check.watertight


def test_inward_orientation_is_told():
    check = check_mesh(shape(TET, TET_TRIANGLES[:, ::-1]))
    assert check.oriented
    assert "oriented inward" in check.problems()[0]
    assert not check.watertight


def test_two_tetrahedra_that_share_an_edge():
    points = np.concatenate([TET, [[1, -1, 0], [0, -1, -1.0]]])
    other = np.array([0, 1, 4, 5])[TET_TRIANGLES]
    check = check_mesh(shape(points, np.concatenate([TET_TRIANGLES, other])))
    assert check.non_manifold_edges.tolist() == [[0, 1]]
    assert not check.manifold


def test_two_tetrahedra_that_share_a_vertex():
    points = np.concatenate([TET, -TET[1:]])
    other = np.array([0, 4, 5, 6])[TET_TRIANGLES][:, ::-1]
    check = check_mesh(shape(points, np.concatenate([TET_TRIANGLES, other])))
    assert check.non_manifold_vertices.tolist() == [0]
    assert len(check.non_manifold_edges) == 0
    assert check.problems() == ("1 vertices where separate fans touch",)


def test_two_separate_tetrahedra_are_two_components():
    points = np.concatenate([TET, TET + 3, [[9, 9, 9.0]]])
    check = check_mesh(shape(points, np.concatenate([TET_TRIANGLES, TET_TRIANGLES + 4])))
    assert check.watertight
    assert check.n_components == 2
    assert check.euler_number == 4
    assert check.unused_points.tolist() == [8]


@pytest.mark.parametrize("third", [[2, 0, 0], [1, 0, 0], [0.5, 1e-13, 0]])
def test_triangles_without_area(third):
    check = check_mesh(shape([[0, 0, 0], [1, 0, 0], third], [[0, 1, 2]]))
    assert check.degenerate_triangles.tolist() == [0]


def test_a_repeated_corner_is_degenerate():
    assert check_mesh(shape(TET, [[0, 1, 1]])).degenerate_triangles.tolist() == [0]


def test_an_empty_mesh_is_no_solid():
    check = check_mesh(shape(np.zeros((0, 3)), np.zeros((0, 3), dtype=int)))
    assert not check.closed
    assert check.problems() == ("no triangles",)


def test_quality_of_known_triangles():
    equilateral = np.array([[0, 0, 0], [1, 0, 0], [0.5, np.sqrt(3) / 2, 0]])
    right = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0.0]])
    triangle = np.array([[0, 1, 2]])
    assert triangle_quality(7 * equilateral, triangle)[0] == pytest.approx(1.0)
    assert triangle_quality(right, triangle)[0] == pytest.approx(np.sqrt(3) / 2)
    assert triangle_quality(right * [1, 0, 1], triangle)[0] == 0.0


def test_edge_table_names_the_triangles_of_each_edge():
    table = edge_table(TET_TRIANGLES)
    for (a, b), pair in zip(table.vertices, table.triangles, strict=True):
        with_edge = [t for t, corners in enumerate(TET_TRIANGLES) if {a, b} <= set(corners)]
        assert sorted(pair) == with_edge
    for triangle, sides in zip(TET_TRIANGLES, table.of_sides, strict=True):
        for k in range(3):
            assert set(table.vertices[sides[k]]) == {triangle[k], triangle[(k + 1) % 3]}
    assert (edge_table(TET_TRIANGLES[:1]).triangles[:, 1] == -1).all()


def test_a_border_vertex_of_one_fan_is_manifold():
    assert len(non_manifold_vertices(TET_TRIANGLES[:2])) == 0
    bow_tie = np.array([[0, 1, 2], [0, 3, 4]])
    assert non_manifold_vertices(bow_tie).tolist() == [0]


def test_inverted_triangles():
    moved = TET.copy()
    moved[1] = [-0.5, 0, 0]
    turned = inverted_triangles(moved, TET, TET_TRIANGLES)
    assert turned.tolist() == [True, True, True, False]
    assert not inverted_triangles(3 * TET + 1, TET, TET_TRIANGLES).any()
    assert inverted_triangles(0.1 * TET, TET, TET_TRIANGLES, tol=0.02).all()
    flat = TET.copy()
    flat[2] = [2, 0, 0]
    assert inverted_triangles(TET, flat, TET_TRIANGLES).tolist() == [False, False, True, True]


@pytest.mark.parametrize("seed", range(3))
def test_agrees_with_trimesh(seed):
    trimesh = pytest.importorskip("trimesh")
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(subdivisions=2)
    keep = rng.random(len(ball.faces)) > 0.1 * seed
    mesh = trimesh.Trimesh(ball.vertices, ball.faces[keep], process=False)
    check = check_mesh(shape(np.array(mesh.vertices), np.array(mesh.faces)))
    assert check.watertight == mesh.is_watertight
    assert check.area == pytest.approx(mesh.area)
    assert check.n_edges == len(mesh.edges_unique)
    assert check.n_components == mesh.body_count
