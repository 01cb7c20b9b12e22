"""Flat drawings in the style of cadskin's pictures: lines and points over two axes, several side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from cadskin.view.canvas import Colour, draw_lines, draw_text, hex_colour
from cadskin.view.legend import GREY, INK
from cadskin.view.numbers import tick_labels, ticks
from cadskin.view.pictures import save_png
from cadskin.view.software import BACKGROUND
from cadskin.view.stroke_font import text_width

LINE = hex_colour("#c9ced6")
_HEX = "#3366aa #d1642c #2e8b57 #8a5cb8 #b8352f #1f9aa8 #b8860b #d16aa5 #5b6470 #7aa52a"
COLOURS = [hex_colour(text) for text in _HEX.split()]


@dataclass
class Panel:
    """One chart: its content in data units, drawn by `draw_panels`."""

    title: str
    x_label: str
    y_label: str
    equal: bool = False
    lines: list[tuple[np.ndarray, Colour, float, str]] = field(default_factory=list)
    dots: list[tuple[np.ndarray, Colour, float]] = field(default_factory=list)

    def line(self, points: np.ndarray, colour: Colour, *, width: float = 1.6, name: str = "") -> None:
        """Add a polyline (n, 2)."""
        self.lines.append((segments_of(points), colour, width, name))

    def segments(self, segments: np.ndarray, colour: Colour, *, width: float = 1.0) -> None:
        """Add single lines (n, 4) ``x0 y0 x1 y1``."""
        self.lines.append((np.asarray(segments, float), colour, width, ""))

    def points(self, points: np.ndarray, colour: Colour, *, width: float = 5.0) -> None:
        """Add dots (n, 2)."""
        self.dots.append((np.asarray(points, float), colour, width))


def segments_of(points: np.ndarray) -> np.ndarray:
    """Return the segments (n - 1, 4) of a polyline (n, 2)."""
    points = np.asarray(points, float)
    return np.concatenate([points[:-1], points[1:]], axis=1)


def draw_panels(path: Path, panels: Sequence[Panel], *, size: tuple[int, int] = (800, 640)) -> Path:
    """Draw charts side by side to a PNG file."""
    width, height = size
    pixels = np.full((height, width * len(panels), 3), BACKGROUND)
    for k, panel in enumerate(panels):
        _draw(pixels[:, k * width : (k + 1) * width], panel)
    return save_png(path, pixels, title=", ".join(panel.title for panel in panels))


def _draw(pixels: np.ndarray, panel: Panel) -> None:
    height, width = pixels.shape[:2]
    names = max((text_width(line[3], 13) for line in panel.lines if line[3]), default=-44.0)
    box = np.array([92.0, 96.0, width - 74.0 - names, height - 70.0])  # left, top, right, bottom
    draw_text(pixels, panel.title, 40, 50, height=18, colour=INK, weight=1.2)
    low, high = _limits(panel)
    scale = (box[2:] - box[:2]) / (high - low)
    if panel.equal:
        scale[:] = scale.min()
    middle = (box[:2] + box[2:]) / 2

    def pixel(points: np.ndarray) -> np.ndarray:
        return middle + (points - (low + high) / 2) * scale * [1, -1]

    _draw_axes(pixels, panel, box, (low, high), pixel)
    for segments, colour, thickness, _ in panel.lines:
        ends = np.concatenate([pixel(segments[:, :2]), pixel(segments[:, 2:])], axis=1)
        draw_lines(pixels, ends, thickness, colour)
    for points, colour, thickness in panel.dots:
        draw_lines(pixels, np.concatenate([pixel(points)] * 2, axis=1), thickness, colour)
    _draw_names(pixels, panel, box)


def _limits(panel: Panel) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest x and y of what is drawn, with a margin."""
    ends = [line[0].reshape(-1, 2) for line in panel.lines] + [dots[0] for dots in panel.dots]
    every = np.vstack(ends)
    low, high = every.min(axis=0), every.max(axis=0)
    margin = 0.05 * np.maximum(high - low, 1e-9)
    return low - margin, high + margin


def _draw_axes(pixels, panel, box, limits, pixel) -> None:
    left, top, right, bottom = box
    for axis in (0, 1):
        values = ticks(limits[0][axis], limits[1][axis])
        values = values[(values >= limits[0][axis]) & (values <= limits[1][axis])]
        for value, label in zip(values, tick_labels(values), strict=True):
            place = pixel(np.where(np.arange(2) == axis, value, limits[0]))[axis]
            if axis == 0:
                draw_lines(pixels, np.array([[place, top, place, bottom]]), 0.7, LINE)
                draw_text(pixels, label, place, bottom + 22, height=12, colour=GREY, anchor="middle")
            else:
                draw_lines(pixels, np.array([[left, place, right, place]]), 0.7, LINE)
                draw_text(pixels, label, left - 10, place + 5, height=12, colour=GREY, anchor="right")
    draw_text(pixels, panel.x_label, right, bottom + 48, height=13, colour=INK, anchor="right")
    draw_text(pixels, panel.y_label, 40, top - 16, height=13, colour=INK)


def _draw_names(pixels: np.ndarray, panel: Panel, box: np.ndarray) -> None:
    """Write the names of lines to the right of the chart, each behind a piece of its line."""
    named = [(colour, name) for _, colour, _, name in panel.lines if name]
    x, y = box[2] + 54, box[1] + 16
    for colour, name in named:
        draw_lines(pixels, np.array([[x - 34, y - 5, x - 10, y - 5]]), 3.0, colour)
        draw_text(pixels, name, x, y, height=13, colour=INK)
        y += 24
