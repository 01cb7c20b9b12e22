"""Create a skin model of a part."""

from __future__ import annotations

from .. import api
from ..command import QT_TRANSLATE_NOOP, Command
from ..selection import the_part

__all__ = ["CreateSkin"]


class CreateSkin(Command):
    """Create a skin model with all tolerances of the part, and open its panel."""

    name = "CadSkin_CreateSkin"
    menu = QT_TRANSLATE_NOOP("CadSkin_CreateSkin", "Create skin model")
    tip = QT_TRANSLATE_NOOP("CadSkin_CreateSkin", "Create a model of the part as it could be made")
    icon = "skin"
    shortcut = "T, S"

    def run(self) -> None:
        """Create it."""
        from ..panels import skin as panel

        panel.show(api.create_skin(the_part()))
