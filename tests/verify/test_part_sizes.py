"""Sizes on parts (ISO 14405-1): two-point, global, ranks, envelope; widths, spheres, radii."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cadskin.errors import AssociationError, SpecificationError
from cadskin.spec import Specification, size
from cadskin.verify import verify
from cadskin.verify.extraction import MadePart
from cadskin.verify.part_size import evaluate_size


def bound(part, dimension, **changes):
    return replace(Specification(dimensions=[dimension]).bind(part).dimensions[0], **changes)


def shaped(part, radius_of):
    """Give the round surface of the shaft the radius ``radius_of(turn, z)``."""
    points = np.array(part.surface.points)
    wall = part.feature_of(0).vertex_ids
    turn = np.arctan2(points[wall, 1], points[wall, 0])
    radius = radius_of(turn, points[wall, 2])
    points[wall, :2] = radius[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return MadePart(part.surface.with_points(points), part)


def test_two_points_do_not_see_three_lobes_the_envelope_does(array_shaft):
    """r = R + a cos 3t: every diameter is 2 R; the circumscribed cylinder has R + a."""
    nominal = array_shaft.feature_of(0).radius
    made = shaped(array_shaft, lambda turn, z: nominal + 0.02 * np.cos(3 * turn))
    given = size(0, 2 * nominal, (-0.01, 0.01))
    plain = evaluate_size(bound(array_shaft, given), made)
    assert plain.value == pytest.approx(2 * nominal, abs=2e-3)
    assert plain.ok
    enveloped = evaluate_size(bound(array_shaft, given, modifiers=("envelope requirement",)), made)
    assert enveloped.details["mating_size"] == pytest.approx(2 * (nominal + 0.02), abs=2e-3)
    assert not enveloped.ok
    least = evaluate_size(bound(array_shaft, given, modifiers=("GG",)), made)
    assert least.value == pytest.approx(2 * nominal, abs=1e-4)
    widest = evaluate_size(bound(array_shaft, given, modifiers=("GN",)), made)
    assert widest.value == pytest.approx(enveloped.details["mating_size"], abs=1e-12)
    assert widest.certified


def test_ranks_of_a_tapered_shaft(array_shaft):
    nominal = array_shaft.feature_of(0).radius
    high = array_shaft.surface.points[:, 2].max()
    made = shaped(array_shaft, lambda turn, z: nominal + 0.05 * z / high)
    for word, expected in (
        ("SX", 0.95),
        ("SN", 0.05),
        ("average", 0.5),
        ("SD", 0.5),
        ("range of sizes", None),
    ):
        found = evaluate_size(bound(array_shaft, size(0, 10.0, (-9, 90)), modifiers=(word,)), made)
        wanted = 0.1 * 0.9 if expected is None else 2 * nominal + 0.1 * expected
        assert found.value == pytest.approx(wanted, abs=2e-4)


def test_width_of_two_opposite_planes(array_box):
    """The top leans by 0.001 along x: sizes 20 ± 0.03; the narrowest slab around, the mean between."""
    points = np.array(array_box.surface.points)
    top = np.isclose(points[:, 2], 10.0)
    points[top, 2] += 0.001 * points[top, 0]
    made = MadePart(array_box.surface.with_points(points), array_box)
    given = size([4, 5], 20.0, (-0.05, 0.05), name="thickness")
    local = evaluate_size(bound(array_box, given), made)
    assert (local.details["smallest"], local.details["largest"]) == pytest.approx((19.97, 20.03), abs=1e-4)
    assert local.ok
    least = evaluate_size(bound(array_box, given, modifiers=("GG",)), made)
    assert least.value == pytest.approx(20.0, abs=1e-4)
    around = evaluate_size(bound(array_box, given, modifiers=("GN",)), made)
    assert 20.0 < around.value <= 20.03 + 1e-9
    too_tight = evaluate_size(bound(array_box, size([4, 5], 20.0, (-0.01, 0.01), name="thickness")), made)
    assert not too_tight.ok


@pytest.mark.parametrize(
    ("changes", "text"),
    [({"modifiers": ("controlled radius",)}, "controlled radius"), ({"modifiers": ("CV",)}, "CV")],
)
def test_unknown_modifiers_are_named(array_shaft, changes, text):
    with pytest.raises(SpecificationError, match=text):
        evaluate_size(
            bound(array_shaft, size(0, 10.0, (-1, 1)), **changes), MadePart(array_shaft.surface, array_shaft)
        )


def test_a_single_plane_has_no_size(array_box):
    with pytest.raises(SpecificationError, match="size of plane is not supported"):
        evaluate_size(bound(array_box, size(5, 10.0, (-1, 1))), MadePart(array_box.surface, array_box))


@pytest.mark.parametrize("whole", [True, False])
def test_sphere(whole):
    cadquery = pytest.importorskip("cadquery", reason="needs cadquery to make a sphere")
    from cadskin.cad import nominal

    solid = cadquery.Workplane().sphere(8.0)
    if not whole:
        solid = solid.intersect(cadquery.Workplane().box(30, 30, 30).translate((0, 0, 21)))
    part = nominal(solid, edge_length=1.0)
    face = part.feature(kind="sphere").face_indices[0]
    made = MadePart(part.surface, part)
    given = bound(part, size(face, 16.0, (-0.1, 0.1), name="spherical diameter"))
    if whole:
        assert evaluate_size(given, made).value == pytest.approx(16.0, abs=1e-9)
    else:
        with pytest.raises(AssociationError, match="opposite"):
            evaluate_size(given, made)
        assert evaluate_size(replace(given, modifiers=("GG",)), made).value == pytest.approx(16.0, abs=1e-9)
    radius = bound(part, size(face, 8.0, (-0.1, 0.1), name="spherical radius"))
    assert evaluate_size(radius, made).value == pytest.approx(8.0, abs=1e-9)


def test_sizes_stand_in_the_table(array_shaft):
    spec = Specification(dimensions=[size(0, 2 * array_shaft.feature_of(0).radius, (-0.1, 0.1), id="d")])
    found = verify(array_shaft.surface, spec, nominal=array_shaft, sizes=True)
    assert found["d"].ok
    assert found.conforming
