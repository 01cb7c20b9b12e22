"""The picture of ``cadskin spec``: a tile for each tolerance, its faces in another colour.

Each is seen from where its faces are visible; two tiles where no view shows them all.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cadskin.errors import ExportError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Vectors
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification, Tolerance

__all__ = ["draw_tolerances"]

_MOST_TILES = 48
_TILE = (640, 480)


def draw_tolerances(path: Path, spec: Specification, models: tuple[NominalModel, ...]) -> Path:
    """Draw the parts once for each tolerance that is on faces, up to 48 tiles.

    Raises
    ------
    ExportError
        No tolerance is on faces, or the file cannot be written.
    """
    import numpy as np

    from cadskin.shape import DiscreteShape
    from cadskin.view import sheet
    from cadskin.view.visibility import seen_areas, views_of

    tiles: list[DiscreteShape] = []
    titles: list[str] = []
    views: list[Vectors] = []
    areas: dict[int, Floats] = {}
    for tolerance in spec:
        model = _model_of(tolerance, models)
        if model is None:
            continue
        surface = model.surface
        if id(model) not in areas:
            areas[id(model)] = seen_areas(surface)
        labels = np.isin(surface.face_ids, tolerance.feature.faces).astype(np.int64)
        chosen = views_of(tolerance.feature.faces, areas[id(model)])
        if len(tiles) + len(chosen) > _MOST_TILES:
            break
        tiles += [DiscreteShape(surface.points, surface.triangles, labels)] * len(chosen)
        titles += [f"{tolerance.id} {tolerance}", f"{tolerance.id}, other side"][: len(chosen)]
        views += chosen
    if not tiles:
        raise ExportError(f"no picture {path}: no tolerance is on faces of the part")
    return sheet(path, tiles, titles, views=views, tile=_TILE)


def _model_of(tolerance: Tolerance, models: tuple[NominalModel, ...]) -> NominalModel | None:
    if not tolerance.feature.faces:
        return None
    named = [model for model in models if tolerance.feature.part in (None, model.source.part)]
    return named[0] if named else None
