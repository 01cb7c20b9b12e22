"""Every command as a plain function, for macros and for FreeCAD without a window.

>>> from freecad.CadSkin import api                                             # doctest: +SKIP
>>> api.add_tolerance(box, ["Face6"], "flatness", 0.02)                         # doctest: +SKIP
>>> skin = api.compute(api.create_skin(box, seed=7))                            # doctest: +SKIP
>>> api.result(skin).statistics()                                               # doctest: +SKIP

Lengths are in mm. A function that cannot do what it is asked for raises `InputError` or `JobError`, whose
message says why, and leaves the document as it was.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import FreeCAD

from . import datum as _datum
from . import dimension as _dimension
from . import general_tolerance as _general
from . import import_step as _import
from . import jobs as _jobs
from . import skin as _skin
from . import tolerance as _tolerance
from .faces import InputError, part_of, part_problem, relink_faces, whole_part
from .faces import accept_faces as _accept
from .kinds import CHARACTERISTICS, characteristics_for
from .objects import is_a, objects_of, transaction
from .protocol import JobError
from .result import SkinResult

__all__ = [
    "CHARACTERISTICS",
    "EXPORT_FORMATS",
    "InputError",
    "JobError",
    "accept_faces",
    "add_datum",
    "add_tolerance",
    "cancel",
    "characteristics_for",
    "check",
    "compute",
    "create_skin",
    "export",
    "find_faces",
    "general_tolerance",
    "import_step",
    "join_skins",
    "probe",
    "report",
    "result",
    "sample",
    "show_instance",
    "skins",
    "status",
    "tolerances",
]

EXPORT_FORMATS = ("stl", "ply", "obj", "3mf", "glb", "gltf", "vtu", "npz")


_ON_PARTS = (_tolerance.TYPE, _datum.TYPE, _dimension.TYPE, _general.TYPE)


# -- the specification --------------------


def import_step(path: str | Path, document: Any = None) -> list[Any]:
    """Import the parts of a STEP file with their semantic tolerances and datums.

    Parameters
    ----------
    path : str or Path
    document : App.Document, optional
        The active one by default, or a new one.

    Returns
    -------
    list of App.DocumentObject
        The parts; their tolerances and datums are in the document beside them.
    """
    target = document or FreeCAD.ActiveDocument or FreeCAD.newDocument()
    return _import.import_file(target, path)


def add_tolerance(
    part: Any,
    faces: Any,
    characteristic: str,
    value: float,
    *,
    datums: str = "",
    diameter: bool = False,
    **more: Any,
) -> Any:
    """Add a tolerance to faces of a part.

    Parameters
    ----------
    part : App.DocumentObject
    faces : str or list of str
        ``"Face6"``.
    characteristic : str
        ``flatness``, ``position``, ...; see `characteristics_for`.
    value : float
        [mm], above 0.
    datums : str
        ``"A|B-C"``.
    diameter : bool
        The zone is round.
    **more
        ``modifiers``, ``model``, ``correlation_length`` [mm], ``zone_share``, ``label``.

    Returns
    -------
    App.FeaturePython

    Raises
    ------
    InputError
        No face, an edge, a value of 0 or less, a characteristic that has no meaning on such a face, a datum
        that is not there.
    """
    if not value > 0:
        raise InputError(f"the value of a tolerance must be above 0, got {value:g} mm")
    if characteristic not in CHARACTERISTICS:
        raise InputError(
            f"no characteristic is called {characteristic!r}; there are {', '.join(CHARACTERISTICS)}"
        )
    with transaction(part.Document, "Add tolerance"):
        obj = _tolerance.make_tolerance(part.Document, part, faces, characteristic, value)
        obj.Datums, obj.Diameter = datums, diameter
        _set_more(obj, more)
        told = _tolerance.problem(obj)
        if told:
            raise InputError(told)
        join_skins(obj)
    return obj


_MORE = {
    "modifiers": ("Modifiers", list),
    "model": ("Model", str),
    "correlation_length": ("CorrelationLength", float),
    "zone_share": ("ZoneShare", float),
    "label": ("Label", str),
}


def _set_more(obj: Any, more: dict[str, Any]) -> None:
    for name, value in more.items():
        if name not in _MORE:
            raise InputError(f"a tolerance has no {name!r}; it has {', '.join(_MORE)}")
        prop, kind = _MORE[name]
        setattr(obj, prop, kind(value))


def add_datum(part: Any, faces: Any, letter: str | None = None) -> Any:
    """Add a datum to faces of a part; without a letter the next free one is taken.

    Raises
    ------
    InputError
        No face, or a letter that is taken.
    """
    with transaction(part.Document, "Add datum"):
        obj = _datum.make_datum(part.Document, part, faces, letter)
        join_skins(obj)
    return obj


def general_tolerance(part: Any, value: float, characteristic: str = "surface_profile") -> Any:
    """Set the general tolerance of a part: it holds on every face without a tolerance of its own.

    Raises
    ------
    InputError
        A value of 0 or less, or no part.
    """
    with transaction(part.Document, "General tolerance"):
        obj = _general.make_general(part.Document, part, value, characteristic)
        join_skins(obj)
    return obj


def tolerances(part: Any) -> list[Any]:
    """Return the tolerances, datums, dimensions and the general tolerance of a part."""
    found = objects_of(part.Document, *_ON_PARTS)
    return [obj for obj in found if part_of(obj) == part]


def accept_faces(obj: Any) -> None:
    """Take the faces that a tolerance, a datum or all of a skin model are on now for those that are meant.

    Raises
    ------
    InputError
        One of them is gone.
    """
    with transaction(obj.Document, "Accept faces"):
        for item in _with_faces(obj):
            _accept(item)
            item.touch()


def find_faces(obj: Any) -> bool:
    """Put a tolerance, a datum or all of a skin model back on the faces that were picked, where found.

    Returns
    -------
    bool
        Whether they were found.
    """
    found = True
    with transaction(obj.Document, "Find faces"):
        for item in _with_faces(obj):
            found = relink_faces(item) and found
            item.touch()
    return found


def _with_faces(obj: Any) -> list[Any]:
    members = obj.Tolerances if is_a(obj, _skin.TYPE) else [obj]
    return [item for item in members if hasattr(item, "Signature")]


def join_skins(obj: Any) -> None:
    """Enter a tolerance or datum into the skin models of its part."""
    for skin in skins(part_of(obj)):
        if obj not in skin.Tolerances:
            skin.Tolerances = [*skin.Tolerances, obj]


# -- skin models --------------------


def create_skin(
    part: Any,
    *,
    edge_length: float | None = None,
    seed: int | None = None,
    instances: int | None = None,
    conform: str = "conditioned",
    correlation_length: float | None = None,
) -> Any:
    """Create a skin model of a part, with all its tolerances; nothing is computed yet.

    Parameters
    ----------
    part : App.DocumentObject
    edge_length : float, optional
        Size of the triangles [mm]; a hundredth of the diagonal by default.
    seed, instances : int, optional
    conform : {"conditioned", "scale", "reject", "none"}
        How the tolerances are met.
    correlation_length : float, optional
        Of the deviations [mm].

    Returns
    -------
    Mesh.Feature

    Raises
    ------
    InputError
        The part cannot be worked with, or a value has no meaning.
    """
    part = whole_part(part)
    told = part_problem(part)
    if told:
        raise InputError(told)
    if conform not in _skin.CONFORM:
        raise InputError(f"conform is one of {', '.join(_skin.CONFORM)}, not {conform!r}")
    given = {
        "EdgeLength": edge_length,
        "Seed": seed,
        "Instances": instances,
        "CorrelationLength": correlation_length,
    }
    with transaction(part.Document, "Create skin model"):
        obj = _skin.make_skin(part.Document, part, tolerances(part))
        for name, value in given.items():
            if value is not None:
                setattr(obj, name, value)
        obj.Conform = conform
        wrong = [
            text for text in _skin.problems(obj) if text.startswith(("edge length", "the number", "the seed"))
        ]
        if wrong:
            raise InputError("; ".join(wrong))
    return obj


def skins(part: Any) -> list[Any]:
    """Return the skin models of a part."""
    return [obj for obj in objects_of(part.Document, _skin.TYPE) if obj.Part == part]


def compute(skin: Any, *, wait: bool | None = None, timeout: float | None = None) -> Any:
    """Compute a skin model in the worker.

    Parameters
    ----------
    skin : Mesh.Feature
    wait : bool, optional
        Wait for the result; by default without a window.
    timeout : float, optional
        Seconds to wait at most.

    Returns
    -------
    Mesh.Feature
        The skin model itself.

    Raises
    ------
    InputError
        It cannot be computed: a face has moved, a value is missing.
    JobError
        There is no worker, it failed, or was cancelled.
    """
    return _waited(skin, _jobs.start_compute(_of_kind(skin)), wait, timeout)


def check(skin: Any, *, wait: bool | None = None, timeout: float | None = None) -> Any:
    """Check a computed skin model against the tolerances as they are now; the parts stay as they are."""
    return _waited(skin, _jobs.start_verify(_of_kind(skin)), wait, timeout)


def sample(skin: Any, instances: int, *, seed: int | None = None, wait: bool | None = None) -> Any:
    """Draw several parts.

    Parameters
    ----------
    skin : Mesh.Feature
    instances : int
        From 1 on. Part k depends on the seed and on k alone.
    seed : int, optional
    wait : bool, optional
        As for `compute`.
    """
    if instances < 1:
        raise InputError(f"the number of instances must be 1 or more, got {instances}")
    with transaction(skin.Document, "Number of instances"):
        skin.Instances = instances
        if seed is not None:
            skin.Seed = seed
    return compute(skin, wait=wait)


def _waited(skin: Any, job: Any, wait: bool | None, timeout: float | None) -> Any:
    if not FreeCAD.GuiUp if wait is None else wait:
        job.wait(timeout)
        if job.state != "done":
            raise JobError(job.error, job.text)
    return skin


def cancel(skin: Any) -> bool:
    """Cancel the computation of a skin model; return whether there was one."""
    job = _jobs.job_of(skin)
    if job is None:
        return False
    job.cancel()
    return True


def status(skin: Any) -> str:
    """Return the status of a skin model, looked up anew."""
    _skin.refresh(_of_kind(skin))
    return str(skin.Status)


def result(skin: Any) -> SkinResult | None:
    """Return the result as arrays; None before the first computation."""
    return _skin.result(_of_kind(skin))


def report(skin: Any) -> dict[str, Any]:
    """Return the report: per instance extent and a row per tolerance, versions, warnings."""
    return _skin.report(_of_kind(skin))


def show_instance(skin: Any, index: int) -> None:
    """Show another one of the parts that were drawn.

    Raises
    ------
    InputError
        There is none of that number.
    """
    with transaction(skin.Document, "Show instance"):
        try:
            _skin.show_instance(_of_kind(skin), index)
        except IndexError as error:
            raise InputError(str(error)) from error


def probe(skin: Any, position: Any) -> tuple[int, float]:
    """Return (face number, deviation [mm]) of the shown part nearest to a position in the document [mm].

    Raises
    ------
    InputError
        The skin model has not been computed.
    """
    found = result(skin)
    if found is None:
        raise InputError(f"{skin.Label} has not been computed; compute it first")
    local = skin.Placement.inverse().multVec(FreeCAD.Vector(position))
    triangle, _corner, value = found.nearest_corner(tuple(local), max(skin.ShownInstance, 0))
    return int(found.triangle_face[triangle]), value


def export(skin: Any, path: str | Path, *, instance: int | None = None) -> Path:
    """Write one of the parts to a mesh file; the worker does it, with all that the format can hold.

    Parameters
    ----------
    skin : Mesh.Feature
    path : str or Path
        Its suffix names the format, one of `EXPORT_FORMATS`.
    instance : int, optional
        The shown one by default.

    Raises
    ------
    InputError
        Unknown format, or nothing has been computed.
    JobError
        The file cannot be written, or the part has changed since.
    """
    target = Path(path).absolute()
    if target.suffix.lower().lstrip(".") not in EXPORT_FORMATS:
        raise InputError(f"{target.name}: the format is none of {', '.join(EXPORT_FORMATS)}")
    if not _skin.has_result(_of_kind(skin)):
        raise InputError(f"{skin.Label} has not been computed; compute it first")
    number = max(skin.ShownInstance, 0) if instance is None else instance
    request = {"task": "export", **_jobs.stored_request(skin), "path": str(target), "instance": number}
    job = _jobs.run_on_skin(skin, request, None, "Export", old=True).wait()
    if job.state != "done":
        raise JobError(job.error, job.text)
    return target


def _of_kind(skin: Any) -> Any:
    if not is_a(skin, _skin.TYPE):
        raise InputError(f"{getattr(skin, 'Label', skin)} is no skin model; select one")
    return skin
