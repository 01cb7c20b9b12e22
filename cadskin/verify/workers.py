"""Verification of a population in several processes: each gets the nominal part once and then its share.

Processes are started by ``python -m cadskin.verify.workers`` and spoken to over pipes, so that a script needs
no ``if __name__ == "__main__"``, and results do not depend on their number.
"""

from __future__ import annotations

import pickle
import queue
import subprocess
import sys
import threading
from dataclasses import dataclass
from typing import TYPE_CHECKING, BinaryIO, cast

from cadskin._progress import report
from cadskin.errors import CadskinError, SpecificationError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Progress
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification
    from cadskin.verify.datums import Standard
    from cadskin.verify.results import Verification

__all__ = ["verified_parts"]


@dataclass(frozen=True, eq=False)
class _Job:
    """What a process needs: the part, what is asked of it, and the fields (k, n_c) of its share."""

    nominal: NominalModel
    spec: Specification
    standard: Standard
    sections: int
    numbers: tuple[int, ...]
    fields: Floats


def verified_parts(
    nominal: NominalModel,
    spec: Specification,
    deviations: Floats,
    *,
    standard: Standard,
    sections: int,
    workers: int,
    progress: Progress | None = None,
) -> list[Verification]:
    """Return the verification of every part of a population, in order.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification
        Bound to the part.
    deviations : (N, n_c) float
    standard, sections
        As for `verify`.
    workers : int
        Processes, one or more.
    progress : callable, optional

    Raises
    ------
    SpecificationError
        Less than one worker.
    CadskinError
        A process ended before its share was done.
    """
    if workers < 1:
        raise SpecificationError(f"workers must be 1 or more, got {workers}")
    shares = [range(first, len(deviations), workers) for first in range(min(workers, len(deviations)))]
    jobs = [_Job(nominal, spec, standard, sections, tuple(share), deviations[share]) for share in shares]
    results: queue.Queue[tuple[int, Verification | BaseException]] = queue.Queue()
    processes = [_started() for _ in jobs]
    try:
        for process, job in zip(processes, jobs, strict=True):
            threading.Thread(target=_serve, args=(process, job, results), daemon=True).start()
        return _collected(results, len(deviations), progress)
    finally:
        for process in processes:
            process.kill()
            process.wait()
            for stream in (process.stdin, process.stdout):
                if stream is not None:
                    stream.close()


def _started() -> subprocess.Popen[bytes]:
    command = [sys.executable, "-m", "cadskin.verify.workers"]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)


def _collected(
    results: queue.Queue[tuple[int, Verification | BaseException]], count: int, progress: Progress | None
) -> list[Verification]:
    found: dict[int, Verification] = {}
    while len(found) < count:
        number, result = results.get()
        if isinstance(result, BaseException):
            raise result
        found[number] = result
        report(progress, len(found), count)
    return [found[number] for number in range(count)]


def _serve(
    process: subprocess.Popen[bytes],
    job: _Job,
    results: queue.Queue[tuple[int, Verification | BaseException]],
) -> None:
    """Send a job to its process and pass on what comes back."""
    try:
        data_in, data_out = cast("BinaryIO", process.stdin), cast("BinaryIO", process.stdout)
        pickle.dump(job, data_in)
        data_in.flush()
        for _ in job.numbers:
            results.put(pickle.load(data_out))
    except (OSError, EOFError, pickle.UnpicklingError, ValueError) as error:
        reason = CadskinError(
            f"a process of the verification ended (exit code {process.poll()}); run with workers=1"
        )
        reason.__cause__ = error
        results.put((-1, reason))


def main() -> None:
    """Evaluate the parts of a job from the standard input."""
    from cadskin.skin import SkinModel
    from cadskin.verify.prepared import prepare

    job = pickle.load(sys.stdin.buffer)
    prepared = prepare(job.nominal, job.spec, standard=job.standard, sections=job.sections)
    for number, field in zip(job.numbers, job.fields, strict=True):
        found = prepared.evaluate(SkinModel(job.nominal, field))
        pickle.dump((number, found), sys.stdout.buffer)
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    # The job was pickled by the module of this name, not by ``__main__``.
    from cadskin.verify import workers

    workers.main()
