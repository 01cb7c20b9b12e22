"""Make the faces that are picked a datum."""

from __future__ import annotations

from .. import api
from ..command import QT_TRANSLATE_NOOP, Command
from ..selection import has_faces, selected_faces

__all__ = ["AddDatum"]


class AddDatum(Command):
    """Make a datum with the next free letter."""

    name = "CadSkin_AddDatum"
    menu = QT_TRANSLATE_NOOP("CadSkin_AddDatum", "Add datum")
    tip = QT_TRANSLATE_NOOP("CadSkin_AddDatum", "Make the faces that are picked a datum")
    icon = "datum"
    shortcut = "T, D"

    def makes_sense(self) -> bool:
        """Tell whether faces are picked."""
        return has_faces()

    def run(self) -> None:
        """Make it."""
        api.add_datum(*selected_faces())
