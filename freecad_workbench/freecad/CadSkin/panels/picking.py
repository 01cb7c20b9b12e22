"""Picking faces in the 3D view for a panel: on while its button is down."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import FreeCADGui

from ..faces import part_problem, whole_part
from ..qt import QtCore
from ..signature import face_number
from .base import alive

__all__ = ["FacePicker"]


class FacePicker:
    """Watches the selection; a click on a face of the part puts it into the list, or takes it out again.

    Parameters
    ----------
    part : App.DocumentObject
    faces : list of str
        At the beginning.
    changed : callable
        Called with the list of faces when it changes.
    refused : callable
        Called with the reason when something else than a face of the part was clicked.
    """

    def __init__(
        self,
        part: Any,
        faces: list[str],
        changed: Callable[[list[str]], None],
        refused: Callable[[str], None],
    ) -> None:
        self.part, self.faces = part, list(faces)
        self._changed, self._refused = changed, refused
        self._active = self._busy = False
        self._hovered = ("", "")

    @property
    def active(self) -> bool:
        """Whether clicks are taken."""
        return self._active

    def set_active(self, active: bool) -> None:
        """Begin or end taking clicks."""
        if active and not self._active:
            FreeCADGui.Selection.addObserver(self)
        elif self._active and not active:
            FreeCADGui.Selection.removeObserver(self)
        self._active = active

    def setPreselection(self, _document: str, name: str, sub: str) -> None:
        """Remember what the mouse is over; FreeCAD calls it."""
        self._hovered = (name, sub.rpartition(".")[2])

    def addSelection(self, document: str, name: str, sub: str, point: Any) -> None:
        """Take a click; FreeCAD calls it.

        A click on a face that is selected already selects the whole object in FreeCAD: the face under the
        mouse is meant then. A click in the tree has no point.
        """
        if self._busy or document != self.part.Document.Name:
            return
        clicked = self.part.Document.getObject(name)
        sub = sub.rpartition(".")[2]
        if not sub and any(point) and self._hovered[0] == name:
            sub = self._hovered[1]
        if clicked is None or whole_part(clicked) != self.part:
            self._refused(f"that is no face of {self.part.Label}; pick its faces only")
        elif face_number(sub) is None:
            self._refused(f"{sub or 'the whole part'} is no face; pick faces only")
        elif sub in self.faces:
            self.set_faces([face for face in self.faces if face != sub])
        else:
            self.set_faces([*self.faces, sub])
        QtCore.QTimer.singleShot(0, self.highlight)

    def clearSelection(self, _document: str) -> None:
        """Mark the faces of the list again after a click into the void; FreeCAD calls it."""
        if not self._busy:
            QtCore.QTimer.singleShot(0, self.highlight)

    def set_faces(self, faces: list[str]) -> None:
        """Replace the list."""
        self.faces = list(faces)
        self._changed(self.faces)

    def highlight(self) -> None:
        """Select the faces of the list, so that they are seen."""
        if not self._active or not alive(self.part):
            return
        self._busy = True
        try:
            FreeCADGui.Selection.clearSelection()
            known = self.part.Shape.Faces if part_problem(self.part) is None else []
            for face in self.faces:
                number = face_number(face)
                if number is not None and number <= len(known):
                    FreeCADGui.Selection.addSelection(self.part, face)
        finally:
            self._busy = False
