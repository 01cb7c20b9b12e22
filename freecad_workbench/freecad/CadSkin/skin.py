"""The skin model: a mesh object with the result of a simulation, and what it was made of."""

from __future__ import annotations

import json
import tempfile
from pathlib import Path
from typing import Any

import Mesh

from . import datum, dimension, general_tolerance, tolerance
from .faces import face_numbers, faces_now, part_of, part_problem, size_of
from .objects import HIDDEN, READ_ONLY, Field, Proxy, attach_view, is_a, set_status
from .ply import write_ply
from .result import ResultError, SkinResult, read_result
from .signature import FaceSignature, pack, same_face, unpack

__all__ = [
    "CONFORM",
    "TYPE",
    "SkinProxy",
    "clear_result",
    "is_up_to_date",
    "make_skin",
    "problems",
    "report",
    "request_of",
    "result",
    "show_instance",
    "store_result",
    "update_report",
]

TYPE = "CadSkinSkin"
CONFORM = ["conditioned", "scale", "reject", "none"]
_KEPT = 3  # results in memory

_results: dict[str, SkinResult] = {}


class SkinProxy(Proxy):
    """`Mesh::FeaturePython` of a skin model."""

    Type = TYPE
    GROUP = "Skin model"
    FIELDS = (
        Field("App::PropertyLinkGlobal", "Part", "The nominal part"),
        Field(
            "App::PropertyLinkListGlobal",
            "Tolerances",
            "Tolerances, datums and the general tolerance of the part",
        ),
        Field("App::PropertyLength", "EdgeLength", "Size of the triangles; 0: a hundredth of the diagonal"),
        Field("App::PropertyInteger", "Seed", "Another number gives another part"),
        Field("App::PropertyEnumeration", "Conform", "How the tolerances are met", CONFORM),
        Field("App::PropertyLength", "CorrelationLength", "Of the deviations; 0: a fifth of the part"),
        Field("App::PropertyInteger", "Instances", "How many parts are drawn", 1),
        Field("App::PropertyInteger", "Instance", "Which one is shown, from 0 on"),
        Field(
            "App::PropertyString",
            "Status",
            "Whether the result belongs to the part as it is",
            None,
            READ_ONLY,
        ),
        Field("App::PropertyColorList", "VertexColors", "Colours of the deviation map", None, HIDDEN),
        Field("App::PropertyFileIncluded", "ResultFile", "The arrays of the result", None, HIDDEN),
        Field("App::PropertyString", "Report", "The report of the result (JSON)", "{}", HIDDEN),
        Field("App::PropertyString", "Inputs", "What the result was made of (JSON)", "", HIDDEN),
        Field("App::PropertyStringList", "PartSignature", "The faces of the part then", None, HIDDEN),
        Field("App::PropertyInteger", "ShownInstance", "The one that the mesh shows", -1, HIDDEN),
    )

    def onDocumentRestored(self, obj: Any) -> None:
        """Bring an object of an older version up to date; a job of the time of saving is over."""
        super().onDocumentRestored(obj)
        if obj.Status.startswith("Computing"):
            set_status(obj, "Not computed" if not has_result(obj) else "The computation was not finished")

    def execute(self, obj: Any) -> None:
        """Follow the placement of the part and set the status; nothing is computed here."""
        if obj.Placement != _placement(obj):
            obj.Placement = _placement(obj)
        if has_result(obj) and obj.Instance != obj.ShownInstance:
            show_instance(obj, obj.Instance)
        set_status(obj, _status(obj))


def make_skin(document: Any, part: Any, members: list[Any]) -> Any:
    """Make an empty skin model of a part.

    Parameters
    ----------
    document : App.Document
    part : App.DocumentObject
    members : list of App.DocumentObject
        Tolerances, datums, general tolerance.
    """
    from . import preferences

    obj = document.addObject("Mesh::FeaturePython", "Skin")
    SkinProxy(obj)
    obj.Part, obj.Tolerances = part, members
    obj.EdgeLength, obj.Seed = preferences.get("EdgeLength"), preferences.get("Seed")
    obj.Instances = max(1, preferences.get("Instances"))
    obj.Label = f"Skin model of {part.Label}"
    attach_view(obj, "view_skin")
    set_status(obj, _status(obj))
    obj.touch()
    return obj


