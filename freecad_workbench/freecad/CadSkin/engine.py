"""Run jobs in the worker: one process that stays, jobs one after the other.

In the window the process is a `QProcess` and its messages arrive as events; without one it is a subprocess,
and `Job.wait` takes the messages in.
"""

from __future__ import annotations

import contextlib
import json
import time
import traceback
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any

import FreeCAD

from . import preferences
from .protocol import (
    PROTOCOL,
    JobError,
    clean_environment,
    new_folder,
    parse_message,
    remove_folder,
    serve_arguments,
    write_request,
)

__all__ = ["Engine", "Job", "engine", "submit"]

_GRACE = 2.0  # seconds that a cancelled job may take before its process is ended
_POLL = 0.05


class Job:
    """A job: its state, and how to cancel it.

    Attributes
    ----------
    state : str
        ``waiting``, ``running``, ``done``, ``failed`` or ``cancelled``.
    fraction, text
        Progress; of a failed job, what went wrong.
    error : str
        Kind of the error, see `protocol.JobError`.
    result : dict
        Content of ``result.json``.
    folder : Path
        It is removed after the last callback.
    """

    def __init__(self, owner: Engine, folder: Path, request: dict[str, Any]) -> None:
        self.id = uuid.uuid4().hex[:12]
        self.folder, self.request = folder, request
        self.state, self.fraction, self.text, self.error = "waiting", 0.0, "waiting", ""
        self.result: dict[str, Any] = {}
        self.on_progress: Callable[[Job, float, str], None] | None = None
        self.on_done: Callable[[Job, dict[str, Any]], None] | None = None
        self.on_error: Callable[[Job, str, str], None] | None = None
        self.cancel_time: float | None = None
        self.attempts = 0
        self.awaited = self.keep_folder = False
        self._engine = owner

    @property
    def finished(self) -> bool:
        """Whether it has ended, in whatever way."""
        return self.state in ("done", "failed", "cancelled")

    def cancel(self) -> None:
        """Ask the worker to stop; it is ended when it does not within two seconds."""
        self._engine.cancel(self)

    def wait(self, timeout: float | None = None) -> Job:
        """Wait until the job has ended; messages are taken in meanwhile.

        Raises
        ------
        JobError
            The time is over; the job goes on.
        """
        self.awaited = True
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self.finished:
            if deadline is not None and time.monotonic() > deadline:
                raise JobError("TimeOut", f"the job has not ended within {timeout:g} s")
            self._engine.pump(_POLL)
        return self

    def path(self, name: str) -> Path:
        """Return a file of the job folder."""
        return self.folder / name


