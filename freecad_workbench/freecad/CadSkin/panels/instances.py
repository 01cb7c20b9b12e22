"""The panel of the instances: how many parts, which is shown, how a value spreads over them."""

from __future__ import annotations

from typing import Any

import numpy as np

from .. import api
from .. import skin as skins
from ..colormap import format_deviation
from ..qt import QtCore, QtWidgets, translate
from .base import open_panel, row_form, shown_name, silent
from .histogram import Histogram
from .job_panel import JobPanel
from .result_table import place_of

__all__ = ["InstancesPanel", "show"]

_LARGEST, _RMS = "largest deviation", "RMS deviation"


def show(obj: Any) -> InstancesPanel:
    """Open the panel."""
    return open_panel(InstancesPanel(obj))


class InstancesPanel(JobPanel):
    """Draws many parts, goes through them, and shows the histogram of a value."""

    title = translate("Instances")
    icon = "sample"

    def build(self) -> None:
        """Add what draws the parts and what goes through them."""
        self._values: dict[str, tuple[np.ndarray, float | None]] = {}
        self._of: Any = None
        self._build_draw()
        self._build_browse()

    def _build_draw(self) -> None:
        form = row_form()
        self.count, self.seed = QtWidgets.QSpinBox(), QtWidgets.QSpinBox()
        self.count.setRange(1, 10000)
        self.count.setValue(max(self.obj.Instances, 20) if self.obj.Instances == 1 else self.obj.Instances)
        self.seed.setRange(0, 2**31 - 1)
        self.seed.setValue(self.obj.Seed)
        form.addRow(translate("Parts"), self.count)
        form.addRow(translate("Seed"), self.seed)
        self.layout.addLayout(form)
        self.draw, self.cancel = (
            QtWidgets.QPushButton(translate("Draw")),
            QtWidgets.QPushButton(translate("Cancel")),
        )
        self.draw.clicked.connect(self._draw)
        self.cancel.clicked.connect(lambda: self.attempt(api.cancel, self.obj))
        row = QtWidgets.QHBoxLayout()
        row.addWidget(self.draw, 2)
        row.addWidget(self.cancel, 1)
        self.layout.addLayout(row)
        self.layout.addWidget(self.bar)
        self.layout.addWidget(self.status)

    def _build_browse(self) -> None:
        self.browse = QtWidgets.QGroupBox()
        layout = QtWidgets.QVBoxLayout(self.browse)
        layout.setContentsMargins(4, 4, 4, 4)
        self.slider = QtWidgets.QSlider(QtCore.Qt.Horizontal)
        self.slider.valueChanged.connect(self._show_instance)
        self.which = QtWidgets.QLabel()
        self.which.setWordWrap(True)
        self.quantity = QtWidgets.QComboBox()
        self.quantity.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.quantity.setMinimumContentsLength(8)
        self.quantity.currentIndexChanged.connect(self._refresh_histogram)
        self.histogram = Histogram()
        self.summary = QtWidgets.QLabel()
        self.summary.setWordWrap(True)
        for widget in (self.slider, self.which, self.quantity):
            layout.addWidget(widget)
        layout.addWidget(self.histogram, 1)
        layout.addWidget(self.summary)
        self.layout.addWidget(self.browse, 1)

    def _draw(self) -> None:
        self.attempt(api.sample, self.obj, self.count.value(), seed=self.seed.value(), wait=False)

    def _show_instance(self, number: int) -> None:
        self.attempt(api.show_instance, self.obj, number)
        self.refresh()

    def show_state(self, busy: bool) -> None:
        """Show which buttons can be used, the status, the shown part and the histogram."""
        self.draw.setEnabled(not busy)
        self.cancel.setEnabled(busy)
        status = self.obj.Status
        self.status.tell(status, "bad" if status.startswith(("Failed", "Cannot")) else "")
        found = skins.result(self.obj)
        self.browse.setVisible(found is not None and found.size > 0)
        if found is None or not found.size:
            return
        if found is not self._of:
            self._take(found)
        shown = self.shown_of(found.size)
        with silent(self.slider):
            self.slider.setRange(0, found.size - 1)
            self.slider.setValue(shown)
        self.slider.setEnabled(found.size > 1)
        self._refresh_histogram()

    def _take(self, found: Any) -> None:
        """Collect the quantities of a new result."""
        self._of = found
        statistics = np.array([found.statistics(k) for k in range(found.size)])
        self._values = {translate(_LARGEST): (np.abs(statistics[:, :2]).max(axis=1), None)}
        self._values[translate(_RMS)] = (statistics[:, 2], None)
        labels = {item.Name: item.Label for item in self.obj.Tolerances}
        for row in found.tolerance_rows(0):
            name = labels.get(row["id"]) or place_of(str(row["id"])) or shown_name(row["characteristic"])
            self._values[name] = (found.tolerance_values(row["id"]), row.get("limit"))
        before = self.quantity.currentText()
        names = list(self._values)
        with silent(self.quantity):
            self.quantity.clear()
            self.quantity.addItems(names)
            fallback = 2 if len(names) > 2 else 0
            self.quantity.setCurrentIndex(names.index(before) if before in names else fallback)

    def _refresh_histogram(self, *_: Any) -> None:
        name = self.quantity.currentText()
        if name not in self._values:
            return
        values, limit = self._values[name]
        shown = self.shown_of(len(values))
        self.histogram.show_values(values, limit, shown)
        conforming = self._of.instance_report(shown).get("conforming")
        mark = {True: " ✓", False: " ✗"}.get(conforming, "")
        self.which.setText(
            f"{translate('part')} {shown + 1} / {len(values)}{mark}: {format_deviation(values[shown])}"
        )
        self.summary.setText(self._summary(values, limit))

    def _summary(self, values: np.ndarray, limit: float | None) -> str:
        known = values[np.isfinite(values)]
        if not known.size:
            return translate("not evaluated")
        text = f"{translate('mean')} {format_deviation(known.mean())}"
        if known.size > 1:
            text += f", {translate('std. dev.')} {format_deviation(known.std(ddof=1))}"
        if limit is not None:
            held = int((known <= limit * (1 + 1e-9)).sum())
            text += f"\n{held} / {len(values)} {translate('within the limit')}"
        return text
