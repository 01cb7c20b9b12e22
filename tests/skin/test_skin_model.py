"""The skin model and the ensemble as values."""

from __future__ import annotations

import dataclasses
import json
import pickle

import numpy as np
import pytest
from support.parts import box, plate_with_hole

from cadskin import __version__
from cadskin.errors import GeometryError
from cadskin.skin import Provenance, SkinEnsemble, SkinModel, simulate


@pytest.fixture(scope="module")
def part():
    return plate_with_hole()


@pytest.fixture(scope="module")
def skin(part):
    return SkinModel(part, 0.01 * np.random.default_rng(1).standard_normal(part.n_samples))


def test_is_frozen(skin):
    with pytest.raises(dataclasses.FrozenInstanceError):
        skin.deviation = None
    for array in (skin.deviation, skin.points, skin.surface.points, skin.vertex_deviation, skin.displacement):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1


def test_a_wrong_field_is_refused(part):
    with pytest.raises(GeometryError, match="deviation has shape"):
        SkinModel(part, np.zeros(5))


def test_surface_keeps_triangles_and_labels(part, skin):
    assert skin.surface.triangles is part.surface.triangles
    assert skin.surface.face_ids is part.surface.face_ids
    assert skin.closed


def test_feature_gives_its_rows_and_points(part, skin):
    hole = skin.feature(kind="cylinder")
    assert hole.feature is part.feature(name="hole")
    np.testing.assert_array_equal(hole.deviation, skin.deviation[hole.feature.rows])
    # Seen along the nominal normals, the points of the hole deviate by just that much.
    along = np.einsum("ij,ij->i", hole.points - hole.feature.points, hole.feature.normals)
    np.testing.assert_allclose(along, hole.deviation, atol=1e-12)
    np.testing.assert_allclose(skin.realised_deviation, skin.deviation, atol=1e-12)


def test_vertex_deviation_is_the_largest_in_magnitude(part):
    values = np.linspace(-1, 1, part.n_samples)
    per_vertex = SkinModel(part, 1e-3 * values).vertex_deviation
    for vertex in (0, 5, 100, part.surface.n_points - 1):
        rows = 1e-3 * values[part.samples.vertex_ids == vertex]
        assert per_vertex[vertex] == rows[np.argmax(np.abs(rows))]


def test_pickle_keeps_values_frozen(skin):
    again = pickle.loads(pickle.dumps(skin))
    np.testing.assert_array_equal(again.points, skin.points)
    assert again.provenance == skin.provenance
    assert not again.deviation.flags.writeable


def test_html_table(skin):
    html = skin._repr_html_()
    assert f"<td>{skin.nominal.surface.n_points}</td>" in html
    assert f"{skin.deviation.max():+.4g} mm" in html
    assert f"<td>{skin.report.max_residual:.2g} mm</td>" in html


def test_ensemble_is_a_sequence_of_skin_models(part):
    fields = 0.01 * np.random.default_rng(2).standard_normal((5, part.n_samples))
    ensemble = SkinEnsemble(part, fields, Provenance(model="mine", seed=(3,)))
    assert len(ensemble) == 5
    assert [skin.provenance.index for skin in ensemble] == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal(ensemble[-1].deviation, fields[4])
    assert ensemble[-1].provenance == Provenance(model="mine", seed=(3,), index=4)
    np.testing.assert_array_equal(ensemble[1:3][1].deviation, fields[2])
    with pytest.raises(IndexError):
        ensemble[5]
    assert not ensemble.deviations.flags.writeable
    again = pickle.loads(pickle.dumps(ensemble))
    np.testing.assert_array_equal(again.deviations, ensemble.deviations)
    assert "<td>5</td>" in ensemble._repr_html_()


def test_provenance_is_plain_data():
    part = box()
    data = simulate(part, np.zeros(part.n_samples)).provenance.to_dict()
    assert data["version"] == __version__
    assert data["model"] == "array"
    assert data["seed"] is None
    assert len(data["nominal_sha256"]) == 64
    again = Provenance(**json.loads(json.dumps(data, default=list)))
    assert again.nominal_sha256 == data["nominal_sha256"]


def test_the_hash_of_the_nominal_model_tells_parts_apart():
    one, two, other = (SkinModel(p, np.zeros(p.n_samples)) for p in (box(), box(), box((6.0, 4.0, 3.1))))
    from cadskin.skin.provenance import nominal_sha256

    assert nominal_sha256(one.nominal) == nominal_sha256(two.nominal)
    assert nominal_sha256(one.nominal) != nominal_sha256(other.nominal)


def test_independent_readers_call_it_watertight(part):
    trimesh = pytest.importorskip("trimesh")
    field = 0.2 * np.random.default_rng(4).uniform(-1, 1, part.n_samples)
    skin = SkinModel(part, field)
    mesh = trimesh.Trimesh(skin.points, skin.surface.triangles, process=False)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(skin.surface.volume, rel=1e-9)


def test_save_and_conversions_delegate(skin, tmp_path):
    trimesh = pytest.importorskip("trimesh")
    written = skin.save(tmp_path / "plate.ply")
    again = trimesh.load(written, process=False)
    np.testing.assert_allclose(again.vertices, skin.points, atol=1e-5)
    assert skin.to_trimesh().is_watertight
    assert len(skin.to_meshio().points) == skin.surface.n_points
