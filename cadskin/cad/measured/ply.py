"""PLY files, text and binary: vertices, their normals, faces.

References
----------
Turk: The PLY polygon file format (1994).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import ReadError

if TYPE_CHECKING:
    from pathlib import Path

    from cadskin._typing import Points, Triangles, Vectors

__all__ = ["read_ply"]

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}  # fmt: skip


@dataclass(frozen=True)
class _Property:
    name: str
    dtype: str
    count: str | None  # type of the length of a list


@dataclass(frozen=True)
class _Element:
    name: str
    size: int
    properties: tuple[_Property, ...]


def read_ply(file: Path) -> tuple[Points, Vectors | None, Triangles | None]:
    """Return vertices (n, 3), normals (n, 3) or None, triangles (m, 3) or None (polygons become fans).

    Raises
    ------
    ReadError
        Not a PLY file, a cut-off one, or one without x, y, z.
    """
    data = file.read_bytes()
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise ReadError(f"{file.name} has no header of a PLY file")
    start = data.index(b"\n", end) + 1
    form, elements = _header(file, data[:end].decode("ascii", errors="replace"))
    try:
        if form == "ascii":
            tables = _text_tables(data[start:].split(), elements)
        else:
            tables = _binary_tables(data, start, elements, "<" if "little" in form else ">")
    except (ValueError, IndexError) as error:
        raise ReadError(f"{file.name}: the data do not fit the header; cut off? ({error})") from error
    vertex = tables.get("vertex", {})
    if not {"x", "y", "z"} <= set(vertex):
        raise ReadError(f"{file.name} has no vertices with x, y and z")
    points = np.stack([vertex[key].astype(np.float64) for key in "xyz"], axis=1)
    normals = None
    if {"nx", "ny", "nz"} <= set(vertex):
        normals = np.stack([vertex[key].astype(np.float64) for key in ("nx", "ny", "nz")], axis=1)
    polygons = tables.get("face", {})
    lists = polygons.get("vertex_indices", polygons.get("vertex_index"))
    return points, normals, None if lists is None or not len(lists) else _fans(lists)


def _header(file: Path, text: str) -> tuple[str, list[_Element]]:
    form, elements = "", []
    for line in text.splitlines():
        words = line.split()
        if not words or words[0] in ("ply", "comment", "obj_info"):
            continue
        try:
            if words[0] == "format":
                form = words[1]
            elif words[0] == "element":
                elements.append(_Element(words[1], int(words[2]), ()))
            elif words[0] == "property":
                one = (
                    _Property(words[4], _TYPES[words[3]], _TYPES[words[2]])
                    if words[1] == "list"
                    else _Property(words[2], _TYPES[words[1]], None)
                )
                last = elements[-1]
                elements[-1] = _Element(last.name, last.size, (*last.properties, one))
        except (IndexError, KeyError, ValueError) as error:
            raise ReadError(f"{file.name}: header line {line!r} is not understood") from error
    if form not in ("ascii", "binary_little_endian", "binary_big_endian"):
        raise ReadError(f"{file.name}: format {form!r} is not one of PLY")
    return form, elements


def _binary_tables(data: bytes, at: int, elements: list[_Element], order: str) -> dict[str, dict[str, Any]]:
    tables: dict[str, dict[str, Any]] = {}
    for element in elements:
        if all(one.count is None for one in element.properties):
            record = np.dtype([(one.name, order + one.dtype) for one in element.properties])
            table = np.frombuffer(data, record, element.size, at)
            tables[element.name] = {one.name: table[one.name] for one in element.properties}
            at += record.itemsize * element.size
        else:
            tables[element.name], at = _binary_lists(data, at, element, order)
    return tables


def _binary_lists(data: bytes, at: int, element: _Element, order: str) -> tuple[dict[str, Any], int]:
    """Rows with lists: at once where all are triangles, else one by one."""
    fields: list[Any] = []
    for one in element.properties:
        if one.count is not None:
            fields += [(one.name + " length", order + one.count), (one.name, order + one.dtype, 3)]
        else:
            fields.append((one.name, order + one.dtype))
    record = np.dtype(fields)
    lists = [one.name for one in element.properties if one.count is not None]
    if at + record.itemsize * element.size <= len(data):
        table = np.frombuffer(data, record, element.size, at)
        if all((table[name + " length"] == 3).all() for name in lists):
            return {
                one.name: table[one.name] for one in element.properties
            }, at + record.itemsize * element.size
    found: dict[str, list[Any]] = {one.name: [] for one in element.properties}
    for _ in range(element.size):
        for one in element.properties:
            length = 1
            if one.count is not None:
                length = int(np.frombuffer(data, order + one.count, 1, at)[0])
                at += np.dtype(one.count).itemsize
            found[one.name].append(np.frombuffer(data, order + one.dtype, length, at))
            at += length * np.dtype(one.dtype).itemsize
    return dict(found), at


def _text_tables(words: list[bytes], elements: list[_Element]) -> dict[str, dict[str, Any]]:
    tables: dict[str, dict[str, Any]] = {}
    at = 0
    for element in elements:
        width = len(element.properties)
        if all(one.count is None for one in element.properties):
            block = np.array(words[at : at + width * element.size], dtype=np.float64)
            block = block.reshape(element.size, width)
            tables[element.name] = {one.name: block[:, k] for k, one in enumerate(element.properties)}
            at += width * element.size
            continue
        found: dict[str, list[Any]] = {one.name: [] for one in element.properties}
        for _ in range(element.size):
            for one in element.properties:
                length = 1
                if one.count is not None:
                    length, at = int(words[at]), at + 1
                values = words[at : at + length]
                if len(values) < length:
                    raise ValueError("the data end early")
                found[one.name].append(np.array(values, dtype=np.float64))
                at += length
        tables[element.name] = dict(found)
    return tables


def _fans(lists: Any) -> Triangles:
    if isinstance(lists, np.ndarray):
        return lists.astype(np.int64)
    rows = [(polygon[0], polygon[k], polygon[k + 1]) for polygon in lists for k in range(1, len(polygon) - 1)]
    return np.array(rows, dtype=np.int64).reshape(-1, 3)
