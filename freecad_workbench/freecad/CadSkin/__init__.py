"""The CadSkin workbench: made parts with their deviations in FreeCAD.

This package runs in FreeCAD's own Python: standard library, numpy and FreeCAD modules only. The work is
done by ``python -m cadskin.worker`` in another Python; see DESIGN.md, "The FreeCAD workbench".
"""

__version__ = "0.1.0"
