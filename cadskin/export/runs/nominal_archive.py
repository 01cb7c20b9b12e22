"""A nominal model as one .npz of plain arrays and a JSON text: read again without a geometry kernel."""

from __future__ import annotations

import json
import zipfile
from dataclasses import asdict, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import GeometryError, ReadError
from cadskin.export.atomic import atomic_file
from cadskin.shape import ideal as ideals
from cadskin.shape.discrete import DiscreteShape
from cadskin.shape.face import Face, Source
from cadskin.shape.nominal import NominalModel, build_features
from cadskin.shape.samples import Samples

if TYPE_CHECKING:
    from cadskin.shape.ideal import IdealSurface

__all__ = ["load_nominal", "save_nominal"]

_FORMAT = "cadskin nominal model 1"
_SURFACE = ("points", "triangles", "face_ids")
_SAMPLES = ("vertex_ids", "face_ids", "uv", "normals", "curvatures", "directions", "singular")


def save_nominal(path: str | Path, nominal: NominalModel) -> Path:
    """Write a nominal model to a .npz file.

    Raises
    ------
    ExportError
        The file cannot be written.
    """
    about = {
        "format": _FORMAT,
        "faces": [_face_record(face) for face in nominal.faces],
        "features": [list(feature.face_indices) for feature in nominal.features],
        "closed": nominal.closed,
        "source": asdict(nominal.source),
        "notes": list(nominal.notes),
        "failed_faces": list(nominal.failed_faces),
    }
    arrays = {f"surface_{key}": getattr(nominal.surface, key) for key in _SURFACE}
    arrays |= {f"sample_{key}": getattr(nominal.samples, key) for key in _SAMPLES}
    arrays["starts"] = np.array([0, *(feature.stop for feature in nominal.features)], dtype=np.int64)
    text: Any = np.array(json.dumps(about, sort_keys=True))
    with atomic_file(path) as stream:
        np.savez(stream, about=text, **arrays)
    return Path(path)


def load_nominal(path: str | Path) -> NominalModel:
    """Read a nominal model that `save_nominal` wrote.

    Raises
    ------
    ReadError
        Not such a file, or a damaged one.
    """
    try:
        with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as stored:
            about = json.loads(str(stored["about"]))
            arrays = {key: stored[key] for key in stored.files if key != "about"}
        if about.get("format") != _FORMAT:
            raise ReadError(f"{path} has format {about.get('format')!r}, this version reads {_FORMAT!r}")
        surface = DiscreteShape(*(arrays[f"surface_{key}"] for key in _SURFACE))
        samples = Samples(*(arrays[f"sample_{key}"] for key in _SAMPLES))
        faces = tuple(_face(index, record) for index, record in enumerate(about["faces"]))
        return NominalModel(
            surface,
            faces,
            build_features(surface, about["features"], faces, samples, arrays["starts"]),
            samples,
            closed=bool(about["closed"]),
            source=Source(**about["source"]),
            notes=tuple(about["notes"]),
            failed_faces=tuple(about["failed_faces"]),
        )
    except (OSError, KeyError, TypeError, ValueError, EOFError, zipfile.BadZipFile, GeometryError) as error:
        if isinstance(error, ReadError):
            raise
        raise ReadError(f"{path} is not a nominal model of cadskin, or it is damaged: {error}") from error


def _face_record(face: Face) -> dict[str, Any]:
    record = {item.name: _plain(getattr(face, item.name)) for item in fields(face) if item.name != "index"}
    ideal = face.ideal
    record["ideal"] = {
        "type": type(ideal).__name__,
        **{item.name: _plain(getattr(ideal, item.name)) for item in fields(ideal)},
    }
    return record


def _face(index: int, record: dict[str, Any]) -> Face:
    values = dict(record)
    shape = dict(values.pop("ideal"))
    known = (ideals.Plane, ideals.Cylinder, ideals.Cone, ideals.Sphere, ideals.Torus, ideals.Freeform)
    made = {kind.__name__: kind for kind in known}[shape.pop("type")]
    surface: IdealSurface = made(**{key: _array(value) for key, value in shape.items()})
    return Face(index=index, ideal=surface, **{key: _array(value) for key, value in values.items()})


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _array(value: Any) -> Any:
    return np.array(value, dtype=np.float64) if isinstance(value, list) else value
