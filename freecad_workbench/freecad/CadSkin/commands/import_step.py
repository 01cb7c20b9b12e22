"""Import a STEP file with its tolerances."""

from __future__ import annotations

from typing import Any

import FreeCAD
import FreeCADGui

from .. import import_step
from ..command import QT_TRANSLATE_NOOP, Command, tell
from ..qt import QtWidgets, translate

__all__ = ["ImportStep"]


class ImportStep(Command):
    """Import parts, tolerances and datums."""

    name = "CadSkin_ImportStep"
    menu = QT_TRANSLATE_NOOP("CadSkin_ImportStep", "Import STEP with tolerances...")
    tip = QT_TRANSLATE_NOOP(
        "CadSkin_ImportStep", "Import a STEP file with the tolerances and datums that it holds (AP242)"
    )
    icon = "import_step"

    def IsActive(self) -> bool:
        """Say yes: a document is made where none is open."""
        return True

    def run(self) -> None:
        """Ask for a file and begin the import."""
        path, _ = QtWidgets.QFileDialog.getOpenFileName(
            FreeCADGui.getMainWindow(), translate(self.menu, self.name), "", "STEP (*.step *.stp *.p21)"
        )
        if path:
            start(path)


def start(path: str) -> Any:
    """Begin the import of a file into the active document; its parts are shown when it is done."""
    document = FreeCAD.ActiveDocument or FreeCAD.newDocument()
    name = document.Name

    def done(parts: list[Any]) -> None:
        if FreeCADGui.ActiveDocument is not None and FreeCADGui.ActiveDocument.Document.Name == name:
            FreeCADGui.SendMsgToActiveView("ViewFit")
        FreeCAD.Console.PrintMessage(f"CadSkin: {len(parts)} parts imported from {path}\n")

    return import_step.start_import(document, path, done, lambda _kind, text: tell(text))
