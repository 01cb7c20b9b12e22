"""What the task panels share. They are made for 270 pixels: that is what FreeCAD 0.20 gives them."""

from __future__ import annotations

from contextlib import contextmanager
from typing import Any

import FreeCAD
import FreeCADGui

from ..faces import InputError
from ..icons import icon_path
from ..kinds import CHARACTERISTICS
from ..protocol import JobError
from ..qt import QtCore, QtGui, QtWidgets, button_value, is_dark, translate

__all__ = [
    "BOX_MARGINS",
    "Panel",
    "Status",
    "alive",
    "current",
    "fill_table",
    "length_box",
    "make_room",
    "open_panel",
    "plain_table",
    "row_form",
    "settle",
    "shown_name",
    "silent",
    "symbol_of",
]

#: Inside a group box; FreeCAD's style draws the title over the top.
BOX_MARGINS = (5, 12, 5, 5)
_ROW, _ROWS = 22, 8  # height of a row in pixels, rows that are seen at once
_GOOD, _BAD, _CAUTION = ("#1f7a45", "#7fd6a0"), ("#b3261e", "#ff9a8f"), ("#8a5a00", "#f2c14e")


class Panel:
    """A task panel: ``form`` is the widget; subclasses fill ``layout``."""

    title = ""
    icon = "skin"
    #: Whether OK and Cancel are offered, or only Close.
    decides = False

    def __init__(self) -> None:
        self.form = QtWidgets.QWidget()
        self.form.setWindowTitle(self.title)
        self.form.setWindowIcon(QtGui.QIcon(icon_path(self.icon)))
        self.layout = QtWidgets.QVBoxLayout(self.form)
        self.layout.setContentsMargins(4, 4, 4, 4)
        self.layout.setSpacing(6)
        self.status = Status()
        self.form.destroyed.connect(lambda *_: self.dropped())  # by a macro, or with its document

    def getStandardButtons(self) -> int:
        """Return the buttons."""
        buttons = QtWidgets.QDialogButtonBox
        return button_value(buttons.Ok, buttons.Cancel) if self.decides else button_value(buttons.Close)

    def isAllowedAlterSelection(self) -> bool:
        """Allow commands that select."""
        return True

    def isAllowedAlterView(self) -> bool:
        """Allow commands that change the view."""
        return True

    def isAllowedAlterDocument(self) -> bool:
        """Allow commands that change the document, where no decision is open."""
        return not self.decides

    def accept(self) -> bool:
        """Close with OK."""
        return self.leave()

    def reject(self) -> bool:
        """Close with Cancel or Close."""
        return self.leave()

    def leave(self) -> bool:
        """Let go of everything, and let FreeCAD close the panel."""
        self.closed()
        return True

    def closed(self) -> None:
        """Let go of everything that was watched."""

    def dropped(self) -> None:
        """Let go of everything when the panel was taken away without a decision."""
        self.closed()

    def attempt(self, action: Any, *arguments: Any, **named: Any) -> Any:
        """Do something; what cannot be done is told in the panel and not in a window on top of it."""
        try:
            return action(*arguments, **named)
        except (InputError, JobError) as error:
            self.status.tell(str(error), "bad")
        return None


class Status(QtWidgets.QLabel):
    """A line of text, as long as it needs, in the colour of good, bad or caution."""

    def __init__(self) -> None:
        super().__init__()
        self.setWordWrap(True)
        self.setMinimumWidth(80)
        self.setTextInteractionFlags(QtCore.Qt.TextSelectableByMouse)
        self.setSizePolicy(QtWidgets.QSizePolicy.Ignored, QtWidgets.QSizePolicy.MinimumExpanding)

    def tell(self, text: str, kind: str = "") -> None:
        """Show a text; kind is ``good``, ``bad``, ``caution`` or nothing."""
        colors = {"good": _GOOD, "bad": _BAD, "caution": _CAUTION}.get(kind)
        self.setStyleSheet(f"color: {colors[is_dark(self)]};" if colors else "")
        self.setText(text)


_open: list[Panel] = []


def open_panel(panel: Panel) -> Panel:
    """Show a panel in place of the one of ours that may be open, and return it.

    Raises
    ------
    InputError
        Another tool's panel is open: its changes are not ours to throw away.
    """
    make_room()
    FreeCADGui.Control.showDialog(panel)
    _open[:] = [panel]
    QtCore.QTimer.singleShot(0, settle)
    return panel


def settle() -> None:
    """Commit the transaction that FreeCAD leaves open after a command with a panel.

    Inside a command FreeCAD only notes that a transaction shall be committed, and forgets it when a panel
    is open at the end. A panel with OK and Cancel needs its transaction; under any other one it would swallow
    every later step of undo, and results would wait for its end.
    """
    panel = current()
    if panel is None or not panel.decides:
        FreeCAD.closeActiveTransaction()


