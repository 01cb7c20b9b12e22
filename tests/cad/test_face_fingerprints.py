"""The same faces found again after a new export, and nothing guessed."""

from dataclasses import asdict

import cadquery as cq
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cadskin.cad import describe_faces, read_parts
from cadskin.errors import GeometryError
from cadskin.shape.fingerprint import FaceFingerprint, fingerprint, match_faces


def bracket(hole=(10, 5), height=8, diameter=6):
    plate = cq.Workplane().box(60, 40, height).faces(">Z").workplane().pushPoints([hole]).hole(diameter)
    return plate.edges(">X and |Z").fillet(4)


def prints(workplane):
    return [fingerprint(face) for face in describe_faces(workplane.val().wrapped)]


def test_a_new_export_in_another_face_order_matches_face_by_face(tmp_path):
    old = bracket()
    path = tmp_path / "again.step"
    old.rotate((0, 0, 0), (0, 0, 1), 180).rotate((0, 0, 0), (0, 0, 1), 180).val().exportStep(str(path))
    new = list(describe_faces(read_parts(path)[0].shape))
    order = np.random.default_rng(3).permutation(len(new))
    matches = match_faces(prints(old), [new[k] for k in order])
    assert {match.status for match in matches} == {"matched"}
    assert sorted(match.new for match in matches) == list(range(len(new)))
    for match, face in zip(matches, describe_faces(old.val().wrapped), strict=True):
        np.testing.assert_allclose(new[order[match.new]].centre, face.centre, atol=1e-6)


def test_a_moved_hole_is_found_as_moved():
    old, new = bracket(), bracket(hole=(-5, 5))
    (k,) = [i for i, p in enumerate(prints(old)) if p.internal]
    matches = match_faces(prints(old), prints(new))
    assert matches[k].status == "moved"
    assert prints(new)[matches[k].new].internal
    # The planes that the hole pierces keep their place in space, so they are found, at another centre.
    assert all(match.status in ("matched", "moved") for match in matches)


def test_two_equal_candidates_are_not_guessed():
    two = cq.Workplane().box(60, 40, 8).faces(">Z").workplane().pushPoints([(-10, 0), (10, 0)]).hole(6)
    one = cq.Workplane().box(60, 40, 8).faces(">Z").workplane().pushPoints([(0, 12)]).hole(6)
    old = [p for p in prints(one) if p.internal]
    (match,) = match_faces(old, prints(two), tolerance=1e-3)
    assert match.status == "ambiguous"
    assert match.new is None
    assert [prints(two)[k].internal for k in match.candidates] == [True, True]
    # the other way round: two old holes cannot both become the one new hole
    back = match_faces([p for p in prints(two) if p.internal], prints(one), tolerance=1e-3)
    assert [m.status for m in back] == ["ambiguous", "ambiguous"]


def test_a_face_that_is_gone_is_lost():
    old, new = bracket(), cq.Workplane().box(60, 40, 8)
    lost = [prints(old)[m.old].kind for m in match_faces(prints(old), prints(new)) if m.status == "lost"]
    assert lost.count("cylinder") == 3
    assert match_faces([], prints(new)) == ()
    assert {m.status for m in match_faces(prints(old), [])} == {"lost"}


def test_another_diameter_is_another_face():
    matches = match_faces(prints(bracket()), prints(bracket(diameter=7)))
    assert [m.status for m, p in zip(matches, prints(bracket()), strict=True) if p.internal] == ["lost"]


def test_a_pierced_plane_is_still_the_same_plane():
    """A new hole changes area and centre of the top face, not its plane."""
    old, new = cq.Workplane().box(60, 40, 8), bracket()
    top = next(i for i, p in enumerate(prints(old)) if p.normal[2] > 0.5)
    match = match_faces(prints(old), prints(new))[top]
    assert match.status == "moved"
    assert prints(new)[match.new].normal[2] > 0.5


def test_distance_is_a_length_and_infinite_between_kinds():
    a, b = (
        prints(cq.Workplane().box(2, 2, 2))[0],
        prints(cq.Workplane().box(2, 2, 2).translate((0, 0, 0.5)))[0],
    )
    assert a.distance(a) == 0.0
    assert a.distance(b) == pytest.approx(0.5)
    assert a.distance(b) == b.distance(a)
    assert a.distance(next(p for p in prints(bracket()) if p.internal)) == float("inf")


def test_keys_are_quantised_and_survive_plain_data():
    one, again = prints(bracket()), prints(bracket())
    assert [p.quantised() for p in one] == [p.quantised() for p in again]
    assert len({p.quantised() for p in one}) == len(one)
    assert [FaceFingerprint(**asdict(p)) for p in one] == one
    with pytest.raises(GeometryError, match="step"):
        one[0].quantised(0)


@settings(max_examples=25, deadline=None)
@given(st.lists(st.floats(-5, 5), min_size=3, max_size=3), st.randoms(use_true_random=False))
def test_matching_never_pairs_two_old_faces_with_one_new(shift, random):
    old = prints_of_box()
    new = [
        FaceFingerprint(
            **{**asdict(p), "centre": tuple(np.add(p.centre, shift) if random.random() < 0.5 else p.centre)}
        )
        for p in old
    ]
    matches = match_faces(old, new)
    chosen = [m.new for m in matches if m.new is not None]
    assert len(chosen) == len(set(chosen))
    for match in matches:
        assert (match.new is not None) == (match.status in ("matched", "moved"))
        if match.new is not None:
            assert match.candidates == (match.new,)


def prints_of_box():
    return [
        FaceFingerprint("plane", False, area, centre, normal)
        for area, centre, normal in [
            (4.0, (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
            (4.0, (0.0, 0.0, -1.0), (0.0, 0.0, -1.0)),
            (6.0, (1.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
            (6.0, (-1.0, 0.0, 0.0), (-1.0, 0.0, 0.0)),
        ]
    ]
