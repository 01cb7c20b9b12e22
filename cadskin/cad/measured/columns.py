"""Columns of numbers, as scanners and spreadsheets write them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import ReadError

if TYPE_CHECKING:
    from pathlib import Path

    from cadskin._typing import Points, Vectors

__all__ = ["read_columns"]

_COMMENTS = ("#", "//", "!", "%")


def read_columns(file: Path, columns: Sequence[int] | None = None) -> tuple[Points, Vectors | None]:
    """Return points (n, 3) and, for six ``columns``, normals (n, 3), in the unit of the file.

    Raises
    ------
    ReadError
        A line that does not fit the others, or columns that are not there.
    """
    wanted = tuple(range(3)) if columns is None else tuple(columns)
    if len(wanted) not in (3, 6) or min(wanted) < 0:
        raise ReadError(
            f"columns must be three (x, y, z) or six (and a normal), counted from 0, got {wanted}"
        )
    text = file.read_text(encoding="utf-8-sig", errors="replace")
    numbers, lines = _numeric_lines(text)
    if not lines:
        raise ReadError(f"{file.name} holds no line of numbers")
    width = lines[0].count(" ") + 1
    if max(wanted) >= width:
        raise ReadError(
            f"{file.name} has {width} columns, number {max(wanted)} (counted from 0) is not there"
        )
    values = _as_array(file, numbers, lines, width)[:, wanted]
    points = np.ascontiguousarray(values[:, :3])
    return points, np.ascontiguousarray(values[:, 3:]) if len(wanted) == 6 else None


def _numeric_lines(text: str) -> tuple[list[int], list[str]]:
    """Numbers (from 1) and normalised text of the lines that are not comments, header or a leading count."""
    decimal_comma = ";" in text and re.search(r"\d,\d", text) is not None and "." not in text
    if decimal_comma:
        text = text.replace(",", ".")
    text = text.replace(",", " ").replace(";", " ").replace("\t", " ")
    numbers: list[int] = []
    lines: list[str] = []
    for number, line in enumerate(text.splitlines(), start=1):
        words = line.split()
        if not words or words[0].startswith(_COMMENTS):
            continue
        if not lines and (len(words) < 3 or not _is_number(words[0])):
            continue  # a header, or the number of points
        numbers.append(number)
        lines.append(" ".join(words))
    return numbers, lines


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _as_array(file: Path, numbers: list[int], lines: list[str], width: int) -> Points:
    try:
        values = np.array(" ".join(lines).split(), dtype=np.float64)
    except ValueError:
        values = np.zeros(0)
    if values.size == width * len(lines):
        return values.reshape(-1, width)
    for number, line in zip(numbers, lines, strict=True):
        words = line.split()
        if len(words) != width or not all(map(_is_number, words)):
            raise ReadError(
                f"{file.name}, line {number}: expected {width} numbers as before, got {line[:60]!r}"
            )
    raise ReadError(f"{file.name}: the lines do not have {width} numbers each")
