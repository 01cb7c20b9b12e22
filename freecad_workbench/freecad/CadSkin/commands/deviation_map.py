"""Show or hide the deviation map."""

from __future__ import annotations

from ..command import QT_TRANSLATE_NOOP, Command
from ..selection import selected_skin, the_skin
from ..skin import has_result

__all__ = ["DeviationMap"]


class DeviationMap(Command):
    """Switch between the deviation colours and the plain mesh."""

    name = "CadSkin_DeviationMap"
    menu = QT_TRANSLATE_NOOP("CadSkin_DeviationMap", "Deviation map on/off")
    tip = QT_TRANSLATE_NOOP("CadSkin_DeviationMap", "Show the deviations as colours, or the plain mesh")
    icon = "deviation_map"
    shortcut = "T, M"

    def makes_sense(self) -> bool:
        """Tell whether there is a result."""
        found = selected_skin()
        return found is not None and has_result(found)

    def run(self) -> None:
        """Switch."""
        view_object = the_skin().ViewObject
        view_object.DeviationMap = not view_object.DeviationMap
        view_object.Visibility = True
