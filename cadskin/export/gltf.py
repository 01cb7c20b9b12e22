"""GlTF 2.0, binary (GLB) or as JSON with the data inside, for browsers and viewers."""

from __future__ import annotations

import base64
import json
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from cadskin._typing import Floats
from cadskin.errors import ExportError
from cadskin.export.colours import feature_colours, map_colours, to_linear
from cadskin.export.content import Content
from cadskin.export.wedges import Wedges, wedge_normals, wedges_of

__all__ = ["write_glb", "write_gltf"]

_FLOAT, _UINT = 5126, 5125
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963
_QUARTER_TURN = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # z up (CAD) to y up (glTF)


def write_glb(stream: BinaryIO, content: Content) -> None:
    """Write GLB: vertices in mm under a node that scales to metres and turns z up to y up.

    There is one vertex per feature sample, so that normals and colours stop at sharp edges; a reader that
    needs a closed mesh merges equal positions. Attributes: ``POSITION`` [mm], ``NORMAL``, ``COLOR_0``
    (deviation, blue to red, symmetric about 0), ``_DEVIATION`` [mm], ``_FEATURE_ID``.

    References
    ----------
    Khronos glTF 2.0 specification, sections 3.4 (units: metre), 3.7 (meshes), 4 (GLB).
    """
    document, data = _document(content)
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + len(data)
    if total >= 2**32:
        raise ExportError(f"GLB holds at most 4 GiB, this shape needs {total} bytes; write PLY, VTU or NPZ")
    stream.write(b"glTF" + np.array([2, total], dtype="<u4").tobytes())
    stream.write(np.array([len(text)], dtype="<u4").tobytes() + b"JSON" + text)
    stream.write(np.array([len(data)], dtype="<u4").tobytes() + b"BIN\x00" + data)


def write_gltf(stream: BinaryIO, content: Content) -> None:
    """Write glTF as one JSON file with the data inside (base64); see `write_glb`."""
    document, data = _document(content)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    document["buffers"][0]["uri"] = uri
    stream.write(json.dumps(document, separators=(",", ":")).encode())


def _document(content: Content) -> tuple[dict[str, Any], bytes]:
    """Return the JSON document and the binary buffer."""
    wedges = wedges_of(content)
    attributes: dict[str, NDArray[Any]] = {
        "POSITION": content.points[wedges.vertex_ids],
        "NORMAL": _unit_float32(wedge_normals(content, wedges, content.points)),
        "COLOR_0": to_linear(_colours(content, wedges)),
    }
    if wedges.deviation is not None:
        attributes["_DEVIATION"] = wedges.deviation
    if content.nominal is not None:
        attributes["_FEATURE_ID"] = content.nominal.feature_ids()
    buffer = _Buffer()
    indices = buffer.add(wedges.corners.ravel().astype("<u4"), _UINT, _ELEMENT_ARRAY_BUFFER)
    accessors = {
        name: buffer.add(np.asarray(values, dtype="<f4"), _FLOAT, _ARRAY_BUFFER)
        for name, values in attributes.items()
    }
    document = {
        "asset": {"version": "2.0", "generator": content.provenance["generator"]},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": content.name, "mesh": 0, "scale": [0.001] * 3, "rotation": _QUARTER_TURN}],
        "meshes": [
            {
                "name": content.name,
                "primitives": [{"attributes": accessors, "indices": indices, "material": 0, "mode": 4}],
                "extras": {"unit": "mm", "provenance": content.provenance},
            }
        ],
        "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.6}}],
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": buffer.length}],
    }
    return document, b"".join(buffer.parts)


def _unit_float32(normals: Floats) -> Floats:
    """Return normals with unit length also where the mesh has none (a vertex of triangles without area)."""
    fallback = np.where((np.abs(normals).sum(axis=1) == 0)[:, None], np.array([0.0, 0.0, 1.0]), normals)
    return np.asarray(fallback)


def _colours(content: Content, wedges: Wedges) -> Floats:
    if wedges.deviation is not None:
        limit = float(np.abs(wedges.deviation).max(initial=0.0))
        return map_colours(wedges.deviation, -limit, limit)
    if content.nominal is not None:
        return feature_colours(len(content.nominal.features))[content.nominal.feature_ids()]
    face_of_row = np.zeros(len(wedges.vertex_ids), dtype=np.int64)
    face_of_row[wedges.corners] = content.surface.face_ids[:, None]
    return feature_colours(int(face_of_row.max()) + 1)[face_of_row]


class _Buffer:
    """The binary buffer with its views and accessors; every view starts at a multiple of four."""

    def __init__(self) -> None:
        self.parts: list[bytes] = []
        self.views: list[dict[str, Any]] = []
        self.accessors: list[dict[str, Any]] = []
        self.length = 0

    def add(self, values: NDArray[Any], component: int, target: int) -> int:
        """Add an array of four-byte numbers and return the index of its accessor."""
        raw = np.ascontiguousarray(values).tobytes()
        self.views.append({"buffer": 0, "byteOffset": self.length, "byteLength": len(raw), "target": target})
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": component,
            "count": len(values),
            "type": "VEC3" if values.ndim == 2 else "SCALAR",
            "min": np.atleast_1d(values.min(axis=0)).tolist(),
            "max": np.atleast_1d(values.max(axis=0)).tolist(),
        }
        self.accessors.append(accessor)
        self.parts.append(raw)
        self.length += len(raw)
        return len(self.accessors) - 1
