"""PLY, binary little endian, with the deviation per vertex and the labels per triangle."""

from __future__ import annotations

from typing import BinaryIO

import numpy as np

from cadskin.export.content import Content
from cadskin.export.stl import warn_of_rounding

__all__ = ["write_ply"]


def write_ply(stream: BinaryIO, content: Content, *, double: bool = False) -> None:
    """Write PLY: vertex ``x y z [deviation]`` in mm, face ``vertex_indices face_id [feature_id]``."""
    if not double:
        warn_of_rounding(content, "PLY")
    real, word = ("<f8", "double") if double else ("<f4", "float")
    vertex_names = ["x", "y", "z"] + (["deviation"] if content.vertex_deviation is not None else [])
    face_names = ["face_id"] + (["feature_id"] if content.feature_ids is not None else [])
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        *(f"comment {line}" for line in content.header()),
        f"element vertex {content.surface.n_points}",
        *(f"property {word} {name}" for name in vertex_names),
        f"element face {content.surface.n_triangles}",
        "property list uchar int vertex_indices",
        *(f"property int {name}" for name in face_names),
        "end_header",
    ]
    vertices = np.zeros((content.surface.n_points, len(vertex_names)), dtype=real)
    vertices[:, :3] = content.points
    if content.vertex_deviation is not None:
        vertices[:, 3] = content.vertex_deviation
    faces = np.zeros(
        content.surface.n_triangles,
        dtype=[("count", "u1"), ("corners", "<i4", 3), *((name, "<i4") for name in face_names)],
    )
    faces["count"] = 3
    faces["corners"] = content.triangles
    faces["face_id"] = content.surface.face_ids
    if content.feature_ids is not None:
        faces["feature_id"] = content.feature_ids
    stream.write(("\n".join(lines) + "\n").encode("ascii"))
    stream.write(vertices.tobytes())
    stream.write(faces.tobytes())
