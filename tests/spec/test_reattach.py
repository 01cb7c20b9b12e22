"""A specification finds its faces again on another export, and never guesses."""

from dataclasses import replace

import numpy as np
import pytest

from cadskin.errors import SelectionError, SpecificationError
from cadskin.shape import Plane
from cadskin.spec import (
    Specification,
    fingerprinted,
    flatness,
    parse_spec,
    perpendicularity,
    reattach,
    to_toml,
)


@pytest.fixture
def spec(array_box):
    bound = Specification(
        flatness(">Z", 0.02), perpendicularity("|X", 0.1, datums="A"), datums={"A": "<Z"}
    ).bind(array_box)
    without = bound.changed(
        *(replace(t, feature=replace(t.feature, selectors=())) for t in bound.tolerances),
        datums=tuple(replace(d, feature=replace(d.feature, selectors=())) for d in bound.datums),
    )
    return fingerprinted(without, array_box.faces)


def renumbered(faces, order):
    return [replace(faces[old], index=new, step_id=100 + new) for new, old in enumerate(order)]


def shifted(face, vector):
    centre = face.centre + np.asarray(vector)
    plane = Plane(face.ideal.origin + np.asarray(vector), face.ideal.normal)
    return replace(face, centre=centre, bounds=face.bounds + np.asarray(vector), ideal=plane)


def test_only_the_used_faces_have_fingerprints(spec):
    assert [record.face for record in spec.fingerprints] == [0, 1, 4, 5]


def test_fingerprints_round_trip_through_toml(spec):
    assert parse_spec(to_toml(spec)) == spec


def test_another_order_of_the_faces(spec, array_box):
    order = [5, 3, 0, 1, 2, 4]
    result = reattach(spec, renumbered(array_box.faces, order))
    top, sides = result.spec.tolerances
    assert top.feature.faces == (order.index(5),)
    assert top.feature.step_faces == (100,)
    assert sides.feature.groups == ((order.index(0),), (order.index(1),))
    assert result.spec.datum("A").feature.faces == (order.index(4),)
    assert (result.moved, result.refused) == ((), ())
    assert result.renumbered == 4


def test_a_moved_face_is_found_and_named(spec, array_box):
    faces = list(array_box.faces)
    faces[5] = shifted(faces[5], (0, 0, 1.5))
    result = reattach(spec, faces)
    assert result.moved == ((None, 5, 5),)
    assert result.spec.tolerances[0].feature.faces == (5,)


def test_two_candidates_are_refused_not_guessed(spec, array_box):
    faces = [
        *array_box.faces[:5],
        shifted(array_box.faces[5], (0, 0, 1.5)),
        shifted(array_box.faces[5], (0, 0, -1.5)),
    ]
    faces = [replace(face, index=i) for i, face in enumerate(faces)]
    result = reattach(spec, faces)
    assert result.refused == ("face 5 could be face 5 or 6",)
    assert result.spec.tolerances[0].feature.faces == ()
    assert "could be face 5 or 6" in result.spec.unresolved[0].reason
    assert "flatness-1" in result.spec.unresolved[0].entity


def test_a_lost_face_is_said(spec, array_box):
    faces = [replace(face, index=i) for i, face in enumerate(array_box.faces[:5])]
    result = reattach(spec, faces)
    assert result.refused == ("face 5 is not there any more",)


def test_without_fingerprints_there_is_nothing_to_go_by(array_box):
    with pytest.raises(SpecificationError, match="no fingerprints"):
        reattach(Specification(flatness(0, 0.1)), array_box.faces)


def test_binding_to_another_export_is_refused(spec, array_box, array_shaft):
    assert spec.bind(array_box) == spec
    with pytest.raises(SpecificationError, match="written for another export"):
        spec.bind(array_shaft)


def test_parts_by_name(spec, array_box):
    faces = renumbered(array_box.faces, [5, 3, 0, 1, 2, 4])
    assert reattach(spec, {"block": faces}).renumbered == 4
    with pytest.raises((SpecificationError, SelectionError), match="--part"):
        reattach(spec, {"block": faces, "lid": faces})
