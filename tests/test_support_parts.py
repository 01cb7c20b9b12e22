"""The hand-made parts of these tests are what they claim to be."""

from __future__ import annotations

import numpy as np
import pytest
from support.parts import (
    box,
    cone,
    cylinder,
    filleted_box,
    plate_with_hole,
    pyramid,
    sphere,
    thin_wall,
    wedge,
)

from cadskin.shape.check import check_mesh
from cadskin.shape.discrete import triangle_normals


@pytest.mark.parametrize(
    ("part", "volume"),
    [
        (box(), 72.0),
        (cylinder(h=0.2), np.pi * 9 * 5),
        (plate_with_hole(h=0.3), 2 * (80 - 4 * np.pi)),
        (filleted_box(h=0.2), 3 * (30 - 1.5**2 * (1 - np.pi / 4))),
        (wedge(np.pi / 3), 3 * 0.5 * 25 * np.sin(np.pi / 3)),
        (thin_wall(), 4.0),
        (pyramid(), 32 * 4 / 3),
        (cone(h=0.3), np.pi * 9 * 4 / 3),
        (sphere(), 4 / 3 * np.pi * 8),
    ],
)
def test_builders_make_watertight_parts(part, volume):
    check = check_mesh(part.surface)
    assert check.problems() == ()
    assert check.volume == pytest.approx(volume, rel=0.03)
    seen = triangle_normals(part.surface.points, part.surface.triangles)
    told = part.samples.normals[part.corner_samples].sum(axis=1)
    assert (np.einsum("ij,ij->i", seen, told) > 2.0).all()
