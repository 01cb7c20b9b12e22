"""The result of meshing a shape."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cadskin._arrays import frozen
from cadskin._typing import Bools, Floats, Ints, Points, Triangles, Vectors

__all__ = ["LabelledMesh"]


@dataclass(frozen=True, eq=False)
class LabelledMesh:
    """Triangles that know their B-rep face, and one wedge per (face, vertex) pair.

    A vertex on a sharp edge has a normal per adjacent face; a wedge holds what the surface of one face says
    about one vertex.

    Parameters
    ----------
    points : (n, 3) float
        Vertices [mm].
    triangles : (m, 3) int
        Counter-clockwise seen from outside.
    face_ids : (m,) int
        Zero-based face of each triangle, in the order of ``TopExp.MapShapes`` and cadquery's ``.Faces()``.
    wedge_faces, wedge_vertices : (w,) int
        Unique pairs, sorted by face, then vertex.
    wedge_uv : (w, 2) float
        Surface parameters.
    wedge_normals : (w, 3) float
        Exact unit normals out of the material.
    wedge_curvatures : (w, 2) float
        Principal curvatures k1 >= k2 [1/mm], positive where the surface bends towards its outward normal.
    wedge_directions : (w, 2, 3) float
        Unit principal directions.
    wedge_singular : (w,) bool
        True where the surface has no normal (the apex of a cone); the row holds a stand-in.
    closed : bool
        True for a closed 2-manifold.
    failed_faces : tuple of int
        Faces that could only be closed from their boundary points, or not at all.
    notes : tuple of str
        What had to be repaired or left out, in words.
    """

    points: Points
    triangles: Triangles
    face_ids: Ints
    wedge_faces: Ints
    wedge_vertices: Ints
    wedge_uv: Floats
    wedge_normals: Vectors
    wedge_curvatures: Floats
    wedge_directions: Floats
    wedge_singular: Bools
    closed: bool
    failed_faces: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check and freeze the arrays."""
        m, w = len(self.triangles), len(self.wedge_faces)
        spec: tuple[tuple[str, Any, tuple[int | None, ...], bool], ...] = (
            ("points", np.float64, (None, 3), True),
            ("triangles", np.int64, (None, 3), True),
            ("face_ids", np.int64, (m,), True),
            ("wedge_faces", np.int64, (w,), True),
            ("wedge_vertices", np.int64, (w,), True),
            ("wedge_uv", np.float64, (w, 2), False),
            ("wedge_normals", np.float64, (w, 3), True),
            ("wedge_curvatures", np.float64, (w, 2), True),
            ("wedge_directions", np.float64, (w, 2, 3), True),
            ("wedge_singular", np.bool_, (w,), True),
        )
        for key, dtype, shape, finite in spec:
            value = frozen(getattr(self, key), dtype=dtype, shape=shape, name=key, finite=finite)
            object.__setattr__(self, key, value)
        object.__setattr__(self, "failed_faces", tuple(int(face) for face in self.failed_faces))
        object.__setattr__(self, "notes", tuple(self.notes))

    def __reduce__(self) -> tuple[Any, ...]:
        keys = tuple(self.__dataclass_fields__)
        return type(self), tuple(getattr(self, key) for key in keys)
