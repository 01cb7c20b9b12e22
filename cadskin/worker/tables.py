"""Specifications as plain tables with FreeCAD's face numbers (``Face1`` is 1), there and back.

A tolerance is a table ``{id, characteristic, value, faces, datums, diameter, modifiers, model, deviation,
name, extra}``; ``deviation`` is a shorter way to say ``model`` (see `cadskin.worker.models`),
``extra`` holds all further keys of a spec file as they are (docs/specification.md).
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cadskin.errors import ReadError, SpecificationError
from cadskin.spec import CHARACTERISTICS, parse_spec
from cadskin.spec.toml_write import inline, to_toml
from cadskin.worker.models import model_table
from cadskin.worker.request import RequestError

if TYPE_CHECKING:
    from cadskin.spec import Datum, Dimension, Specification

__all__ = ["specification_from_tables", "tables_of_specification"]

# Keys that only make sense for the export they were read from: faces are given by number here.
_OF_THE_FILE = ("on", "faces", "step_faces", "groups", "part")
_PLAIN = ("id", "name", "datums", "diameter", "modifiers", "model")
_PLACE = re.compile(r"tolerances(:\d+)?: ")


def specification_from_tables(
    tolerances: list[dict[str, Any]],
    datums: list[dict[str, Any]] | None = None,
    general: Mapping[str, Any] | None = None,
    dimensions: list[dict[str, Any]] | None = None,
) -> Specification:
    """Return the specification of a request.

    Parameters
    ----------
    tolerances, datums : list of dict
    general : mapping, optional
        ``{value, characteristic}`` of all faces without a tolerance of their own.
    dimensions : list of dict, optional

    Raises
    ------
    SpecificationError, RequestError
        A tolerance without faces or without meaning; the message names it.

    Examples
    --------
    >>> rows = [{"id": "Tolerance", "characteristic": "flatness", "value": 0.02, "faces": [6]}]
    >>> spec = specification_from_tables(rows)
    >>> spec["Tolerance"].feature.selectors
    (5,)
    """
    lines = []
    if general is not None:
        kind = str(general.get("characteristic") or "surface_profile")
        value = {kind: _value(general, "the general tolerance"), **general.get("extra", {})}
        lines.append(f"default = {inline(value)}")
    lines.append("tolerances = [")
    lines += [f"  {inline(_tolerance(row))}," for row in tolerances]
    lines.append("]\ndimensions = [")
    lines += [f"  {inline(_dimension(row))}," for row in dimensions or []]
    lines += ["]", "[datums]"]
    lines += [f"{inline({str(row.get('letter')): _datum(row)})[1:-1]}" for row in datums or []]
    try:
        return parse_spec("\n".join(lines), name="tolerances")
    except (SpecificationError, ReadError) as error:
        raise SpecificationError(_PLACE.sub("", str(error), count=1)) from error


def _tolerance(row: Mapping[str, Any]) -> dict[str, Any]:
    label = f"tolerance {row.get('name') or row.get('id') or '?'}"
    kind = row.get("characteristic")
    if not isinstance(kind, str):
        raise RequestError(f"{label} has no characteristic")
    rest = {key: row[key] for key in _PLAIN if row.get(key)}
    if row.get("deviation"):
        rest["model"] = model_table(row["deviation"], label)
    extra = dict(row.get("extra") or {})
    return {kind: _value(row, label), "on": _selectors(row, label), **extra, **rest}


def _datum(row: Mapping[str, Any]) -> dict[str, Any]:
    faces = _selectors(row, f"datum {row.get('letter')}")
    extra = dict(row.get("extra") or {})
    if "targets" in extra:  # they say where the faces are touched; the datum is nothing but them
        places = [[faces[k] for k in target.get("faces", [])] for target in extra["targets"]]
        extra["targets"] = [
            {**target, "faces": place} for target, place in zip(extra["targets"], places, strict=True)
        ]
        return extra
    return {"on": faces, **extra}


def _dimension(row: Mapping[str, Any]) -> dict[str, Any]:
    faces, values = _selectors(row, f"dimension {row.get('id')}"), dict(row.get("extra") or {})
    for key in ("on", "to"):
        if key in values:
            values[key] = [faces[k] for k in values[key]]
    return {**values, "id": row.get("id")}


def _selectors(row: Mapping[str, Any], label: str) -> list[int]:
    faces = row.get("faces")
    if not isinstance(faces, list) or not faces:
        raise RequestError(f"{label} is on no face; pick its faces")
    if not all(isinstance(face, int) and not isinstance(face, bool) and face >= 1 for face in faces):
        raise RequestError(f"{label}: faces must be numbers from 1 on, got {faces!r}")
    return [face - 1 for face in faces]


def _value(row: Mapping[str, Any], label: str) -> float:
    value = row.get("value")
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise RequestError(f"{label} has no value")
    return float(value)


def tables_of_specification(spec: Specification) -> dict[str, Any]:
    """Return a specification as ``tolerances``, ``datums``, ``general``, ``dimensions`` and ``unresolved``.

    Parameters
    ----------
    spec : Specification
        On the faces of one part.

    Examples
    --------
    >>> from cadskin.spec import FeatureSelection, Specification, flatness
    >>> spec = Specification(flatness(FeatureSelection(faces=(5,)), 0.02))
    >>> tables_of_specification(spec)["tolerances"][0]["faces"]
    [6]
    """
    values = tomllib.loads(to_toml(spec.with_fingerprints(())))
    rows = values.get("tolerances", [])
    tables = [
        _table(row, item.id, item.feature.faces) for row, item in zip(rows, spec.tolerances, strict=True)
    ]
    letters = values.get("datums", {})
    datums = [_datum_table(datum, letters[datum.letter]) for datum in spec.datums]
    default = values.get("default")
    return {
        "tolerances": tables,
        "datums": datums,
        "general": None if default is None else _table(default, "general", ()),
        "dimensions": [
            _dimension_table(item, row)
            for item, row in zip(spec.dimensions, values.get("dimensions", []), strict=True)
        ],
        "unresolved": values.get("unresolved", []),
        "notes": [*spec.notes, *(f"{item.id}: {note}" for item in spec for note in item.notes)],
    }


def _table(row: Mapping[str, Any], name: str, faces: tuple[int, ...]) -> dict[str, Any]:
    kind = next(key for key in row if key in CHARACTERISTICS)
    value = row[kind]
    extra = {key: row[key] for key in row if key not in (*_OF_THE_FILE, *_PLAIN, kind)}
    return {
        "id": name,
        "characteristic": kind,
        "value": None if isinstance(value, str) else value,
        "faces": [face + 1 for face in faces],
        **{key: row[key] for key in _PLAIN if key in row and key != "id"},
        "extra": extra,
    }


def _dimension_table(dimension: Dimension, row: Mapping[str, Any]) -> dict[str, Any]:
    """Return the table of a dimension; ``on`` and ``to`` are positions in the list of its faces."""
    first, second = dimension.feature.faces, dimension.second.faces
    faces = list(dict.fromkeys((*first, *second)))
    extra = {key: row[key] for key in row if key not in (*_OF_THE_FILE, "to", "id", "raw_unit")}
    extra["on"] = [faces.index(face) for face in first]
    if second:
        extra["to"] = [faces.index(face) for face in second]
    return {"id": dimension.id, "faces": [face + 1 for face in faces], "extra": extra}


def _datum_table(datum: Datum, row: Any) -> dict[str, Any]:
    """Return the table of a datum; the faces of its targets are positions in the list of its faces."""
    extra = {key: row[key] for key in row if key not in _OF_THE_FILE} if isinstance(row, dict) else {}
    faces = list(datum.feature.faces)
    faces += [face for target in datum.targets for face in target.feature.faces]
    faces = list(dict.fromkeys(faces))
    if "targets" in extra:
        extra["targets"] = [
            {
                **{key: value for key, value in values.items() if key not in _OF_THE_FILE},
                "faces": [faces.index(face) for face in target.feature.faces],
            }
            for values, target in zip(extra["targets"], datum.targets, strict=True)
        ]
    return {"letter": datum.letter, "faces": [face + 1 for face in faces], "extra": extra}
