"""The panel of a skin model: how it is made, its progress, and how it stands against its tolerances."""

from __future__ import annotations

import random
from typing import Any

from .. import api
from .. import skin as skins
from ..colormap import format_deviation
from ..faces import face_numbers
from ..qt import QtCore, QtWidgets, translate
from .base import BOX_MARGINS, alive, fill_table, length_box, open_panel, plain_table, row_form, silent
from .job_panel import JobPanel
from .result_table import result_rows, verdict

__all__ = ["SkinPanel", "show"]


def show(obj: Any) -> SkinPanel:
    """Open the panel."""
    return open_panel(SkinPanel(obj))


class SkinPanel(JobPanel):
    """Settings, Compute, and the result of the part that is shown."""

    title = translate("Skin model")
    icon = "skin"

    def build(self) -> None:
        """Add settings, buttons and the result."""
        self._build_settings()
        self._build_buttons()
        self._build_result()

    def _build_settings(self) -> None:
        obj, form = self.obj, row_form()
        automatic = translate("0: chosen from the size of the part")
        self.edge = length_box(obj.EdgeLength.Value, none_text=automatic)
        self.length = length_box(obj.CorrelationLength.Value, none_text=automatic)
        self.seed = QtWidgets.QSpinBox()
        self.seed.setRange(0, 2**31 - 1)
        self.seed.setValue(obj.Seed)
        self.dice = QtWidgets.QToolButton()
        self.dice.setText("⚄")
        self.dice.setToolTip(translate("Another seed: another part"))
        self.count = QtWidgets.QSpinBox()
        self.count.setRange(1, 10000)
        self.count.setValue(obj.Instances)
        self.conform = QtWidgets.QComboBox()
        self.conform.addItems(list(skins.CONFORM))
        self.conform.setCurrentText(obj.Conform)
        self.conform.setToolTip(translate("How the parts are held inside the tolerances"))
        seed = QtWidgets.QHBoxLayout()
        seed.addWidget(self.seed, 1)
        seed.addWidget(self.dice)
        form.addRow(translate("Mesh size"), self.edge)
        form.addRow(translate("Corr. length"), self.length)
        form.addRow(translate("Seed"), seed)
        form.addRow(translate("Parts"), self.count)
        form.addRow(translate("Conform"), self.conform)
        self.length.setToolTip(translate("Correlation length of the deviations; ") + automatic)
        self.layout.addLayout(form)
        for box in (self.edge, self.length, self.seed, self.count):
            box.editingFinished.connect(self.store)
        self.dice.clicked.connect(self._roll)
        self.conform.activated.connect(self.store)

    def _build_buttons(self) -> None:
        self.compute = QtWidgets.QPushButton(translate("Compute"))
        self.cancel = QtWidgets.QPushButton(translate("Cancel"))
        self.check = QtWidgets.QPushButton(translate("Check"))
        self.check.setToolTip(
            translate("Evaluate the tolerances as they are now; the parts stay as they are")
        )
        row = QtWidgets.QHBoxLayout()
        for button, action in (
            (self.compute, self._compute),
            (self.cancel, self._cancel),
            (self.check, self._check),
        ):
            button.setMinimumWidth(50)
            button.clicked.connect(action)
            row.addWidget(button, 1)
        self.layout.addLayout(row)
        self.layout.addWidget(self.bar)
        self.layout.addWidget(self.status)

    def _build_result(self) -> None:
        self.result_box = QtWidgets.QGroupBox(translate("Result"))
        layout = QtWidgets.QVBoxLayout(self.result_box)
        layout.setContentsMargins(*BOX_MARGINS)
        self.extent = QtWidgets.QLabel()
        self.extent.setWordWrap(True)
        self.shown = QtWidgets.QSlider(QtCore.Qt.Horizontal)
        self.shown.setToolTip(translate("Which of the parts is shown"))
        self.shown.valueChanged.connect(self._show_instance)
        self.table = plain_table([translate("Tolerance"), translate("Value / limit"), ""])
        layout.addWidget(self.shown)
        layout.addWidget(self.extent)
        layout.addWidget(self.table)
        self.layout.addWidget(self.result_box)
        self.layout.addStretch(1)

    def store(self, *_: Any) -> None:
        """Write the settings into the object, in one step of undo where something is new."""
        if not alive(self.obj):
            return
        wanted = {
            "EdgeLength": self.edge.property("rawValue"),
            "CorrelationLength": self.length.property("rawValue"),
            "Seed": self.seed.value(),
            "Instances": self.count.value(),
            "Conform": self.conform.currentText(),
        }
        new = {
            name: value
            for name, value in wanted.items()
            if getattr(getattr(self.obj, name), "Value", getattr(self.obj, name)) != value
        }
        if new:
            with api.transaction(self.document, "Settings of the skin model"):
                for name, value in new.items():
                    setattr(self.obj, name, value)
            self.refresh()

    def _roll(self) -> None:
        self.seed.setValue(random.randrange(1, 10**6))
        self.store()

    def _compute(self) -> None:
        self.store()
        self.attempt(api.compute, self.obj, wait=False)

    def _check(self) -> None:
        self.attempt(api.check, self.obj, wait=False)

    def _cancel(self) -> None:
        self.attempt(api.cancel, self.obj)

    def _show_instance(self, number: int) -> None:
        self.attempt(api.show_instance, self.obj, number)
        self.refresh()

    def show_state(self, busy: bool) -> None:
        """Show which buttons can be used, the status and the result."""
        self.compute.setEnabled(not busy)
        self.cancel.setEnabled(busy)
        self.check.setEnabled(not busy and skins.has_result(self.obj))
        status = self.obj.Status
        kinds = {"Up to date": "good", "Computing": "", "Not computed": ""}
        kind = next((kind for text, kind in kinds.items() if status.startswith(text)), "bad")
        self.status.tell(status, "caution" if status.startswith(("Out of date", "Cancelled")) else kind)
        self._refresh_result()

    def _refresh_result(self) -> None:
        found = skins.result(self.obj)
        self.result_box.setVisible(found is not None and found.size > 0)
        if found is None or not found.size:
            return
        instance = self.shown_of(found.size)
        with silent(self.shown):
            self.shown.setRange(0, found.size - 1)
            self.shown.setValue(instance)
        self.shown.setVisible(found.size > 1)
        lowest, highest, rms = found.statistics(instance)
        parts = f"{translate('part')} {instance + 1} / {found.size}" if found.size > 1 else ""
        rows = found.tolerance_rows(instance)
        sentence, kind = verdict(rows)
        mark = {"good": "✓", "bad": "✗"}.get(kind, "")
        self.result_box.setTitle(" ".join((translate("Result"), parts, mark)).strip())
        self.extent.setText(
            f"{format_deviation(lowest, signed=True)} … {format_deviation(highest, signed=True)}\n"
            f"RMS {format_deviation(rms)}\n{sentence}"
        )
        names = {item.Name: (_faces_of(item), item.Label) for item in self.obj.Tolerances}
        fill_table(self.table, result_rows(rows, names))


def _faces_of(item: Any) -> str:
    """Return the faces of a tolerance in a few letters: ``Face7``, ``Face1+3``, ``Face1+3 …``."""
    numbers = [str(number) for number in face_numbers(item)] if hasattr(item, "Faces") else []
    return "Face" + "+".join(numbers[:2]) + (" …" if len(numbers) > 2 else "") if numbers else item.Label
