"""Smooth patches: sharp edges part them, tangent edges and seams do not."""

from __future__ import annotations

import numpy as np
import pytest
from support.parts import bent_plate, box, cylinder, filleted_box, thin_wall

from cadskin.shape import smooth_patches


def test_a_box_has_a_patch_per_face() -> None:
    part = box()
    patches = smooth_patches(part)
    assert patches.n_patches == 6
    assert patches.n_nodes == part.n_samples  # no two samples agree in their normal


def test_a_shaft_has_a_barrel_and_two_caps() -> None:
    assert smooth_patches(cylinder()).n_patches == 3


def test_a_fillet_joins_its_neighbours_and_shares_their_nodes() -> None:
    part = filleted_box()
    patches = smooth_patches(part)
    ids = part.feature_ids()
    shared = [np.unique(ids[patches.node_of_sample == n]) for n in range(patches.n_nodes)]
    assert any(len(features) == 2 for features in shared)
    assert patches.n_patches < len(part.features)
    assert patches.n_nodes < part.n_samples


def test_the_two_sides_of_a_thin_wall_stay_apart() -> None:
    part = thin_wall()
    patches = smooth_patches(part)
    normals = patches.normals(part)
    for patch in range(patches.n_patches):
        mine = normals[patches.patch_of_node == patch]
        assert (mine @ mine[0] > 0.99).all()


@pytest.mark.parametrize(("angle", "joined"), [(5.0, True), (9.0, True), (12.0, False), (40.0, False)])
def test_the_tangent_angle_decides(angle: float, joined: bool) -> None:
    part = bent_plate(np.deg2rad(angle))
    sharp = smooth_patches(part, angle=np.deg2rad(1.0))
    assert (smooth_patches(part).n_patches < sharp.n_patches) == joined


def test_every_triangle_lies_in_one_patch_and_spreads_back_to_its_vertices() -> None:
    part = filleted_box()
    patches = smooth_patches(part)
    of_corners = patches.patch_of_node[patches.triangles]
    assert (of_corners == patches.patch_of_triangle[:, None]).all()
    np.testing.assert_array_equal(patches.vertex_of_node[patches.triangles], part.surface.triangles)
    np.testing.assert_array_equal(patches.vertex_of_node[patches.node_of_sample], part.samples.vertex_ids)
