"""Profile of lines, values per area, projected zones and members of an axis on parts: closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from support.parts import Arc, Line, extrude

from cadskin.shape import DiscreteShape
from cadskin.shape.ideal import Cylinder, Plane
from cadskin.spec import (
    AreaUnit,
    FeatureSelection,
    Specification,
    flatness,
    line_profile,
    perpendicularity,
    position,
    size,
    surface_profile,
)
from cadskin.verify import verify
from cadskin.verify.extraction import MadePart
from cadskin.verify.members import members_of

TURN = 2 * np.pi


def on_top(part, height):
    points = np.array(part.surface.points)
    top = np.isclose(points[:, 2], points[:, 2].max())
    points[top, 2] += height(*points[top, :2].T)
    return part.surface.with_points(points)


def value_of(part, surface, tolerance, **datums):
    found = verify(surface, Specification(tolerance, datums=datums, checked=False), nominal=part)
    assert not found.unresolved, found.unresolved
    return found[tolerance.id or found.evaluations[0][0]]


def test_a_line_profile_to_datums_stays_where_they_are(array_box):
    made = on_top(array_box, lambda x, y: 0.05 + 0 * x)
    assert value_of(array_box, made, line_profile(5, 0.2, datums="A"), A=4).value == pytest.approx(0.1)
    free = value_of(array_box, made, line_profile(5, 0.2))
    assert free.value == pytest.approx(0.0, abs=1e-9)
    assert any("no intersection plane" in note for note in free.notes)


def test_each_line_floats_by_itself_without_datums(array_box):
    """A twisted plane has straight lines along x; its surface is no plane."""
    made = on_top(array_box, lambda x, y: 1e-4 * x * y)
    lines = value_of(array_box, made, line_profile(5, 0.2))
    surface = value_of(array_box, made, surface_profile(5, 0.2))
    assert surface.value > 0.05
    assert lines.value < 0.02 * surface.value  # what is left is the mesh: triangles for a twisted square


@pytest.mark.parametrize(("relation", "value"), [("parallel B", 0.0), ("perpendicular B", 0.02)])
def test_the_intersection_plane_chooses_the_lines(array_box, relation, value):
    """A bow along y is seen in lines across the wall B (normal y), not in lines parallel to it."""
    made = on_top(array_box, lambda x, y: 0.02 * (1 - (y / 20.0) ** 2))
    tolerance = line_profile(5, 0.2, intersection_plane=relation)
    assert value_of(array_box, made, tolerance, B=3).value == pytest.approx(value, rel=1e-5, abs=1e-9)


def test_lines_of_a_cylinder_are_its_circles(array_shaft):
    """Chords of the mesh do not cut into the surface; an oval of two lobes has lines of its own size."""
    part = array_shaft
    perfect = value_of(part, part.surface, line_profile(0, 0.2))
    assert perfect.value == pytest.approx(0.0, abs=1e-9)
    points = np.array(part.surface.points)
    wall = part.feature_of(0).vertex_ids
    turn = np.arctan2(points[wall, 1], points[wall, 0])
    points[wall, :2] += (0.01 * np.cos(2 * turn))[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    oval = value_of(part, part.surface.with_points(points), line_profile(0, 0.2))
    assert oval.value == pytest.approx(0.02, rel=0.02)


@pytest.mark.parametrize("shape", ["square", "rectangular", "circular"])
def test_flatness_of_an_area_of_a_parabola(array_box, shape):
    """z = c x²: an area of length s along x is c s² / 4 unflat (a circle reaches it along its diameter)."""
    spacing = np.diff(np.unique(array_box.surface.points[:, 0].round(9)))[0]
    side, bow = 4 * float(spacing), 1e-3
    made = on_top(array_box, lambda x, y: bow * x**2)
    area = AreaUnit(shape, side, side if shape == "rectangular" else None)
    tolerance = flatness(5, 0.5, per_area=area)
    found = value_of(array_box, made, tolerance)
    assert found.value == pytest.approx(bow * side**2 / 4, rel=1e-9)
    assert found.value < 0.3 * value_of(array_box, made, flatness(5, 0.5)).value
    # A mesh with triangles in another order is no skin model: its areas are laid out on itself.
    scan = DiscreteShape(made.points, made.triangles[::-1], made.face_ids[::-1])
    assert value_of(array_box, scan, tolerance).value == pytest.approx(found.value, rel=1e-9)


@pytest.fixture(scope="module")
def plate():
    """A plate 60 x 40 x 10 from z = 0 with a hole of radius 5 in the middle."""
    x, y = 30.0, 20.0
    outline = [
        Line((-x, -y), (x, -y)), Line((x, -y), (x, y)), Line((x, y), (-x, y)), Line((-x, y), (-x, -y))
    ]  # fmt: skip
    return extrude([outline, [Arc((0.0, 0.0), 5.0, TURN, 0.0, name="hole")]], 10.0, 1.0)


def named(part):
    hole = next(f.index for f in part.faces if f.kind == "cylinder")
    floor = next(f.index for f in part.faces if f.kind == "plane" and f.normal[2] < -0.5)
    return hole, floor


@pytest.mark.parametrize("make", [position, perpendicularity])
def test_a_projected_zone_sees_the_lean_beyond_the_part(plate, make):
    """The hole leans by 0.01; its axis leaves the material at the floor and goes on for 15."""
    hole, floor = named(plate)
    points = np.array(plate.surface.points)
    low, high = points[:, 2].min(), points[:, 2].max()
    wall = plate.feature_of(hole).vertex_ids
    points[wall, 0] += 0.01 * (points[wall, 2] - 0.5 * (low + high))
    surface = plate.surface.with_points(points)
    within = value_of(plate, surface, make(hole, 1.0, diameter=True, datums="A"), A=floor)
    beyond = value_of(plate, surface, make(hole, 1.0, diameter=True, datums="A", projected=15.0), A=floor)
    if make is position:  # free in x and y: what counts is the lean over the length
        assert within.value == pytest.approx(0.01 * 0.9 * 10.0, rel=0.02)
    assert beyond.value == pytest.approx(0.01 * 15.0, rel=1e-4)


def test_pieces_with_other_axes_are_members_of_their_own(plate):
    hole, floor = named(plate)
    tolerance = position(FeatureSelection(faces=(hole, floor), derived="axis"), 0.1, diameter=True)
    members, notes = members_of(tolerance, MadePart(plate.surface, plate))
    assert members == ((hole,),)
    assert "no axis is derived" in notes[0]
    assert isinstance(plate.feature_of(hole).ideal, Cylinder)
    assert isinstance(plate.feature_of(floor).ideal, Plane)


def test_a_zone_on_one_side_is_kept_by_the_perfect_part(array_box):
    """With everything inside (Ⓤ 0) the nominal surface is the zone's border: the limit is met."""
    found = value_of(array_box, array_box.surface, surface_profile(5, 0.3, datums="A", outside=0.0), A=4)
    assert found.value == pytest.approx(0.3, abs=1e-12)
    assert found.ok
    high = on_top(array_box, lambda x, y: 1e-6 + 0 * x)
    assert not value_of(array_box, high, surface_profile(5, 0.3, datums="A", outside=0.0), A=4).ok


