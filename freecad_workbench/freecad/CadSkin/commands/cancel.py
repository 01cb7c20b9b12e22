"""Cancel a computation."""

from __future__ import annotations

from .. import api, jobs
from ..command import QT_TRANSLATE_NOOP, Command
from ..selection import selected_skin, the_skin

__all__ = ["Cancel"]


class Cancel(Command):
    """Cancel the computation of the skin model."""

    name = "CadSkin_Cancel"
    menu = QT_TRANSLATE_NOOP("CadSkin_Cancel", "Cancel")
    tip = QT_TRANSLATE_NOOP("CadSkin_Cancel", "Cancel the computation of the skin model")
    icon = "cancel"

    def makes_sense(self) -> bool:
        """Tell whether one is going on."""
        found = selected_skin()
        return found is not None and jobs.job_of(found) is not None

    def run(self) -> None:
        """Cancel it."""
        api.cancel(the_skin())
