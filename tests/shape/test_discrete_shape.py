"""The discrete shape: closed forms on a tetrahedron and a cube."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from cadskin.errors import GeometryError
from cadskin.shape import DiscreteShape, triangle_normals, vertex_normals

TETRAHEDRON = ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])


@pytest.fixture
def tetrahedron() -> DiscreteShape:
    points, triangles = TETRAHEDRON
    return DiscreteShape(points, triangles, [0, 1, 2, 3])


def test_volume_area_and_diagonal_are_the_closed_forms(tetrahedron: DiscreteShape) -> None:
    assert tetrahedron.volume == pytest.approx(1 / 6, rel=1e-14)
    assert tetrahedron.area == pytest.approx(1.5 + np.sqrt(3) / 2, rel=1e-14)
    assert tetrahedron.diagonal == pytest.approx(np.sqrt(3), rel=1e-14)
    assert len(tetrahedron.edges) == 6


@pytest.mark.parametrize("shift", [0.0, 1e5])
def test_volume_does_not_depend_on_the_origin(tetrahedron: DiscreteShape, shift: float) -> None:
    assert tetrahedron.with_points(tetrahedron.points + shift).volume == pytest.approx(1 / 6, rel=1e-9)


def test_normals_point_outward(tetrahedron: DiscreteShape) -> None:
    normals = triangle_normals(tetrahedron.points, tetrahedron.triangles)
    np.testing.assert_allclose(normals[0], [0, 0, -1])
    centre = tetrahedron.points.mean(axis=0)
    outward = vertex_normals(tetrahedron.points, tetrahedron.triangles)
    assert (np.einsum("ij,ij->i", outward, tetrahedron.points - centre) > 0).all()


def test_arrays_are_frozen_and_survive_pickling(tetrahedron: DiscreteShape) -> None:
    again = pickle.loads(pickle.dumps(tetrahedron))
    for shape in (tetrahedron, again):
        with pytest.raises(ValueError, match="read-only"):
            shape.points[0, 0] = 1.0
    np.testing.assert_array_equal(again.points, tetrahedron.points)


@pytest.mark.parametrize(
    ("points", "triangles", "faces", "message"),
    [
        ([[0, 0]], [[0, 0, 0]], [0], "points has shape"),
        ([[0, 0, np.nan]], [[0, 0, 0]], [0], "NaN or infinity, first in row 0"),
        ([[0, 0, 0]], [[0, 0, 1]], [0], "vertex that does not exist"),
        ([[0, 0, 0]], [[0, 0, 0]], [0, 1], "face_ids has shape"),
    ],
)
def test_bad_arrays_are_refused(points: list, triangles: list, faces: list, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        DiscreteShape(points, triangles, faces)
