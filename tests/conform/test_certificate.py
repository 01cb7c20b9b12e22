"""Certificates: a stranger confirms them from the mesh and the specification, and finds what was changed."""

import json

import numpy as np
import pytest
from support.parts import box

from cadskin.conform import simulate_conforming
from cadskin.conform.certificate import certificate_of, read_certificate, recheck
from cadskin.deviation import GaussianField
from cadskin.errors import ReadError
from cadskin.spec import Specification, flatness, parallelism, read_spec
from cadskin.verify.meshes import read_labelled_mesh

BOTTOM, TOP = 0, 1


@pytest.fixture(scope="module")
def part():
    return box((60.0, 40.0, 20.0), h=12.0)


@pytest.fixture(scope="module")
def spec():
    return Specification(flatness(BOTTOM, 0.02), parallelism(TOP, 0.03, datums="A"), datums={"A": BOTTOM})


@pytest.fixture(scope="module")
def skin(part, spec):
    return simulate_conforming(part, GaussianField(0.01, 50.0), spec, size=1, rng=1)[0]


def test_a_stranger_confirms_it_from_files(tmp_path, part, spec, skin):
    (tmp_path / "part.json").write_text(json.dumps(certificate_of(skin, spec)))
    skin.save(tmp_path / "part.npz")
    spec.save(tmp_path / "part.toml")
    stated = read_certificate(tmp_path / "part.json")
    assert stated["conforming"] is True
    assert stated["seed"] == [1]
    assert stated["index"] == 0
    assert [item["ok"] for item in stated["tolerances"]] == [True, True]
    assert all(len(item["active"]) >= 2 for item in stated["tolerances"])
    mesh = read_labelled_mesh(tmp_path / "part.npz")
    found = recheck(stated, mesh, read_spec(tmp_path / "part.toml"), part)
    assert found.differences == ()
    assert found.confirmed


def test_what_was_changed_is_named(part, spec, skin):
    stated = certificate_of(skin, spec)
    moved = skin.points.copy()
    moved[part.feature_of(TOP).vertex_ids[0], 2] += 0.05
    other = skin.surface.with_points(moved)
    notes = recheck(stated, other, spec, part).differences
    assert any("mesh_sha256" in note for note in notes)
    assert any(note.startswith("parallelism-1 is") for note in notes)
    assert any("conforming is False" in note for note in notes)
    wider = Specification(flatness(BOTTOM, 0.2), datums={"A": BOTTOM})
    notes = recheck(stated, skin.surface, wider, part).differences
    assert any("spec_sha256" in note for note in notes)
    assert "parallelism-1 is not evaluated" in notes
    forged = stated | {"tolerances": [item | {"value": 0.5 * item["value"]} for item in stated["tolerances"]]}
    assert len(recheck(forged, skin.surface, spec, part).differences) == 2


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"format": "cadskin certificate 9"}'])
def test_strange_certificates(tmp_path, text):
    (tmp_path / "c.json").write_text(text)
    with pytest.raises(ReadError, match="certificate"):
        read_certificate(tmp_path / "c.json")
    with pytest.raises(ReadError, match="cannot be read"):
        read_certificate(tmp_path / "nothing.json")


def test_numbers_survive_json(skin, spec):
    stated = certificate_of(skin, spec)
    assert json.loads(json.dumps(stated))["tolerances"] == stated["tolerances"]
    assert np.isfinite([item["value"] for item in stated["tolerances"]]).all()
