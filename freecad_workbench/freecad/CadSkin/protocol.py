"""Messages and files between this process and the worker. Standard library only."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from pathlib import Path
from typing import Any

__all__ = [
    "PROTOCOL",
    "JobError",
    "LineBuffer",
    "clean_environment",
    "new_folder",
    "parse_message",
    "remove_folder",
    "serve_arguments",
    "write_request",
]

PROTOCOL = 1
_PREFIX = "cadskin-job-"

# What an application sets for itself and another Python must not inherit (AppImage, snap, conda, Qt).
_NOT_INHERITED = (
    "PYTHONHOME",
    "PYTHONPATH",
    "PYTHONSTARTUP",
    "PYTHONEXECUTABLE",
    "PIP_USER",
    "QT_PLUGIN_PATH",
    "QT_QPA_PLATFORM_PLUGIN_PATH",
    "LD_LIBRARY_PATH",
    "LD_PRELOAD",
)


class JobError(RuntimeError):
    """A job that failed.

    Attributes
    ----------
    kind : str
        ``WorkerMissing``, ``WorkerCrashed``, ``ProtocolMismatch``, ``Cancelled``, ``DiskError``, or the name
        of the worker's own error.
    """

    def __init__(self, kind: str, text: str) -> None:
        super().__init__(text)
        self.kind = kind


class LineBuffer:
    """Collects bytes and gives complete lines."""

    def __init__(self) -> None:
        self._rest = b""

    def feed(self, data: bytes) -> list[bytes]:
        """Return the lines that are complete now."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        return lines


def parse_message(line: bytes) -> dict[str, Any] | None:
    """Return the message in a line of the worker; None for anything else that is printed.

    >>> parse_message(b'{"event": "done", "job": "1"}')["job"]
    '1'
    >>> parse_message(b"a library says hello") is None
    True
    """
    try:
        message = json.loads(line.decode("utf-8"))
    except ValueError:
        return None
    return message if isinstance(message, dict) and isinstance(message.get("event"), str) else None


def clean_environment(environment: dict[str, str] | None = None) -> dict[str, str]:
    """Return an environment for another Python: without what FreeCAD's own start set."""
    given = dict(os.environ if environment is None else environment)
    bundled = bool(given.get("APPIMAGE") or given.get("APPDIR") or given.get("SNAP"))
    for name in _NOT_INHERITED:
        if bundled or not name.startswith("LD_"):
            given.pop(name, None)
    given["PYTHONIOENCODING"] = "utf-8"
    given["PYTHONUNBUFFERED"] = "1"
    return given


def serve_arguments() -> list[str]:
    """Return the arguments with which Python becomes a worker."""
    return ["-u", "-m", "cadskin.worker", "--serve"]


def new_folder() -> Path:
    """Return a new, private job folder.

    Raises
    ------
    JobError
        There is no place for it.
    """
    try:
        return Path(tempfile.mkdtemp(prefix=_PREFIX))
    except OSError as error:
        raise JobError("DiskError", f"no job folder can be made: {error.strerror or error}") from error


def remove_folder(folder: Path) -> None:
    """Remove a job folder; only one that `new_folder` made."""
    if folder.name.startswith(_PREFIX):
        shutil.rmtree(folder, ignore_errors=True)


def write_request(folder: Path, job: str, request: dict[str, Any]) -> None:
    """Write ``request.json``.

    Raises
    ------
    JobError
        It cannot be written (a full disk).
    """
    values = {"protocol": PROTOCOL, "job": job, **request}
    try:
        (folder / "request.json").write_text(json.dumps(values, ensure_ascii=False), encoding="utf-8")
    except OSError as error:
        raise JobError("DiskError", f"the job cannot be written: {error.strerror or error}") from error
