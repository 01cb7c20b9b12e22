"""A panel that begins with a list of faces: picked in the 3D view, shown with surface and area."""

from __future__ import annotations

from typing import Any

import FreeCAD

from ..faces import faces_now, link_faces, part_of, part_problem
from ..qt import QtWidgets, translate
from ..signature import face_number
from .base import Panel, fill_table, make_room, open_panel, plain_table
from .picking import FacePicker

__all__ = ["FaceListPanel", "edit"]


def edit(panel: type[FaceListPanel], obj: Any, step: str) -> Any:
    """Open a panel on an object; its changes are one step of undo with this name, which Cancel takes back."""
    make_room()
    if not obj.Document.HasPendingTransaction:
        obj.Document.openTransaction(step)
    return open_panel(panel(obj))


class FaceListPanel(Panel):
    """Edits an object that is on faces, in a transaction that OK commits and Cancel aborts."""

    decides = True

    def __init__(self, obj: Any) -> None:
        super().__init__()
        self.obj, self.document = obj, obj.Document
        self.decided = False
        self._transaction = FreeCAD.getActiveTransaction()
        names = list(obj.Faces[1]) if obj.Faces else []
        self.picker = FacePicker(part_of(obj), names, self._faces_changed, self._refused)
        self._build_list()
        self.build()
        self.layout.addWidget(self.status)
        self.layout.addStretch(1)
        self._show_faces()
        self.connect()
        self.pick.setChecked(True)
        self.check()

    def build(self) -> None:
        """Add the widgets below the list."""

    def connect(self) -> None:
        """Connect them."""

    def store(self, *_: Any) -> None:
        """Write what the widgets say into the object, and check it."""

    def object_problem(self) -> str | None:
        """Say why the object cannot be used; None where it can."""
        raise NotImplementedError

    def faces_shown(self) -> None:
        """Follow the list of faces."""

    def label(self) -> str:
        """Return the name of the object in the tree."""
        raise NotImplementedError

    def _build_list(self) -> None:
        self.pick = QtWidgets.QPushButton(translate("Pick faces"))
        self.pick.setCheckable(True)
        self.pick.setToolTip(translate("While this is down, a click on a face adds it or takes it away"))
        self.pick.toggled.connect(self._toggle_picking)
        self.remove = QtWidgets.QPushButton(translate("Remove"))
        self.remove.setToolTip(translate("Take the selected rows out of the list"))
        self.remove.clicked.connect(self._remove_rows)
        buttons = QtWidgets.QHBoxLayout()
        buttons.addWidget(self.pick, 2)
        buttons.addWidget(self.remove, 1)
        self.layout.addLayout(buttons)
        self.table = plain_table([translate("Face"), translate("Surface"), "mm²"], stretch=1)
        self.layout.addWidget(self.table)

    def _toggle_picking(self, active: bool) -> None:
        self.picker.set_active(active)
        self.picker.highlight()

    def _refused(self, reason: str) -> None:
        self.status.tell(reason, "bad")

    def _remove_rows(self) -> None:
        gone = {self.picker.faces[index.row()] for index in self.table.selectionModel().selectedRows()}
        self.picker.set_faces([face for face in self.picker.faces if face not in gone])
        self.picker.highlight()

    def _faces_changed(self, faces: list[str]) -> None:
        if faces:
            self.attempt(link_faces, self.obj, self.picker.part, faces)
        self._show_faces()
        self.check()

    def face_problem(self, _surface: str) -> str | None:
        """Say why a face with such a surface cannot be used; None where it can."""
        return None

    def _show_faces(self) -> None:
        self.fill_faces()
        self.faces_shown()

    def fill_faces(self) -> None:
        """Fill the table of the faces; those that cannot be used have a cross."""
        part = self.picker.part
        now = faces_now(part) if part_problem(part) is None else []
        rows = []
        for name in self.picker.faces:
            number = face_number(name)
            if number is None or number > len(now):
                rows.append(([name.lstrip("?"), translate("gone"), "–"], "bad", translate("pick it again")))
            else:
                face = now[number - 1]
                told = self.face_problem(face.kind)
                surface = f"✗ {face.kind}" if told else face.kind
                rows.append(([name, surface, f"{face.area:.4g}"], "bad" if told else "", told or ""))
        fill_table(self.table, rows)

    def problem(self) -> str | None:
        """Say why the object cannot be kept as it is; None where it can."""
        return self.object_problem() if self.picker.faces else translate("no face is picked")

    def check(self) -> None:
        """Say at the bottom whether the object can be used."""
        told = self.problem()
        self.status.tell(told or translate("can be used"), "bad" if told else "good")

    def accept(self) -> bool:
        """Keep the object, if it can be used."""
        told = self.problem()
        if told:
            self.status.tell(told, "bad")
            return False
        self.closed()
        self.decided = True
        self.obj.Label = self.label()
        self.document.recompute()
        self.document.commitTransaction()
        return True

    def reject(self) -> bool:
        """Leave the document as it was before the panel."""
        self.closed()
        self.decided = True
        self.document.abortTransaction()
        self.document.recompute()
        return True

    def closed(self) -> None:
        """End picking."""
        self.picker.set_active(False)

    def dropped(self) -> None:
        """Take a panel that was taken away for cancelled."""
        self.closed()
        if not self.decided:
            self.decided = True
            if FreeCAD.getActiveTransaction() == self._transaction:  # its document may have gone already
                FreeCAD.closeActiveTransaction(True)
