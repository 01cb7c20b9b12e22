"""Statismo export: orthonormal vertex modes that say the same as the model, in the layout of version 0.9."""

from __future__ import annotations

import numpy as np
import pytest

import cadskin as cs
from cadskin.errors import StatisticsError
from cadskin.skin import simulate_ensemble
from cadskin.stats import StatisticalShapeModel, save_statismo
from cadskin.stats.statismo import vertex_modes


@pytest.fixture(scope="module")
def model():
    from support.parts import box

    part = box((60.0, 40.0, 10.0), 5.0)
    ensemble = simulate_ensemble(part, cs.GaussianField(0.02, 30.0), size=6, rng=1, check=False)
    return StatisticalShapeModel.fit(ensemble, features=">Z", modes=3)


def test_vertex_modes_span_the_same_shapes(model):
    mean, basis, variances = vertex_modes(model)
    np.testing.assert_allclose(basis.T @ basis, np.eye(3), atol=1e-12)
    for c in np.eye(3):
        shape = model.skin_model(model.instance(c)).points - mean
        residual = shape.ravel() - basis @ (basis.T @ shape.ravel())
        assert np.abs(residual).max() < 1e-9
    total = sum(((model.skin_model(model.instance(c)).points - mean) ** 2).sum() for c in np.eye(3))
    assert variances.sum() == pytest.approx(total, rel=1e-9)


def test_file_has_the_layout_of_statismo(model, tmp_path):
    h5py = pytest.importorskip("h5py")
    path = save_statismo(tmp_path / "model.h5", model)
    assert [p.name for p in tmp_path.iterdir()] == ["model.h5"]
    with h5py.File(path) as file:
        n = model.nominal.surface.n_points
        assert file["model/mean"].shape == (3 * n,)
        assert file["model/pcaBasis"].shape == (3 * n, 3)
        assert file["model/pcaVariance"].shape == (3,)
        assert file["model/noiseVariance"][()] == pytest.approx(model.noise**2, rel=1e-6)
        assert file["representer/points"].shape == (3, n)
        assert file["representer/cells"].shape == (3, model.nominal.surface.n_triangles)
        assert file["representer"].attrs["datasetType"] == "POLYGON_MESH"
        assert (file["version/majorVersion"][()], file["version/minorVersion"][()]) == (0, 9)


def test_a_model_without_its_part_cannot_be_exported(tmp_path):
    pytest.importorskip("h5py")
    with pytest.raises(StatisticsError, match="nominal"):
        save_statismo(tmp_path / "a.h5", StatisticalShapeModel.fit(np.eye(4)))
