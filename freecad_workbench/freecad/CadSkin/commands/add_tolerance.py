"""Add a tolerance to the faces that are picked."""

from __future__ import annotations

from typing import Any

from .. import api, tolerance
from ..command import QT_TRANSLATE_NOOP, Command
from ..faces import faces_now
from ..kinds import characteristics_for
from ..selection import has_faces, selected_faces
from ..signature import face_number

__all__ = ["AddTolerance"]

_FIRST = ("flatness", "cylindricity", "surface_profile")  # of these the first that has a meaning
_VALUE = 0.1  # mm, until the user gives one


class AddTolerance(Command):
    """Make a tolerance and open its panel; Cancel takes it away again."""

    name = "CadSkin_AddTolerance"
    menu = QT_TRANSLATE_NOOP("CadSkin_AddTolerance", "Add tolerance")
    tip = QT_TRANSLATE_NOOP("CadSkin_AddTolerance", "Add a tolerance to the faces that are picked")
    icon = "tolerance"
    shortcut = "T, A"

    def makes_sense(self) -> bool:
        """Tell whether faces are picked."""
        return has_faces()

    def run(self) -> None:
        """Make it."""
        from ..panels import base
        from ..panels import tolerance as panel

        base.make_room()
        panel.show(begin(*selected_faces()))


def begin(part: Any, names: list[str]) -> Any:
    """Make a tolerance in a transaction that stays open: the panel commits or aborts it."""
    document = part.Document
    document.openTransaction("Add tolerance")
    try:
        faces = faces_now(part)
        kinds = [faces[face_number(name) - 1].kind for name in names if face_number(name) <= len(faces)]
        fitting = characteristics_for(kinds)
        first = next(name for name in _FIRST if name in fitting)
        obj = tolerance.make_tolerance(document, part, names, first, _VALUE)
        api.join_skins(obj)
        document.recompute()
    except BaseException:
        document.abortTransaction()
        raise
    return obj
