"""What the tests in FreeCAD share: a document with a drilled plate, stand-ins for the worker."""

from __future__ import annotations

import os
import shutil
import stat
import sys
import tempfile
import unittest
from pathlib import Path

import FreeCAD
import Part

LIMIT = 300.0  # seconds; the first job starts the kernel and may compile


def python_for_scripts():
    """Return a plain Python: FreeCAD's own executable is FreeCAD."""
    return os.environ.get("CADSKIN_WORKER_PYTHON") or shutil.which("python3") or sys.executable


class DocumentTest(unittest.TestCase):
    """A test with a document of its own."""

    def setUp(self):
        self.document = FreeCAD.newDocument("Test")
        self.document.UndoMode = 1
        self.folder = Path(tempfile.mkdtemp(prefix="cadskin-test-"))

    def tearDown(self):
        for name in list(FreeCAD.listDocuments()):
            FreeCAD.closeDocument(name)
        shutil.rmtree(self.folder, ignore_errors=True)

    def plate(self, label="Plate", hole=True):
        """A plate 30 x 20 x 6 with a hole of 8 mm through it."""
        box = self.document.addObject("Part::Box", "Box")
        box.Length, box.Width, box.Height = 30, 20, 6
        if not hole:
            box.Label = label
            self.document.recompute()
            return box
        drill = self.document.addObject("Part::Cylinder", "Drill")
        drill.Radius, drill.Height = 4, 20
        drill.Placement.Base = FreeCAD.Vector(15, 10, -5)
        cut = self.document.addObject("Part::Cut", "Plate")
        cut.Base, cut.Tool, cut.Label = box, drill, label
        self.document.recompute()
        return cut

    def face(self, part, *, kind="Plane", z=None):
        """Name of the first face of a kind, with its centre at a height [mm]."""
        for number, face in enumerate(part.Shape.Faces, start=1):
            right = type(face.Surface).__name__ == kind
            if right and (z is None or abs(face.CenterOfMass.z - z) < 1e-6):
                return f"Face{number}"
        raise LookupError(kind)

    def reopened(self, name="test.FCStd"):
        """Save, close and open the document again."""
        path = self.folder / name
        self.document.saveAs(str(path))
        FreeCAD.closeDocument(self.document.Name)
        self.document = FreeCAD.openDocument(str(path))
        return self.document


def stand_in(folder, body):
    """Write a script that stands in for Python with cadskin, and return its path.

    ``body`` has ``send(**message)``, ``jobs()`` (the lines of the client as tables), json, os, sys and time.
    """
    path = folder / "python"
    path.write_text(
        f"#!{python_for_scripts()} -u\n"
        "import json, os, sys, time\n"
        "def send(**message):\n"
        "    print(json.dumps(message), flush=True)\n"
        "def jobs():\n"
        "    for line in sys.stdin:\n"
        "        yield json.loads(line)\n" + body,
        encoding="utf-8",
    )
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return str(path)


def box_shape(length=10.0):
    """A box without a document."""
    return Part.makeBox(length, 8, 6)
