"""Jobs of skin models: begun with what the document holds, and their results put into it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import FreeCAD

from . import engine, faces, skin
from .engine import Job
from .faces import InputError, faces_now
from .protocol import JobError, remove_folder
from .signature import local_shape

__all__ = ["cancel_all", "cancel_document", "job_of", "run", "run_on_skin", "start_compute", "start_verify"]

_AGAIN = 500  # milliseconds until a result that had to wait is tried again

Key = tuple  # name and uid of the document, name of the skin

_jobs: dict[Key, Job] = {}
_listeners: list[Callable[[Any], None]] = []


def listen(function: Callable[[Any], None]) -> None:
    """Have a function called with the skin object whenever the state of its job changes (for panels)."""
    if function not in _listeners:
        _listeners.append(function)


def unlisten(function: Callable[[Any], None]) -> None:
    """Undo `listen`."""
    if function in _listeners:
        _listeners.remove(function)


def job_of(obj: Any) -> Job | None:
    """Return the job that computes a skin model now; None where there is none."""
    return _jobs.get(_key(obj))


def _key(obj: Any) -> Key:
    return (obj.Document.Name, obj.Document.Uid, obj.Name)


def start_compute(obj: Any) -> Job:
    """Begin the simulation of a skin model.

    Raises
    ------
    InputError
        It cannot be computed: the message lists what stands against it.
    JobError
        There is no worker, or the job cannot be written.
    """
    told = skin.problems(obj)
    if told:
        skin.refresh(obj)
        raise InputError(f"{obj.Label} cannot be computed: " + "; ".join(told))
    request = skin.request_of(obj)
    signatures = list(faces_now(obj.Part))

    def store(current: Any, job: Job, result: dict[str, Any]) -> None:
        skin.store_result(current, job.folder, result, request, signatures)

    return run_on_skin(obj, {"task": "simulate", **request}, store, "Skin model result")


def start_verify(obj: Any) -> Job:
    """Begin the check of a computed skin model against the tolerances as they are now.

    Raises
    ------
    InputError
        It has no result, or a tolerance cannot be used.
    """
    _needs_result(obj)
    told = skin.problems(obj)
    if told:
        raise InputError(f"{obj.Label} cannot be checked: " + "; ".join(told))

    def store(current: Any, _job: Job, result: dict[str, Any]) -> None:
        skin.update_report(current, result)

    return run_on_skin(
        obj, {"task": "verify", **stored_request(obj)}, store, "Check against tolerances", old=True
    )


def stored_request(obj: Any) -> dict[str, Any]:
    """Return a request for the stored result: its mesh size, the tolerances as they are now."""
    values = skin.request_of(obj)
    made_with = json.loads(obj.Inputs or "{}")
    values.pop("edge_length", None)
    if "edge_length" in made_with:
        values["edge_length"] = made_with["edge_length"]
    return values


def _needs_result(obj: Any) -> None:
    if not skin.has_result(obj):
        raise InputError(f"{obj.Label} has not been computed; compute it first")


def run_on_skin(
    obj: Any,
    request: dict[str, Any],
    store: Callable[[Any, Job, dict[str, Any]], None] | None,
    transaction: str,
    *,
    old: bool = False,
) -> Job:
    """Begin a job of a skin model; its result goes into the document in a transaction of its own.

    Parameters
    ----------
    obj : Mesh.Feature
    request : dict
    store : callable or None
        Called with (object, job, result) in the transaction.
    transaction : str
    old : bool
        The job works on the stored result.
    """
    if job_of(obj) is not None:
        raise InputError(f"{obj.Label} is being computed; wait, or cancel it")
    key = _key(obj)
    shape = local_shape(obj.Part)
    stored = Path(obj.ResultFile) if old else None

    def prepare(folder: Path) -> None:
        write_brep(folder / "part.brep", shape)
        if stored is not None:
            (folder / "skin.npz").write_bytes(stored.read_bytes())

    def on_progress(_job: Job, _fraction: float, _text: str) -> None:
        _changed(key)

    def on_done(job: Job, values: dict[str, Any]) -> None:
        current = _alive(key)
        if current is not None and _must_wait(current, job):
            job.keep_folder = True
            _later(lambda: on_done(job, values))
            return
        _jobs.pop(key, None)
        if current is None:
            faces.warn("the skin model is gone; its result was dropped")
        elif store is not None:
            failure = _in_transaction(current, transaction, lambda: store(current, job, values))
            if failure:
                job.state, job.error, job.text = "failed", "DocumentError", failure
        if job.keep_folder:
            remove_folder(job.folder)
        for warning in values.get("warnings", []):
            faces.warn(warning)
        for function in list(_listeners) if current is not None else []:
            function(current)

    def on_error(_job: Job, kind: str, text: str) -> None:
        _jobs.pop(key, None)
        if kind != "Cancelled":
            FreeCAD.Console.PrintError(f"CadSkin: {text}\n")
        word = "Cancelled" if kind == "Cancelled" else f"Failed: {text}"
        _changed(key, word)

    job = engine.submit(request, on_progress, on_done, on_error, prepare=prepare)
    _jobs[key] = job
    _changed(key)
    return job


def run(
    request: dict[str, Any], prepare: Callable[[Path], None] | None = None, *, keep: Any = None
) -> dict[str, Any]:
    """Run a job that belongs to no skin model, and wait for it.

    Parameters
    ----------
    request : dict
    prepare : callable, optional
        Writes files into the job folder.
    keep : callable, optional
        Called with (job, result) while the files of the job are there; its value is returned.

    Raises
    ------
    JobError
        It failed, or was cancelled.
    """
    out: dict[str, Any] = {}
    failure: list[BaseException] = []

    def on_done(job: Job, values: dict[str, Any]) -> None:
        try:
            out["value"] = values if keep is None else keep(job, values)
        except Exception as error:
            failure.append(error)

    job = engine.submit(request, None, on_done, None, prepare=prepare).wait()
    if failure:
        raise failure[0]
    if job.state != "done":
        raise JobError(job.error, job.text)
    return out["value"]


def write_brep(path: Path, shape: Any) -> None:
    """Write text BREP, in which ``FaceN`` stays the N-th face.

    Raises
    ------
    JobError
        It cannot be written.
    """
    # FreeCAD's own writer takes the name as it is, and says nothing of a full disk: Python writes.
    path.write_text(shape.exportBrepToString(), encoding="ascii")


def _alive(key: Key) -> Any:
    """Return the skin model if its document is still open and it is still in it."""
    document, uid, name = key
    if document not in FreeCAD.listDocuments():
        return None
    found = FreeCAD.getDocument(document)
    return found.getObject(name) if found.Uid == uid else None


def _must_wait(obj: Any, job: Job) -> bool:
    """Tell whether the user is in the middle of a transaction that a result must not end: a panel is open."""
    return bool(FreeCAD.GuiUp and obj.Document.HasPendingTransaction and not job.awaited)


def _later(function: Callable[[], None]) -> None:
    from .qt import QtCore

    QtCore.QTimer.singleShot(_AGAIN, function)


def _in_transaction(obj: Any, text: str, work: Callable[[], None]) -> str:
    """Do something to a document in a transaction of its own; nothing of it stays where it fails.

    Returns
    -------
    str
        What went wrong; empty where nothing did.
    """
    document, touched = obj.Document, "Touched" in obj.State
    within = document.HasPendingTransaction  # of a macro that waits for the result: it belongs there
    failure = ""
    if not within:
        document.openTransaction(text)
    try:
        work()
        skin.refresh(obj)
    except Exception as error:
        if not within:
            document.abortTransaction()
        failure = str(error)
        skin.refresh(obj, f"Failed: {failure}")
        FreeCAD.Console.PrintError(f"CadSkin: {failure}\n")
    else:
        if not within:
            document.commitTransaction()
    if not touched:
        obj.purgeTouched()
    return failure


def _changed(key: Key, text: str | None = None) -> None:
    """Show the state of a job: in the status, without a transaction, and to those who listen."""
    obj = _alive(key)
    if obj is None:
        return
    touched = "Touched" in obj.State
    skin.refresh(obj, text)
    if not touched:
        obj.purgeTouched()
    for function in list(_listeners):
        function(obj)


def cancel_document(document: Any) -> None:
    """Cancel the jobs of a document that is closed."""
    for key, job in list(_jobs.items()):
        if key[:2] == (document.Name, document.Uid):
            job.cancel()
    faces.forget(document)


def cancel_all() -> None:
    """Cancel all jobs."""
    for job in list(_jobs.values()):
        job.cancel()


class DocumentObserver:
    """Cancels what belongs to a document or a skin model that goes away."""

    def slotDeletedDocument(self, document: Any) -> None:
        """Cancel the jobs of a document."""
        cancel_document(document)

    def slotDeletedObject(self, obj: Any) -> None:
        """Cancel the job of a skin model."""
        if getattr(getattr(obj, "Proxy", None), "Type", None) == skin.TYPE:
            job = job_of(obj)
            if job is not None:
                job.cancel()


_observer = DocumentObserver()
FreeCAD.addDocumentObserver(_observer)
