"""A picture of a part: deviations as colours, the shape exaggerated, edges drawn, on any machine."""

from __future__ import annotations

import os
from collections import Counter
from pathlib import Path
from typing import Unpack

import numpy as np

from cadskin._typing import Floats, Vectors
from cadskin.export.atomic import write_bytes
from cadskin.export.content import Content, Shape, content_of
from cadskin.view.camera import Camera, fit, view_direction
from cadskin.view.canvas import draw_text
from cadskin.view.legend import GREY, draw_axes, draw_colour_bar, draw_scale, draw_title
from cadskin.view.numbers import FACTORS, number, signed_range
from cadskin.view.png import encode_png
from cadskin.view.scene import Scene, automatic_exaggeration, scene_of
from cadskin.view.software import best_direction, render
from cadskin.view.style import ColourScale, Style, StyleOptions, checked_size, colour_scale

__all__ = ["draw", "headline", "picture", "save_png", "shown"]

_NAMED = 3  # so many faces are told by name
_MARGIN = 40  # pixels of a 1200 x 900 picture, like all lengths below
_HEADER, _FOOTER, _BAR = 96, 84, 150


def picture(
    path: str | os.PathLike[str],
    shape: Shape,
    *,
    title: str | None = None,
    size: tuple[int, int] = (1200, 900),
    **style: Unpack[StyleOptions],
) -> Path:
    """Draw a shape to a PNG file, off screen and without any graphics library.

    A skin model shows its deviation as colours, with a colour bar, on a surface whose displacement is
    exaggerated by the printed factor; every point has the colour of its own feature, so colours stop at sharp
    edges. A nominal model has one colour per feature, a discrete shape one per B-rep face.

    Parameters
    ----------
    path : str or path
    shape : NominalModel, SkinModel or DiscreteShape
    title : str, optional
        By default the name of the part.
    size : tuple of int
        Width and height [pixel].
    view : str or (3,) float
        ``auto`` (the oblique view that shows most of the part), ``iso``, ``front``, ``back``, ``left``,
        ``right``, ``top``, ``bottom``, or a direction from the part to the eye.
    exaggeration : float
        Factor on the displacement. By default the greatest of 1, 2, 5, 10, ... that keeps the drawn shift
        below 1.2 % of the part and folds nothing (see `cadskin.view.scene.automatic_exaggeration`).
    clim : float or (float, float)
        Deviations [mm] at the ends of the colour bar; one number is symmetric about 0. By default the next
        round number above the greatest. Beyond them the end colour is drawn and the bar ends in a point.
    unit : str
        ``mm`` or ``µm`` of the colour bar; by default by size.
    colormap : str or (k, 3) float
        ``blue-red``, ``green-purple``, ``dark-light``, or sRGB rows in 0..1.
    edges : bool
        Draw B-rep edges and outlines.
    lit : bool
        False: every point has exactly the colour of the bar, without light and shade.
    legend : bool
        False: the part alone.
    engine : str
        ``software`` (always works), or ``pyvista`` (in a child process, needs ``cadskin[view]`` and libGL).

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        A wrong option, or a file that cannot be written; nothing is left behind.
    GeometryError
        Nothing to draw.
    MissingDependencyError
        ``engine="pyvista"`` and a package or a system library is missing.

    Examples
    --------
    >>> import tempfile, cadskin.shape
    >>> tet = cadskin.shape.DiscreteShape([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ...                                   [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], [0, 1, 2, 3])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     picture(folder + "/tet.png", tet, title="tetrahedron", size=(400, 300)).read_bytes()[1:4]
    b'PNG'
    """
    width_height = checked_size(size)
    content = content_of(shape)
    name = content.name if title is None else title
    return save_png(path, draw(content, Style(**style), name, width_height), title=name)


def save_png(path: str | os.PathLike[str], pixels: Floats, *, title: str) -> Path:
    """Write ``pixels`` (h, w, 3), sRGB in 0..1, to a PNG file in one step."""
    from cadskin import __version__

    data = np.round(np.clip(pixels, 0.0, 1.0) * 255).astype(np.uint8)
    return write_bytes(path, encode_png(data, text={"Title": title, "Software": f"cadskin {__version__}"}))


def draw(content: Content, style: Style, title: str, size: tuple[int, int]) -> Floats:
    """Return the picture (height, width, 3) of a shape, sRGB in 0..1."""
    colours = None if content.deviation is None else colour_scale(content.deviation, style)
    exaggeration = automatic_exaggeration(content) if style.exaggeration is None else style.exaggeration
    scene = _scene(content, colours, exaggeration)
    scale = min(size[0] / 1200, size[1] / 900)
    camera = fit(_direction(scene, style), scene.points, _frame(size, scale, style, bar=colours is not None))
    pixels = _render(scene, camera, size, style)
    if style.legend:
        header = headline(content, colours)
        left = _MARGIN * scale
        right = size[0] - left
        draw_title(pixels, title, header, box=(left, left, right), scale=scale)
        _draw_footer(pixels, camera, None if colours is None else exaggeration, scale)
        if colours is not None:
            _draw_bar(pixels, colours, scale)
    return pixels


