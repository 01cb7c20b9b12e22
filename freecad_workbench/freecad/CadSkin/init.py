"""Run by FreeCAD at its start, with a window or without: make the tests known to its test runner."""

import FreeCAD

if hasattr(FreeCAD, "__unit_test__"):
    FreeCAD.__unit_test__ += ["freecad.CadSkin.tests"]
