"""A prepared verification: the values of single evaluations, bit by bit, and its work done once."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.errors import GeometryError, SpecificationError
from cadskin.shape.association import Pose, associate, frame_about
from cadskin.skin import SkinEnsemble
from cadskin.spec import (
    Datum,
    FeatureSelection,
    Specification,
    as_selection,
    coaxiality,
    flatness,
    parallelism,
    perpendicularity,
    position,
    surface_profile,
    symmetry,
)
from cadskin.verify import datums as datums_module
from cadskin.verify import flatness as flatness_of
from cadskin.verify import prepare, verify
from cadskin.verify.extraction import MadePart
from cadskin.verify.median import heights_at, opposite_triangles, section_centres
from cadskin.verify.sampling import sampling_shortfall
from cadskin.verify.tolerances import evaluate


def box_spec():
    return Specification(
        flatness(5, 0.1),
        parallelism(5, 0.1, datums="A"),
        perpendicularity(1, 0.1, datums="A|C"),
        surface_profile([1, 5], 0.2, datums="A|B|C"),
        position(5, 0.2, datums="A|B"),
        symmetry(FeatureSelection(faces=(0, 1), derived="median_plane"), 0.2, datums="D"),
        datums=[
            Datum("A", as_selection(4)),
            Datum("B", as_selection(2)),
            Datum("C", as_selection(0)),
            Datum("D", FeatureSelection(faces=(2, 3))),
        ],
        checked=False,
    )


def populations(part, plain_skin):
    rng = np.random.default_rng(3)
    base = plain_skin(part).surface.points
    return [base + 0.003 * rng.standard_normal(base.shape) for _ in range(3)]


def test_values_are_those_of_single_evaluations(array_box, plain_skin):
    spec = box_spec()
    prepared = prepare(array_box, spec)
    for points in populations(array_box, plain_skin):
        surface = array_box.surface.with_points(points)
        table = prepared.evaluate(points)
        assert not table.unresolved
        for tolerance in prepared.spec:
            alone = evaluate(tolerance, MadePart(surface, array_box), prepared.spec)
            assert alone.to_dict() == table[tolerance.id].to_dict()
            assert prepared.evaluate_tolerance(tolerance, surface).value == alone.value
        assert verify(surface, spec, nominal=array_box).to_dict() == table.to_dict()


def test_a_datum_is_associated_once_per_part(array_box, plain_skin, monkeypatch):
    calls = []
    real = datums_module.establish_one

    def counted(feature, **options):
        calls.append(feature.label)
        return real(feature, **options)

    monkeypatch.setattr(datums_module, "establish_one", counted)
    prepared = prepare(array_box, box_spec())
    first, second, _ = populations(array_box, plain_skin)
    prepared.evaluate(first)
    calls.clear()
    prepared.evaluate(second)
    assert sorted(calls) == ["A", "B", "C", "C", "D"]  # C is second once, and third once
    calls.clear()
    moved = np.array(second)
    moved[array_box.feature_of(5).vertex_ids[:3], 2] += 0.01  # no point of a datum but those of the rim
    prepared.evaluate(moved)
    assert "A" not in calls


def test_a_population_in_several_processes(array_box):
    """The same bits from one process and from two, and progress to the end."""
    fields = 0.01 * np.random.default_rng(4).standard_normal((5, array_box.n_samples))
    ensemble, seen = SkinEnsemble(array_box, fields), []
    alone = verify(ensemble, box_spec())
    shared = verify(ensemble, box_spec(), workers=2, progress=lambda done, total: seen.append((done, total)))
    np.testing.assert_array_equal(alone.values, shared.values)
    np.testing.assert_array_equal(alone.kept, shared.kept)
    assert alone.unresolved == shared.unresolved == ()
    assert seen[-1] == (5, 5)
    with pytest.raises(SpecificationError, match="workers"):
        verify(ensemble, box_spec(), workers=0)


def test_sampling_shortfall_is_that_of_the_points(array_box, plain_skin):
    prepared = prepare(array_box, box_spec())
    surface = array_box.surface.with_points(populations(array_box, plain_skin)[0])
    points = surface.points[np.unique(array_box.feature_of(5).vertex_ids)]
    expected = sampling_shortfall(points, lambda some: flatness_of(some).value)[1]
    assert prepared.sampling_shortfall("flatness-1", surface) == pytest.approx(expected, abs=1e-12)
    with pytest.raises(SpecificationError, match="derived features"):
        prepared.sampling_shortfall("symmetry-1", surface)
    table = verify(surface, box_spec(), nominal=array_box, sampling=True)
    assert table["flatness-1"].details["sampling_shortfall"] == pytest.approx(expected, abs=1e-12)
    assert table["parallelism-1"].details["sampling_shortfall"] > 0
    assert any("no estimate" in note for note in table["symmetry-1"].notes)


def test_vertices_of_another_mesh_are_refused(array_box):
    with pytest.raises(GeometryError, match="vertices for a nominal mesh of"):
        prepare(array_box, box_spec()).evaluate(np.zeros((5, 3)))


def test_a_perfect_shaft_is_coaxial_with_itself(array_shaft):
    prepared = prepare(
        array_shaft, Specification(coaxiality(0, 0.1, datums="A"), datums={"A": 0}, checked=False)
    )
    assert prepared.evaluate(array_shaft.surface.points)["coaxiality-1"].value == pytest.approx(0, abs=1e-9)


def test_section_centres_are_the_gaussian_circles():
    rng = np.random.default_rng(0)
    pose = Pose(np.array([5.0, -3.0, 2.0]), frame_about(rng.standard_normal(3)), np.zeros(2))
    rings = []
    for height in (0.0, 4.0, 9.0):
        turn = rng.uniform(0, 2.0, 40)
        radius = 7.0 + 0.1 * rng.standard_normal(40)
        flat = np.column_stack([radius * np.cos(turn), radius * np.sin(turn), np.full(40, height)])
        rings.append(pose.origin + flat @ pose.axes.T)
    for ring, centre in zip(rings, section_centres(rings, pose), strict=True):
        known = associate(ring, "circle", "least squares", section_normal=pose.axis).pose.origin
        offset = known - centre
        np.testing.assert_allclose(offset - (offset @ pose.axis) * pose.axis, 0, atol=1e-10)


def test_heights_between_points_are_linear():
    rng = np.random.default_rng(1)
    flat, own = rng.uniform(0, 1, (60, 2)), rng.uniform(0.2, 0.8, (30, 2))
    height = flat @ [0.3, -0.2] + 0.7
    found = heights_at(own, flat, height, opposite_triangles(own, flat))
    np.testing.assert_allclose(found, own @ [0.3, -0.2] + 0.7, atol=1e-12)
    beyond = np.array([[5.0, 5.0]])
    corners = opposite_triangles(beyond, flat)
    assert heights_at(beyond, flat, height, corners)[0] == height[np.argmin(((flat - 5.0) ** 2).sum(axis=1))]