def _scene(content: Content, colours: ColourScale | None, exaggeration: float) -> Scene:
    if colours is None:
        return scene_of(content)
    return scene_of(
        content, exaggeration=exaggeration, low=colours.low, high=colours.high, table=colours.table
    )


def _direction(scene: Scene, style: Style) -> Vectors:
    if isinstance(style.view, str) and style.view == "auto":
        return best_direction(scene)
    return view_direction(style.view)


def _frame(
    size: tuple[int, int], scale: float, style: Style, *, bar: bool
) -> tuple[float, float, float, float]:
    """Return left, top, right and bottom of the room for the part."""
    width, height = size
    if not style.legend:
        margin = 0.03 * min(width, height)
        return margin, margin, width - margin, height - margin
    right = width - (_MARGIN + (_BAR if bar else 0)) * scale
    return _MARGIN * scale, (_MARGIN + _HEADER) * scale, right, height - (_MARGIN + _FOOTER) * scale


def _render(scene: Scene, camera: Camera, size: tuple[int, int], style: Style) -> Floats:
    if style.engine == "pyvista":
        from cadskin.view.pyvista_engine import render_in_child

        return render_in_child(scene, camera, size, edges=style.edges, lit=style.lit)
    return render(scene, camera, size, edges=style.edges, lit=style.lit)


def headline(content: Content, colours: ColourScale | None) -> str:
    """Return the line below the title: the range of the deviation, or what the part consists of."""
    if colours is not None and content.deviation is not None:
        factor = FACTORS[colours.unit]
        known = content.deviation[np.isfinite(content.deviation)]
        low, high = _range(known * factor)
        text = f"deviation {signed_range(low, high)} {colours.unit}"
        share = len(known) / max(len(content.deviation), 1)
        return text if share == 1.0 else f"{text} · {100 * share:.0f} % measured, the rest is grey"
    size = " × ".join(number(float(extent)) for extent in np.ptp(content.points, axis=0))
    return " · ".join([*shown(content), f"{content.surface.n_triangles} triangles", f"{size} mm"])


def shown(content: Content) -> list[str]:
    """Return what a shape consists of, in words: its faces by name where they are few, else by kind."""
    present = np.unique(content.surface.face_ids)
    present = present[present >= 0]
    if content.nominal is None:
        if len(present) < 2:  # a scan, a mesh of another program, or a piece cut out
            return [f"face {present[0]}" if len(present) and present[0] else "mesh"]
        few = ", ".join(map(str, present[:-1])) + f" and {present[-1]}"
        return [f"faces {few}" if len(present) <= _NAMED else f"{len(present)} faces"]
    faces = [content.nominal.faces[face] for face in present]
    if len(faces) <= _NAMED:
        return [", ".join(face.name or f"{face.kind} (face {face.index})" for face in faces)]
    kinds = Counter(face.kind for face in faces).most_common()
    counts = [f"{len(faces)} faces: {', '.join(_counted(kind, count) for kind, count in kinds)}"]
    if len(content.nominal.features) != len(content.nominal.faces):
        counts.append(f"{len(content.nominal.features)} features")
    return counts


def _counted(kind: str, count: int) -> str:
    word = {"bspline": "B-spline", "other": "other surface"}.get(kind, kind)
    return f"{count} {word if count == 1 else 'tori' if kind == 'torus' else word + 's'}"


def _range(values: Floats) -> tuple[float, float]:
    return float(values.min()), float(values.max())


def _draw_footer(pixels: Floats, camera: Camera, exaggeration: float | None, scale: float) -> None:
    height = pixels.shape[0]
    bottom = height - _MARGIN * scale
    draw_axes(pixels, camera, at=((_MARGIN + 44) * scale, bottom - 44 * scale), scale=scale)
    end = draw_scale(pixels, camera, left=(_MARGIN + 120) * scale, bottom=bottom, scale=scale)
    if exaggeration is not None:
        text = f"deviation drawn × {exaggeration:g}"
        draw_text(pixels, text, end + 28 * scale, bottom, height=13 * scale, colour=GREY)


def _draw_bar(pixels: Floats, colours: ColourScale, scale: float) -> None:
    height, width = pixels.shape[:2]
    top, bottom = (_MARGIN + _HEADER + 60) * scale, height - (_MARGIN + _FOOTER + 30) * scale
    left = width - (_MARGIN + 98) * scale
    draw_colour_bar(pixels, colours, (left, top, left + 24 * scale, bottom), scale)
