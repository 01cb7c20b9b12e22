"""The workbench in FreeCAD's window."""

from __future__ import annotations

import contextlib
from importlib import import_module
from pathlib import Path

import FreeCAD
import FreeCADGui

_HERE = Path(__file__).resolve().parent

# Module of `commands` and class, in the order of the toolbar; None is a separator.
COMMANDS: tuple[tuple[str, str] | None, ...] = (
    ("import_step", "ImportStep"),
    None,
    ("add_tolerance", "AddTolerance"),
    ("add_datum", "AddDatum"),
    ("general_tolerance", "GeneralTolerance"),
    ("accept_faces", "AcceptFaces"),
    ("accept_faces", "FindFaces"),
    None,
    ("create_skin", "CreateSkin"),
    ("compute", "Compute"),
    ("cancel", "Cancel"),
    ("check", "Check"),
    ("sample", "Sample"),
    None,
    ("deviation_map", "DeviationMap"),
    ("color_map", "Exaggeration"),
    ("color_map", "MapSettings"),
    ("probe", "ProbeValue"),
    None,
    ("export", "Export"),
)


def register_commands() -> list[str]:
    """Make the commands known to FreeCAD and return their names, separators included."""
    names = []
    for item in COMMANDS:
        if item is None:
            names.append("Separator")
            continue
        module, class_name = item
        command = getattr(import_module(f"freecad.CadSkin.commands.{module}"), class_name)()
        FreeCADGui.addCommand(command.name, command)
        names.append(command.name)
    return names


class CadSkinWorkbench(FreeCADGui.Workbench):
    """Made parts: tolerances, skin models, deviation maps."""

    MenuText = "CadSkin"
    ToolTip = "Parts as they are made: tolerances, skin models, deviations"
    Icon = str(_HERE / "resources" / "icons" / "workbench.svg")

    def GetClassName(self) -> str:
        """Return the class that FreeCAD makes it with."""
        return "Gui::PythonWorkbench"

    def Initialize(self) -> None:
        """Fill toolbar and menu."""
        names = register_commands()
        self.appendToolbar("CadSkin", names)
        self.appendMenu("CadSkin", names)

    def Activated(self) -> None:
        """Do nothing more: the worker starts with the first job."""

    def Deactivated(self) -> None:
        """Let jobs go on: another workbench may be used meanwhile."""


def _close_worker() -> None:
    from freecad.CadSkin import engine

    engine.close()


def _add_preferences() -> None:
    from freecad.CadSkin.preferences_page import PreferencesPage

    FreeCADGui.addIconPath(str(_HERE / "resources" / "icons"))
    FreeCADGui.addPreferencePage(PreferencesPage, "CadSkin")


def _watch_the_end() -> None:
    """End the worker with the window; should that fail, it notices itself that FreeCAD is gone."""
    from freecad.CadSkin.qt import QtCore

    application = QtCore.QCoreApplication.instance()
    if application is not None:
        application.aboutToQuit.connect(_close_worker)


FreeCADGui.addLanguagePath(str(_HERE / "resources" / "translations"))
_add_preferences()
with contextlib.suppress(ImportError):  # without Qt's shim there is no window to watch
    _watch_the_end()
FreeCADGui.addWorkbench(CadSkinWorkbench())
FreeCAD.Console.PrintLog("CadSkin: workbench loaded\n")
