"""Faces of a part that a tolerance or datum is on: picked, checked, found again."""

from __future__ import annotations

from typing import Any

import FreeCAD

from .signature import (
    FaceSignature,
    describe_change,
    face_number,
    find_face,
    local_shape,
    pack,
    shape_signatures,
    unpack,
)

__all__ = [
    "InputError",
    "accept_faces",
    "check_faces",
    "face_numbers",
    "faces_now",
    "link_faces",
    "part_of",
    "part_problem",
    "relink_faces",
    "size_of",
    "whole_part",
]


class InputError(ValueError):
    """What the user gave cannot be worked with; the message says why and what to do."""


_cache: dict[tuple[str, str], tuple[int, Any, list[FaceSignature]]] = {}


def whole_part(feature: Any) -> Any:
    """Return the body of its last feature, and any other object itself.

    A click on a PartDesign body selects its last feature; the part is the body.
    """
    body = feature.getParentGeoFeatureGroup() if hasattr(feature, "getParentGeoFeatureGroup") else None
    if body is not None and body.isDerivedFrom("PartDesign::Body") and body.Tip == feature:
        return body
    return feature


def part_problem(part: Any) -> str | None:
    """Say why an object is no part that can be worked with; None where it is one."""
    if part is None:
        return "the part is gone"
    shape = getattr(part, "Shape", None)
    if shape is None or not hasattr(shape, "Faces"):
        return f"{part.Label} has no shape"
    if not part.isValid():
        return f"{part.Label} has an error; repair it first"
    if shape.isNull() or not shape.Faces:
        return f"{part.Label} is empty"
    solids = len(shape.Solids)
    if solids != 1:
        found = "no solid" if not solids else f"{solids} solids"
        return f"{part.Label} has {found}; a skin model is made of one solid"
    return None


def faces_now(part: Any) -> list[FaceSignature]:
    """Return the signatures of the faces of a part, in its own frame; kept until its shape changes."""
    key = (part.Document.Name, part.Name)
    mark = part.Shape.hashCode()
    known = _cache.get(key)
    # The shape is kept too: a hash code is an address, which another shape may get once this one is gone.
    if known is None or known[0] != mark or not known[1].isSame(part.Shape):
        known = (mark, part.Shape, shape_signatures(local_shape(part)))
        _cache[key] = known
    return known[2]


def size_of(part: Any) -> float:
    """Return the longest side of the bounding box of a part [mm]."""
    box = part.Shape.BoundBox
    return float(max(box.XLength, box.YLength, box.ZLength))


def part_of(obj: Any) -> Any:
    """Return the part that a tolerance, datum or general tolerance is on; None where the link is empty."""
    if hasattr(obj, "Faces"):
        return obj.Faces[0] if obj.Faces else None
    return getattr(obj, "Part", None)


def face_numbers(obj: Any) -> list[int]:
    """Return the numbers of the faces that an object is on, those that FreeCAD has lost left out."""
    names = obj.Faces[1] if obj.Faces else ()
    return [number for number in map(face_number, names) if number is not None]


def link_faces(obj: Any, part: Any, names: Any) -> None:
    """Put an object on faces, and remember what they look like.

    Raises
    ------
    InputError
        No face, an edge or a vertex, a face that is not there, or a part that cannot be worked with.
    """
    part = whole_part(part)
    problem = part_problem(part)
    if problem:
        raise InputError(problem)
    wanted = [names] if isinstance(names, str) else list(names)
    if not wanted:
        raise InputError("nothing is picked; pick one face or several")
    signatures = faces_now(part)
    for name in wanted:
        number = face_number(name)
        if number is None:
            raise InputError(f"{name or 'the whole part'} is no face; pick faces only")
        if number > len(signatures):
            raise InputError(f"{part.Label} has no {name}; it has Face1 to Face{len(signatures)}")
    unique = list(dict.fromkeys(wanted))
    obj.Faces = (part, unique)
    obj.Signature = pack(signatures[face_number(name) - 1] for name in unique)


def check_faces(obj: Any) -> str | None:
    """Say what is wrong with the faces of an object; None where they are those that were picked."""
    part = part_of(obj)
    problem = part_problem(part)
    if problem:
        return problem
    names = list(obj.Faces[1])
    if not names or names == [""]:
        return "no face is picked"
    lost = [name for name in names if face_number(name) is None]
    if lost:
        return f"{', '.join(name.lstrip('?') for name in lost)} is gone; pick its faces again"
    before = unpack(obj.Signature)
    if len(before) != len(names):
        return "the faces were changed by hand; accept them"
    now, size = faces_now(part), size_of(part)
    changes = [describe_change(face_number(name), known, now, size) for name, known in zip(names, before)]
    told = [change for change in changes if change]
    return "; ".join(told) or None


def accept_faces(obj: Any) -> None:
    """Take the faces of the link as they are now for those that are meant.

    Raises
    ------
    InputError
        One of them is gone.
    """
    part = part_of(obj)
    link_faces(obj, part, list(obj.Faces[1]) if part is not None else ())


def relink_faces(obj: Any) -> bool:
    """Put the link on the faces that were picked, where all of them are found; return whether that was so."""
    part = part_of(obj)
    if part_problem(part):
        return False
    now, size = faces_now(part), size_of(part)
    numbers = [find_face(known, now, size) for known in unpack(obj.Signature)]
    if not numbers or None in numbers:
        return False
    link_faces(obj, part, [f"Face{number}" for number in numbers])
    return True


def surfaces_of(obj: Any) -> list[str]:
    """Return the types of the surfaces that an object is on."""
    part = part_of(obj)
    if part_problem(part):
        return []
    now = faces_now(part)
    return [now[number - 1].kind for number in face_numbers(obj) if number <= len(now)]


def forget(document: Any) -> None:
    """Forget the faces of a document that is closed."""
    for key in [key for key in _cache if key[0] == document.Name]:
        del _cache[key]


def warn(text: str) -> None:
    """Write a warning into the report view."""
    FreeCAD.Console.PrintWarning(f"CadSkin: {text}\n")
