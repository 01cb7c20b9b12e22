"""Meshes with face labels, read for verification: NPZ and PLY as `cadskin.write` makes them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import ReadError
from cadskin.shape import DiscreteShape

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["read_labelled_mesh", "read_mesh_arrays"]

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4",
    "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4",
    "float32": "f4", "float64": "f8",
}  # fmt: skip


def read_labelled_mesh(path: str | Path) -> DiscreteShape:
    """Read a mesh whose triangles carry their B-rep face.

    Parameters
    ----------
    path : path
        ``.npz`` (`points`, `triangles`, `face_ids`) or ``.ply`` (binary little endian or ASCII, faces with
        the property ``face_id``).

    Raises
    ------
    ReadError
        A file that is missing, damaged, or without labels.

    Warns
    -----
    CadskinWarning
        Single precision: an exact plane of 250 mm is then about 7e-6 mm unflat.
    """
    from cadskin.verify.scans import read_scan

    scan = read_scan(path)
    if scan.triangles is None or scan.face_ids is None:
        raise ReadError(
            f"{path}: its triangles have no property face_id; write it as .npz or .ply with cadskin, or take "
            "its faces from the nominal part (labelled_scan)"
        )
    return DiscreteShape(scan.points, scan.triangles, scan.face_ids)


def read_mesh_arrays(path: Path) -> tuple[NDArray[Any], NDArray[Any] | None, NDArray[Any] | None]:
    """Return points, triangles and face labels of an NPZ or PLY file; None for what it does not have."""
    if path.suffix.lower() == ".npz":
        return _npz(path)
    if path.suffix.lower() == ".ply":
        return _ply(path)
    raise ReadError(f"{path}: no kind of mesh or point cloud; .npz, .ply, .stl, .csv, .txt and .xyz are read")


def _npz(path: Path) -> tuple[NDArray[Any], NDArray[Any] | None, NDArray[Any] | None]:
    with np.load(path, allow_pickle=False) as arrays:
        if "points" not in arrays:
            raise ReadError(f"{path}: no array points; a mesh written by cadskin has it")
        found = [arrays[key].astype(np.int64) if key in arrays else None for key in ("triangles", "face_ids")]
        return arrays["points"], found[0], found[1]


def _ply(path: Path) -> tuple[NDArray[Any], NDArray[Any] | None, NDArray[Any] | None]:
    data = path.read_bytes()
    end = data.find(b"end_header")
    if not data.startswith(b"ply") or end < 0:
        raise ReadError(f"{path}: no PLY file")
    start = data.index(b"\n", end) + 1
    words = [line.split() for line in data[:end].decode("ascii", errors="replace").splitlines()]
    elements: dict[str, tuple[int, list[list[str]]]] = {}
    name, layout = "", "ascii"
    for line in words:
        if line[:1] == ["format"]:
            layout = line[1]
        elif line[:1] == ["element"]:
            name = line[1]
            elements[name] = (int(line[2]), [])
        elif line[:1] == ["property"]:
            elements[name][1].append(line[1:])
    if list(elements) == ["vertex"]:
        elements["face"] = (0, [["list", "uchar", "int", "vertex_indices"]])
    if list(elements)[:2] != ["vertex", "face"]:
        raise ReadError(f"{path}: vertices and then faces are expected")
    if layout == "ascii":
        return _ascii_ply(path, data[start:], elements)
    if layout != "binary_little_endian":
        raise ReadError(f"{path}: layout {layout} is not read; binary_little_endian and ascii are")
    n_vertices, vertex_properties = elements["vertex"]
    vertex = np.dtype([(prop[-1], "<" + _TYPES[prop[0]]) for prop in vertex_properties])
    vertices = np.frombuffer(data, vertex, n_vertices, start)
    n_faces, face_properties = elements["face"]
    fields: list[Any] = []
    for prop in face_properties:
        if prop[0] == "list":
            fields += [("count", "<" + _TYPES[prop[1]]), ("corners", "<" + _TYPES[prop[2]], 3)]
        else:
            fields.append((prop[-1], "<" + _TYPES[prop[0]]))
    faces = np.frombuffer(data, np.dtype(fields), n_faces, start + n_vertices * vertex.itemsize)
    if (faces["count"] != 3).any():
        raise ReadError(f"{path}: a face that is no triangle")
    points = np.stack([vertices[axis] for axis in "xyz"], axis=1)
    if not n_faces:
        return points, None, None
    labels = faces["face_id"].astype(np.int64) if "face_id" in (faces.dtype.names or ()) else None
    return points, faces["corners"].astype(np.int64), labels


def _ascii_ply(
    path: Path, body: bytes, elements: dict[str, tuple[int, list[list[str]]]]
) -> tuple[NDArray[Any], NDArray[Any] | None, NDArray[Any] | None]:
    n_vertices, vertex_properties = elements["vertex"]
    n_faces, face_properties = elements["face"]
    lines = body.decode("ascii").splitlines()
    columns = [[prop[-1] for prop in vertex_properties].index(axis) for axis in "xyz"]
    vertices = np.array([[float(word) for word in line.split()] for line in lines[:n_vertices]])
    names = [prop[-1] for prop in face_properties if prop[0] != "list"]
    if not n_faces:
        return vertices[:, columns], None, None
    if face_properties[0][0] != "list":
        raise ReadError(f"{path}: the corners of a face are expected first")
    faces = np.array([[int(float(word)) for word in line.split()] for line in lines[n_vertices:][:n_faces]])
    if (faces[:, 0] != 3).any():
        raise ReadError(f"{path}: a face that is no triangle")
    labels = faces[:, 4 + names.index("face_id")] if "face_id" in names else None
    return vertices[:, columns], faces[:, 1:4], labels
