"""The legend of a deviation map as a picture: colour bar, ticks, what is shown. Drawn by Qt."""

from __future__ import annotations

from dataclasses import dataclass

from .colormap import ColorMap, unit_of
from .qt import QtCore, QtGui

__all__ = ["LegendText", "draw_label", "draw_legend"]

_PAPER = QtGui.QColor(250, 250, 252, 232)
_INK = QtGui.QColor(28, 30, 36)
_FAINT = QtGui.QColor(96, 100, 112)


@dataclass(frozen=True)
class LegendText:
    """What stands around the colour bar.

    Parameters
    ----------
    title : str
    lines : tuple of str
        Small print below the bar: instance, exaggeration, extremes.
    marks : tuple of float
        Deviations [mm] that get a mark at the bar: the ends of the tolerance zone.
    """

    title: str
    lines: tuple[str, ...] = ()
    marks: tuple[float, ...] = ()


def draw_legend(
    colors: ColorMap, text: LegendText, *, bar_height: int = 220, scale: float = 1.0
) -> QtGui.QImage:
    """Return the legend as a picture with its own light ground, readable on any background."""
    layout = _Layout(colors, text, bar_height, scale)
    picture = QtGui.QImage(layout.width, layout.height, QtGui.QImage.Format_RGBA8888)
    picture.fill(QtCore.Qt.transparent)
    painter = QtGui.QPainter(picture)
    painter.setRenderHint(QtGui.QPainter.Antialiasing)
    painter.setRenderHint(QtGui.QPainter.TextAntialiasing)
    layout.draw(painter)
    painter.end()
    return picture


def draw_label(text: str, *, scale: float = 1.0) -> QtGui.QImage:
    """Return a label whose lower left corner points at a place."""
    font = _font(12, scale, bold=True)
    metrics = QtGui.QFontMetrics(font)
    tail = round(14 * scale)
    width = _text_width(font, text) + round(14 * scale) + tail
    height = metrics.height() + round(8 * scale) + tail
    picture = QtGui.QImage(width, height, QtGui.QImage.Format_RGBA8888)
    picture.fill(QtCore.Qt.transparent)
    painter = QtGui.QPainter(picture)
    painter.setRenderHint(QtGui.QPainter.Antialiasing)
    painter.setPen(QtGui.QPen(_INK, 1.5 * scale))
    painter.drawLine(QtCore.QPointF(0.0, height), QtCore.QPointF(tail, height - tail))
    painter.setBrush(_INK)
    painter.drawEllipse(QtCore.QPointF(1.5 * scale, height - 1.5 * scale), 3.0 * scale, 3.0 * scale)
    box = QtCore.QRectF(tail, 0.5, width - tail - 1.0, height - tail - 1.0)
    painter.setBrush(QtGui.QColor(_PAPER.red(), _PAPER.green(), _PAPER.blue(), 245))
    painter.setPen(QtGui.QPen(_INK, 1))
    painter.drawRoundedRect(box, 4 * scale, 4 * scale)
    painter.setFont(font)
    painter.drawText(box, QtCore.Qt.AlignCenter, text)
    painter.end()
    return picture


