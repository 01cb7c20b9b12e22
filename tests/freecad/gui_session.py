"""Run by FreeCAD with a window: the tests of ``gui/``, a result file, and the end of the process.

A failure inside a timer callback would leave FreeCAD running for ever, so everything is caught and
written, and a watchdog that needs no Python thread ends the process with the stacks of all threads.
"""

import faulthandler
import json
import os
import sys
import time
import traceback
import unittest
from pathlib import Path

import FreeCAD
from PySide import QtCore

HERE = Path(os.path.abspath(FreeCAD.__file__ if "__file__" not in globals() else __file__)).parent
OUT = Path(os.environ["CADSKIN_GUI_OUT"])


def failures_of(result):
    """Return what failed as plain data."""
    return [{"test": str(test), "text": text} for test, text in [*result.failures, *result.errors]] + [
        {"test": str(test), "text": "unexpected success"} for test in result.unexpectedSuccesses
    ]


def run():
    """Run all tests, write the result and end FreeCAD."""
    started = time.monotonic()
    code = 1
    summary = {"ran": 0, "skipped": 0, "failures": [], "freecad": ".".join(FreeCAD.Version()[:3])}
    try:
        sys.path[:0] = [str(HERE / "gui"), str(HERE), str(HERE.parents[1] / "freecad_workbench" / "freecad")]
        with (OUT / "tests.txt").open("w", encoding="utf-8") as stream:
            suite = unittest.defaultTestLoader.discover(str(HERE / "gui"), os.environ["CADSKIN_GUI_PATTERN"])
            result = unittest.TextTestRunner(stream=stream, verbosity=2).run(suite)
        summary.update(ran=result.testsRun, skipped=len(result.skipped), failures=failures_of(result))
        code = 0 if result.wasSuccessful() else 1
    except BaseException:
        summary["failures"].append({"test": "session", "text": traceback.format_exc()})
    summary["seconds"] = time.monotonic() - started
    (OUT / "result.json").write_text(json.dumps(summary, indent=1), encoding="utf-8")
    os._exit(code)


STACKS = (OUT / "stacks.txt").open("w", encoding="utf-8")
faulthandler.enable(file=STACKS)
faulthandler.dump_traceback_later(float(os.environ["CADSKIN_GUI_SECONDS"]), exit=True, file=STACKS)
QtCore.QTimer.singleShot(800, run)
