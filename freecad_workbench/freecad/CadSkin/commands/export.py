"""Export a skin model as a mesh file."""

from __future__ import annotations

import FreeCADGui

from .. import api, jobs, skin
from ..command import QT_TRANSLATE_NOOP, Command
from ..qt import QtWidgets, translate
from ..selection import selected_skin, the_skin

__all__ = ["Export"]


class Export(Command):
    """Ask for a file and write the part that is shown."""

    name = "CadSkin_Export"
    menu = QT_TRANSLATE_NOOP("CadSkin_Export", "Export mesh...")
    tip = QT_TRANSLATE_NOOP("CadSkin_Export", "Write the part that is shown to a mesh file")
    icon = "export"

    def makes_sense(self) -> bool:
        """Tell whether there is a result that nothing works on."""
        found = selected_skin()
        return found is not None and skin.has_result(found) and jobs.job_of(found) is None

    def run(self) -> None:
        """Ask and write."""
        found = the_skin()
        formats = ";;".join(f"{name.upper()} (*.{name})" for name in api.EXPORT_FORMATS)
        path, _ = QtWidgets.QFileDialog.getSaveFileName(
            FreeCADGui.getMainWindow(), translate(self.menu, self.name), f"{found.Label}.stl", formats
        )
        if path:
            api.export(found, path)
