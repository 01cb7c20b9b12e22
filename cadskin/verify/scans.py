"""Scans for verification: meshes and point clouds, with the face of each point or without."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import CadskinWarning, GeometryError, ReadError
from cadskin.shape import DiscreteShape
from cadskin.shape.discrete import triangle_normals
from cadskin.verify.meshes import read_mesh_arrays
from cadskin.verify.nearest import closest_on_triangles

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Ints, Points, Triangles
    from cadskin.shape import NominalModel

__all__ = ["Scan", "labelled_points", "labelled_scan", "read_scan"]

_RIM = 0.05  # of an edge of the scan: a point that near to a face counts as one of its rim


@dataclass(frozen=True, eq=False)
class Scan:
    """A measured part as its file has it.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int or None
        None for a point cloud.
    face_ids : (m,) or (n,) int or None
        B-rep face of each triangle, of each point for a cloud; None where the file does not say.
    """

    points: Points
    triangles: Triangles | None = None
    face_ids: Ints | None = None


def labelled_points(points: Points, face_ids: Ints) -> DiscreteShape:
    """Return a point cloud as `verify` takes it: each point is a triangle of itself, with a face.

    Sections of a cloud are those it was measured in (points split by the gaps of their heights).

    Parameters
    ----------
    points : (n, 3) float
    face_ids : (n,) int
        -1 for a point that belongs to no face.

    Raises
    ------
    GeometryError
        NaN, or another number of labels than points.
    """
    cloud, labels = np.asarray(points, dtype=np.float64), np.asarray(face_ids)
    if labels.shape != (len(cloud),):
        raise GeometryError(f"{len(cloud)} points need as many labels, got {labels.shape}")
    return DiscreteShape(cloud, np.repeat(np.arange(len(cloud))[:, None], 3, axis=1), labels)


def labelled_scan(scan: Scan, nominal: NominalModel) -> DiscreteShape:
    """Return a scan with the B-rep face of each triangle; where the file has none, the nearest of the part.

    A triangle of a face that reaches over its rim, with a corner that is nearer to another face, belongs to
    none (label -1): the rounding of an edge by a scanner is no form deviation.

    Parameters
    ----------
    scan : Scan
        In the coordinates of the nominal model (align it first).
    nominal : NominalModel
    """
    surface = nominal.surface
    if scan.triangles is None:
        if scan.face_ids is not None:
            return labelled_points(scan.points, scan.face_ids)
        index, _ = closest_on_triangles(scan.points, surface.points, surface.triangles)
        return labelled_points(scan.points, surface.face_ids[index])
    if scan.face_ids is not None:
        return DiscreteShape(scan.points, scan.triangles, scan.face_ids)
    corners = scan.points[scan.triangles]
    index, _ = closest_on_triangles(
        corners.mean(axis=1),
        surface.points,
        surface.triangles,
        normals=triangle_normals(scan.points, scan.triangles),
    )
    labels = surface.face_ids[index]
    return DiscreteShape(scan.points, scan.triangles, _within_rims(scan, nominal, labels))


def _within_rims(scan: Scan, nominal: NominalModel, labels: Ints) -> Ints:
    assert scan.triangles is not None
    surface, kept = nominal.surface, labels.copy()
    used = np.unique(scan.triangles)
    nearest = np.full(len(scan.points), np.inf)
    nearest[used] = _apart(scan.points[used], surface.points, surface.triangles)
    sides = scan.points[scan.triangles[:, 1]] - scan.points[scan.triangles[:, 0]]
    slack = _RIM * float(np.median(np.linalg.norm(sides, axis=1)))
    for feature in nominal.features:
        rows = np.flatnonzero(np.isin(labels, feature.face_indices))
        if not len(rows):
            continue
        own = np.unique(scan.triangles[rows])
        apart = np.zeros(len(scan.points))
        apart[own] = _apart(scan.points[own], surface.points, surface.triangles[feature.triangle_ids])
        beyond = apart[own] > nearest[own] + slack
        outside = np.zeros(len(scan.points), dtype=bool)
        outside[own[beyond]] = True
        kept[rows[outside[scan.triangles[rows]].any(axis=1)]] = -1
    return kept


def _apart(places: Points, points: Points, triangles: Triangles) -> NDArray[np.float64]:
    index, weights = closest_on_triangles(places, points, triangles)
    foot = np.einsum("nk,nkj->nj", weights, points[triangles[index]])
    return np.asarray(np.linalg.norm(foot - places, axis=1))


def read_scan(path: str | Path) -> Scan:
    """Read a mesh or a point cloud.

    Parameters
    ----------
    path : path
        ``.npz`` (`points`, perhaps `triangles`, `face_ids`), ``.ply`` (perhaps with labels), ``.stl``,
        or a table of x, y, z and perhaps the face (``.csv``, ``.txt``, ``.xyz``) [mm].

    Raises
    ------
    ReadError
        A file that is missing, damaged or of another kind.

    Warns
    -----
    CadskinWarning
        Single precision: an exact plane of 250 mm is then about 7e-6 mm unflat.
    """
    source = Path(path)
    readers = {".stl": _stl, ".csv": _table, ".txt": _table, ".xyz": _table}
    reader = readers.get(source.suffix.lower(), read_mesh_arrays)
    try:
        points, triangles, labels = reader(source)
    except OSError as error:
        raise ReadError(f"{source}: cannot be read ({error.strerror or error})") from error
    except (KeyError, ValueError, IndexError) as error:
        if isinstance(error, ReadError):
            raise
        raise ReadError(f"{source}: damaged or no mesh or cloud ({error})") from error
    if not np.isfinite(points).all():
        raise ReadError(f"{source}: the points hold NaN or infinity")
    warn_of_single_precision(source, points)
    return Scan(points.astype(np.float64), triangles, labels)


def warn_of_single_precision(source: Path, points: NDArray[Any]) -> None:
    """Warn that coordinates of single precision make an exact plane unflat."""
    if points.dtype != np.float32:
        return
    size = float(np.abs(points).max(initial=0.0))
    warnings.warn(
        f"{source.name} is in single precision: values below {size * 6e-8:.1g} mm are rounding; "
        "write it with double precision (--double, or NPZ)",
        CadskinWarning,
        stacklevel=3,
    )


def _table(path: Path) -> tuple[NDArray[Any], None, NDArray[Any] | None]:
    text = path.read_text(encoding="utf-8", errors="replace")
    rows = [line.replace(",", " ").replace(";", " ").split() for line in text.splitlines() if line.strip()]
    if rows and not _is_number(rows[0][0]):
        rows = rows[1:]
    table = np.array(rows, dtype=np.float64)
    if table.ndim != 2 or table.shape[1] < 3:
        raise ReadError(f"{path}: a table of x, y, z and perhaps the face is expected")
    labels = table[:, 3].astype(np.int64) if table.shape[1] == 4 else None
    return table[:, :3], None, labels


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _stl(path: Path) -> tuple[NDArray[Any], NDArray[Any], None]:
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if len(data) == 84 + 50 * count:
        record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("spare", "<u2")])
        corners = np.frombuffer(data, record, count, 84)["corners"].reshape(-1, 3)
    else:
        words = [line.split() for line in data.decode("ascii", errors="replace").splitlines()]
        rows = [line[1:4] for line in words if line[:1] == ["vertex"]]
        corners = np.array(rows, dtype=np.float64).reshape(-1, 3)
    if not len(corners) or len(corners) % 3:
        raise ReadError(f"{path}: no STL file, or one without triangles")
    points, index = np.unique(corners, axis=0, return_inverse=True)
    triangles = np.asarray(index, dtype=np.int64).reshape(-1, 3)
    first, second, third = triangles.T
    flat = (first == second) | (second == third) | (third == first)
    return points, triangles[~flat], None
