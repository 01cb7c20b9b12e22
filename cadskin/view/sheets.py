"""Several parts in one picture."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Unpack

import numpy as np

from cadskin._typing import Floats
from cadskin.errors import ExportError
from cadskin.export.content import Content, Shape, content_of
from cadskin.view.camera import View
from cadskin.view.legend import draw_colour_bar, draw_title
from cadskin.view.pictures import draw, headline, save_png
from cadskin.view.scene import automatic_exaggeration
from cadskin.view.software import BACKGROUND
from cadskin.view.style import Style, StyleOptions, checked_size, colour_scale

__all__ = ["sheet"]

_MOST_PIXELS = 100_000_000
_STEPS = 51  # of each colour channel with a common bar: the eye sees no difference, the file is half as large
_HEADER, _BAR = 44, 96  # pixels beside tiles of 280 x 210 with one common bar


def sheet(
    path: str | os.PathLike[str],
    shapes: Sequence[Shape],
    titles: Sequence[str] | None = None,
    *,
    views: Sequence[View] | None = None,
    columns: int | None = None,
    tile: tuple[int, int] = (800, 600),
    common_bar: bool = False,
    **style: Unpack[StyleOptions],
) -> Path:
    """Draw several shapes to one PNG file, row by row.

    Skin models share the limits of the colour bar, so that they can be compared.

    Parameters
    ----------
    path : str or path
    shapes : sequence of NominalModel, SkinModel or DiscreteShape
    titles : sequence of str, optional
        One per shape, by default the names of the parts.
    views : sequence of View, optional
        One per shape, instead of the view of all.
    columns : int, optional
        By default as many as make the sheet about square.
    tile : tuple of int
        Width and height of one tile [pixel].
    common_bar : bool
        True: skin models with one colour bar at the right of the sheet, in tiles without axes and scale and
        with larger letters; for sheets of many small tiles.
    **style
        The other options of `cadskin.view.picture`.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        No shapes, a wrong number of titles, a wrong option, a sheet of more than 100 million pixels, a
        common bar for shapes without a deviation, or a file that cannot be written.

    Examples
    --------
    >>> import tempfile, cadskin.shape
    >>> tet = cadskin.shape.DiscreteShape([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ...                                   [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], [0, 1, 2, 3])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     sheet(folder + "/two.png", [tet, tet], ["one", "two"], tile=(200, 150)).name
    'two.png'
    """
    contents = [content_of(shape) for shape in shapes]
    names = [content.name for content in contents] if titles is None else list(titles)
    if not contents or len(names) != len(contents):
        raise ExportError(f"a sheet needs shapes and one title for each: {len(contents)} and {len(names)}")
    if views is not None and len(views) != len(contents):
        raise ExportError(f"a sheet needs one view for each shape: {len(contents)} and {len(views)}")
    width, height = checked_size(tile)
    per_row = _columns(len(contents), columns)
    rows = -(-len(contents) // per_row)
    if width * per_row * height * rows > _MOST_PIXELS:
        raise ExportError(f"{rows} x {per_row} tiles of {width} x {height} pixels are too many")
    common = _with_common_limits(Style(**style), contents)
    bar = _bar_width((width, height)) if common_bar else 0
    pixels = np.full((rows * height, per_row * width + bar, 3), BACKGROUND)
    for k, (content, name) in enumerate(zip(contents, names, strict=True)):
        top, left = height * (k // per_row), width * (k % per_row)
        own = common if views is None else dataclasses.replace(common, view=views[k])
        drawn = (_small_tile if common_bar else draw)(content, own, name, (width, height))
        pixels[top : top + height, left : left + width] = drawn
    if common_bar:
        _draw_common_bar(pixels, contents, common, (width, height))
        pixels = BACKGROUND + np.round((pixels - BACKGROUND) * _STEPS) / _STEPS
    return save_png(path, pixels, title=", ".join(names)[:1000])


def _letters(tile: tuple[int, int]) -> float:
    """Scale of the letters of small tiles."""
    return min(tile[0] / 280, tile[1] / 210)


def _bar_width(tile: tuple[int, int]) -> int:
    return round(_BAR * _letters(tile))


def _small_tile(content: Content, style: Style, name: str, tile: tuple[int, int]) -> Floats:
    """Return a tile (h, w, 3): title, range and exaggeration in two lines, the part below them."""
    (width, height), scale = tile, _letters(tile)
    if content.deviation is None:
        raise ExportError(f"a common colour bar is for skin models; {content.name} has no deviation")
    header = round(_HEADER * scale)
    factor = automatic_exaggeration(content) if style.exaggeration is None else style.exaggeration
    line = headline(content, colour_scale(content.deviation, style)).removeprefix("deviation ")
    bare = dataclasses.replace(style, legend=False, exaggeration=factor)
    pixels = np.full((height, width, 3), BACKGROUND)
    pixels[header:] = draw(content, bare, name, (width, height - header))
    box = (10 * scale, 8 * scale, width - 10 * scale)
    draw_title(pixels, name, f"{line} · drawn × {factor:g}", box=box, scale=0.58 * scale)
    return pixels


def _draw_common_bar(
    pixels: Floats, contents: Sequence[Content], style: Style, tile: tuple[int, int]
) -> None:
    """Draw the colour bar at the right; it ends in a point where any shape goes beyond its limits."""
    known = [content.deviation for content in contents if content.deviation is not None]
    height, width = pixels.shape[:2]
    scale = _letters(tile)
    middle, half = height / 2, min(0.4 * height, 1.2 * tile[1])
    left = width - (_BAR - 14) * scale
    box = (left, middle - half, left + 18 * scale, middle + half)
    draw_colour_bar(pixels, colour_scale(np.concatenate(known), style), box, 0.8 * scale)


def _columns(count: int, columns: int | None) -> int:
    if columns is None:
        return int(np.ceil(np.sqrt(count)))
    if columns < 1 or int(columns) != columns:
        raise ExportError(f"columns must be a whole number of at least 1, got {columns}")
    return min(int(columns), count)


def _with_common_limits(style: Style, contents: Sequence[Content]) -> Style:
    """Return ``style`` with the limits that the greatest deviation of all shapes needs."""
    deviations = [content.deviation for content in contents if content.deviation is not None]
    if style.clim is not None or not deviations:
        return style
    return dataclasses.replace(style, clim=max(colour_scale(values, style).high for values in deviations))
