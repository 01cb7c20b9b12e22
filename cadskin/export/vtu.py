"""VTU (VTK unstructured grid, XML) for ParaView and PyVista."""

from __future__ import annotations

import base64
from typing import Any, BinaryIO
from xml.sax.saxutils import quoteattr

import numpy as np
from numpy.typing import NDArray

from cadskin.export.content import Content

__all__ = ["write_vtu"]

_WORDS = {"<f8": "Float64", "<i8": "Int64", "|u1": "UInt8"}
_VTK_TRIANGLE = 5


def write_vtu(stream: BinaryIO, content: Content) -> None:
    """Write VTU with appended base64 data, all in double precision.

    Point data: ``deviation`` [mm] (where there is one) and ``normals``; cell data: ``face_id`` and
    ``feature_id``. Lengths in mm.
    """
    n_points, n_triangles = content.surface.n_points, content.surface.n_triangles
    appended = _Appended()
    sections = [
        _section("PointData", _point_data(content), appended),
        _section("CellData", _cell_data(content), appended),
        _section("Points", {"points": content.points}, appended),
        _section("Cells", _cells(content), appended),
    ]
    head = (
        '<?xml version="1.0"?>\n'
        '<VTKFile type="UnstructuredGrid" version="1.0" byte_order="LittleEndian" header_type="UInt64">\n'
        f"<!-- {'; '.join(content.header()).replace('--', '- -')} -->\n"
        f'<UnstructuredGrid>\n<Piece NumberOfPoints="{n_points}" NumberOfCells="{n_triangles}">\n'
        + "".join(sections)
        + '</Piece>\n</UnstructuredGrid>\n<AppendedData encoding="base64">\n_'
    )
    stream.write(head.encode("ascii"))
    for block in appended.blocks:
        stream.write(block)
    stream.write(b"\n</AppendedData>\n</VTKFile>\n")


def _point_data(content: Content) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {"normals": content.normals()}
    if content.vertex_deviation is not None:
        arrays = {"deviation": content.vertex_deviation, **arrays}
    return arrays


def _cell_data(content: Content) -> dict[str, NDArray[Any]]:
    arrays: dict[str, NDArray[Any]] = {"face_id": content.surface.face_ids}
    if content.feature_ids is not None:
        arrays["feature_id"] = content.feature_ids
    return arrays


def _cells(content: Content) -> dict[str, NDArray[Any]]:
    count = content.surface.n_triangles
    return {
        "connectivity": content.triangles.ravel(),
        "offsets": 3 * np.arange(1, count + 1, dtype=np.int64),
        "types": np.full(count, _VTK_TRIANGLE, dtype=np.uint8),
    }


class _Appended:
    """The blocks of the appended section, and where the next one starts."""

    def __init__(self) -> None:
        self.blocks: list[bytes] = []
        self.offset = 0

    def add(self, array: NDArray[Any]) -> int:
        """Add an array; return its offset. VTK encodes the byte count and the data as two runs."""
        raw = array.tobytes()
        block = base64.b64encode(np.uint64(len(raw)).astype("<u8").tobytes() + raw)
        start = self.offset
        self.blocks.append(block)
        self.offset += len(block)
        return start


def _section(tag: str, arrays: dict[str, NDArray[Any]], appended: _Appended) -> str:
    scalars = ' Scalars="deviation"' if "deviation" in arrays else ""
    normals = ' Normals="normals"' if "normals" in arrays else ""
    lines = []
    for name, array in arrays.items():
        data = np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<"))
        components = f'NumberOfComponents="{data.shape[1]}" ' if data.ndim == 2 else ""
        lines.append(
            f'<DataArray type="{_WORDS[data.dtype.str]}" Name={quoteattr(name)} '
            f'{components}format="appended" offset="{appended.add(data)}"/>\n'
        )
    return f"<{tag}{scalars}{normals}>\n" + "".join(lines) + f"</{tag}>\n"
