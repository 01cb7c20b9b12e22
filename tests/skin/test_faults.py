"""Self-intersections are found and told with their place."""

from __future__ import annotations

import numpy as np
import pytest
from support.parts import (
    Line,
    Patch,
    assemble,
    box,
    cylinder,
    extrude,
    filleted_box,
    plate_with_hole,
    sphere,
    thin_wall,
)

from cadskin.errors import CadskinWarning, GeometryError
from cadskin.shape import Freeform, NominalModel
from cadskin.shape.intersections import self_intersections
from cadskin.skin import check_skin, weld
from cadskin.skin.faults import intersecting_pairs


def by_feature(part, **values):
    field = np.zeros(part.n_samples)
    for name, value in values.items():
        field[part.feature(name=name).rows] = value
    return field


def slot(width=0.4, h=0.5) -> NominalModel:
    """A block with a slot from above (profile in the x-y plane): walls "slot left" and "slot right"."""
    half = 0.5 * width
    corners = [(-3, 0), (3, 0), (3, 4), (half, 4), (half, 1.5), (-half, 1.5), (-half, 4), (-3, 4)]
    names = ["base", "right", "top right", "slot right", "floor", "slot left", "top left", "left"]
    sides = [Line(corners[k], corners[(k + 1) % 8], names[k]) for k in range(8)]
    return extrude([sides], 2.0, h)


def test_a_thin_wall_that_is_eaten_up():
    wall = thin_wall(thickness=0.2)
    with pytest.raises(GeometryError) as raised:
        check_skin(wall, by_feature(wall, front=-0.15, back=-0.12))
    text = str(raised.value)
    assert "the wall is 0.2 mm thick there" in text
    assert "front" in text
    assert "back" in text
    assert "-0.15" in text
    assert "-0.12" in text
    assert "y" not in text.split("near ")[1].split("mm")[0]  # a place in numbers


def test_only_the_thin_place_is_named():
    """A pit of 0.3 mm in the middle of the front of a wall of 0.2 mm."""
    wall = thin_wall(thickness=0.2, h=0.25)
    front = wall.feature(name="front")
    field = np.zeros(wall.n_samples)
    distance = np.hypot(front.points[:, 0] - 2.5, front.points[:, 2] - 2.0)
    field[front.rows] = -0.3 * np.exp(-(distance**2))
    with pytest.raises(
        GeometryError, match=r"near \(2\.[3-7]\d*, 0\.1, (1\.[7-9]\d*|2|2\.[0-3]\d*)\)"
    ) as raised:
        check_skin(wall, field)
    assert "the wall is 0.2 mm thick there" in str(raised.value)
    check_skin(wall, 0.6 * field)


def test_a_slot_that_closes():
    part = slot(width=0.4)
    check_skin(part, by_feature(part, **{"slot left": 0.15, "slot right": 0.15}))
    with pytest.raises(GeometryError, match=r"the gap is 0\.4 mm wide there"):
        check_skin(part, by_feature(part, **{"slot left": 0.25, "slot right": 0.25}))


def test_a_hole_that_is_grown_over():
    """Material added by more than the radius: the hole turns inside out."""
    part = plate_with_hole(radius=1.0, h=0.4)
    check_skin(part, by_feature(part, hole=0.5))
    with pytest.raises(GeometryError, match=r"passes through itself .* between hole and hole .* gap is"):
        check_skin(part, by_feature(part, hole=1.4))


def test_a_hole_that_breaks_through_the_side():
    part = plate_with_hole(size=(8.0, 5.0, 2.0), radius=2.0, h=0.5)
    check_skin(part, by_feature(part, hole=-0.3))
    with pytest.raises(
        GeometryError, match=r"passes through itself .* between side \d and hole .* the wall is 0\.5"
    ):
        check_skin(part, by_feature(part, hole=-0.8))