class _Layout:
    """Where everything goes, in pixels."""

    def __init__(self, colors: ColorMap, text: LegendText, bar_height: int, scale: float) -> None:
        self.colors, self.text, self.scale = colors, text, scale
        self.unit = unit_of(colors.low, colors.high)[1]
        self.normal, self.small, self.strong = _font(12, scale), _font(11, scale), _font(12, scale, bold=True)
        self.margin = round(9 * scale)
        self.bar_width = round(20 * scale)
        self.bar_height = round(bar_height * scale)
        self.line = QtGui.QFontMetrics(self.normal).height()
        self.small_line = QtGui.QFontMetrics(self.small).height()
        self.bar_left = self.margin + round(7 * scale)
        self.bar_top = self.margin + self.line + round(12 * scale)
        self.ticks = colors.ticks(max(3, min(9, int(self.bar_height / (1.6 * self.line)) + 1)))
        self.width = 2 * self.margin + max(
            _text_width(self.strong, self.heading),
            self.bar_left - self.margin + self.bar_width + round(9 * scale) + self._tick_width(),
            *(_text_width(self.small, line) for line in text.lines),
        )
        below = len(text.lines) * self.small_line + (round(8 * scale) if text.lines else 0)
        self.height = self.bar_top + self.bar_height + round(8 * scale) + below + self.margin

    @property
    def heading(self) -> str:
        """Title and unit."""
        return f"{self.text.title} [{self.unit}]"

    def _tick_width(self) -> int:
        return max((_text_width(self.normal, label) for _, label in self.ticks), default=0)

    def y_of(self, value: float) -> float:
        """Return the height on the picture of a deviation."""
        place = (value - self.colors.low) / self.colors.span
        return self.bar_top + self.bar_height * (1.0 - place)

    def draw(self, painter: QtGui.QPainter) -> None:
        """Draw everything."""
        self._draw_paper(painter)
        self._draw_bar(painter)
        self._draw_ticks(painter)
        self._draw_marks(painter)
        painter.setPen(_FAINT)
        painter.setFont(self.small)
        baseline = (
            self.bar_top + self.bar_height + round(16 * self.scale) + QtGui.QFontMetrics(self.small).ascent()
        )
        for number, line in enumerate(self.text.lines):
            painter.drawText(self.margin, baseline + number * self.small_line, line)

    def _draw_paper(self, painter: QtGui.QPainter) -> None:
        painter.setPen(QtGui.QPen(QtGui.QColor(120, 124, 136, 160), 1))
        painter.setBrush(_PAPER)
        radius = 5 * self.scale
        painter.drawRoundedRect(QtCore.QRectF(0.5, 0.5, self.width - 1.0, self.height - 1.0), radius, radius)
        painter.setPen(_INK)
        painter.setFont(self.strong)
        painter.drawText(self.margin, self.margin + QtGui.QFontMetrics(self.strong).ascent(), self.heading)

    def _draw_bar(self, painter: QtGui.QPainter) -> None:
        palette = self.colors.colors()
        painter.setPen(QtCore.Qt.NoPen)
        for row in range(self.bar_height):
            entry = 1 + int((1.0 - (row + 0.5) / self.bar_height) * 254)
            painter.setBrush(QtGui.QColor(*(int(channel) for channel in palette[entry])))
            painter.drawRect(self.bar_left, self.bar_top + row, self.bar_width, 1)
        painter.setBrush(QtCore.Qt.NoBrush)
        painter.setPen(QtGui.QPen(_INK, 1))
        painter.drawRect(
            QtCore.QRectF(self.bar_left - 0.5, self.bar_top - 0.5, self.bar_width + 1, self.bar_height + 1)
        )

    def _draw_ticks(self, painter: QtGui.QPainter) -> None:
        metrics = QtGui.QFontMetrics(self.normal)
        right = self.bar_left + self.bar_width
        painter.setFont(self.normal)
        painter.setPen(QtGui.QPen(_INK, 1))
        label_right = right + round(9 * self.scale) + self._tick_width()
        for value, label in self.ticks:
            y = self.y_of(value)
            painter.drawLine(QtCore.QPointF(right, y), QtCore.QPointF(right + 5 * self.scale, y))
            left = label_right - _text_width(self.normal, label)
            painter.drawText(QtCore.QPointF(left, y + metrics.capHeight() / 2.0), label)

    def _draw_marks(self, painter: QtGui.QPainter) -> None:
        painter.setPen(QtCore.Qt.NoPen)
        painter.setBrush(_INK)
        reach = 5.0 * self.scale
        for value in self.text.marks:
            if self.colors.low <= value <= self.colors.high:
                y, tip = self.y_of(value), self.bar_left - 1.0
                corners = [(tip, y), (tip - 1.3 * reach, y - reach), (tip - 1.3 * reach, y + reach)]
                painter.drawPolygon(QtGui.QPolygonF([QtCore.QPointF(*corner) for corner in corners]))


def _font(pixels: float, scale: float, *, bold: bool = False) -> QtGui.QFont:
    font = QtGui.QFont("DejaVu Sans")
    font.setStyleHint(QtGui.QFont.SansSerif)
    font.setPixelSize(max(6, round(pixels * scale)))
    font.setBold(bold)
    return font


def _text_width(font: QtGui.QFont, text: str) -> int:
    return QtGui.QFontMetrics(font).boundingRect(text).width() + 2
