"""Accept faces that have changed."""

from __future__ import annotations

from typing import Any

import FreeCADGui

from .. import api, datum, skin, tolerance
from ..command import QT_TRANSLATE_NOOP, Command
from ..objects import is_a

__all__ = ["AcceptFaces", "FindFaces"]


def _selected() -> list[Any]:
    kinds = (tolerance.TYPE, datum.TYPE, skin.TYPE)
    chosen = FreeCADGui.Selection.getSelection()
    return [obj for obj in chosen if any(is_a(obj, kind) for kind in kinds)]


class AcceptFaces(Command):
    """Take the faces as they are now for those that are meant."""

    name = "CadSkin_AcceptFaces"
    menu = QT_TRANSLATE_NOOP("CadSkin_AcceptFaces", "Accept changed faces")
    tip = QT_TRANSLATE_NOOP("CadSkin_AcceptFaces", "The faces of the selected tolerances are the right ones")
    icon = "accept_faces"

    def makes_sense(self) -> bool:
        """Tell whether tolerances, datums or skin models are selected."""
        return bool(_selected())

    def run(self) -> None:
        """Accept them."""
        for obj in _selected():
            api.accept_faces(obj)


class FindFaces(Command):
    """Find the faces that were picked in a part that has changed."""

    name = "CadSkin_FindFaces"
    menu = QT_TRANSLATE_NOOP("CadSkin_FindFaces", "Find moved faces")
    tip = QT_TRANSLATE_NOOP(
        "CadSkin_FindFaces", "Put the selected tolerances back on the faces that were picked"
    )
    icon = "find_faces"

    def makes_sense(self) -> bool:
        """Tell whether tolerances, datums or skin models are selected."""
        return bool(_selected())

    def run(self) -> None:
        """Find them."""
        missing = [obj.Label for obj in _selected() if not api.find_faces(obj)]
        if missing:
            raise api.InputError(f"{', '.join(missing)}: not all faces were found; pick them again")
