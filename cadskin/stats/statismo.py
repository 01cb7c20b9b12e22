"""Export to Statismo 0.9 HDF5: a statistical shape model that Scalismo and its viewer open.

References
----------
Luethi et al.: Statismo - A framework for PCA based statistical models, Insight Journal (2012),
hdl:10380/3371; layout of ``/model`` and ``/representer`` as Statismo 0.9 writes it.
"""

from __future__ import annotations

import os
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any
from uuid import uuid4

import numpy as np

import cadskin
from cadskin.errors import ExportError, MissingDependencyError
from cadskin.skin.weld import prepare_weld

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.stats.model import StatisticalShapeModel

__all__ = ["save_statismo", "vertex_modes"]


def save_statismo(path: str | Path, model: StatisticalShapeModel) -> Path:
    """Write a model as Statismo HDF5 (.h5): displacements of the vertices of the nominal mesh.

    The deviations along the normals become displacements by the weld's linear part, and the modes are made
    orthonormal in the sum over the vertices, as Statismo has them.

    Parameters
    ----------
    path : path
    model : StatisticalShapeModel
        With its nominal model.

    Raises
    ------
    MissingDependencyError
        h5py is not installed.
    StatisticsError
        The model knows no nominal model.
    ExportError
        The file cannot be written.
    """
    try:
        import h5py
    except ImportError as error:
        raise MissingDependencyError(
            "writing Statismo files needs h5py: pip install 'cadskin[statismo]'"
        ) from error
    mean, basis, variances = vertex_modes(model)
    target = Path(path)
    part = target.with_name(f".{target.name}.{uuid4().hex[:8]}")
    try:
        with h5py.File(part, "w") as file:
            _write(file, model, mean, basis, variances)
        os.replace(part, target)
    except OSError as error:
        raise ExportError(f"{target} cannot be written: {error}") from error
    finally:
        part.unlink(missing_ok=True)
    return target


def vertex_modes(model: StatisticalShapeModel) -> tuple[Floats, Floats, Floats]:
    """Return mean points (n, 3) [mm], orthonormal displacement modes (3n, k), their variances (k,) [mm²]."""
    nominal = model.skin_model(model.mean).nominal
    operator = prepare_weld(nominal)

    def displaced(field: Floats) -> Floats:
        return operator.displacement(np.asarray(model.skin_model(field).deviation)).ravel()

    rest = displaced(np.zeros(len(model.mean)))
    columns = [displaced(sigma * mode) - rest for sigma, mode in zip(model.sigmas, model.modes, strict=True)]
    left, singular, _ = np.linalg.svd(np.array(columns).reshape(model.n_modes, -1).T, full_matrices=False)
    return nominal.surface.points + displaced(model.mean).reshape(-1, 3), left, singular**2


def _write(file: Any, model: StatisticalShapeModel, mean: Floats, basis: Floats, variances: Floats) -> None:
    surface = model.skin_model(model.mean).nominal.surface
    file.attrs["version"] = "0.9"
    version = file.create_group("version")
    version["majorVersion"], version["minorVersion"] = np.int32(0), np.int32(9)
    group = file.create_group("model")
    group["mean"] = mean.ravel().astype(np.float32)
    group["pcaBasis"] = basis.astype(np.float32)
    group["pcaVariance"] = variances.astype(np.float32)
    group["noiseVariance"] = np.float32(model.noise**2)
    representer = file.create_group("representer")
    representer.attrs["name"] = "itkStandardMeshRepresenter"
    representer.attrs["version"] = "0.1"
    representer.attrs["datasetType"] = "POLYGON_MESH"
    representer["points"] = surface.points.T.astype(np.float32)
    representer["cells"] = surface.triangles.T.astype(np.int32)
    about = file.create_group("modelinfo")
    about["build-time"] = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    about["scores"] = (model.scores * model.sigmas).T.astype(np.float32)
    builder = about.create_group("modelBuilder-0")
    builder["builderName"] = f"cadskin {cadskin.__version__}"
    builder.create_group("parameters")["notes"] = "; ".join((model.center, *model.notes))
    builder.create_group("dataInfo")["numberOfParts"] = str(model.n_parts)
