"""Read measured points: PLY, STL, and columns of numbers (XYZ, ASC, CSV, TXT, PTS)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin._arrays import frozen
from cadskin.cad.measured.columns import read_columns
from cadskin.cad.measured.ply import read_ply
from cadskin.errors import ReadError

if TYPE_CHECKING:
    from cadskin._typing import Points, Triangles, Vectors

__all__ = ["PointCloud", "Unit", "read_points"]

Unit: TypeAlias = Literal["mm", "um", "cm", "m", "inch"]
_MILLIMETRES = {"mm": 1.0, "um": 1e-3, "cm": 10.0, "m": 1000.0, "inch": 25.4}
_COLUMNS = (".xyz", ".asc", ".csv", ".txt", ".pts", ".dat")


@dataclass(frozen=True, eq=False)
class PointCloud:
    """Measured points, as the file has them, in mm.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    normals : (n, 3) float or None
        As given, not checked for length.
    triangles : (m, 3) int or None
        Of a scanned or computed mesh.
    source : str
        File name, without its folder.
    unit : str
        Of the file.
    """

    points: Points
    normals: Vectors | None = None
    triangles: Triangles | None = None
    source: str = ""
    unit: str = "mm"

    def __post_init__(self) -> None:
        """Check and freeze."""
        object.__setattr__(self, "points", frozen(self.points, shape=(None, 3), name="points", finite=False))
        if self.normals is not None:
            shape = (len(self.points), 3)
            normals = frozen(self.normals, shape=shape, name="normals", finite=False)
            object.__setattr__(self, "normals", normals)
        if self.triangles is not None:
            triangles = frozen(self.triangles, dtype=np.int64, shape=(None, 3), name="triangles")
            object.__setattr__(self, "triangles", triangles)

    def __len__(self) -> int:
        return len(self.points)

    def __repr__(self) -> str:
        size = " x ".join(f"{s:.4g}" for s in np.ptp(self.points, axis=0)) if len(self) else "nothing"
        return f"PointCloud({self.source or 'given'}, {len(self)} points, {size} mm)"


def read_points(path: str | Path, *, unit: Unit = "mm", columns: Sequence[int] | None = None) -> PointCloud:
    """Read measured points.

    Parameters
    ----------
    path : path
        .ply and .stl (text or binary), or columns of numbers (.xyz, .asc, .csv, .txt, .pts, .dat; separated
        by blanks, commas, semicolons or tabs; decimal commas with semicolons; a header and comments are
        passed over).
    unit : {"mm", "um", "cm", "m", "inch"}
        Of the numbers in the file; formats of point clouds do not say it.
    columns : sequence of int, optional
        Which columns are x, y, z, counted from 0; default the first three. Six give normals too.

    Returns
    -------
    PointCloud
        In mm.

    Raises
    ------
    ReadError
        Not such a file, a line that does not fit, or no points.
    """
    file = Path(path)
    if unit not in _MILLIMETRES:
        raise ReadError(f"unit must be one of {', '.join(_MILLIMETRES)}, got {unit!r}")
    suffix = file.suffix.lower()
    try:
        if suffix == ".ply":
            points, normals, triangles = read_ply(file)
        elif suffix == ".stl":
            points, triangles = _read_stl(file)
            normals = None
        elif suffix in _COLUMNS:
            points, normals = read_columns(file, columns)
            triangles = None
        else:
            known = ", ".join((".ply", ".stl", *_COLUMNS))
            raise ReadError(f"{file.name}: measured points are read from {known}")
    except OSError as error:
        raise ReadError(f"{file} cannot be read: {error}") from error
    if not len(points):
        raise ReadError(f"{file.name} holds no points")
    return PointCloud(points * _MILLIMETRES[unit], normals, triangles, file.name, unit)


def _read_stl(file: Path) -> tuple[Points, Triangles]:
    """Corners of an STL file, each place once, and the triangles."""
    data = file.read_bytes()
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if len(data) == 84 + 50 * count:
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
        corners = np.frombuffer(data, record, count, 84)["corners"].reshape(-1, 3).astype(np.float64)
    else:
        corners = _text_stl(file, data)
    places, index = np.unique(corners, axis=0, return_inverse=True)
    return places, index.reshape(-1, 3)


def _text_stl(file: Path, data: bytes) -> Points:
    text = data.decode("ascii", errors="replace")
    if not text.lstrip().startswith("solid"):
        raise ReadError(f"{file.name} is neither a binary STL file (its length is wrong) nor a text one")
    rows = [line.split()[1:] for line in text.splitlines() if line.lstrip().startswith("vertex")]
    try:
        corners = np.array(rows, dtype=np.float64).reshape(-1, 3)
    except ValueError as error:
        raise ReadError(f"{file.name}: a vertex does not have three numbers ({error})") from error
    if len(corners) % 3:
        raise ReadError(f"{file.name}: {len(corners)} vertices are not whole triangles; the file is cut off")
    return corners
