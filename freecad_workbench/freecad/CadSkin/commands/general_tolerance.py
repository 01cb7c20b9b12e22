"""Set the general tolerance of a part."""

from __future__ import annotations

import FreeCADGui

from .. import api
from ..command import QT_TRANSLATE_NOOP, Command
from ..general_tolerance import general_of
from ..qt import QtWidgets, translate
from ..selection import the_part

__all__ = ["GeneralTolerance"]

_VALUE = 0.2  # mm, until the user gives one


class GeneralTolerance(Command):
    """Ask for the value of the tolerance of all faces that have none of their own."""

    name = "CadSkin_GeneralTolerance"
    menu = QT_TRANSLATE_NOOP("CadSkin_GeneralTolerance", "General tolerance...")
    tip = QT_TRANSLATE_NOOP(
        "CadSkin_GeneralTolerance", "Set the tolerance of all faces that have none of their own"
    )
    icon = "general_tolerance"

    def run(self) -> None:
        """Ask and set."""
        part = the_part()
        known = general_of(part)
        value, agreed = QtWidgets.QInputDialog.getDouble(
            FreeCADGui.getMainWindow(),
            translate(self.menu, self.name),
            translate("Profile of any surface [mm]"),
            known.Value.Value if known is not None else _VALUE,
            0.0001,
            1000.0,
            4,
        )
        if agreed:
            api.general_tolerance(part, value)
