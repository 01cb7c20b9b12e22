"""Where a line of sight meets a mesh, against a box whose hits are known."""

import numpy as np
import synthetic
from CadSkin import ray
from hypothesis import given
from hypothesis import strategies as st

POINTS, TRIANGLES, FACES = synthetic.box_mesh(size=(60.0, 40.0, 20.0), cells=5)
inside = st.floats(0.02, 0.98)


@given(st.integers(0, 5), inside, inside, st.tuples(inside, inside, inside))
def test_a_ray_from_outside_meets_the_face_that_it_is_aimed_at(number, first, second, start):
    axis, side = synthetic.BOX_FACES[number]
    size = np.array([60.0, 40.0, 20.0])
    target = size.copy()
    target[axis] *= side
    target[(axis + 1) % 3] *= first
    target[(axis + 2) % 3] *= second
    origin = np.array(start) * size
    origin[axis] = size[axis] * (3.0 if side else -2.0)
    triangle, weights = ray.first_hit(origin, target - origin, POINTS, TRIANGLES)
    assert np.allclose(weights @ POINTS[TRIANGLES[triangle]], target, atol=1e-9)
    assert FACES[triangle] == number + 1
    assert abs(weights.sum() - 1.0) < 1e-12
    assert weights.min() >= -1e-8


def test_a_ray_that_passes_by_meets_nothing():
    away = np.array([100.0, 100.0, 100.0])
    assert ray.first_hit(away, np.array([1.0, 0.0, 0.0]), POINTS, TRIANGLES) is None
    assert ray.first_hit(away, np.array([0.0, 0.0, 1.0]), POINTS, np.zeros((0, 3), int)) is None


def test_a_ray_through_an_edge_of_the_mesh_is_not_lost():
    found = ray.first_hit(np.array([12.0, 8.0, 50.0]), np.array([0.0, 0.0, -1.0]), POINTS, TRIANGLES)
    assert found is not None
    assert FACES[found[0]] == 6
