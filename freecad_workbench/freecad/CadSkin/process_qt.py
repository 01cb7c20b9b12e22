"""The worker as a `QProcess`; its messages arrive in the event loop of the window."""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from typing import Any

from .protocol import LineBuffer
from .qt import QtCore

__all__ = ["QtProcess"]

_TAIL = 4000


class QtProcess:
    """A worker process in Qt's event loop; the parameters are those of `process_plain.PlainProcess`."""

    def __init__(
        self,
        python: str,
        arguments: list[str],
        environment: dict[str, str],
        on_line: Callable[[Any, bytes], None],
        on_end: Callable[[Any, Any, str, bool], None],
    ) -> None:
        self.python = python
        self._on_line, self._on_end = on_line, on_end
        self._buffer, self._printed = LineBuffer(), b""
        self._told = self._started = False
        process = QtCore.QProcess()
        variables = QtCore.QProcessEnvironment()
        for name, value in environment.items():
            variables.insert(name, value)
        process.setProcessEnvironment(variables)
        process.setWorkingDirectory(tempfile.gettempdir())
        process.readyReadStandardOutput.connect(self._read)
        process.readyReadStandardError.connect(self._read_errors)
        process.started.connect(self._begun)
        process.finished.connect(self._finished)
        process.errorOccurred.connect(self._failed)
        self._process = process
        process.start(python, arguments)

    def alive(self) -> bool:
        """Tell whether the process runs, or has ended and nobody has been told yet."""
        return not self._told

    def pid(self) -> int | None:
        """Return its id."""
        return int(self._process.processId()) or None

    def write(self, data: bytes) -> None:
        """Send bytes."""
        if not self._told:
            self._process.write(QtCore.QByteArray(data))

    def pump(self, timeout: float) -> None:
        """Let the event loop run for up to ``timeout`` seconds."""
        deadline = time.monotonic() + timeout
        while True:
            QtCore.QCoreApplication.processEvents()
            if self._told or time.monotonic() >= deadline:
                return
            time.sleep(0.005)

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def close(self) -> None:
        """End the process; nobody is told."""
        self._told = True
        self._process.kill()
        self._process.waitForFinished(2000)

    def _begun(self) -> None:
        self._started = True

    def _read(self) -> None:
        for line in self._buffer.feed(bytes(self._process.readAllStandardOutput())):
            if self._told:
                return
            self._on_line(self, line)

    def _read_errors(self) -> None:
        self._printed = (self._printed + bytes(self._process.readAllStandardError()))[-_TAIL:]

    def _finished(self, code: int, *_status: Any) -> None:
        self._read()
        self._read_errors()
        self._end(code)

    def _failed(self, error: Any) -> None:
        # Only a process that did not start has no `finished` signal. Qt 6 keeps the names in an enumeration.
        names = getattr(QtCore.QProcess, "ProcessError", QtCore.QProcess)
        if error == getattr(names, "FailedToStart", None):
            self._end(self._process.errorString())

    def _end(self, code: Any) -> None:
        if not self._told:
            self._told = True
            self._on_end(self, code, self._printed.decode("utf-8", "replace"), self._started)
