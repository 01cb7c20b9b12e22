"""Read deviations with the mouse."""

from __future__ import annotations

from ..command import QT_TRANSLATE_NOOP, Command
from ..probe import active_probe, start_probe, stop_probe
from ..selection import selected_skin, the_skin
from ..skin import has_result

__all__ = ["ProbeValue"]


class ProbeValue(Command):
    """Begin to read values by clicks, or end it."""

    name = "CadSkin_Probe"
    menu = QT_TRANSLATE_NOOP("CadSkin_Probe", "Probe value")
    tip = QT_TRANSLATE_NOOP(
        "CadSkin_Probe", "A click on the skin model shows the deviation there; again, or Escape, ends it"
    )
    icon = "probe"
    shortcut = "T, V"

    def makes_sense(self) -> bool:
        """Tell whether there is a result to read, or a probe to put away."""
        found = selected_skin()
        return active_probe() is not None or (found is not None and has_result(found))

    def run(self) -> None:
        """Begin, or end."""
        if active_probe() is not None:
            stop_probe()
        else:
            start_probe(the_skin())
