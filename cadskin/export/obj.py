"""Wavefront OBJ with one group per B-rep face."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from typing import BinaryIO

import numpy as np

from cadskin.export.content import Content
from cadskin.export.text import write_rows

__all__ = ["group_names", "write_obj"]


def write_obj(stream: BinaryIO, content: Content) -> None:
    """Write OBJ: vertices in mm with 12 significant digits, triangles sorted into groups by face."""
    for line in content.header():
        stream.write(f"# {line}\n".encode("ascii"))
    write_rows(stream, "v %.12g %.12g %.12g\n", content.points + 0.0)
    face_ids = content.surface.face_ids
    order = np.argsort(face_ids, kind="stable")
    used, starts = np.unique(face_ids[order], return_index=True)
    names = group_names(content.face_names, used.tolist())
    for name, ids in zip(names, np.split(order, starts[1:]), strict=True):
        stream.write(f"g {name}\n".encode("ascii"))
        write_rows(stream, "f %d %d %d\n", content.triangles[ids] + 1)


def group_names(face_names: Sequence[str], used: Sequence[int]) -> list[str]:
    """Return a distinct group name of plain ASCII without blanks for each face that is used.

    A face without a name of its own is ``face_3``; two faces of one name become ``name_3`` and ``name_5``.

    Examples
    --------
    >>> group_names(["Bohrung Ø12", "top", "top", "face 3"], [0, 1, 2, 3])
    ['Bohrung_O12', 'top_1', 'top_2', 'face_3']
    """
    plain = {i: _sanitised(face_names[i]) if 0 <= i < len(face_names) else f"face_{i}" for i in used}
    counts: dict[str, int] = {}
    for name in plain.values():
        counts[name] = counts.get(name, 0) + 1
    names = [f"{name}_{i}" if counts[name] > 1 else name for i, name in plain.items()]
    if len(set(names)) < len(names):  # a name of the file looks like one of ours
        names = [f"{name}_face_{i}" for i, name in plain.items()]
    return names


def _sanitised(name: str) -> str:
    """Letters, digits, ``_``, ``-`` and ``.`` only."""
    decomposed = unicodedata.normalize("NFKD", name.translate(_LETTERS))
    plain = decomposed.encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", plain).strip("_") or "face"


_LETTERS = str.maketrans({"Ø": "O", "ø": "o", "ß": "ss", "æ": "ae", "Æ": "AE", "œ": "oe", "Œ": "OE"})
