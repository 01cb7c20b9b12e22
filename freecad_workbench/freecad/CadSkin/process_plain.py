"""The worker as a subprocess; a thread collects its lines, `pump` hands them on."""

from __future__ import annotations

import contextlib
import os
import queue
import subprocess
import tempfile
import threading
from collections.abc import Callable
from typing import Any

from .protocol import LineBuffer

__all__ = ["PlainProcess"]

_CHUNK = 65536
_TAIL = 4000  # bytes of standard error that are kept for messages


class PlainProcess:
    """A worker process without an event loop.

    Parameters
    ----------
    python : str
    arguments : list of str
    environment : dict
    on_line : callable
        Called with (process, line) by `pump`.
    on_end : callable
        Called with (process, code, printed, started) by `pump`, once.
    """

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
        self._lines: queue.Queue[bytes | None] = queue.Queue()
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 (closed at its end)
        self._process: subprocess.Popen[bytes] | None = None
        self._failure: str | None = None
        self._told = False
        try:
            self._process = subprocess.Popen(
                [python, *arguments],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=self._errors,
                env=environment,
                cwd=tempfile.gettempdir(),
            )
        except OSError as error:
            self._failure = error.strerror or str(error)
            self._lines.put(None)
            return
        threading.Thread(target=self._listen, args=(self._process,), daemon=True).start()

    def _listen(self, process: subprocess.Popen[bytes]) -> None:
        buffer = LineBuffer()
        assert process.stdout is not None
        descriptor = process.stdout.fileno()
        while True:
            try:
                chunk = os.read(descriptor, _CHUNK)
            except OSError:
                chunk = b""
            if not chunk:
                break
            for line in buffer.feed(chunk):
                self._lines.put(line)
        self._lines.put(None)

    def alive(self) -> bool:
        """Tell whether the process runs, or has ended and nobody has been told yet."""
        return not self._told

    def pid(self) -> int | None:
        """Return its id."""
        return None if self._process is None else self._process.pid

    def write(self, data: bytes) -> None:
        """Send bytes; a process that is gone is noticed by `pump`."""
        if self._process is not None and self._process.stdin is not None:
            with contextlib.suppress(OSError, ValueError):
                self._process.stdin.write(data)
                self._process.stdin.flush()

    def pump(self, timeout: float) -> None:
        """Hand on what has arrived, waiting for it up to ``timeout`` seconds."""
        try:
            line = self._lines.get(timeout=timeout) if timeout > 0 else self._lines.get_nowait()
        except queue.Empty:
            return
        while True:
            if line is None:
                self._ended()
                return
            self._on_line(self, line)
            try:
                line = self._lines.get_nowait()
            except queue.Empty:
                return

    def kill(self) -> None:
        """End the process at once."""
        if self._process is not None:
            self._process.kill()

    def close(self) -> None:
        """End the process; nobody is told."""
        self._told = True
        if self._process is not None:
            self._process.kill()
            self._reap()

    def _ended(self) -> None:
        if self._told:
            return
        self._told = True
        if self._process is None:
            self._on_end(self, self._failure, "", False)
            return
        code = self._reap()
        self._errors.seek(0, os.SEEK_END)
        self._errors.seek(max(0, self._errors.tell() - _TAIL))
        printed = self._errors.read().decode("utf-8", "replace")
        self._errors.close()
        self._on_end(self, code, printed, True)

    def _reap(self) -> int:
        assert self._process is not None
        code = self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with contextlib.suppress(OSError):
                    stream.close()
        return code
