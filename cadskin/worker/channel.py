"""Messages to the client, and the private output stream they go through."""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Callable
from typing import Any, TextIO, TypeAlias

from cadskin._typing import Progress

__all__ = ["Channel", "Stage", "private_output"]

Stopped: TypeAlias = Callable[[], bool]

_INTERVAL = 0.1  # seconds between two messages of one stage


def private_output() -> TextIO:
    """Return a stream to the client, and send everything else that is printed to standard error."""
    stream = os.fdopen(os.dup(1), "w", encoding="utf-8", newline="\n")
    os.dup2(2, 1)
    return stream


class Channel:
    """Sends messages as JSON lines; several threads may use it.

    Parameters
    ----------
    stream : text stream
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self._lock = threading.Lock()

    def send(self, event: str, **values: Any) -> None:
        """Send one message; a client that is gone ends the process, there is nobody left to work for."""
        line = json.dumps({"event": event, **values}, ensure_ascii=False)
        with self._lock:
            try:
                self._stream.write(line + "\n")
                self._stream.flush()
            except (BrokenPipeError, ValueError):
                os._exit(3)


class Stage:
    """The progress of one job: stages that each cover a part of the whole.

    Parameters
    ----------
    channel : Channel
    job : str
    stopped : callable
        Tells whether the client has asked to stop.
    """

    def __init__(self, channel: Channel, job: str, stopped: Stopped) -> None:
        self._channel, self._job, self._stopped = channel, job, stopped
        self._last = 0.0

    def __call__(self, low: float, high: float, text: str) -> Progress:
        """Begin a stage from fraction ``low`` to ``high`` and return its progress function."""
        self._tell(low, text)

        def progress(done: int, total: int) -> bool:
            now = time.monotonic()
            if now - self._last >= _INTERVAL:
                self._tell(low + (high - low) * done / max(total, 1), text)
            return not self._stopped()

        return progress

    def _tell(self, fraction: float, text: str) -> None:
        self._last = time.monotonic()
        self._channel.send("progress", job=self._job, fraction=round(fraction, 4), text=text)