class Engine:
    """A worker process and its jobs.

    Parameters
    ----------
    python : str, optional
        By default `preferences.find_worker` says.
    use_qt : bool, optional
        QProcess instead of a subprocess; by default where there is a window.
    """

    def __init__(self, python: str | None = None, *, use_qt: bool | None = None) -> None:
        self._python = python
        self._use_qt = bool(FreeCAD.GuiUp) if use_qt is None else use_qt
        self._jobs: dict[str, Job] = {}  # in the order of their submission
        self._process: Any = None
        self._ready = False
        self.versions: dict[str, Any] = {}

    # -- what callers use

    def submit(
        self,
        request: dict[str, Any],
        on_progress: Callable[[Job, float, str], None] | None = None,
        on_done: Callable[[Job, dict[str, Any]], None] | None = None,
        on_error: Callable[[Job, str, str], None] | None = None,
        *,
        prepare: Callable[[Path], None] | None = None,
    ) -> Job:
        """Start a job.

        Parameters
        ----------
        request : dict
            ``task`` and its options.
        on_progress : callable, optional
            Called with (job, fraction, text).
        on_done : callable, optional
            Called with (job, result) while the files of the job are still there.
        on_error : callable, optional
            Called with (job, kind, text), also for a cancelled job.
        prepare : callable, optional
            Writes further files into the folder that it gets, ``part.brep``.

        Raises
        ------
        JobError
            The files cannot be written, or there is no Python with cadskin: nothing has been started.
        """
        folder = new_folder()
        try:
            job = Job(self, folder, request)
            job.on_progress, job.on_done, job.on_error = on_progress, on_done, on_error
            _prepared(folder, prepare)
            write_request(folder, job.id, request)
            self._start()
        except BaseException:
            remove_folder(folder)
            raise
        self._jobs[job.id] = job
        if self._ready:
            self._send_job(job)
        return job

    @property
    def jobs(self) -> list[Job]:
        """Jobs that have not ended."""
        return list(self._jobs.values())

    @property
    def running(self) -> bool:
        """Whether there is a worker process."""
        return self._process is not None and self._process.alive()

    @property
    def process_id(self) -> int | None:
        """Id of the worker process."""
        return self._process.pid() if self._process is not None else None

    def cancel(self, job: Job) -> None:
        """Cancel a job; one that has not begun ends at once."""
        if job.finished or job.cancel_time is not None:
            return
        job.cancel_time = time.monotonic()
        self._write({"cancel": job.id})
        if job.state == "waiting":
            self._end(job, "cancelled", "Cancelled", "cancelled")
            return
        if self._use_qt:
            from .qt import QtCore

            QtCore.QTimer.singleShot(int(1000 * _GRACE), self._end_stubborn)

    def pump(self, timeout: float = 0.0) -> None:
        """Take in messages, waiting for them up to ``timeout`` seconds."""
        if self._process is not None:
            self._process.pump(timeout)
        elif timeout:
            time.sleep(timeout)
        self._end_stubborn()

    def close(self) -> None:
        """End the worker; jobs that have not ended fail."""
        process, self._process, self._ready = self._process, None, False
        if process is not None:
            process.close()
        for job in self.jobs:
            self._end(job, "cancelled", "Cancelled", "the worker was closed")

    # -- the process

    def _start(self) -> None:
        if self.running:
            return
        self._ready = False
        python = self._python or preferences.find_worker()
        make = _qt_process if self._use_qt else _plain_process
        self._process = make(python, serve_arguments(), clean_environment(), self._line, self._gone)

    def _write(self, message: dict[str, Any]) -> None:
        if self._process is not None:
            self._process.write(json.dumps(message).encode("utf-8") + b"\n")

    def _send_job(self, job: Job) -> None:
        job.attempts += 1
        self._write({"job": job.id, "folder": str(job.folder)})

    def _line(self, process: Any, line: bytes) -> None:
        message = parse_message(line)
        if message is None or process is not self._process:
            return
        if message["event"] == "ready":
            self._greeted(message)
            return
        job = self._jobs.get(str(message.get("job", "")))
        if job is not None:
            self._told(job, message)

    def _greeted(self, message: dict[str, Any]) -> None:
        self.versions = dict(message.get("versions", {}))
        if message.get("protocol") != PROTOCOL:
            text = (
                f"the worker speaks protocol {message.get('protocol')}, the workbench {PROTOCOL}: "
                "update cadskin or the workbench"
            )
            self._fail_all("ProtocolMismatch", text)
            return
        self._ready = True
        for job in self.jobs:
            self._send_job(job)

    def _told(self, job: Job, message: dict[str, Any]) -> None:
        event = message["event"]
        if event == "progress":
            job.state = "running"
            job.fraction, job.text = float(message.get("fraction", 0.0)), str(message.get("text", ""))
            _call(job.on_progress, job, job.fraction, job.text)
        elif event == "done":
            self._finish(job)
        elif event == "error":
            kind, text = str(message.get("error", "Error")), str(message.get("text", ""))
            if message.get("trace"):
                FreeCAD.Console.PrintLog(message["trace"])
            self._end(job, "cancelled" if kind == "Cancelled" else "failed", kind, text)

    def _finish(self, job: Job) -> None:
        try:
            job.result = json.loads(job.path("result.json").read_text(encoding="utf-8"))
        except (OSError, ValueError) as error:
            self._end(job, "failed", "DiskError", f"the result cannot be read: {error}")
            return
        if job.cancel_time is not None:
            self._end(job, "cancelled", "Cancelled", "cancelled")
            return
        self._end(job, "done", "", "")

    def _end(self, job: Job, state: str, kind: str, text: str) -> None:
        """End a job: tell the caller, remove its files."""
        self._jobs.pop(job.id, None)
        job.state, job.error, job.text = state, kind, text
        try:
            if state == "done":
                job.fraction = 1.0
                _call(job.on_done, job, job.result)
            else:
                _call(job.on_error, job, kind, text)
        finally:
            if not job.keep_folder:
                remove_folder(job.folder)
            if not self._jobs and not preferences.get("KeepWorker"):
                self._write({"quit": True})

    def _gone(self, process: Any, code: Any, printed: str, started: bool) -> None:
        """Handle the end of the process: the job it worked on has failed, those that wait begin anew."""
        if process is not self._process:
            return
        was_ready, self._process, self._ready = self._ready, None, False
        if not self._jobs:
            return
        last = (printed.strip().splitlines() or [""])[-1]
        if not started:
            self._fail_all("WorkerMissing", f"{process.python} cannot be started: {code}")
        elif not was_ready:
            preferences.forget_known()
            text = f"the worker did not start in {process.python}: {last or f'exit code {code}'}"
            self._fail_all("WorkerMissing", text)
        else:
            self._crashed(code, last)

    def _crashed(self, code: Any, last: str) -> None:
        for job in self.jobs:
            if job.cancel_time is not None:
                self._end(job, "cancelled", "Cancelled", "cancelled")
            elif job.state == "running" or job.attempts > 1:
                text = f"the worker ended unexpectedly (code {code})" + (f": {last}" if last else "")
                self._end(job, "failed", "WorkerCrashed", text)
        if self._jobs:  # they had not begun: a worker that was idle for long has ended
            try:
                self._start()
            except JobError as error:
                self._fail_all(error.kind, str(error))

    def _fail_all(self, kind: str, text: str) -> None:
        process, self._process, self._ready = self._process, None, False
        if process is not None:
            process.close()
        for job in self.jobs:
            self._end(job, "failed", kind, text)

    def _end_stubborn(self) -> None:
        """End the process of a job that was cancelled and goes on."""
        now = time.monotonic()
        late = [job for job in self.jobs if job.cancel_time is not None and now - job.cancel_time >= _GRACE]
        if late and self._process is not None:
            self._process.kill()


