"""The datum: a letter on faces."""

from __future__ import annotations

import re
from typing import Any

from .faces import InputError, check_faces, face_numbers, link_faces, part_of
from .objects import EXTRA, SIGNATURE, STATUS, Field, Proxy, attach_view, new_object, objects_of, with_extra

__all__ = [
    "TYPE",
    "DatumProxy",
    "datum_of_letter",
    "datum_table",
    "letters_in",
    "make_datum",
    "next_letter",
    "problem",
]

TYPE = "CadSkinDatum"
_LETTERS = "ABCDEFGHJKLMNPRSTUVWXYZ"  # ISO 5459 leaves I, O and Q out


class DatumProxy(Proxy):
    """`App::FeaturePython` of a datum."""

    Type = TYPE
    GROUP = "Datum"
    FIELDS = (
        Field("App::PropertyLinkSubGlobal", "Faces", "The faces of the datum feature"),
        Field("App::PropertyString", "Letter", "Its letter"),
        EXTRA,
        SIGNATURE,
        STATUS,
    )

    def problem(self, obj: Any) -> str | None:
        """Say why it cannot be used; None where it can."""
        return problem(obj)


def make_datum(document: Any, part: Any, faces: Any, letter: str | None = None) -> Any:
    """Make a datum on faces of a part.

    Raises
    ------
    InputError
        See `faces.link_faces`, or the letter is taken; the document is left as it was.
    """
    with new_object(document, DatumProxy, "Datum") as obj:
        link_faces(obj, part, faces)
        obj.Letter = next_letter(part_of(obj)) if letter is None else letter.strip()
        told = problem(obj)
        if told:
            raise InputError(told)
    obj.Label = f"Datum {obj.Letter}"
    attach_view(obj, "view_datum")
    obj.touch()
    return obj


def problem(obj: Any) -> str | None:
    """Say why a datum cannot be used; None where it can."""
    told = check_faces(obj)
    if told:
        return told
    if not re.fullmatch(r"[A-Za-z]+[0-9]*", obj.Letter):
        return f"{obj.Letter!r} is no datum letter"
    first = datum_of_letter(part_of(obj), obj.Letter)
    if first is not None and first.Name != obj.Name:
        return f"there is a datum {obj.Letter} already ({first.Label})"
    return None


def datum_of_letter(part: Any, letter: str) -> Any:
    """Return the first datum with a letter on a part; None where there is none."""
    for obj in objects_of(part.Document, TYPE):
        if obj.Letter == letter and part_of(obj) == part:
            return obj
    return None


def next_letter(part: Any) -> str:
    """Return the first letter that no datum of a part has."""
    taken = {obj.Letter for obj in objects_of(part.Document, TYPE) if part_of(obj) == part}
    names = [*_LETTERS, *(first + second for first in _LETTERS for second in _LETTERS)]
    return next(name for name in names if name not in taken)


def letters_in(text: str) -> list[str]:
    """Return the letters of a datum system.

    >>> letters_in("A|B-C(M)|D[SL]")
    ['A', 'B', 'C', 'D']
    """
    plain = re.sub(r"\([^)]*\)|\[[^\]]*\]", "", text)
    return list(dict.fromkeys(word.strip() for word in re.split(r"[|\-]", plain) if word.strip()))


def datum_table(obj: Any) -> dict[str, Any]:
    """Return a datum as the worker takes it."""
    return with_extra({"letter": obj.Letter, "faces": face_numbers(obj)}, obj)
