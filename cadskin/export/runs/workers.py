"""Several processes draw the parts of one run; each part depends on the seed and its number alone.

A worker is this module run by the same Python: it gets the sampler's ingredients once, then numbers of parts,
and gives parts back. It lives as long as its standard input is open, so none outlives its caller.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from cadskin import errors
from cadskin.conform.simulate import prepare_conforming
from cadskin.errors import CadskinError, ExportError
from cadskin.skin.simulate import child_seed

if TYPE_CHECKING:
    from numpy.random import SeedSequence

    from cadskin.conform.simulate import ConformingSampler, Made

__all__ = ["Job", "Workers", "workers_of"]

_GROUP = 4  # parts that a worker draws at a time, at most


@dataclass(frozen=True, eq=False)
class Job:
    """What a worker needs to draw any part of a run.

    Parameters
    ----------
    arguments : dict
        Of `cadskin.conform.prepare_conforming`.
    seed : SeedSequence
        Of the run.
    check : bool
        Look for inverted and intersecting triangles; parts that have some are drawn anew.
    """

    arguments: dict[str, Any]
    seed: SeedSequence
    check: bool

    def prepared(self) -> ConformingSampler:
        """Return the sampler."""
        return prepare_conforming(**self.arguments)

    def draw(self, sampler: ConformingSampler, numbers: Sequence[int]) -> Iterator[Made]:
        """Yield the parts of these numbers, checked."""
        seeds = [child_seed(self.seed, number) for number in numbers]
        for number, seed, made in zip(numbers, seeds, sampler.draw_all(seeds), strict=True):
            yield sampler.sound(made, seed, f"part {number}") if self.check else made


class Workers:
    """Running worker processes; see `workers_of`."""

    def __init__(self, processes: Sequence[subprocess.Popen[bytes]]) -> None:
        self._processes = tuple(processes)
        self._threads: list[threading.Thread] = []

    def draw(self, numbers: Sequence[int], done: Callable[[int], None]) -> list[Made]:
        """Return the parts of these numbers in their order.

        Parameters
        ----------
        numbers : sequence of int
        done : callable
            Gets the count of finished parts; what it raises stops the work.
        """
        size = max(1, min(_GROUP, -(-len(numbers) // len(self._processes))))
        groups = [numbers[k : k + size] for k in range(0, len(numbers), size)]
        waiting: queue.SimpleQueue[int] = queue.SimpleQueue()
        answers: queue.SimpleQueue[tuple[int, Any]] = queue.SimpleQueue()
        for index in range(len(groups)):
            waiting.put(index)
        self.join()
        for process in self._processes:
            thread = threading.Thread(target=_serve, args=(process, groups, waiting, answers), daemon=True)
            thread.start()
            self._threads.append(thread)
        found: dict[int, list[Made]] = {}
        while len(found) < len(groups):
            index, answer = answers.get()
            if isinstance(answer, Exception):
                raise answer
            found[index] = answer
            done(sum(len(made) for made in found.values()))
        return [made for index in sorted(found) for made in found[index]]

    def join(self) -> None:
        """Wait for the threads that talk to the processes."""
        for thread in self._threads:
            thread.join()
        self._threads.clear()


@contextmanager
def workers_of(job: Job, count: int) -> Iterator[Workers]:
    """Start workers for a job; they end with the block.

    Raises
    ------
    ExportError
        The model cannot be sent to another process (a function in it, for instance).
    """
    try:
        request = pickle.dumps(job)
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        raise ExportError(f"the model cannot be sent to other processes ({error}); use one worker") from error
    home = str(Path(__file__).resolve().parents[3])
    paths = os.pathsep.join([home, *filter(None, [os.environ.get("PYTHONPATH")])])
    processes: list[subprocess.Popen[bytes]] = []
    workers = None
    try:
        for _ in range(count):
            process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import main; main()"],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                env={**os.environ, "PYTHONPATH": paths},
            )
            processes.append(process)
            _send(process, request)
        workers = Workers(processes)
        yield workers
    finally:
        for process in processes:
            process.kill()
            process.wait()
        if workers is not None:
            workers.join()
        for process in processes:
            _close(process)


def _serve(
    process: subprocess.Popen[bytes],
    groups: Sequence[Sequence[int]],
    waiting: queue.SimpleQueue[int],
    answers: queue.SimpleQueue[tuple[int, Any]],
) -> None:
    """Give a worker one group after the other, and pass its answers on."""
    while True:
        try:
            index = waiting.get_nowait()
        except queue.Empty:
            return
        try:
            _send(process, pickle.dumps(list(groups[index])))
            assert process.stdout is not None
            kind, value = _receive(process.stdout)
        except (OSError, EOFError):
            answers.put(
                (index, CadskinError(f"a worker ended with code {process.wait()}; use fewer of them"))
            )
            return
        answers.put((index, value if kind == "made" else _revived(kind, value)))
        if kind != "made":
            return


def _revived(kind: str, text: str) -> Exception:
    """Return the error that a worker told of."""
    found = getattr(errors, kind, None)
    return found(text) if found is not None else RuntimeError(f"{kind} in a worker: {text}")


def _close(process: subprocess.Popen[bytes]) -> None:
    for stream in (process.stdin, process.stdout):
        if stream is not None:
            with suppress(BrokenPipeError):  # it was killed with a request unread
                stream.close()


def _send(process: subprocess.Popen[bytes], data: bytes) -> None:
    assert process.stdin is not None
    process.stdin.write(len(data).to_bytes(8, "little") + data)
    process.stdin.flush()


def _receive(stream: BinaryIO | Any) -> Any:
    head = stream.read(8)
    if len(head) < 8:
        raise EOFError
    size = int.from_bytes(head, "little")
    data = stream.read(size)
    if len(data) < size:
        raise EOFError
    return pickle.loads(data)


def main() -> None:
    """Draw parts as asked on standard input until it closes."""
    import traceback
    import warnings

    warnings.simplefilter("ignore")  # the caller said them already
    requests, replies = sys.stdin.buffer, os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # whatever prints does not spoil the replies
    try:
        job: Job = _receive(requests)
        sampler = None
        while True:
            numbers = _receive(requests)
            try:
                sampler = job.prepared() if sampler is None else sampler
                answer: tuple[str, Any] = ("made", list(job.draw(sampler, numbers)))
            except CadskinError as error:
                answer = (type(error).__name__, str(error))
            except Exception as error:  # told to the caller, who raises it
                answer = (type(error).__name__, f"{error}\n{traceback.format_exc()}")
            data = pickle.dumps(answer)
            replies.write(len(data).to_bytes(8, "little") + data)
            replies.flush()
    except (EOFError, BrokenPipeError):  # the caller is gone
        return
