"""Write a mesh as binary PLY, the fastest way into FreeCAD's reader; it keeps the order of the vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np

__all__ = ["write_ply"]


def write_ply(path: Path, points: np.ndarray, triangles: np.ndarray) -> None:
    """Write vertices (n, 3) [mm] and triangles (m, 3)."""
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(points)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    faces = np.zeros(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    with Path(path).open("wb") as stream:
        stream.write(header.encode("ascii"))
        stream.write(np.ascontiguousarray(points, dtype="<f4").tobytes())
        stream.write(faces.tobytes())
