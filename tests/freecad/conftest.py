"""Paths: the helpers of this folder, and the workbench package as ``CadSkin`` without FreeCAD around it."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
for folder in (HERE, HERE.parents[1] / "freecad_workbench" / "freecad"):
    if str(folder) not in sys.path:
        sys.path.append(str(folder))
