"""What is selected in the 3D view and the tree."""

from __future__ import annotations

from typing import Any

import FreeCADGui

from . import datum, general_tolerance, skin, tolerance
from .faces import InputError, part_of, part_problem, whole_part
from .objects import is_a, objects_of
from .signature import face_number

__all__ = ["has_faces", "selected_faces", "selected_part", "selected_skin", "the_part", "the_skin"]

_OURS = (tolerance.TYPE, datum.TYPE, general_tolerance.TYPE, skin.TYPE)


def _selection() -> list[Any]:
    return list(FreeCADGui.Selection.getSelectionEx())


def has_faces() -> bool:
    """Tell whether faces, and nothing but faces, are picked."""
    names = [name for item in _selection() for name in item.SubElementNames]
    return bool(names) and all(face_number(name) is not None for name in names)


def selected_faces() -> tuple[Any, list[str]]:
    """Return the part and the names of the faces that are picked.

    Raises
    ------
    InputError
        Nothing is picked, something else than faces, or faces of several parts.
    """
    picked = [(whole_part(item.Object), name) for item in _selection() for name in item.SubElementNames]
    if not picked:
        raise InputError("nothing is picked; pick one face or several in the 3D view")
    wrong = sorted({name for _, name in picked if face_number(name) is None})
    if wrong:
        raise InputError(f"{', '.join(wrong)} is no face; pick faces only")
    parts = list(dict.fromkeys(part for part, _ in picked))
    if len(parts) > 1:
        names = ", ".join(part.Label for part in parts)
        raise InputError(f"the faces belong to several parts ({names}); pick faces of one part")
    return parts[0], [name for _, name in picked]


def selected_part() -> Any:
    """Return the part that is selected, or that of a selected tolerance or skin model; None without one."""
    for item in _selection():
        obj = item.Object
        if any(is_a(obj, kind) for kind in _OURS):
            return part_of(obj)
        found = whole_part(obj)
        if part_problem(found) is None:
            return found
    return None


def the_part() -> Any:
    """Return the selected part, or the only one of the document.

    Raises
    ------
    InputError
        None is selected, and there are none or several; or the one that is selected has an error.
    """
    found = selected_part()
    if found is not None:
        return found
    for item in _selection():
        told = part_problem(whole_part(item.Object))
        if told:
            raise InputError(told)
    document = FreeCADGui.ActiveDocument.Document
    shapes = [obj for obj in document.Objects if obj.ViewObject.Visibility and hasattr(obj, "Shape")]
    parts = list(dict.fromkeys(whole_part(obj) for obj in shapes if part_problem(whole_part(obj)) is None))
    if len(parts) != 1:
        raise InputError("no part is selected; select one" if parts else "the document has no solid part")
    return parts[0]


def selected_skin() -> Any:
    """Return the skin model that is selected, or the only one of the document; None otherwise."""
    for item in _selection():
        if is_a(item.Object, skin.TYPE):
            return item.Object
    if FreeCADGui.ActiveDocument is None:
        return None
    found = objects_of(FreeCADGui.ActiveDocument.Document, skin.TYPE)
    return found[0] if len(found) == 1 else None


def the_skin() -> Any:
    """Return the skin model that a command is for.

    Raises
    ------
    InputError
        There is none, or there are several and none is selected.
    """
    found = selected_skin()
    if found is None:
        raise InputError("select a skin model; create one first where there is none")
    return found
