"""Open the panel of the deviation map."""

from __future__ import annotations

from ..command import QT_TRANSLATE_NOOP, Command
from ..selection import selected_skin, the_skin
from ..skin import has_result

__all__ = ["Exaggeration", "MapSettings"]


class MapSettings(Command):
    """Range, bands, palette and legend."""

    name = "CadSkin_ColorMap"
    menu = QT_TRANSLATE_NOOP("CadSkin_ColorMap", "Colours and legend...")
    tip = QT_TRANSLATE_NOOP("CadSkin_ColorMap", "Range, bands, palette and legend of the deviation map")
    icon = "color_map"
    focus = "mode"

    def makes_sense(self) -> bool:
        """Tell whether there is a result."""
        found = selected_skin()
        return found is not None and has_result(found)

    def run(self) -> None:
        """Open the panel."""
        from ..panels import color_map as panel

        panel.show(the_skin(), focus=self.focus)


class Exaggeration(MapSettings):
    """The same panel, with the keyboard at the exaggeration."""

    name = "CadSkin_Exaggeration"
    menu = QT_TRANSLATE_NOOP("CadSkin_Exaggeration", "Exaggeration...")
    tip = QT_TRANSLATE_NOOP("CadSkin_Exaggeration", "Draw deviations up to 1000 times larger")
    icon = "exaggeration"
    shortcut = "T, X"
    focus = "slider"