def make_room() -> None:
    """Close our panel that may be open and has nothing to decide.

    Raises
    ------
    InputError
        Another panel is open: what was done in it is not ours to throw away.
    """
    if not FreeCADGui.Control.activeDialog():
        return
    before = current()
    if before is None or before.decides:
        raise InputError(translate("another task is open; close it first"))
    before.closed()
    FreeCADGui.Control.closeDialog()


def current() -> Panel | None:
    """Return our panel that is open; None otherwise."""
    return _open[0] if _open and FreeCADGui.Control.activeDialog() else None


def length_box(value: float, *, none_text: str = "") -> Any:
    """Return a spin box for a length [mm] that shows and takes units; `none_text` stands for 0."""
    box = FreeCADGui.UiLoader().createWidget("Gui::QuantitySpinBox")
    box.setProperty("unit", "mm")
    box.setProperty("minimum", 0.0)
    box.setProperty("maximum", 1e6)
    box.setProperty("singleStep", 0.01)
    box.setProperty("rawValue", float(value))
    box.setMinimumWidth(60)
    if none_text:
        box.setToolTip(none_text)
    return box


def row_form(*, boxed: bool = False) -> QtWidgets.QFormLayout:
    """Return a layout of labelled rows whose fields may be narrow; boxed is for one inside a group box."""
    form = QtWidgets.QFormLayout()
    form.setContentsMargins(*(BOX_MARGINS if boxed else (0, 0, 0, 0)))
    form.setSpacing(4)
    form.setFieldGrowthPolicy(QtWidgets.QFormLayout.AllNonFixedFieldsGrow)
    return form


def plain_table(headings: list[str], *, stretch: int = 0) -> QtWidgets.QTableWidget:
    """Return a table for reading whose column `stretch` takes the room that the others leave."""
    table = QtWidgets.QTableWidget(0, len(headings))
    table.setHorizontalHeaderLabels(headings)
    table.verticalHeader().hide()
    table.verticalHeader().setDefaultSectionSize(_ROW)
    table.setEditTriggers(QtWidgets.QAbstractItemView.NoEditTriggers)
    table.setSelectionBehavior(QtWidgets.QAbstractItemView.SelectRows)
    table.setShowGrid(False)
    table.setAlternatingRowColors(True)
    table.setHorizontalScrollBarPolicy(QtCore.Qt.ScrollBarAlwaysOff)
    table.setMinimumWidth(120)
    header = table.horizontalHeader()
    header.setMinimumSectionSize(20)
    for column in range(len(headings)):
        mode = QtWidgets.QHeaderView.Stretch if column == stretch else QtWidgets.QHeaderView.ResizeToContents
        header.setSectionResizeMode(column, mode)
    return table


def fill_table(table: QtWidgets.QTableWidget, rows: list[tuple[list[str], str, str]]) -> None:
    """Fill a table with rows of (texts, kind, tooltip); kind colours the last text."""
    table.setRowCount(len(rows))
    shown = min(max(len(rows), 2), _ROWS)
    table.setFixedHeight(table.horizontalHeader().sizeHint().height() + 4 + _ROW * shown)
    for number, (texts, kind, tip) in enumerate(rows):
        for column, text in enumerate(texts):
            item = QtWidgets.QTableWidgetItem(text)
            item.setToolTip(tip or text)
            if column:
                item.setTextAlignment(QtCore.Qt.AlignRight | QtCore.Qt.AlignVCenter)
            colors = {"good": _GOOD, "bad": _BAD, "caution": _CAUTION}.get(kind)
            if colors and column == len(texts) - 1:
                item.setForeground(QtGui.QColor(colors[is_dark(table)]))
            table.setItem(number, column, item)


def alive(obj: Any) -> bool:
    """Tell whether an object is still in an open document; a panel may outlive it."""
    try:
        return bool(obj.Name) and obj.Document is not None
    except (ReferenceError, RuntimeError):
        return False


def symbol_of(characteristic: str) -> str:
    """Return the symbol of a characteristic where the font has it; else nothing."""
    kind = CHARACTERISTICS.get(characteristic)
    metrics = QtGui.QFontMetrics(QtWidgets.QApplication.font())
    return kind.symbol if kind is not None and metrics.inFontUcs4(ord(kind.symbol)) else ""


@contextmanager
def silent(*widgets: Any) -> Any:
    """Change widgets without their signals."""
    before = [widget.blockSignals(True) for widget in widgets]
    try:
        yield
    finally:
        for widget, blocked in zip(widgets, before):
            widget.blockSignals(blocked)


def shown_name(characteristic: str) -> str:
    """Return the name of a characteristic as it is shown."""
    return translate(characteristic.replace("_", " "))
