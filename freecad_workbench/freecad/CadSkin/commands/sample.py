"""Draw several parts of a skin model."""

from __future__ import annotations

from .. import jobs
from ..command import QT_TRANSLATE_NOOP, Command
from ..selection import selected_skin, the_skin

__all__ = ["Sample"]


class Sample(Command):
    """Open the panel of the instances."""

    name = "CadSkin_Sample"
    menu = QT_TRANSLATE_NOOP("CadSkin_Sample", "Sample several instances")
    tip = QT_TRANSLATE_NOOP(
        "CadSkin_Sample", "Draw several parts, go through them, see how their values spread"
    )
    icon = "sample"

    def makes_sense(self) -> bool:
        """Tell whether there is a skin model that is not being computed."""
        found = selected_skin()
        return found is not None and jobs.job_of(found) is None

    def run(self) -> None:
        """Open the panel."""
        from ..panels import instances as panel

        panel.show(the_skin())
