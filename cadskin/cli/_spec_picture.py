"""The picture of ``cadskin spec``: one tile per tolerance, its faces in another colour."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from cadskin.errors import ExportError

if TYPE_CHECKING:
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification, Tolerance

__all__ = ["draw_tolerances"]

_MOST_TILES = 48
_TILE = (640, 480)
# What the lettering of pictures has no sign for.
_PLAIN = {"⌀": "Ø", "Ⓜ": "(M)", "Ⓛ": "(L)", "Ⓕ": "(F)", "Ⓣ": "(T)", "Ⓤ": "(U)", "Ⓟ": "(P)", "ⓈⓉ": "(ST)"}


def draw_tolerances(path: Path, spec: Specification, models: tuple[NominalModel, ...]) -> Path:
    """Draw the parts once for each tolerance that is on faces, up to 48 of them.

    Raises
    ------
    ExportError
        No tolerance is on faces, or the file cannot be written.
    """
    import numpy as np

    from cadskin.shape import DiscreteShape
    from cadskin.view import sheet

    tiles: list[DiscreteShape] = []
    titles: list[str] = []
    for tolerance in spec:
        model = _model_of(tolerance, models)
        if model is None or len(tiles) == _MOST_TILES:
            continue
        surface = model.surface
        labels = np.isin(surface.face_ids, tolerance.feature.faces).astype(np.int64)
        tiles.append(DiscreteShape(surface.points, surface.triangles, labels))
        titles.append(_title(tolerance))
    if not tiles:
        raise ExportError(f"no picture {path}: no tolerance is on faces of the part")
    return sheet(path, tiles, titles, tile=_TILE)


def _model_of(tolerance: Tolerance, models: tuple[NominalModel, ...]) -> NominalModel | None:
    if not tolerance.feature.faces:
        return None
    named = [model for model in models if tolerance.feature.part in (None, model.source.part)]
    return named[0] if named else None


def _title(tolerance: Tolerance) -> str:
    text = str(tolerance).removeprefix(tolerance.characteristic.symbol)
    for sign, plain in _PLAIN.items():
        text = text.replace(sign, plain)
    return f"{tolerance.id} {tolerance.type.replace('_', ' ')}{text}"
