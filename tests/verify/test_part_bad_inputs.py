"""Bad inputs of made parts: each gives a defined answer or an error that names it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.parts import Arc, Line, extrude

from cadskin.errors import GeometryError
from cadskin.shape import DiscreteShape
from cadskin.spec import (
    Datum,
    FeatureSelection,
    Specification,
    cylindricity,
    flatness,
    parallelism,
    position,
)
from cadskin.verify import verify
from cadskin.verify.scans import labelled_points


def test_a_datum_without_feature(array_box):
    spec = Specification(
        parallelism(FeatureSelection(faces=(5,)), 0.1, datums="A"), datums=[Datum("A")], checked=False
    )
    (_, reason), *_ = verify(array_box.surface, spec, nominal=array_box).unresolved
    assert "datum A has no feature" in reason


def test_a_datum_letter_that_is_nowhere(array_box):
    spec = Specification(parallelism(FeatureSelection(faces=(5,)), 0.1, datums="Q"), checked=False)
    found = verify(array_box.surface, spec, nominal=array_box)
    assert "no datum has the letter 'Q'" in found.unresolved[0][1]
    assert not found.conforming


def test_too_few_points(array_box):
    cloud = labelled_points(np.array([[0, 0, 10.0], [1, 0, 10.0]]), np.array([5, 5]))
    found = verify(cloud, Specification(flatness(5, 0.1)), nominal=array_box)
    assert "needs at least 3 different points, got 2" in found.unresolved[0][1]


def test_a_face_that_the_scan_has_not_seen(array_box):
    cloud = labelled_points(np.random.default_rng(0).uniform(0, 1, (50, 3)), np.full(50, 4))
    found = verify(cloud, Specification(flatness(5, 0.1)), nominal=array_box)
    assert "no triangle with the labels" in found.unresolved[0][1]
    assert not found.conforming


def test_nan(array_box):
    points = np.array(array_box.surface.points)
    points[3, 1] = np.nan
    with pytest.raises(GeometryError, match="NaN"):
        array_box.surface.with_points(points)


def test_far_from_the_origin(array_box):
    """1e5 mm off: the values keep ten digits of a micrometre, the datums their direction."""
    points = np.array(array_box.surface.points)
    top = np.isclose(points[:, 2], 10.0)
    points[top, 2] += 0.05 * (1 - (points[top, 0] / 30.0) ** 2)
    spec = Specification(flatness(5, 0.1), parallelism(5, 0.1, datums="A"), datums={"A": 4})
    here = verify(array_box.surface.with_points(points), spec, nominal=array_box)
    there = verify(array_box.surface.with_points(points + 1e5), spec, nominal=array_box)
    for (_, near), (_, far) in zip(here.evaluations, there.evaluations, strict=True):
        assert far.value == pytest.approx(near.value, abs=1e-9)


def test_a_perfect_part_is_zero_and_certified(array_box, array_shaft):
    flat = verify(array_box.surface, Specification(flatness(5, 0.1)), nominal=array_box)["flatness-1"]
    assert (flat.value, flat.certified) == (0.0, True)
    round_ = verify(array_shaft.surface, Specification(cylindricity(0, 0.1)), nominal=array_shaft)
    assert round_["cylindricity-1"].value == pytest.approx(0.0, abs=1e-12)
    assert round_.certified


@pytest.fixture(scope="module")
def sliver():
    """A prism 20 high whose one wall is an arc of 10 degrees of radius 50."""
    half = np.radians(5.0)
    low = (50 * np.cos(half), -50 * np.sin(half))
    high = (50 * np.cos(half), 50 * np.sin(half))
    outline = [
        Arc((0.0, 0.0), 50.0, -half, half), Line(high, (30.0, high[1])),
        Line((30.0, high[1]), (30.0, low[1])), Line((30.0, low[1]), low)
    ]  # fmt: skip
    return extrude([outline], 20.0, 1.0)


def test_an_arc_of_ten_degrees(sliver):
    """Its form exists; as an internal datum there is no inscribed cylinder, and that is said."""
    arc = next(f.index for f in sliver.faces if f.kind == "cylinder")
    left = next(f.index for f in sliver.faces if f.kind == "plane" and f.normal[0] < -0.5)
    spec = Specification(
        cylindricity(arc, 0.1), position(left, 0.1, datums="A"), datums={"A": arc}, checked=False
    )
    found = verify(sliver.surface, spec, nominal=sliver)
    assert found["cylindricity-1"].value == pytest.approx(0.0, abs=1e-9)
    inside = [replace(face, internal=True) if face.index == arc else face for face in sliver.faces]
    features = tuple(
        replace(one, faces=tuple(inside[index] for index in one.face_indices)) for one in sliver.features
    )
    hollow = replace(sliver, faces=tuple(inside), features=features)
    refused = dict(verify(hollow.surface, spec, nominal=hollow).unresolved)
    assert "none exists" in refused["position-1"]


def test_a_mesh_with_labels_but_no_nominal_vertices(array_box):
    """Half of the triangles of the top are missing: it is evaluated on those that are there."""
    keep = (array_box.surface.face_ids != 5) | (np.arange(array_box.surface.n_triangles) % 2 == 0)
    made = DiscreteShape(
        array_box.surface.points, array_box.surface.triangles[keep], array_box.surface.face_ids[keep]
    )
    assert verify(made, Specification(flatness(5, 0.1)), nominal=array_box)["flatness-1"].value == 0.0
