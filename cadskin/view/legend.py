"""What stands around the part: title, colour bar, scale, axes."""

from __future__ import annotations

import numpy as np

from cadskin._typing import Floats
from cadskin.view.camera import Camera
from cadskin.view.canvas import Colour, draw_lines, draw_text, fill_rows, hex_colour
from cadskin.view.numbers import FACTORS, number, tick_labels, ticks
from cadskin.view.stroke_font import text_width
from cadskin.view.style import ColourScale

__all__ = ["GREY", "INK", "draw_axes", "draw_colour_bar", "draw_scale", "draw_title"]

INK: Colour = hex_colour("#20262e")
GREY: Colour = hex_colour("#5b6470")
_AXIS_COLOURS = (hex_colour("#c0392b"), hex_colour("#2e8b57"), hex_colour("#2f6db5"))


def draw_title(
    pixels: Floats, title: str, subtitle: str, *, box: tuple[float, float, float], scale: float
) -> None:
    """Write the title, and below it a line in grey; ``box`` is left, top, right. What is too long shrinks."""
    left, top, right = box
    for text, height, base, colour, weight in (
        (title, 22 * scale, 22 * scale, INK, 1.25),
        (subtitle, 14 * scale, 54 * scale, GREY, 1.0),
    ):
        fitting = height * min(1.0, (right - left) / max(text_width(text, height), 1e-9))
        draw_text(pixels, text, left, top + base, height=fitting, colour=colour, weight=weight)


def draw_colour_bar(
    pixels: Floats, colours: ColourScale, box: tuple[float, float, float, float], scale: float
) -> None:
    """Draw the bar into the box ``left top right bottom`` [pixel], labels to its right, the unit above it."""
    left, top, right, bottom = (float(round(value)) for value in box)
    fill_rows(pixels, (left, top, right, bottom), colours.table[::-1])
    _pointed_ends(pixels, colours, (left, top, right, bottom))
    factor = FACTORS[colours.unit]
    values = ticks(colours.low * factor, colours.high * factor)
    share = (values / factor - colours.low) / (colours.high - colours.low)
    line = max(1.0, 1.2 * scale)
    for label, height in zip(tick_labels(values), bottom - share * (bottom - top), strict=True):
        tick = np.array([[right + 1, height, right + 7 * scale, height]])
        draw_lines(pixels, tick, line, GREY)
        draw_text(pixels, label, right + 14 * scale, height + 6.5 * scale, height=13 * scale, colour=INK)
    draw_text(pixels, colours.unit, left, top - 30 * scale, height=14 * scale, colour=INK)


def _pointed_ends(pixels: Floats, colours: ColourScale, box: tuple[float, float, float, float]) -> None:
    """Frame the bar; add a triangle at an end beyond which there are values."""
    left, top, right, bottom = box
    middle, point = (left + right) / 2, 0.75 * (right - left)
    corners = [(left, top), (left, bottom)]
    for beyond, end, direction, colour in (
        (colours.beyond[0], bottom, 1.0, colours.table[0]),
        (colours.beyond[1], top, -1.0, colours.table[-1]),
    ):
        outer = [(left, end), (right, end)]
        if beyond:
            tip = (middle, end + direction * point)
            for row in np.arange(0.5, point, 1.0):
                half = (right - left) / 2 * (1 - row / point)
                y = end + direction * row
                segment = np.array([[middle - half, y, middle + half, y]])
                draw_lines(pixels, segment, 1.0, (float(colour[0]), float(colour[1]), float(colour[2])))
            outer = [(left, end), tip, (right, end)]
        path = np.array(outer)
        draw_lines(pixels, np.concatenate([path[:-1], path[1:]], axis=1), 1.0, GREY)
    sides = np.array([[*corners[0], *corners[1]], [right, top, right, bottom]])
    draw_lines(pixels, sides, 1.0, GREY)


def draw_scale(pixels: Floats, camera: Camera, *, left: float, bottom: float, scale: float) -> float:
    """Draw a bar of a round length in mm; return the x where it ends [pixel]."""
    length = 110 * scale / camera.scale  # mm
    power = 10.0 ** np.floor(np.log10(length))
    length = float(power * max(step for step in (1.0, 2.0, 5.0) if step * power <= length * (1 + 1e-9)))
    width = length * camera.scale
    x0, x1, y = left, left + width, bottom - 6 * scale
    bar = [[x0, y, x1, y], [x0, y - 5 * scale, x0, y + 5 * scale], [x1, y - 5 * scale, x1, y + 5 * scale]]
    draw_lines(pixels, np.array(bar), max(1.5 * scale, 1.0), GREY)
    text = f"{number(length)} mm"
    draw_text(pixels, text, x1 + 12 * scale, bottom, height=13 * scale, colour=GREY)
    return x1 + 12 * scale + text_width(text, 13 * scale)


def draw_axes(pixels: Floats, camera: Camera, *, at: tuple[float, float], scale: float) -> None:
    """Draw the directions of x, y and z around the point ``at`` [pixel], the farthest first."""
    order = np.argsort(camera.axes[2])
    for axis in order:
        right, up = camera.axes[0, axis], camera.axes[1, axis]
        length = float(np.hypot(right, up))
        if length < 0.15:  # it points at the eye
            continue
        x, y = at[0] + 34 * scale * right, at[1] - 34 * scale * up
        draw_lines(pixels, np.array([[*at, x, y]]), 2.2 * scale, _AXIS_COLOURS[axis])
        text_x = at[0] + (34 * scale + 11 * scale / length) * right
        text_y = at[1] - (34 * scale + 11 * scale / length) * up + 4.5 * scale
        draw_text(
            pixels,
            "xyz"[axis],
            text_x,
            text_y,
            height=13 * scale,
            colour=_AXIS_COLOURS[axis],
            anchor="middle",
        )
