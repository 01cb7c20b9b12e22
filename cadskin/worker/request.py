"""Requests of the client, checked."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

from cadskin.errors import CadskinError
from cadskin.worker import PROTOCOL

__all__ = ["Request", "RequestError", "read_request"]


class RequestError(CadskinError, ValueError):
    """A request that is not understood: client and worker do not fit together, or a value is wrong."""


@dataclass(frozen=True)
class Request:
    """One request.

    Parameters
    ----------
    job : str
    task : str
    folder : Path
        Where the files of the job are.
    options : mapping
        What else the request says.
    """

    job: str
    task: str
    folder: Path
    options: Mapping[str, Any] = field(default_factory=dict)

    @property
    def brep(self) -> Path:
        """The part."""
        return self.folder / "part.brep"

    def positive(self, name: str) -> float | None:
        """Return a positive number of the options; None where there is none.

        Raises
        ------
        RequestError
            It is no positive, finite number.
        """
        value = self.options.get(name)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value) or value <= 0:
            raise RequestError(f"{name} must be a positive number, got {value!r}")
        return float(value)

    def count(self, name: str, default: int, *, least: int = 0) -> int:
        """Return a whole number of the options.

        Raises
        ------
        RequestError
            It is none, or less than ``least``.
        """
        value = self.options.get(name, default)
        if isinstance(value, bool) or not isinstance(value, int) or value < least:
            raise RequestError(f"{name} must be a whole number from {least} on, got {value!r}")
        return value

    def tables(self, name: str) -> list[dict[str, Any]]:
        """Return a list of tables of the options.

        Raises
        ------
        RequestError
            It is none.
        """
        value = self.options.get(name, [])
        if not isinstance(value, list) or not all(isinstance(item, dict) for item in value):
            raise RequestError(f"{name} must be a list of tables, got {value!r}")
        return value

    def text(self, name: str, default: str | None = None) -> str | None:
        """Return a text of the options.

        Raises
        ------
        RequestError
            It is none.
        """
        value = self.options.get(name, default)
        if value is not None and not isinstance(value, str):
            raise RequestError(f"{name} must be a text, got {value!r}")
        return value


def read_request(folder: Path) -> Request:
    """Return the request in a job folder.

    Raises
    ------
    RequestError
        There is none, it is no JSON table, or it follows another protocol.
    """
    path = folder / "request.json"
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise RequestError(f"cannot read {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise RequestError(f"{path} is no JSON text: {error}") from error
    if not isinstance(values, dict):
        raise RequestError(f"{path} must hold one table")
    protocol = values.pop("protocol", None)
    if protocol != PROTOCOL:
        from cadskin import __version__

        raise RequestError(
            f"the request follows protocol {protocol!r}, this worker (cadskin {__version__}) speaks "
            f"{PROTOCOL}: install the cadskin and the workbench of one release"
        )
    job, task = values.pop("job", ""), values.pop("task", "")
    if not isinstance(job, str) or not isinstance(task, str):
        raise RequestError(f"{path}: job and task must be texts")
    return Request(job, task, folder, values)
