"""Check a skin model against the tolerances as they are now."""

from __future__ import annotations

from .. import api, jobs, skin
from ..command import QT_TRANSLATE_NOOP, Command
from ..selection import selected_skin, the_skin

__all__ = ["Check"]


class Check(Command):
    """Begin the check; the parts stay as they are."""

    name = "CadSkin_Check"
    menu = QT_TRANSLATE_NOOP("CadSkin_Check", "Check against tolerances")
    tip = QT_TRANSLATE_NOOP(
        "CadSkin_Check", "Evaluate the tolerances as they are now on the parts that were drawn"
    )
    icon = "check"

    def makes_sense(self) -> bool:
        """Tell whether there is a result that nothing works on."""
        found = selected_skin()
        return found is not None and skin.has_result(found) and jobs.job_of(found) is None

    def run(self) -> None:
        """Begin it, and show the table."""
        from ..panels import skin as panel

        found = the_skin()
        api.check(found, wait=False)
        panel.show(found)
