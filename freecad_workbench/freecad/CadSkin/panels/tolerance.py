"""The panel of a tolerance: faces, characteristic, value, datums, deviations."""

from __future__ import annotations

from typing import Any

from .. import tolerance
from ..datum import TYPE as DATUM_TYPE
from ..faces import surfaces_of
from ..kinds import CHARACTERISTICS, characteristics_for, refusal
from ..objects import objects_of
from ..qt import QtWidgets, translate
from .base import length_box, row_form, shown_name, silent, symbol_of
from .face_list import FaceListPanel, edit

__all__ = ["TolerancePanel", "show"]

#: Deviation models that are offered; others can be written into the box.
_MODELS = ("", "field", "noise", "field:kernel=matern32")


def show(obj: Any) -> TolerancePanel:
    """Open the panel; the changes are one step of undo, which Cancel takes back."""
    return edit(TolerancePanel, obj, "Edit tolerance")


class TolerancePanel(FaceListPanel):
    """Edits a tolerance; what is wrong is said at once, at the bottom."""

    title = translate("Tolerance")
    icon = "tolerance"

    def build(self) -> None:
        """Add the rows of values and those of the deviations."""
        self._build_values()
        self._build_deviations()

    def _build_values(self) -> None:
        obj, form = self.obj, row_form()
        self.characteristic = QtWidgets.QComboBox()
        self.characteristic.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.characteristic.setMinimumContentsLength(8)
        self.value = length_box(obj.Value.Value)
        self.diameter = QtWidgets.QCheckBox(translate("round zone (⌀)"))
        self.diameter.setChecked(bool(obj.Diameter))
        self.datums = QtWidgets.QLineEdit(obj.Datums)
        letters = [item.Letter for item in objects_of(obj.Document, DATUM_TYPE)]
        self.datums.setPlaceholderText("A|B-C" if letters else translate("no datum yet"))
        self.datums.setToolTip(translate("Datums of the part:") + " " + (", ".join(letters) or "–"))
        form.addRow(translate("Type"), self.characteristic)
        form.addRow(translate("Value"), self.value)
        form.addRow("", self.diameter)
        form.addRow(translate("Datums"), self.datums)
        self.layout.addLayout(form)

    def _build_deviations(self) -> None:
        obj, form = self.obj, row_form(boxed=True)
        box = QtWidgets.QGroupBox(translate("Deviations of these faces"))
        self.model = QtWidgets.QComboBox()
        self.model.setEditable(True)
        self.model.addItems(list(_MODELS))
        self.model.setCurrentText(obj.Model)
        self.model.lineEdit().setPlaceholderText(translate("as the part"))
        self.model.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.model.setMinimumContentsLength(6)
        tip = translate("Correlation length; 0: a fifth of the part")
        self.length = length_box(obj.CorrelationLength.Value, none_text=tip)
        self.share = QtWidgets.QDoubleSpinBox()
        self.share.setRange(0.0, 1.0)
        self.share.setSingleStep(0.05)
        self.share.setSpecialValueText(translate("process"))
        self.share.setToolTip(translate("Standard deviation as a share of the value of the tolerance"))
        self.share.setValue(obj.ZoneShare)
        form.addRow(translate("Model"), self.model)
        form.addRow(translate("Corr. length"), self.length)
        form.addRow(translate("Share"), self.share)
        box.setLayout(form)
        self.layout.addWidget(box)

    def connect(self) -> None:
        """Store every change."""
        self.characteristic.currentIndexChanged.connect(self.store)
        self.diameter.toggled.connect(self.store)
        self.datums.textChanged.connect(self.store)
        self.model.editTextChanged.connect(self.store)
        for box in (self.value, self.length, self.share):
            box.valueChanged.connect(self.store)

    def faces_shown(self) -> None:
        """Offer the characteristics that have a meaning on these faces."""
        fitting = characteristics_for(surfaces_of(self.obj))
        current = self.obj.Characteristic
        if current not in fitting:
            fitting.insert(0, current)
        with silent(self.characteristic):
            self.characteristic.clear()
            for name in fitting:
                self.characteristic.addItem(f"{symbol_of(name)}  {shown_name(name)}".strip(), name)
            self.characteristic.setCurrentIndex(fitting.index(current))

    def store(self, *_: Any) -> None:
        """Write what the widgets say into the tolerance, and check it."""
        obj = self.obj
        obj.Characteristic = self.characteristic.currentData()
        obj.Value = self.value.property("rawValue")
        obj.Diameter = self.diameter.isChecked()
        obj.Datums = self.datums.text().strip()
        obj.Model = self.model.currentText().strip()
        obj.CorrelationLength = self.length.property("rawValue")
        obj.ZoneShare = self.share.value()
        self.fill_faces()
        self.check()

    def face_problem(self, surface: str) -> str | None:
        """Say why the characteristic has no meaning on a surface."""
        return refusal(self.obj.Characteristic, [surface])

    def object_problem(self) -> str | None:
        """Say why the tolerance cannot be used."""
        return tolerance.problem(self.obj)

    def check(self) -> None:
        """Allow datums and a round zone where they have a meaning, and say what is wrong."""
        kind = CHARACTERISTICS[self.obj.Characteristic]
        self.datums.setEnabled(kind.datums != "never" or bool(self.datums.text()))
        self.diameter.setEnabled(kind.diameter or self.diameter.isChecked())
        super().check()

    def label(self) -> str:
        """Return ``Flatness 0.02 mm``."""
        return f"{shown_name(self.obj.Characteristic).capitalize()} {self.obj.Value.Value:g} mm"
