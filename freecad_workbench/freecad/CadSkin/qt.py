"""Qt through FreeCAD's own shim, with the few differences of PySide2 and PySide6 in one place."""

from __future__ import annotations

from typing import Any

from PySide import QtCore, QtGui

try:
    from PySide import QtWidgets
except ImportError:  # FreeCAD 0.20 keeps the widgets in QtGui
    QtWidgets = QtGui

import FreeCAD

__all__ = ["QtCore", "QtGui", "QtWidgets", "button_value", "is_dark", "run_dialog", "translate"]


def translate(text: str, context: str = "CadSkin") -> str:
    """Return a text of the user interface in the user's language."""
    return FreeCAD.Qt.translate(context, text)


def button_value(*buttons: Any) -> int:
    """Return standard buttons as the integer that FreeCAD's task panels want (int in Qt 5, enum in Qt 6)."""
    return sum(int(getattr(button, "value", button)) for button in buttons)


def run_dialog(dialog: Any) -> int:
    """Run a modal dialog: ``exec_`` went away with PySide6."""
    return dialog.exec() if hasattr(dialog, "exec") else dialog.exec_()


def is_dark(widget: Any) -> bool:
    """Return whether a widget has light text on a dark ground."""
    return widget.palette().window().color().lightness() < 128
