"""Several parts in one picture."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Unpack

import numpy as np

from cadskin.errors import ExportError
from cadskin.export.content import Content, Shape, content_of
from cadskin.view.camera import View
from cadskin.view.pictures import draw, save_png
from cadskin.view.software import BACKGROUND
from cadskin.view.style import Style, StyleOptions, checked_size, colour_scale

__all__ = ["sheet"]

_MOST_PIXELS = 100_000_000


def sheet(
    path: str | os.PathLike[str],
    shapes: Sequence[Shape],
    titles: Sequence[str] | None = None,
    *,
    views: Sequence[View] | None = None,
    columns: int | None = None,
    tile: tuple[int, int] = (800, 600),
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
    **style
        The other options of `cadskin.view.picture`.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        No shapes, a wrong number of titles, a wrong option, a sheet of more than 100 million pixels, or a
        file that cannot be written.

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
    pixels = np.full((rows * height, per_row * width, 3), BACKGROUND)
    for k, (content, name) in enumerate(zip(contents, names, strict=True)):
        top, left = height * (k // per_row), width * (k % per_row)
        own = common if views is None else dataclasses.replace(common, view=views[k])
        pixels[top : top + height, left : left + width] = draw(content, own, name, (width, height))
    return save_png(path, pixels, title=", ".join(names)[:1000])


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
