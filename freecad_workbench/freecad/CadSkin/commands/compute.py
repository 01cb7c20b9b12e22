"""Compute a skin model."""

from __future__ import annotations

from .. import api, jobs
from ..command import QT_TRANSLATE_NOOP, Command
from ..selection import selected_skin, the_skin

__all__ = ["Compute"]


class Compute(Command):
    """Begin the computation; the window stays free."""

    name = "CadSkin_Compute"
    menu = QT_TRANSLATE_NOOP("CadSkin_Compute", "Compute")
    tip = QT_TRANSLATE_NOOP("CadSkin_Compute", "Compute the skin model in the background")
    icon = "compute"
    shortcut = "T, C"

    def makes_sense(self) -> bool:
        """Tell whether there is a skin model that is not being computed."""
        found = selected_skin()
        return found is not None and jobs.job_of(found) is None

    def run(self) -> None:
        """Begin it."""
        api.compute(the_skin(), wait=False)
