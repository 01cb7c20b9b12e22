"""The result of a simulation as plain arrays: what the display and the panels work with.

Only numpy and the standard library; no FreeCAD module is needed, so this file is tested without FreeCAD too.
"""

from __future__ import annotations

import io
import json
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zipfile import BadZipFile

import numpy as np

__all__ = ["ResultError", "SkinResult", "read_result"]

_ARRAYS = ("points", "triangles", "triangle_face", "displacement", "corner_deviation")


class ResultError(ValueError):
    """Result files that do not fit together, or are damaged."""


@dataclass(frozen=True, eq=False)
class SkinResult:
    """One or several made parts on one nominal mesh.

    Parameters
    ----------
    points : (n, 3) float64
        Nominal vertices [mm].
    triangles : (m, 3) int32
        Vertices of each triangle, outward.
    triangle_face : (m,) int32
        The B-rep face of each triangle, 1 for ``Face1``.
    displacement : (size, n, 3) float32
        Displacement of each vertex in each instance [mm].
    corner_deviation : (size, m, 3) float32
        Signed deviation along the nominal normal of the triangle's face, at its three corners [mm],
        + = material added. A vertex on an edge has one value per face, so colours do not bleed over the edge.
    report : dict
        The content of ``result.json``; see `instance_report`.
    """

    points: np.ndarray
    triangles: np.ndarray
    triangle_face: np.ndarray
    displacement: np.ndarray
    corner_deviation: np.ndarray
    report: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check the shapes against each other and freeze the arrays."""
        n_points, n_triangles, size = len(self.points), len(self.triangles), len(self.displacement)
        expected = {
            "points": (n_points, 3),
            "triangles": (n_triangles, 3),
            "triangle_face": (n_triangles,),
            "displacement": (size, n_points, 3),
            "corner_deviation": (size, n_triangles, 3),
        }
        for name, shape in expected.items():
            array = getattr(self, name)
            if array.shape != shape:
                raise ResultError(f"the result is damaged: {name} has shape {array.shape}, not {shape}")
            array.flags.writeable = False
        if n_triangles and not 0 <= self.triangles.min() <= self.triangles.max() < n_points:
            raise ResultError("the result is damaged: a triangle names a vertex that does not exist")

    @property
    def size(self) -> int:
        """Number of instances."""
        return len(self.displacement)

    @property
    def n_points(self) -> int:
        """Number of vertices."""
        return len(self.points)

    @property
    def n_triangles(self) -> int:
        """Number of triangles."""
        return len(self.triangles)

    def instance_points(self, instance: int = 0, *, exaggeration: float = 1.0) -> np.ndarray:
        """Return the vertices (n, 3) [mm] of an instance, its deviation drawn larger on request."""
        return self.points + exaggeration * self.displacement[instance].astype(np.float64)

    def vertex_deviation(self, instance: int = 0) -> np.ndarray:
        """Return one deviation (n,) [mm] per vertex: that of largest magnitude where faces meet."""
        corners = self.triangles.ravel()
        values = self.corner_deviation[instance].ravel()
        highest = np.full(self.n_points, -np.inf)
        lowest = np.full(self.n_points, np.inf)
        np.maximum.at(highest, corners, values)
        np.minimum.at(lowest, corners, values)
        largest = np.where(highest >= -lowest, highest, lowest)
        return np.where(np.isfinite(largest), largest, 0.0)

    def face_numbers(self) -> np.ndarray:
        """Return the faces that have triangles, 1 for ``Face1``."""
        return np.unique(self.triangle_face)

    def face_deviation(self, face: int, instance: int = 0) -> np.ndarray:
        """Return the deviations (k, 3) [mm] at the corners of the triangles of one face."""
        return self.corner_deviation[instance][self.triangle_face == face]

    def statistics(self, instance: int = 0, face: int | None = None) -> tuple[float, float, float]:
        """Return the smallest, the largest and the root mean square deviation [mm], area-weighted.

        Parameters
        ----------
        instance : int
        face : int, optional
            Only this face, 1 for ``Face1``.
        """
        chosen = slice(None) if face is None else self.triangle_face == face
        values = self.corner_deviation[instance][chosen].astype(np.float64)
        if not len(values):
            return 0.0, 0.0, 0.0
        areas = self._areas()[chosen]
        square = (values**2).mean(axis=1)
        return float(values.min()), float(values.max()), float(np.sqrt((areas @ square) / areas.sum()))

    def range(self) -> tuple[float, float]:
        """Return the smallest and the largest deviation [mm] of all instances."""
        if not self.corner_deviation.size:
            return 0.0, 0.0
        return float(self.corner_deviation.min()), float(self.corner_deviation.max())

    def nearest_corner(self, position: Any, instance: int = 0) -> tuple[int, int, float]:
        """Return (triangle, corner, deviation [mm]) of the vertex that is nearest to a point."""
        distance = ((self.instance_points(instance) - np.asarray(position, dtype=float)) ** 2).sum(axis=1)
        vertex = int(distance.argmin())
        triangle, corner = (int(k) for k in np.argwhere(self.triangles == vertex)[0])
        return triangle, corner, float(self.corner_deviation[instance, triangle, corner])

    def instance_report(self, instance: int = 0) -> dict[str, Any]:
        """Return ``min max rms conforming tolerances`` of one instance; empty where there is no report.

        Each entry of ``tolerances`` has ``id characteristic value limit ok certified reason``; ``ok`` is
        None, and ``reason`` says why, where the tolerance could not be evaluated.
        """
        instances = self.report.get("instances", [])
        return dict(instances[instance]) if instance < len(instances) else {}

    def tolerance_rows(self, instance: int = 0) -> list[dict[str, Any]]:
        """Return the rows of the table of tolerances of one instance."""
        return list(self.instance_report(instance).get("tolerances", []))

    def tolerance_values(self, tolerance_id: str) -> np.ndarray:
        """Return the value (size,) [mm] of a tolerance in every instance; NaN where not evaluated."""
        values = np.full(self.size, np.nan)
        for instance in range(self.size):
            for row in self.tolerance_rows(instance):
                if row["id"] == tolerance_id and row.get("value") is not None:
                    values[instance] = row["value"]
        return values

    def to_bytes(self) -> bytes:
        """Return arrays and report as the bytes of one ``.npz`` file."""
        stream = io.BytesIO()
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        text = json.dumps(self.report, ensure_ascii=False).encode("utf-8")
        np.savez(stream, report=np.frombuffer(text, dtype=np.uint8), **arrays)
        return stream.getvalue()

    def _areas(self) -> np.ndarray:
        first, second, third = (self.points[self.triangles[:, k]] for k in range(3))
        return 0.5 * np.linalg.norm(np.cross(second - first, third - first), axis=1)


def read_result(path: str | Path, report: dict[str, Any] | None = None) -> SkinResult:
    """Return the result in an ``.npz`` file.

    Parameters
    ----------
    path : str or Path
    report : dict, optional
        Instead of the report in the file.

    Raises
    ------
    ResultError
        The file is damaged, or is no result.
    """
    try:
        # numpy leaves a damaged file open that it has opened itself.
        with open(path, "rb") as stream, np.load(stream, allow_pickle=False) as file:
            arrays = {name: file[name] for name in _ARRAYS}
            stored = bytes(file["report"]).decode("utf-8") if "report" in file else "{}"
        return SkinResult(**arrays, report=json.loads(stored) if report is None else report)
    except ResultError:
        raise
    except (
        OSError,
        KeyError,
        ValueError,
        TypeError,
        AttributeError,
        EOFError,
        BadZipFile,
        zlib.error,
    ) as error:
        raise ResultError(f"{Path(path).name} holds no result that can be read: {error}") from error
