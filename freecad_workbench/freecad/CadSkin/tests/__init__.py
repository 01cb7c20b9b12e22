"""Tests that run in FreeCAD without a window: ``freecadcmd -t freecad.CadSkin.tests``.

The worker's Python is that of the preferences, or of the variable CADSKIN_WORKER_PYTHON.
"""

from __future__ import annotations

import unittest
from pathlib import Path


def load_tests(
    loader: unittest.TestLoader, _standard: unittest.TestSuite, _pattern: object
) -> unittest.TestSuite:
    """Load all modules of this folder that are called ``test_*``."""
    suite = unittest.TestSuite()
    for path in sorted(Path(__file__).parent.glob("test_*.py")):
        suite.addTests(loader.loadTestsFromName(f"{__name__}.{path.stem}"))
    return suite
