"""The child process in which the kernel may crash: ``python -m cadskin.cad._child FOLDER``.

It takes ``request.pickle`` from a private folder of its parent and leaves ``result.pickle`` there. Progress
goes line by line to its standard output; everything that the kernel prints goes to a file of that folder.
"""

from __future__ import annotations

import os
import pickle
import sys
import threading
import warnings
from importlib import import_module
from pathlib import Path
from typing import Any, TextIO

from cadskin.errors import CadskinError, CadskinWarning


def main(folder: Path) -> int:
    """Do the one job in ``folder`` and return the exit code."""
    _end_with_the_parent()
    channel = _private_output(folder / "output.txt")
    task, arguments, memory_limit = pickle.loads((folder / "request.pickle").read_bytes())
    _limit_memory(memory_limit)

    def progress(done: int, total: int) -> None:
        channel.write(f"{done} {total}\n")
        channel.flush()

    answer = _answer(task, arguments, progress)
    partial = folder / "result.partial"
    with partial.open("wb") as stream:
        pickle.dump(answer, stream, protocol=pickle.HIGHEST_PROTOCOL)
    partial.replace(folder / "result.pickle")
    return 0


def _answer(task: str, arguments: dict[str, Any], progress: Any) -> tuple[str, Any, list[str]]:
    """Return (``value`` | ``error``, what came out, warnings)."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", CadskinWarning)
        try:
            answer: tuple[str, Any] = ("value", _work(task, arguments, progress))
        except CadskinError as error:
            answer = ("error", (type(error).__name__, str(error)))
        except MemoryError:
            answer = ("memory", None)
        except Exception as error:  # the kernel's own, or a defect of ours: the parent names the file
            answer = ("failure", f"{type(error).__name__}: {' '.join(str(error).split())[:300]}")
    told = [str(w.message) for w in caught if issubclass(w.category, CadskinWarning)]
    return (*answer, told)


def _work(task: str, arguments: dict[str, Any], progress: Any) -> Any:
    if task == "nominals":
        from cadskin.cad.discretise import nominal, nominals

        options = dict(arguments)
        path, part = options.pop("path"), options.pop("part", None)
        if part is not None:
            return (nominal(path, part=part, progress=progress, **options),)
        return nominals(path, progress=progress, **options)
    if task == "describe":
        from cadskin.cad.describing import describe_file

        return describe_file(arguments["path"], progress=progress)
    raise ValueError(f"unknown task {task!r}")


def _end_with_the_parent() -> None:
    """Leave when the parent's end of our standard input closes: no orphan goes on working."""

    def wait() -> None:
        sys.stdin.buffer.read()
        os._exit(3)

    threading.Thread(target=wait, daemon=True).start()


def _private_output(log: Path) -> TextIO:
    """Return a stream to the parent, and send everything else that is printed to a file."""
    channel = os.fdopen(os.dup(1), "w", encoding="ascii")
    target = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    os.dup2(target, 1)
    os.dup2(target, 2)
    os.close(target)
    return channel


def _limit_memory(limit: int | None) -> None:
    """Bound the memory [bytes] where the platform can; the kernel is loaded first, it always has room."""
    if limit is None:
        return
    import_module("cadskin.cad.describing")
    try:
        import resource
    except ImportError:  # Windows has no such limit; the time limit still holds
        return
    kind = resource.RLIMIT_DATA if sys.platform == "linux" else resource.RLIMIT_AS
    resource.setrlimit(kind, (limit, limit))


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
