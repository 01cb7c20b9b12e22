"""Run jobs: one by its folder, or one after the other as a client asks for them."""

from __future__ import annotations

import json
import os
import queue
import shutil
import threading
import traceback
from pathlib import Path
from typing import Any

from cadskin.errors import CadskinError, Cancelled
from cadskin.worker import PROTOCOL
from cadskin.worker.channel import Channel, Stage
from cadskin.worker.parts import PartMemory
from cadskin.worker.request import Request, RequestError, read_request
from cadskin.worker.results import versions
from cadskin.worker.tasks import Context, run_task

__all__ = ["Client", "run_job", "serve"]

_CHUNK = 65536
_OWN = "cadskin-job-"  # begin of the names of the workbench's job folders


def run_job(folder: Path, channel: Channel, client: Client, parts: PartMemory, job: str = "") -> bool:
    """Run the job in a folder, send how it ends, and return whether it succeeded.

    Parameters
    ----------
    folder : Path
    channel : Channel
    client : Client
        Who may cancel.
    parts : PartMemory
    job : str
        Its id, for the case that the request cannot be read.
    """
    try:
        request = read_request(folder)
        job = request.job or job
        values = _done(request, channel, client, parts)
    except Cancelled:
        channel.send("error", job=job, error="Cancelled", text="cancelled")
    except CadskinError as error:
        channel.send("error", job=job, error=type(error).__name__, text=str(error))
    except MemoryError:
        text = "there is not enough memory; take a larger mesh size or fewer instances"
        channel.send("error", job=job, error="MemoryError", text=text)
    except OSError as error:
        text = f"{error.strerror or error}: {error.filename or folder} (is the disk full?)"
        channel.send("error", job=job, error="OSError", text=text)
    except (
        Exception
    ) as error:  # the kernel's own, or a defect of ours: the client shows it, the worker lives on
        text = f"{type(error).__name__}: {error}"
        channel.send("error", job=job, error="InternalError", text=text, trace=traceback.format_exc())
    else:
        channel.send("done", job=job, **values)
        return True
    return False


def _done(request: Request, channel: Channel, client: Client, parts: PartMemory) -> dict[str, Any]:
    stage = Stage(channel, request.job, lambda: client.has_cancelled(request.job))
    return run_task(request, Context(stage, parts))


class Client:
    """The client at the other end of standard input: what it asks for, and whether it is still there.

    Parameters
    ----------
    descriptor : int
        Of standard input.
    """

    def __init__(self, descriptor: int = 0) -> None:
        self.jobs: queue.Queue[dict[str, Any] | None] = queue.Queue()
        self.folders: set[Path] = set()  # of jobs that have not ended
        self._cancelled: set[str] = set()
        self._descriptor = descriptor

    def listen(self) -> None:
        """Take lines until the client closes its end; then the process ends, so that no orphan works on.

        ``os.read`` it is: a thread that blocks in a buffered stream makes Python abort when it exits.
        """
        rest = b""
        while True:
            try:
                chunk = os.read(self._descriptor, _CHUNK)
            except OSError:
                chunk = b""
            if not chunk:
                self._remove_folders()
                os._exit(3)
            *lines, rest = (rest + chunk).split(b"\n")
            for line in lines:
                self._take(line)

    def start(self) -> Client:
        """Listen in a thread."""
        threading.Thread(target=self.listen, daemon=True).start()
        return self

    def has_cancelled(self, job: str) -> bool:
        """Tell whether the client has cancelled a job."""
        return job in self._cancelled

    def _take(self, line: bytes) -> None:
        try:
            message = json.loads(line)
        except ValueError:
            message = None
        if not isinstance(message, dict):
            return
        if "cancel" in message:
            self._cancelled.add(str(message["cancel"]))
        elif message.get("quit"):
            self.jobs.put(None)
        else:
            if isinstance(message.get("folder"), str):
                self.folders.add(Path(message["folder"]))
            self.jobs.put(message)

    def _remove_folders(self) -> None:
        """Remove what a client that was killed has left behind; only folders that are named as its own."""
        for folder in self.folders.copy():
            if folder.name.startswith(_OWN):
                shutil.rmtree(folder, ignore_errors=True)


def serve(channel: Channel, client: Client, *, idle: float) -> int:
    """Run the jobs that a client asks for, one after the other.

    Each line of standard input is a table: ``{"job": id, "folder": path}``, ``{"cancel": id}`` or
    ``{"quit": true}``.

    Parameters
    ----------
    channel : Channel
    client : Client
    idle : float
        Seconds without a job after which the worker ends.

    Returns
    -------
    int
        Exit code, 0.
    """
    parts = PartMemory()
    channel.send("ready", protocol=PROTOCOL, versions=versions(), pid=os.getpid())
    while True:
        try:
            message = client.jobs.get(timeout=idle)
        except queue.Empty:
            return 0
        if message is None:
            return 0
        job, folder = str(message.get("job", "")), message.get("folder")
        if not isinstance(folder, str):
            channel.send("error", job=job, error=RequestError.__name__, text="a job needs its folder")
            continue
        run_job(Path(folder), channel, client, parts, job)
        client.folders.discard(Path(folder))
