"""Save and load a statistical shape model: one .npz file of plain arrays and a JSON text."""

from __future__ import annotations

import json
import os
import zipfile
from pathlib import Path
from typing import TYPE_CHECKING
from uuid import uuid4

import numpy as np

import cadskin
from cadskin.errors import ExportError, ReadError, StatisticsError
from cadskin.skin.provenance import nominal_sha256
from cadskin.stats.model import StatisticalShapeModel

if TYPE_CHECKING:
    from cadskin.shape import NominalModel

__all__ = ["load_shape_model", "save_shape_model"]

_FORMAT = "cadskin statistical shape model 1"
_ARRAYS = ("mean", "modes", "variances", "weights", "part_weights", "scores", "gram", "rows")


def save_shape_model(path: str | Path, model: StatisticalShapeModel) -> Path:
    """Write a model to a .npz file; an older file is replaced only when the new one is complete.

    The nominal model is not inside, only its hash: give it again to `load_shape_model`.

    Raises
    ------
    ExportError
        The file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() != ".npz":
        raise ExportError(f"{target}: a statistical shape model is saved as .npz")
    about = {
        "format": _FORMAT,
        "version": cadskin.__version__,
        "units": "mm",
        "total_variance": model.total_variance,
        "ddof": model.ddof,
        "residual": model.residual,
        "center": model.center,
        "notes": list(model.notes),
        "nominal_sha256": nominal_sha256(model.nominal) if model.nominal is not None else "",
    }
    arrays = {key: getattr(model, key) for key in _ARRAYS if getattr(model, key) is not None}
    part = target.with_name(f".{target.name}.{uuid4().hex[:8]}")
    try:
        with part.open("wb") as stream:
            np.savez(stream, about=np.array(json.dumps(about)), **arrays)
        os.replace(part, target)
    except OSError as error:
        raise ExportError(f"{target} cannot be written: {error}") from error
    finally:
        part.unlink(missing_ok=True)
    return target


def load_shape_model(path: str | Path, *, nominal: NominalModel | None = None) -> StatisticalShapeModel:
    """Read a model that `StatisticalShapeModel.save` wrote.

    Parameters
    ----------
    path : path
    nominal : NominalModel, optional
        The nominal model of the training parts, for `StatisticalShapeModel.skin_model`.

    Raises
    ------
    ReadError
        Not such a file.
    StatisticsError
        Another nominal model than the one the model was fitted on.
    """
    try:
        with np.load(path, allow_pickle=False) as stored:
            about = json.loads(str(stored["about"]))
            arrays = {key: stored[key] for key in _ARRAYS if key in stored}
    except (OSError, KeyError, ValueError, zipfile.BadZipFile) as error:
        raise ReadError(f"{path} is not a statistical shape model of cadskin: {error}") from error
    if about.get("format") != _FORMAT:
        raise ReadError(f"{path} has format {about.get('format')!r}, this version reads {_FORMAT!r}")
    if nominal is not None and nominal_sha256(nominal) != about["nominal_sha256"]:
        raise StatisticsError(
            f"{path} was fitted on another nominal model; mesh the same part with the same edge length"
        )
    return StatisticalShapeModel(
        **arrays,
        total_variance=about["total_variance"],
        ddof=about["ddof"],
        residual=about["residual"],
        center=about["center"],
        nominal=nominal,
        notes=tuple(about["notes"]),
    )