# -- inputs --------------------


def members(obj: Any, kind: str) -> list[Any]:
    """Return the members of a skin model of one kind."""
    return [item for item in obj.Tolerances if is_a(item, kind)]


def problems(obj: Any) -> list[str]:
    """Return what stands against a computation: nothing is computed on a wrong face."""
    told = part_problem(obj.Part)
    if told:
        return [told]
    found = []
    for module in (tolerance, datum, dimension, general_tolerance):
        for item in members(obj, module.TYPE):
            told = module.problem(item)
            if told is None and part_of(item) != obj.Part:
                told = f"it is on another part, {part_of(item).Label}"
            if told:
                found.append(f"{item.Label}: {told}")
    if obj.EdgeLength.Value < 0 or obj.CorrelationLength.Value < 0:
        found.append("edge length and correlation length must not be negative")
    if obj.Instances < 1:
        found.append(f"the number of instances must be 1 or more, it is {obj.Instances}")
    if obj.Seed < 0:
        found.append(f"the seed must not be negative, it is {obj.Seed}")
    return found


def request_of(obj: Any) -> dict[str, Any]:
    """Return the request of a simulation, without the task."""
    on = [item for module in (tolerance, datum, dimension) for item in members(obj, module.TYPE)]
    general = members(obj, general_tolerance.TYPE)
    values: dict[str, Any] = {
        "part": obj.Part.Label,
        "seed": int(obj.Seed),
        "size": int(obj.Instances),
        "conform": str(obj.Conform),
        "tolerances": [tolerance.tolerance_table(item) for item in members(obj, tolerance.TYPE)],
        "datums": [datum.datum_table(item) for item in members(obj, datum.TYPE)],
        "dimensions": [dimension.dimension_table(item) for item in members(obj, dimension.TYPE)],
        **_faces_for_worker(obj.Part, sorted({number for item in on for number in face_numbers(item)})),
    }
    if general:
        values["general"] = general_tolerance.general_table(general[0])
    for name, length in (("edge_length", obj.EdgeLength), ("correlation_length", obj.CorrelationLength)):
        if length.Value > 0:
            values[name] = float(length.Value)
    return values


def _faces_for_worker(part: Any, numbers: list[int]) -> dict[str, Any]:
    """Return what the worker compares its faces with."""
    now = faces_now(part)
    known = {str(k): {"area": now[k - 1].area, "centre": list(now[k - 1].centre)} for k in numbers}
    return {"faces": known, "n_faces": len(now)}


def _comparable(request: dict[str, Any]) -> dict[str, Any]:
    """Return what of a request makes another result: not the faces' numbers in digits, not labels."""
    left = {key: value for key, value in request.items() if key not in ("faces", "n_faces", "part")}
    left["tolerances"] = [
        {key: value for key, value in row.items() if key != "name"} for row in left["tolerances"]
    ]
    return left


# -- status --------------------


def has_result(obj: Any) -> bool:
    """Tell whether a skin model has been computed."""
    return bool(obj.ResultFile)


def is_up_to_date(obj: Any) -> bool:
    """Tell whether the result was made of the part and the tolerances as they are."""
    return has_result(obj) and not problems(obj) and _outdated(obj) is None


def _outdated(obj: Any) -> str | None:
    before, now, size = unpack(obj.PartSignature), faces_now(obj.Part), size_of(obj.Part)
    if len(before) != len(now) or not all(same_face(a, b, size) for a, b in zip(before, now)):
        return "the part has changed"
    if json.loads(obj.Inputs or "{}") != _comparable(request_of(obj)):
        return "tolerances or settings have changed"
    return None


def _status(obj: Any) -> str:
    from .jobs import job_of

    job = job_of(obj)
    if job is not None:
        return f"Computing, {job.fraction:.0%}: {job.text}"
    told = problems(obj)
    if told:
        return "Cannot be computed: " + "; ".join(told)
    if not has_result(obj):
        return "Not computed"
    outdated = _outdated(obj)
    return f"Out of date: {outdated}" if outdated else "Up to date"


def refresh(obj: Any, text: str | None = None) -> None:
    """Set the status anew, or to a text."""
    set_status(obj, _status(obj) if text is None else text)


