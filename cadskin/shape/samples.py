"""The feature samples: the rows that deviation fields refer to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._arrays import frozen

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Vectors

__all__ = ["Samples"]


@dataclass(frozen=True, eq=False)
class Samples:
    """The feature samples: one row per (feature, vertex), so an edge point stands once per adjacent feature.

    A deviation field is one number per row. Rows of one feature are contiguous, in the order of the features.

    Parameters
    ----------
    vertex_ids : (n_c,) int
        Vertex of the discrete shape.
    face_ids : (n_c,) int
        B-rep face on which the row was evaluated.
    uv : (n_c, 2) float
        Surface parameters there; NaN for a mesh without CAD.
    normals : (n_c, 3) float
        Exact unit normals out of the material.
    curvatures : (n_c, 2) float
        Principal curvatures k1 >= k2 [1/mm]; positive where the surface bends towards its outward normal
        (a hole), negative on a convex surface (a shaft of radius R has k2 = -1/R).
    directions : (n_c, 2, 3) float
        Unit principal directions of k1 and k2; with the normal they are the augmented Darboux frame.
    singular : (n_c,) bool
        True where the surface has no normal (the apex of a cone); the row holds a stand-in.
    """

    vertex_ids: Ints
    face_ids: Ints
    uv: Floats
    normals: Vectors
    curvatures: Floats
    directions: Floats
    singular: Bools

    def __post_init__(self) -> None:
        """Check and freeze."""
        n = len(self.vertex_ids)
        spec: tuple[tuple[str, Any, tuple[int, ...], bool], ...] = (
            ("vertex_ids", np.int64, (n,), True),
            ("face_ids", np.int64, (n,), True),
            ("uv", np.float64, (n, 2), False),
            ("normals", np.float64, (n, 3), True),
            ("curvatures", np.float64, (n, 2), True),
            ("directions", np.float64, (n, 2, 3), True),
            ("singular", np.bool_, (n,), True),
        )
        for key, dtype, shape, finite in spec:
            value = frozen(getattr(self, key), dtype=dtype, shape=shape, name=f"samples.{key}", finite=finite)
            object.__setattr__(self, key, value)

    def __repr__(self) -> str:
        return f"Samples({len(self)} rows)"

    def __len__(self) -> int:
        return len(self.vertex_ids)

    def __reduce__(self) -> tuple[Any, ...]:
        keys = ("vertex_ids", "face_ids", "uv", "normals", "curvatures", "directions", "singular")
        return type(self), tuple(getattr(self, key) for key in keys)
