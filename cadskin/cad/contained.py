"""Read and mesh CAD files in a child process, so that no file can take the caller down.

The parent never imports the geometry kernel. A crash, a hang or a blow-up of memory becomes a `KernelError`
that names the file.
"""

from __future__ import annotations

import os
import pickle
import queue
import signal
import subprocess
import sys
import tempfile
import threading
import time
import warnings
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cadskin import errors
from cadskin._progress import report
from cadskin._typing import Progress
from cadskin.cad.description import FileDescription
from cadskin.errors import CadskinError, CadskinWarning, KernelError
from cadskin.shape.nominal import Face, NominalModel, build_features

__all__ = ["contained_describe", "contained_nominals"]

_POLL = 0.2  # seconds between two looks at the clock and at the caller's wish to stop


def contained_nominals(
    path: str | Path,
    options: Mapping[str, Any] | None = None,
    *,
    time_limit: float | None = 300.0,
    memory_limit: int | None = None,
    progress: Progress | None = None,
) -> tuple[NominalModel, ...]:
    """Return the nominal models of a CAD file, read and meshed in a child process.

    Parameters
    ----------
    path : str or Path
    options : mapping, optional
        Options of `cadskin.nominals`; with ``part`` only that part is made.
    time_limit : float, optional
        Seconds after which the child is ended; None for no limit.
    memory_limit : int, optional
        Bytes of data that the child may allocate (Linux; of address space on macOS; no limit on Windows).
    progress : callable, optional
        Called with (done, total); returning False ends the child.

    Raises
    ------
    KernelError
        The kernel crashed, hung or ran out of memory.
    ReadError, GeometryError, MeshingError, SelectionError
        As from `cadskin.nominals`.
    Cancelled
        ``progress`` returned False.
    """
    arguments = {**(options or {}), "path": str(Path(path).absolute())}
    models = _run("nominals", arguments, time_limit=time_limit, memory_limit=memory_limit, progress=progress)
    return tuple(_refrozen(model) for model in models)


def contained_describe(
    path: str | Path,
    *,
    time_limit: float | None = 300.0,
    memory_limit: int | None = None,
    progress: Progress | None = None,
) -> FileDescription:
    """Return what is in a CAD file, read in a child process; see `contained_nominals`.

    Examples
    --------
    >>> contained_describe("no such file.step")
    Traceback (most recent call last):
    cadskin.errors.ReadError: no such file.step: there is no such file
    """
    from cadskin.cad.filekind import cad_file

    cad_file(Path(path))
    described: FileDescription = _run(
        "describe",
        {"path": str(Path(path).absolute())},
        time_limit=time_limit,
        memory_limit=memory_limit,
        progress=progress,
    )
    parts = tuple(replace(part, faces=_refrozen_faces(part.faces)) for part in described.parts)
    return replace(described, parts=parts)


def _run(
    task: str,
    arguments: dict[str, Any],
    *,
    time_limit: float | None,
    memory_limit: int | None,
    progress: Progress | None,
) -> Any:
    """Run one task in a child and return its value; raise what it raised."""
    name = Path(arguments["path"]).name
    with tempfile.TemporaryDirectory(prefix="cadskin-") as place:
        folder = Path(place)
        (folder / "request.pickle").write_bytes(pickle.dumps((task, arguments, memory_limit)))
        child = _start(folder)
        try:
            _watch(child, progress, time_limit, name)
        finally:
            _end(child)
        result = folder / "result.pickle"
        if not result.exists():
            raise KernelError(f"{name}: {_what_happened(child.returncode, folder, memory_limit)}")
        kind, value, told = pickle.loads(result.read_bytes())
    for message in told:
        warnings.warn(message, CadskinWarning, stacklevel=3)
    if kind == "value":
        return value
    raise _error(kind, value, name, memory_limit)


