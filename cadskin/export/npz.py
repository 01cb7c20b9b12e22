"""NPZ: every array of the shape, and where it comes from as JSON."""

from __future__ import annotations

import json
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from cadskin.export.content import Content

__all__ = ["arrays_of", "write_npz"]


def write_npz(stream: BinaryIO, content: Content) -> None:
    """Write the arrays of `arrays_of`; `numpy.load` reads them without pickle."""
    arrays: dict[str, Any] = arrays_of(content)
    np.savez(stream, **arrays)


def arrays_of(content: Content) -> dict[str, NDArray[Any]]:
    """Return the arrays of an NPZ file.

    ==================== ============ ==================================================================
    key                  shape        meaning
    ==================== ============ ==================================================================
    ``points``           (n, 3)       vertices [mm]
    ``triangles``        (m, 3)       vertex indices, outward
    ``face_ids``         (m,)         B-rep face of each triangle
    ``face_names``       (f,)         name of each face
    ``provenance``       ()           JSON text: generator, unit, source of the part, skin (model, seed, ...)
    ``feature_ids``      (m,)         feature of each triangle ¹
    ``nominal_points``   (n, 3)       vertices of the ideal part [mm] ¹
    ``sample_*``                      ``vertex_ids face_ids uv normals curvatures directions singular`` of
                                      `cadskin.shape.Samples`, and ``feature_ids``, one row per sample ¹
    ``deviation``        (n_c,)       deviation of each feature sample [mm] ²
    ``vertex_deviation`` (n,)         deviation of each vertex [mm] ²
    ==================== ============ ==================================================================

    ¹ not for a bare discrete shape. ² only for a skin model.
    """
    arrays: dict[str, NDArray[Any]] = {
        "points": content.points,
        "triangles": content.triangles,
        "face_ids": content.surface.face_ids,
        "face_names": np.array(content.face_names, dtype=np.str_),
        "provenance": np.array(json.dumps(content.provenance, sort_keys=True)),
    }
    if content.nominal is not None and content.feature_ids is not None:
        samples = content.nominal.samples
        keys = ("vertex_ids", "face_ids", "uv", "normals", "curvatures", "directions", "singular")
        arrays |= {"feature_ids": content.feature_ids, "nominal_points": content.nominal.surface.points}
        arrays |= {f"sample_{key}": getattr(samples, key) for key in keys}
        arrays["sample_feature_ids"] = content.nominal.feature_ids()
    if content.deviation is not None and content.vertex_deviation is not None:
        arrays |= {"deviation": content.deviation, "vertex_deviation": content.vertex_deviation}
    return arrays
