"""The panel of a datum: faces and letter."""

from __future__ import annotations

from typing import Any

from .. import datum
from ..qt import QtWidgets, translate
from .base import row_form
from .face_list import FaceListPanel, edit

__all__ = ["DatumPanel", "show"]


def show(obj: Any) -> DatumPanel:
    """Open the panel; the changes are one step of undo, which Cancel takes back."""
    return edit(DatumPanel, obj, "Edit datum")


class DatumPanel(FaceListPanel):
    """Edits a datum."""

    title = translate("Datum")
    icon = "datum"

    def build(self) -> None:
        """Add the letter."""
        form = row_form()
        self.letter = QtWidgets.QLineEdit(self.obj.Letter)
        self.letter.setMaxLength(4)
        form.addRow(translate("Letter"), self.letter)
        self.layout.addLayout(form)

    def connect(self) -> None:
        """Store every change."""
        self.letter.textChanged.connect(self.store)

    def store(self, *_: Any) -> None:
        """Write the letter into the datum, and check it."""
        self.obj.Letter = self.letter.text().strip()
        self.check()

    def object_problem(self) -> str | None:
        """Say why the datum cannot be used."""
        return datum.problem(self.obj)

    def label(self) -> str:
        """Return ``Datum A``."""
        return f"{translate('Datum')} {self.obj.Letter}"