def test_a_fillet_that_loses_more_than_its_radius():
    """An outer fillet of 1.5 mm and its neighbours lose 2 mm: the fillet would turn inside out."""
    part = filleted_box(radius=1.5)
    check_skin(part, by_feature(part, fillet=-1.0, front=-1.0, left=-1.0))
    with pytest.raises(
        GeometryError, match=r"on fillet near \(.*the deviation is -2 mm and the radius 1\.5 mm there"
    ):
        check_skin(part, by_feature(part, fillet=-2.0, front=-2.0, left=-2.0))


def test_the_pairs_are_those_of_the_full_test():
    wall = thin_wall(thickness=0.2)
    for seed in range(8):
        field = 0.12 * np.random.default_rng(seed).uniform(-1, 1, wall.n_samples)
        moved = weld(wall, field)
        expected = self_intersections(wall.surface.points + moved, wall.surface.triangles)
        np.testing.assert_array_equal(intersecting_pairs(wall.surface, moved), expected)


def test_pairs_kept_for_small_moves_serve_later_and_longer_ones():
    wall = thin_wall(thickness=0.05, h=0.25)
    front, pit = wall.feature(name="front"), np.zeros(wall.n_samples)
    pit[front.rows] = np.exp(-((front.points[:, 0] - 2.5) ** 2) - (front.points[:, 2] - 2.0) ** 2)
    for size in (0.02, 0.04, 0.03, 0.06, 0.048, 0.2):
        moved = weld(wall, -size * pit)
        expected = self_intersections(wall.surface.points + moved, wall.surface.triangles)
        np.testing.assert_array_equal(intersecting_pairs(wall.surface, moved), expected)
        assert (len(expected) > 0) == (size > 0.05)


def test_walls_that_just_touch_count():
    wall = thin_wall(thickness=0.25)
    with pytest.raises(GeometryError, match=r"0\.25 mm thick"):
        check_skin(wall, by_feature(wall, front=-0.125, back=-0.125))


@pytest.mark.parametrize("part", [box(), cylinder(), slot()])
def test_sound_skins_pass(part):
    check_skin(part, np.zeros(part.n_samples))
    check_skin(part, np.full(part.n_samples, 0.05))
    check_skin(part, 0.05 * np.random.default_rng(1).uniform(-1, 1, part.n_samples))


def test_a_nominal_mesh_that_intersects_itself_is_told_apart():
    """The box is pushed through itself before anything is simulated on it."""
    part = thin_wall(thickness=0.2, h=0.5)
    points = part.surface.points.copy()
    front = np.setdiff1d(part.feature(name="front").vertex_ids, np.concatenate([
        part.feature(name=name).vertex_ids for name in ("top", "bottom", "left", "right")
    ]))  # fmt: skip
    points[front[len(front) // 2], 1] = 0.3
    bad = NominalModel(part.surface.with_points(points), part.faces, part.features, part.samples)
    with pytest.warns(CadskinWarning, match="the nominal mesh already intersects itself at"):
        check_skin(bad, np.full(part.n_samples, 0.001))


def test_a_shell_that_passes_through_the_other_leaves_no_intersection_and_is_told():
    """The inner surface of a hollow ball of 0.2 mm grows by 0.3 mm: closed, nothing turned, no crossing."""
    outer, inner = sphere(radius=2.0), sphere(radius=1.8)
    n = outer.surface.n_points
    hollow = assemble(
        [
            Patch(
                outer.surface.points, outer.surface.triangles, outer.samples.normals[_rows(outer)], Freeform()
            ),
            Patch(
                inner.surface.points,
                inner.surface.triangles[:, ::-1],
                -inner.samples.normals[_rows(inner)],
                Freeform(),
            ),
        ]
    )
    assert hollow.surface.n_points == 2 * n
    check_skin(hollow, np.repeat([0.1, -0.1], n))
    check_skin(hollow, np.repeat([-0.05, -0.1], n))
    with pytest.raises(GeometryError, match=r"passes through itself .* the wall is 0\.\d+ mm thick"):
        check_skin(hollow, np.repeat([0.0, -0.3], n))


def _rows(part):
    """Sample of each vertex of a part of one feature."""
    rows = np.zeros(part.surface.n_points, dtype=int)
    rows[part.samples.vertex_ids] = np.arange(part.n_samples)
    return rows
