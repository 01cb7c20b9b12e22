"""A panel of a skin model that follows its jobs."""

from __future__ import annotations

from typing import Any

from .. import jobs
from ..qt import QtWidgets
from .base import Panel, alive

__all__ = ["JobPanel"]


class JobPanel(Panel):
    """Has a progress bar, and is refreshed whenever the state of a job of its skin model changes."""

    def __init__(self, obj: Any) -> None:
        super().__init__()
        self.obj, self.document = obj, obj.Document
        self.bar = QtWidgets.QProgressBar()
        self.bar.setRange(0, 100)
        self.build()
        jobs.listen(self._job_changed)
        self.refresh()

    def build(self) -> None:
        """Add the widgets."""
        raise NotImplementedError

    def show_state(self, busy: bool) -> None:
        """Show the skin model as it is; `busy` while a job works on it."""
        raise NotImplementedError

    def refresh(self) -> None:
        """Show the skin model as it is, if it is still there."""
        if not alive(self.obj):
            return
        job = jobs.job_of(self.obj)
        self.bar.setVisible(job is not None)
        if job is not None:
            self.bar.setValue(round(100 * job.fraction))
        self.show_state(job is not None)

    def shown_of(self, size: int) -> int:
        """Return which of some instances the mesh shows."""
        return min(max(self.obj.ShownInstance, 0), size - 1)

    def _job_changed(self, obj: Any) -> None:
        if alive(self.obj) and obj == self.obj:
            self.refresh()

    def closed(self) -> None:
        """Listen no more."""
        jobs.unlisten(self._job_changed)
