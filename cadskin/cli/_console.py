"""What the commands say and how: results on standard output, everything else on standard error."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["failure", "note", "print_json", "print_table", "progress_bar", "status"]

TITLE = "cadskin"
UNLIMITED = 10_000  # columns


def _console(*, stderr: bool) -> Console:
    from rich.console import Console

    return Console(stderr=stderr, highlight=False, soft_wrap=True)


def note(text: str) -> None:
    """Write one line to standard error."""
    print(f"{TITLE}: {text}", file=sys.stderr)  # noqa: T201


def failure(text: str, code: int) -> int:
    """Write why the command stops, in one line, and return the exit code ``code``."""
    note(" ".join(text.split()))
    return code


def print_json(value: Any) -> None:
    """Write a value as JSON to standard output; numpy scalars and arrays are welcome, NaN becomes null."""
    text = json.dumps(_plain(value), indent=2, ensure_ascii=False, allow_nan=False)
    print(text)  # noqa: T201


def print_table(
    title: str, columns: Sequence[str], rows: Sequence[Sequence[object]], *, right: Sequence[str] = ()
) -> None:
    """Write a table to standard output; columns named in ``right`` are aligned to the right."""
    from rich import box
    from rich.measure import Measurement
    from rich.table import Table
    from rich.text import Text

    console = _console(stderr=False)
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for column in columns:
        table.add_column(column, justify="right" if column in right else "left", overflow="fold")
    for row in rows:
        table.add_row(*(Text(str(cell)) for cell in row))
    if not console.is_terminal:  # a file or a pipe has no width: never fold a cell there
        console.width = Measurement.get(console, console.options.update(width=UNLIMITED), table).maximum
    console.print(table)


@contextmanager
def status(text: str) -> Iterator[None]:
    """Show what is going on while the block runs; only a terminal sees it."""
    console = _console(stderr=True)
    if console.is_terminal:
        with console.status(text):
            yield
    else:
        yield


@contextmanager
def progress_bar(text: str) -> Iterator[Callable[[int, int], None]]:
    """Show a bar on a terminal while the block runs; yields the ``progress`` function of the library."""
    from rich.progress import Progress

    console = _console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(text, total=None)

        def progress(done: int, total: int) -> None:
            bar.update(task, completed=done, total=total)

        yield progress


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if hasattr(value, "tolist"):  # numpy
        return _plain(value.tolist())
    if isinstance(value, float):
        return value if abs(value) < float("inf") else None
    if value is None or isinstance(value, bool | int | str):
        return value
    return str(value)
