"""A small histogram with a limit: how a value spreads over the parts that were drawn."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..colormap import format_deviation, unit_of
from ..qt import QtCore, QtGui, QtWidgets

__all__ = ["Histogram", "histogram_bins"]

_GOOD, _BAD, _SHOWN = QtGui.QColor("#3b63c8"), QtGui.QColor("#c4362c"), QtGui.QColor("#f2b632")
_MARGIN, _HEAD, _FOOT = 6, 20, 18


def histogram_bins(values: np.ndarray, limit: float | None, most: int = 24) -> tuple[np.ndarray, np.ndarray]:
    """Return (counts, edges) that include the limit, from 0 on where all values are positive."""
    known = values[np.isfinite(values)]
    if not known.size:
        return np.zeros(0, dtype=int), np.zeros(0)
    low, high = float(known.min()), float(known.max())
    if limit is not None:
        low, high = min(low, limit), max(high, limit)
    low = 0.0 if low > 0.0 else low
    if high - low < 1e-12:
        high = low + 1e-3
    high += 0.02 * (high - low)
    bins = max(5, min(most, 2 * int(np.sqrt(known.size)) + 4))
    return np.histogram(known, bins=bins, range=(low, high))


class Histogram(QtWidgets.QWidget):
    """Draws it: blue within the limit, red above, the part that is shown in yellow."""

    def __init__(self) -> None:
        super().__init__()
        self.setMinimumSize(120, 110)
        self.setSizePolicy(QtWidgets.QSizePolicy.Expanding, QtWidgets.QSizePolicy.Expanding)
        self._values = np.zeros(0)
        self._limit: float | None = None
        self._shown = 0

    def show_values(self, values: np.ndarray, limit: float | None, shown: int) -> None:
        """Draw other values [mm]."""
        self._values, self._limit, self._shown = np.asarray(values, dtype=float), limit, shown
        self.update()

    def paintEvent(self, _event: Any) -> None:
        """Draw; Qt calls it."""
        painter = QtGui.QPainter(self)
        painter.setRenderHint(QtGui.QPainter.Antialiasing)
        painter.fillRect(self.rect(), self.palette().base())
        counts, edges = histogram_bins(self._values, self._limit)
        if counts.size:
            self._draw(painter, counts, edges)
        else:
            painter.drawText(self.rect(), QtCore.Qt.AlignCenter, "–")
        painter.end()

    def _draw(self, painter: QtGui.QPainter, counts: np.ndarray, edges: np.ndarray) -> None:
        width, height = self.width() - 2 * _MARGIN, self.height() - _FOOT - _HEAD
        place = lambda value: _MARGIN + width * (value - edges[0]) / (edges[-1] - edges[0])  # noqa: E731
        shown = self._values[self._shown] if self._shown < len(self._values) else np.nan
        for number, count in enumerate(counts):
            left, right = place(edges[number]), place(edges[number + 1])
            middle = 0.5 * (edges[number] + edges[number + 1])
            color = _BAD if self._limit is not None and middle > self._limit else _GOOD
            if edges[number] <= shown < edges[number + 1]:
                color = _SHOWN
            top = _HEAD + height * (1.0 - count / counts.max())
            painter.fillRect(QtCore.QRectF(left + 0.5, top, right - left - 1.0, height + _HEAD - top), color)
        ink = self.palette().text().color()
        painter.setPen(QtGui.QPen(ink, 1))
        painter.drawLine(
            QtCore.QPointF(_MARGIN, _HEAD + height), QtCore.QPointF(_MARGIN + width, _HEAD + height)
        )
        self._draw_labels(painter, edges, place, ink)

    def _draw_labels(self, painter: QtGui.QPainter, edges: np.ndarray, place: Any, ink: QtGui.QColor) -> None:
        foot = QtCore.QRectF(_MARGIN, self.height() - _FOOT, self.width() - 2 * _MARGIN, _FOOT)
        factor, unit = unit_of(edges[0], edges[-1])
        painter.drawText(foot, QtCore.Qt.AlignLeft | QtCore.Qt.AlignVCenter, f"{edges[0] * factor:.3g}")
        painter.drawText(
            foot, QtCore.Qt.AlignRight | QtCore.Qt.AlignVCenter, f"{edges[-1] * factor:.3g} {unit}"
        )
        if self._limit is None:
            return
        x = place(self._limit)
        painter.setPen(QtGui.QPen(_BAD, 2))
        painter.drawLine(QtCore.QPointF(x, 2), QtCore.QPointF(x, self.height() - _FOOT))
        painter.setPen(ink)
        text = format_deviation(self._limit)
        box = QtCore.QRectF(x - 102, 2, 98, 16)
        painter.drawText(box, QtCore.Qt.AlignRight | QtCore.Qt.AlignVCenter, text)
