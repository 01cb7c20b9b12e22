"""Import a STEP file with its tolerances: FreeCAD's own import drops semantic PMI."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import Part

from . import jobs
from .datum import DatumProxy
from .dimension import make_dimension
from .engine import Job
from .faces import InputError, link_faces, warn
from .general_tolerance import make_general
from .objects import attach_view, new_object, transaction
from .tolerance import ToleranceProxy

__all__ = ["finish_import", "import_file", "start_import"]


def import_file(document: Any, path: str | Path) -> list[Any]:
    """Import the parts of a STEP file with their tolerances and datums, and wait for it.

    Parameters
    ----------
    document : App.Document
    path : str or Path

    Returns
    -------
    list of App.DocumentObject
        The parts.

    Raises
    ------
    InputError
        There is no such file.
    JobError
        The worker cannot read it.
    """
    return jobs.run(_request(path), keep=lambda job, values: finish_import(document, job, values))


def start_import(document: Any, path: str | Path, on_done: Any, on_error: Any) -> Job:
    """Begin an import; ``on_done`` is called with the parts, ``on_error`` with (kind, text)."""
    from . import engine

    def done(job: Job, values: dict[str, Any]) -> None:
        try:
            parts = finish_import(document, job, values)
        except (InputError, OSError, RuntimeError) as error:
            on_error(type(error).__name__, str(error))
        else:
            on_done(parts)

    return engine.submit(_request(path), None, done, lambda _job, kind, text: on_error(kind, text))


def _request(path: str | Path) -> dict[str, Any]:
    file = Path(path)
    if not file.is_file():
        raise InputError(f"{file}: there is no such file")
    return {"task": "import_step", "path": str(file.absolute())}


def finish_import(document: Any, job: Job, values: dict[str, Any]) -> list[Any]:
    """Make the objects of an import in a transaction of their own, and return the parts."""
    with transaction(document, "Import STEP with tolerances"):
        return [_part(document, job.path(record["brep"]), record) for record in values["parts"]]


def _part(document: Any, brep: Path, record: dict[str, Any]) -> Any:
    shape = Part.Shape()
    shape.importBrepFromString(brep.read_text(encoding="ascii"))
    part = document.addObject("Part::Feature", "Part")
    part.Label, part.Shape = record["name"], shape
    for row in record.get("datums", []):
        _datum(document, part, row)
    for row in record.get("tolerances", []):
        _tolerance(document, part, row)
    for row in record.get("dimensions", []):
        if row["faces"]:
            make_dimension(document, part, row)
    general = _general(record)
    if general is not None:
        made = make_general(document, part, general["value"], general["characteristic"])
        made.Extra = json.dumps(general.get("extra", {}), ensure_ascii=False)
    _keep_notes(part, record)
    return part


def _general(record: dict[str, Any]) -> dict[str, Any] | None:
    """Return the general tolerance of a part: the default, or the first tolerance of all its faces."""
    rows = [record.get("general"), *(row for row in record.get("tolerances", []) if _is_general(row))]
    return next((row for row in rows if row is not None and row.get("value")), None)


def _is_general(row: dict[str, Any]) -> bool:
    return not row["faces"] and row.get("extra", {}).get("scope") in ("general", "all_over")


def _keep_notes(part: Any, record: dict[str, Any]) -> None:
    """Keep with the part what the file holds and the document does not, and say it."""
    datums, tolerances = record.get("datums", []), record.get("tolerances", [])
    notes = [f"{item['entity']} ({item['kind']}): {item['reason']}" for item in record.get("unresolved", [])]
    notes += [f"datum {row['letter']} is on no face and was left out" for row in datums if not row["faces"]]
    notes += [
        f"tolerance {row['id']} is on no face and was left out"
        for row in tolerances
        if not row["faces"] and row is not _general(record)
    ]
    loose = [row["id"] for row in record.get("dimensions", []) if not row["faces"]]
    if loose:
        notes.append(f"dimensions {', '.join(loose)} are on no face and were left out")
    notes += record.get("notes", [])
    if notes:
        part.addProperty("App::PropertyStringList", "ImportNotes", "CadSkin", "What to know of the import")
        part.ImportNotes = notes
    for note in notes:
        warn(f"{part.Label}: {note}")


def _datum(document: Any, part: Any, row: dict[str, Any]) -> None:
    if not row["faces"]:
        return
    with new_object(document, DatumProxy, "Datum") as obj:
        link_faces(obj, part, [f"Face{number}" for number in row["faces"]])
    obj.Letter, obj.Label = row["letter"], f"Datum {row['letter']}"
    obj.Extra = json.dumps(row.get("extra", {}), ensure_ascii=False)
    attach_view(obj, "view_datum")


def _tolerance(document: Any, part: Any, row: dict[str, Any]) -> None:
    if not row["faces"]:
        return
    with new_object(document, ToleranceProxy, "Tolerance") as obj:
        link_faces(obj, part, [f"Face{number}" for number in row["faces"]])
    obj.Characteristic, obj.Value = row["characteristic"], row["value"] or 0.0
    obj.Diameter, obj.Datums = bool(row.get("diameter")), row.get("datums") or ""
    obj.Modifiers = list(row.get("modifiers") or [])
    obj.Label = row.get("name") or f"{row['characteristic'].replace('_', ' ')} {row['id']}"
    extra = dict(row.get("extra", {}))
    if row.get("model"):
        extra["model"] = row["model"]
    obj.Extra = json.dumps(extra, ensure_ascii=False)
    attach_view(obj, "view_tolerance")
