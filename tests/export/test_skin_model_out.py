"""The real skin model goes out through its own verbs, with provenance, watertight."""

import json

import numpy as np
import pytest
import trimesh

from cadskin.skin import SkinModel
from cadskin.skin.provenance import Provenance


@pytest.fixture
def skin(array_shaft, plain_skin):
    deviation = plain_skin(array_shaft).deviation
    return SkinModel(array_shaft, deviation, Provenance(model="waves"))


@pytest.mark.parametrize("suffix", ["stl", "ply", "obj", "glb"])
def test_a_saved_skin_model_is_watertight_and_has_its_volume(tmp_path, skin, suffix):
    mesh = trimesh.load(skin.save(tmp_path / f"a.{suffix}"), force="mesh")
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    scale = 1e-9 if suffix == "glb" else 1.0
    np.testing.assert_allclose(mesh.volume, skin.surface.volume * scale, rtol=1e-5)


def test_npz_tells_where_the_skin_model_comes_from(tmp_path, skin):
    with np.load(skin.save(tmp_path / "a.npz"), allow_pickle=False) as archive:
        provenance = json.loads(str(archive["provenance"]))
        np.testing.assert_array_equal(archive["deviation"], skin.deviation)
        np.testing.assert_array_equal(archive["points"], skin.points)
    assert Provenance(**provenance["skin"]).model == "waves"
    assert provenance["source"]["part"] == "shaft"
    assert provenance["generator"].startswith("cadskin ")


def test_pictures_and_conversions_of_a_skin_model(tmp_path, skin):
    assert skin.picture(tmp_path / "a.png", size=(300, 200)).read_bytes()[1:4] == b"PNG"
    assert skin.nominal.picture(tmp_path / "b.png", size=(300, 200)).read_bytes()[1:4] == b"PNG"
    np.testing.assert_array_equal(skin.to_trimesh().vertices, skin.points)
    np.testing.assert_array_equal(skin.to_meshio().points, skin.points)