def _start(folder: Path) -> subprocess.Popen[bytes]:
    package_home = str(Path(__file__).resolve().parents[2])
    paths = [package_home, *filter(None, [os.environ.get("PYTHONPATH")])]
    with (folder / "start.txt").open("wb") as printed:
        return subprocess.Popen(
            [sys.executable, "-m", "cadskin.cad._child", str(folder)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=printed,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
            start_new_session=os.name == "posix",
        )


def _watch(
    child: subprocess.Popen[bytes], progress: Progress | None, time_limit: float | None, name: str
) -> None:
    """Pass the child's progress on until it ends.

    Raises
    ------
    KernelError
        The time is over.
    Cancelled
        ``progress`` asked to stop.
    """
    lines: queue.Queue[bytes | None] = queue.Queue()

    def listen() -> None:
        assert child.stdout is not None
        for line in child.stdout:
            lines.put(line)
        lines.put(None)

    threading.Thread(target=listen, daemon=True).start()
    deadline = None if time_limit is None else time.monotonic() + time_limit
    done, total = 0, 1
    while True:
        if deadline is not None and time.monotonic() > deadline:
            raise KernelError(
                f"{name}: the geometry kernel did not finish within {time_limit:g} s and was stopped; "
                "give it more time (time_limit=, --time-limit) or simplify the part"
            )
        try:
            line = lines.get(timeout=_POLL)
        except queue.Empty:
            report(progress, done, total)  # so that the caller can stop at any time
            continue
        if line is None:
            break
        done, total = (int(word) for word in line.split())
        report(progress, done, total)
    child.wait()


def _end(child: subprocess.Popen[bytes]) -> None:
    """End the child and everything it started, and close its pipes."""
    if child.poll() is None:
        with suppress(ProcessLookupError):
            if os.name == "posix":
                os.killpg(child.pid, signal.SIGKILL)
            else:
                child.kill()
    child.wait()
    for stream in (child.stdin, child.stdout):
        if stream is not None:
            stream.close()


def _what_happened(code: int, folder: Path, memory_limit: int | None) -> str:
    """Return in words how a child ended that left no result."""
    log = folder / "output.txt"
    printed = (log if log.exists() else folder / "start.txt").read_text(errors="replace").strip()
    said = printed.splitlines()[-1][:200] if printed else ""
    if any(word in printed for word in ("bad_alloc", "MemoryError", "Memory allocation")):
        return _out_of_memory(memory_limit)
    if code == -9:
        return "the process that read it was killed, most likely because the machine ran out of memory"
    if code < 0:
        limited = "" if memory_limit is None else f" (its memory was limited to {_size(memory_limit)})"
        died = signal.Signals(-code).name
        return f"the geometry kernel crashed on it ({died}){limited}; the part may be damaged"
    return f"the process that read it ended with code {code}" + (f": {said}" if said else "")


def _error(kind: str, value: Any, name: str, memory_limit: int | None) -> CadskinError:
    if kind == "memory":
        return KernelError(f"{name}: {_out_of_memory(memory_limit)}")
    if kind == "failure":
        return KernelError(f"{name}: the geometry kernel failed: {value}")
    class_name, message = value
    found = getattr(errors, class_name, CadskinError)
    error: CadskinError = found(message)
    return error


def _out_of_memory(limit: int | None) -> str:
    bound = "" if limit is None else f" ({_size(limit)} allowed)"
    return f"the geometry kernel ran out of memory{bound}; use a larger edge length or allow more"


def _size(n_bytes: int) -> str:
    return f"{n_bytes / 2**20:.0f} MB"


def _refrozen(model: NominalModel) -> NominalModel:
    """Return a model out of a pickle with its arrays read-only again."""
    faces = _refrozen_faces(model.faces)
    starts = np.array([0, *(feature.stop for feature in model.features)], dtype=np.int64)
    groups = [feature.face_indices for feature in model.features]
    features = build_features(model.surface, groups, faces, model.samples, starts)
    return replace(model, faces=faces, features=features)


def _refrozen_faces(faces: tuple[Face, ...]) -> tuple[Face, ...]:
    return tuple(replace(face, ideal=replace(face.ideal)) for face in faces)
