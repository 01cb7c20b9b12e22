"""STL: triangles only, 32-bit floats, no labels."""

from __future__ import annotations

import warnings
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from cadskin.errors import CadskinWarning
from cadskin.export.content import Content
from cadskin.export.text import write_rows
from cadskin.shape import triangle_normals

__all__ = ["write_ascii_stl", "write_binary_stl"]

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_FACET = (
    "facet normal %.9g %.9g %.9g\nouter loop\n"
    "vertex %.9g %.9g %.9g\nvertex %.9g %.9g %.9g\nvertex %.9g %.9g %.9g\nendloop\nendfacet\n"
)


def write_binary_stl(stream: BinaryIO, content: Content) -> None:
    """Write binary STL: an 80-byte header, the count, 50 bytes per triangle."""
    warn_of_rounding(content, "STL")
    records = np.zeros(content.surface.n_triangles, dtype=_RECORD)
    records["corners"] = content.points.astype(np.float32)[content.triangles]
    records["normal"] = triangle_normals(content.points, content.triangles)
    # A binary file must not start with "solid": readers would take it for ASCII.
    title = "; ".join(content.header()).encode()[:80]
    stream.write(title.ljust(80))
    stream.write(np.uint32(len(records)).astype("<u4").tobytes())
    stream.write(records.tobytes())


def write_ascii_stl(stream: BinaryIO, content: Content) -> None:
    """Write ASCII STL with the same 32-bit numbers as the binary form, in nine digits."""
    warn_of_rounding(content, "STL")
    name = "_".join(content.name.encode("ascii", "replace").decode().split())
    rows = np.concatenate(
        [
            triangle_normals(content.points, content.triangles),
            content.points.astype(np.float32)[content.triangles].reshape(-1, 9),
        ],
        axis=1,
    )
    stream.write(f"solid {name}\n".encode())
    write_rows(stream, _FACET, rows + 0.0)  # no minus zeros
    stream.write(f"endsolid {name}\n".encode())


def warn_of_rounding(content: Content, format_name: str) -> None:
    """Warn where 32-bit coordinates cannot carry the shape.

    The rounding step is 2**-23 of the largest coordinate: 6e-6 mm at 100 mm, 1e-3 mm at 10 m.

    Warns
    -----
    CadskinWarning
        The step exceeds one percent of the deviation's range, or corners of a triangle fall together.
    """
    rounded = content.points.astype(np.float32)
    step = float(np.spacing(np.abs(rounded).max()))
    way_out = "write PLY with double=True, VTU or NPZ, or move the part to the origin"
    if content.vertex_deviation is not None:
        spread = float(np.ptp(content.vertex_deviation))
        if 0 < spread < 100 * step:
            warnings.warn(
                f"{format_name} keeps 32-bit coordinates: their step of {step:.2g} mm is coarse against a "
                f"deviation that ranges over {spread:.2g} mm; {way_out}",
                CadskinWarning,
                stacklevel=4,
            )
    if _collapses(rounded, content):
        warnings.warn(
            f"{format_name} keeps 32-bit coordinates: at a step of {step:.2g} mm corners of some triangles "
            f"fall together; {way_out}",
            CadskinWarning,
            stacklevel=4,
        )


def _collapses(rounded: NDArray[np.float32], content: Content) -> bool:
    corners = rounded[content.triangles]
    exact = content.points[content.triangles]
    for k in range(3):
        same = (corners[:, k] == corners[:, k - 1]).all(axis=1)
        if same.any() and (exact[same, k] != exact[same, k - 1]).any():
            return True
    return False
