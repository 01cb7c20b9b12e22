"""Progress and cancelling of long work."""

from __future__ import annotations

from cadskin._typing import Progress
from cadskin.errors import Cancelled


def report(progress: Progress | None, done: int, total: int) -> None:
    """Tell ``progress`` how far the work is; stop it when the function returns False.

    Raises
    ------
    Cancelled
        The caller asked to stop.
    """
    if progress is not None and progress(done, total) is False:
        raise Cancelled(f"stopped by the caller after {done} of {total} steps")