@pytest.mark.parametrize(("lobes", "bonus_method"), [(0.0, True), (0.03, False)])
def test_boundary_and_bonus_can_disagree(plate, lobes, bonus_method):
    """A hole of radius 5.05 - a cos 3t moved by 0.05; MMS 10, tolerance 0.05.

    Its mating size pays a bonus of 0.1 - 2 a for a value of 0.1: not enough with a = 0.03. Its surface stays
    outside of the boundary of 9.95 either way, so that it conforms.
    """
    hole, floor = named(plate)
    wall = plate.feature_of(hole).vertex_ids
    points = np.array(plate.surface.points)
    turn = np.arctan2(points[wall, 1], points[wall, 0])
    radius = 5.05 - lobes * np.cos(3 * turn)
    points[wall, :2] = radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]) + [0.05, 0.0]
    left = next(f.index for f in plate.faces if f.kind == "plane" and f.normal[0] < -0.5)
    front = next(f.index for f in plate.faces if f.kind == "plane" and f.normal[1] < -0.5)
    spec = Specification(
        position(hole, 0.05, diameter=True, datums="A|B|C", material="MMR"),
        datums={"A": floor, "B": front, "C": left},
        dimensions=[size(hole, 10.0, (0.0, 0.3))],
        checked=False,
    )
    surface = plate.surface.with_points(points)
    table = verify(surface, spec, nominal=plate, standard="ASME Y14.5.1-2019")
    assert not table.unresolved
    (_, found), *_ = table.evaluations
    assert found.value == pytest.approx(0.1, abs=2e-3)
    assert found.details["bonus"] == pytest.approx(0.1 - 2 * lobes, abs=2e-3)
    assert found.details["bonus_method"] is bonus_method
    assert found.ok
    nearest = np.linalg.norm(points[wall, :2], axis=1).min()
    assert found.details["virtual_boundary_violation"] == pytest.approx(4.975 - nearest, abs=1e-9)
    assert "bonus" not in verify(surface, spec, nominal=plate).evaluations[0][1].details


@pytest.mark.parametrize("make", [position, perpendicularity])
@pytest.mark.parametrize(("relation", "lean"), [("parallel B", 0.02), ("perpendicular B", 0.01)])
def test_an_orientation_plane_turns_the_zone_of_an_axis(plate, make, relation, lean):
    """The hole leans by 0.01 along x and by 0.02 along y; B is the wall of normal y."""
    hole, floor = named(plate)
    front = next(f.index for f in plate.faces if f.kind == "plane" and f.normal[1] < -0.5)
    points = np.array(plate.surface.points)
    wall = plate.feature_of(hole).vertex_ids
    height = points[wall, 2] - points[wall, 2].mean()
    points[wall, :2] += height[:, None] * [0.01, 0.02]
    tolerance = make(hole, 1.0, derived="axis", datums="A", orientation_plane=relation)
    found = value_of(plate, plate.surface.with_points(points), tolerance, A=floor, B=front)
    # Position is free to shift with A alone, so that it too sees the lean only, over the inner 9 mm.
    assert found.value == pytest.approx(9.0 * lean, rel=0.03)
    assert any("orientation only" in step for step in found.operations)


def test_an_orientation_plane_that_holds_nothing_is_refused(plate):
    hole, floor = named(plate)
    tolerance = position(hole, 1.0, derived="axis", datums="A", orientation_plane="parallel A")
    spec = Specification(tolerance, datums={"A": floor}, checked=False)
    assert "free to turn" in verify(plate.surface, spec, nominal=plate).unresolved[0][1]
