"""What all commands share: resources, when they can be used, how errors are told."""

from __future__ import annotations

from typing import Any

import FreeCAD
import FreeCADGui

from .faces import InputError
from .icons import icon_path
from .protocol import JobError
from .qt import QtCore, QtWidgets, translate

__all__ = ["QT_TRANSLATE_NOOP", "Command", "tell"]


def QT_TRANSLATE_NOOP(_context: str, text: str) -> str:  # the name that lupdate looks for
    """Mark a text for translation; the context is the name of the command."""
    return text


def tell(text: str) -> None:
    """Show a message to the user."""
    FreeCAD.Console.PrintWarning(f"CadSkin: {text}\n")
    QtWidgets.QMessageBox.warning(FreeCADGui.getMainWindow(), "CadSkin", text)


def _undecided() -> bool:
    """Tell whether a panel of ours waits for OK or Cancel: its transaction is open."""
    from .panels.base import current

    panel = current()
    return panel is not None and panel.decides


def _settle() -> None:
    from .panels.base import settle

    settle()


class Command:
    """A command of the workbench; subclasses say what it is called and what it does."""

    name = ""
    menu = ""
    tip = ""
    icon = ""
    shortcut = ""

    def GetResources(self) -> dict[str, Any]:
        """Return texts and icon."""
        found = {
            "MenuText": translate(self.menu, self.name),
            "ToolTip": translate(self.tip, self.name),
            "Pixmap": icon_path(self.icon),
        }
        if self.shortcut:
            found["Accel"] = self.shortcut
        return found

    def IsActive(self) -> bool:
        """Tell whether the command makes sense now."""
        return FreeCAD.ActiveDocument is not None and not _undecided() and self.makes_sense()

    def Activated(self, _index: int = 0) -> None:
        """Run the command; what goes wrong is told."""
        alone = FreeCAD.getActiveTransaction() is None
        try:
            self.run()
        except (InputError, JobError) as error:
            tell(str(error))
        if alone:
            QtCore.QTimer.singleShot(0, _settle)

    def makes_sense(self) -> bool:
        """Tell whether it makes sense in a document that is open; looked at often, so it must be quick."""
        return True

    def run(self) -> None:
        """Do it."""
        raise NotImplementedError