def _prepared(folder: Path, prepare: Callable[[Path], None] | None) -> None:
    if prepare is None:
        return
    try:
        prepare(folder)
    except OSError as error:
        raise JobError("DiskError", f"the job cannot be written: {error.strerror or error}") from error


def _call(function: Callable[..., None] | None, *arguments: Any) -> None:
    """Call back; an error there is shown and does not stop the engine."""
    if function is None:
        return
    try:
        function(*arguments)
    except Exception:
        FreeCAD.Console.PrintError("CadSkin: " + traceback.format_exc())


def _plain_process(*arguments: Any) -> Any:
    from .process_plain import PlainProcess

    return PlainProcess(*arguments)


def _qt_process(*arguments: Any) -> Any:
    from .process_qt import QtProcess

    return QtProcess(*arguments)


_engine: Engine | None = None


def engine() -> Engine:
    """Return the engine of this FreeCAD."""
    global _engine
    if _engine is None:
        _engine = Engine()
    return _engine


def close() -> None:
    """End the worker of this FreeCAD."""
    global _engine
    if _engine is not None:
        with contextlib.suppress(JobError):
            _engine.close()
    _engine = None


def submit(*arguments: Any, **options: Any) -> Job:
    """Start a job; see `Engine.submit`."""
    return engine().submit(*arguments, **options)
