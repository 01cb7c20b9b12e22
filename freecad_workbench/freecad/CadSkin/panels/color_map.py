"""The panel of the deviation map: exaggeration, range, colours, legend. Every change is seen at once."""

from __future__ import annotations

import math
from typing import Any

from .. import display
from ..colormap import PALETTES, RANGE_MODES
from ..qt import QtCore, QtWidgets, translate
from .base import BOX_MARGINS, Panel, open_panel, row_form, silent

__all__ = ["ColorMapPanel", "show"]

_STEPS = 60  # of the slider: 20 per decade


def show(obj: Any, *, focus: str = "") -> ColorMapPanel:
    """Open the panel; `focus` is the name of the widget that the keyboard goes to."""
    panel = open_panel(ColorMapPanel(obj))
    if focus:
        getattr(panel, focus).setFocus()
    return panel


class ColorMapPanel(Panel):
    """Edits the view properties of a skin model."""

    title = translate("Deviation map")
    icon = "color_map"

    def __init__(self, obj: Any) -> None:
        super().__init__()
        self.view_object = obj.ViewObject
        self._build_exaggeration()
        self._build_colors()
        self.layout.addWidget(self.status)
        self.layout.addStretch(1)
        self.read()
        self._connect()

    def _build_exaggeration(self) -> None:
        self.shown = QtWidgets.QCheckBox(translate("Show deviations"))
        self.layout.addWidget(self.shown)
        box = QtWidgets.QGroupBox(translate("Exaggeration"))
        layout = QtWidgets.QHBoxLayout(box)
        layout.setContentsMargins(*BOX_MARGINS)
        self.slider = QtWidgets.QSlider(QtCore.Qt.Horizontal)
        self.slider.setRange(0, _STEPS)
        self.slider.setPageStep(_STEPS // 6)
        self.factor = QtWidgets.QSpinBox()
        self.factor.setRange(1, 1000)
        self.factor.setPrefix("× ")
        layout.addWidget(self.slider, 1)
        layout.addWidget(self.factor)
        self.layout.addWidget(box)

    def _build_colors(self) -> None:
        box = QtWidgets.QGroupBox(translate("Colours"))
        form = row_form(boxed=True)
        self.mode, self.palette, self.legend = (QtWidgets.QComboBox() for _ in range(3))
        for combo, names in (
            (self.mode, RANGE_MODES),
            (self.palette, tuple(PALETTES)),
            (self.legend, display.LEGEND_POSITIONS),
        ):
            for name in names:
                combo.addItem(translate(name), name)
            combo.setSizeAdjustPolicy(QtWidgets.QComboBox.AdjustToMinimumContentsLengthWithIcon)
            combo.setMinimumContentsLength(7)
        self.low, self.high = (QtWidgets.QDoubleSpinBox() for _ in range(2))
        for spin in (self.low, self.high):
            spin.setRange(-1e4, 1e4)
            spin.setDecimals(1)
            spin.setSuffix(" µm")
            spin.setKeyboardTracking(False)
        self.bands = QtWidgets.QSpinBox()
        self.bands.setRange(0, 32)
        self.bands.setSpecialValueText(translate("smooth"))
        form.addRow(translate("Range"), self.mode)
        form.addRow(translate("from"), self.low)
        form.addRow(translate("to"), self.high)
        form.addRow(translate("Bands"), self.bands)
        form.addRow(translate("Palette"), self.palette)
        form.addRow(translate("Legend"), self.legend)
        box.setLayout(form)
        self.layout.addWidget(box)

    def read(self) -> None:
        """Show the settings of the view object."""
        settings = display.settings_of(self.view_object)
        with silent(*self._widgets()):
            self.shown.setChecked(bool(settings.show))
            self.factor.setValue(round(settings.exaggeration))
            self.slider.setValue(round(_STEPS * math.log10(max(settings.exaggeration, 1.0)) / 3.0))
            for combo, value in (
                (self.mode, settings.range_mode),
                (self.palette, settings.palette),
                (self.legend, settings.legend),
            ):
                combo.setCurrentIndex(combo.findData(value))
            self.bands.setValue(settings.bands)
            low, high = self._range()
            self.low.setValue(1000.0 * low)
            self.high.setValue(1000.0 * high)
        self._allow()

    def _range(self) -> tuple[float, float]:
        """Return the range [mm] that is drawn now."""
        settings = display.settings_of(self.view_object)
        colors = self.view_object.Proxy.colors() if hasattr(self.view_object.Proxy, "colors") else None
        if colors is None or settings.range_mode == "Manual":
            return settings.low, settings.high
        return colors.low, colors.high

    def _widgets(self) -> tuple[Any, ...]:
        return (
            self.shown,
            self.slider,
            self.factor,
            self.mode,
            self.low,
            self.high,
            self.bands,
            self.palette,
            self.legend,
        )

    def _connect(self) -> None:
        self.shown.toggled.connect(lambda on: self._set("DeviationMap", on))
        self.slider.valueChanged.connect(self._slide)
        self.factor.valueChanged.connect(lambda value: self._set("Exaggeration", float(value)))
        self.bands.valueChanged.connect(lambda value: self._set("Bands", value))
        for combo, name in ((self.mode, "RangeMode"), (self.palette, "Palette"), (self.legend, "Legend")):
            combo.currentIndexChanged.connect(
                lambda _index, combo=combo, name=name: self._set(name, combo.currentData())
            )
        self.low.valueChanged.connect(self._set_limits)
        self.high.valueChanged.connect(self._set_limits)

    def _slide(self, step: int) -> None:
        """Take the round factor that is nearest to the place of the slider: 1, 2, 5, 10, ..."""
        factor = 10.0 ** (3.0 * step / _STEPS)
        nearest = min(display.EXAGGERATIONS, key=lambda known: abs(math.log(known / factor)))
        self._set("Exaggeration", float(nearest))

    def _set(self, name: str, value: Any) -> None:
        setattr(self.view_object, name, value)
        self.read()

    def _set_limits(self, *_: Any) -> None:
        low, high = self.low.value() / 1000.0, self.high.value() / 1000.0
        if low < high:
            self.view_object.RangeLow, self.view_object.RangeHigh = low, high
            self.view_object.RangeMode = "Manual"
            self.read()
        else:
            self._allow()

    def _allow(self) -> None:
        """Say what stands against the range that is written."""
        if self.low.value() >= self.high.value():
            self.status.tell(translate("the range needs its lower end below its upper end"), "bad")
        elif self.mode.currentData() == "Tolerance" and display.zone_of(self.view_object.Object) is None:
            self.status.tell(translate("no tolerance: the range is symmetric"), "caution")
        else:
            self.status.tell("")
