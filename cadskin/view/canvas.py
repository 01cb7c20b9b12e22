"""Flat drawing on a picture: lines with round ends, text, rectangles; all with smooth edges."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
from numba import njit

from cadskin._typing import Floats
from cadskin.view.stroke_font import text_segments, text_width

__all__ = ["Colour", "draw_lines", "draw_text", "fill_rows", "hex_colour"]

Colour: TypeAlias = tuple[float, float, float]  # sRGB in 0..1


def hex_colour(text: str) -> Colour:
    """Return the colour of ``#rrggbb``.

    Examples
    --------
    >>> hex_colour("#ff0000")
    (1.0, 0.0, 0.0)
    """
    red, green, blue = (int(text[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue


def draw_lines(pixels: Floats, segments: Floats, width: float, colour: Colour) -> None:
    """Draw lines (k, 4) ``x0 y0 x1 y1`` of a given width [pixel] into ``pixels`` (h, w, 3)."""
    if not len(segments):
        return
    margin = width / 2 + 1
    height, breadth = pixels.shape[:2]
    left = max(int(segments[:, [0, 2]].min() - margin), 0)
    top = max(int(segments[:, [1, 3]].min() - margin), 0)
    right = min(int(segments[:, [0, 2]].max() + margin) + 1, breadth)
    bottom = min(int(segments[:, [1, 3]].max() + margin) + 1, height)
    if left >= right or top >= bottom:
        return
    coverage = np.zeros((bottom - top, right - left))
    local = np.ascontiguousarray(segments - np.array([left, top, left, top]), dtype=np.float64)
    _cover(coverage, local, width / 2)
    window = pixels[top:bottom, left:right]
    window += coverage[:, :, None] * (np.array(colour) - window)


@njit(cache=True)
def _cover(coverage, segments, radius):  # type: ignore[no-untyped-def]
    """Set each pixel to the share of it that lies within ``radius`` of a line (greatest of all lines)."""
    height, width = coverage.shape
    reach = radius + 1.0
    for s in range(segments.shape[0]):
        x0, y0, x1, y1 = segments[s, 0], segments[s, 1], segments[s, 2], segments[s, 3]
        dx, dy = x1 - x0, y1 - y0
        square = dx * dx + dy * dy
        for row in range(max(int(min(y0, y1) - reach), 0), min(int(max(y0, y1) + reach) + 1, height)):
            for column in range(max(int(min(x0, x1) - reach), 0), min(int(max(x0, x1) + reach) + 1, width)):
                px, py = column + 0.5 - x0, row + 0.5 - y0
                along = 0.0
                if square > 0.0:
                    along = min(max((px * dx + py * dy) / square, 0.0), 1.0)
                distance = np.hypot(px - along * dx, py - along * dy)
                share = min(max(radius + 0.5 - distance, 0.0), 1.0)
                if share > coverage[row, column]:
                    coverage[row, column] = share


def draw_text(
    pixels: Floats,
    text: str,
    x: float,
    y: float,
    *,
    height: float,
    colour: Colour,
    anchor: Literal["left", "middle", "right"] = "left",
    weight: float = 1.0,
) -> None:
    """Write ``text`` with its baseline at ``y`` and its left end, middle or right end at ``x`` [pixel]."""
    x -= {"left": 0.0, "middle": 0.5, "right": 1.0}[anchor] * text_width(text, height)
    # Below 1.1 pixels a stroke gets pale.
    draw_lines(pixels, text_segments(text, x, y, height), max(0.115 * height * weight, 1.1), colour)


def fill_rows(pixels: Floats, box: tuple[float, float, float, float], colours: Floats) -> None:
    """Fill the box ``left top right bottom`` [pixel] with colours (k, 3), first on top."""
    left, top, right, bottom = (round(value) for value in box)
    share = (np.arange(top, bottom) + 0.5 - top) / max(bottom - top, 1)
    rows = colours[np.minimum((share * len(colours)).astype(np.int64), len(colours) - 1)]
    pixels[top:bottom, left:right] = rows[:, None]