# -- results --------------------


def _placement(obj: Any) -> Any:
    """Return where the part stands in the document."""
    part = obj.Part
    if part is None:
        return obj.Placement
    return part.getGlobalPlacement() if hasattr(part, "getGlobalPlacement") else part.Placement


def store_result(
    obj: Any,
    folder: Path,
    report_values: dict[str, Any],
    request: dict[str, Any],
    signatures: list[FaceSignature],
) -> None:
    """Put the result of a job into the document; call it in a transaction.

    Parameters
    ----------
    obj : Mesh.Feature
    folder : Path
        With ``skin.npz`` and ``skin.ply``.
    report_values : dict
        Content of ``result.json``.
    request : dict
        What was asked for when the job began.
    signatures : list of FaceSignature
        Of the part then.

    Raises
    ------
    ResultError
        The files are damaged.
    """
    found = read_result(folder / "skin.npz", report_values)
    obj.ResultFile = str(folder / "skin.npz")
    obj.Report = json.dumps(report_values, ensure_ascii=False)
    obj.Inputs = json.dumps(_comparable(request), ensure_ascii=False)
    obj.PartSignature = pack(signatures)
    _remember(obj, found)
    obj.Instance = min(max(obj.Instance, 0), found.size - 1)
    _show(obj, found, obj.Instance)


def update_report(obj: Any, report_values: dict[str, Any]) -> None:
    """Replace the rows of the tolerances in the report by those of a check; call it in a transaction."""
    values = report(obj)
    values["instances"] = report_values.get("instances", [])
    values["unresolved"] = report_values.get("unresolved", [])
    values["checked_against"] = report_values.get("job", "")
    obj.Report = json.dumps(values, ensure_ascii=False)


def result(obj: Any) -> SkinResult | None:
    """Return the result of a skin model; None before the first computation.

    Raises
    ------
    ResultError
        The arrays in the document are damaged.
    """
    path = obj.ResultFile
    if not path:
        return None
    found = _results.get(_key(obj))
    if found is None:
        found = read_result(path, report(obj))
        _remember(obj, found)
    return found


def _key(obj: Any) -> str:
    """Return a key that changes with the content: undo puts another file under the same name."""
    path = Path(obj.ResultFile)
    status = path.stat()
    return f"{path}|{status.st_mtime_ns}|{status.st_size}|{hash(obj.Report)}"


def _remember(obj: Any, found: SkinResult) -> None:
    _results[_key(obj)] = found
    while len(_results) > _KEPT:
        del _results[next(iter(_results))]


def report(obj: Any) -> dict[str, Any]:
    """Return the report of the last computation as a table; empty before it."""
    try:
        values = json.loads(obj.Report or "{}")
    except ValueError as error:
        raise ResultError(f"the report of {obj.Label} is damaged: {error}") from error
    return values if isinstance(values, dict) else {}


def show_instance(obj: Any, index: int) -> None:
    """Show another instance.

    Raises
    ------
    IndexError
        There is none of that number; the message says how many there are.
    """
    found = result(obj)
    count = 0 if found is None else found.size
    if found is None or not 0 <= index < count:
        raise IndexError(f"{obj.Label} has no instance {index}; it has {count}")
    obj.Instance = index
    _show(obj, found, index)


def _show(obj: Any, found: SkinResult, index: int) -> None:
    with tempfile.TemporaryDirectory(prefix="cadskin-") as place:
        path = Path(place) / "skin.ply"
        write_ply(path, found.instance_points(index), found.triangles)
        mesh = Mesh.Mesh()
        mesh.read(str(path))
    if mesh.CountPoints != found.n_points:
        raise ResultError(f"FreeCAD read {mesh.CountPoints} of {found.n_points} vertices")
    obj.Mesh = mesh
    obj.Placement = _placement(obj)  # after the mesh, which brings one of its own
    obj.ShownInstance = index


def clear_result(obj: Any) -> None:
    """Take the result away; call it in a transaction."""
    obj.Mesh = Mesh.Mesh()
    obj.ResultFile, obj.Report, obj.Inputs = "", "{}", ""
    obj.PartSignature, obj.VertexColors, obj.ShownInstance = [], [], -1
