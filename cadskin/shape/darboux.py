"""Augmented Darboux frames of meshes: normal, principal directions and curvatures by local quadrics.

At each vertex the neighbours are seen in a frame along the vertex normal and a Monge patch

    z = a x² / 2 + b x y + c y² / 2 + d x + e y + third order

is fitted by least squares. The gradient (d, e) corrects the normal, and the second fundamental form gives the
curvatures, with the sign of `cadskin.shape.Samples`: positive where the surface bends towards its normal.

References
----------
Zhang et al. 2013, doi:10.1177/0954405412466987, section on the augmented Darboux frame; Cazals, Pouget:
Estimating differential quantities using polynomial fitting of osculating jets, Comput. Aided Geom. Des. 22
(2005), doi:10.1016/j.cagd.2004.09.004 (a fit of degree 3 gives curvatures with an error of order h²).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.sparse import coo_array, csr_array

from cadskin._arrays import frozen
from cadskin._jit import fast_kernel, kernel
from cadskin.errors import GeometryError
from cadskin.shape._tangents import fill_tangents
from cadskin.shape.discrete import vertex_normals

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Triangles, Vectors

__all__ = ["DarbouxFrames", "classify", "darboux_frames"]

_TERMS = 9  # x, y, xx/2, xy, yy/2 and the four of third order
_MOST = 64  # neighbours used at most


@dataclass(frozen=True, eq=False)
class DarbouxFrames:
    """Augmented Darboux frames.

    Parameters
    ----------
    normals : (n, 3) float
        Unit normals.
    curvatures : (n, 2) float
        Principal curvatures k1 >= k2 [1/mm].
    directions : (n, 2, 3) float
        Unit principal directions; with the normal they are right-handed. At umbilics (a plane, a sphere) any
        pair is principal.
    residual : (n,) float
        Root mean square of the fit [mm]; large on noise and at edges.
    """

    normals: Vectors
    curvatures: Floats
    directions: Floats
    residual: Floats

    def __post_init__(self) -> None:
        """Freeze."""
        for key in ("normals", "curvatures", "directions", "residual"):
            object.__setattr__(self, key, frozen(getattr(self, key), name=key))


def darboux_frames(points: Points, triangles: Triangles, *, normals: Vectors | None = None) -> DarbouxFrames:
    """Return the frames of a mesh by quadric fits over the second ring of neighbours.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int
    normals : (n, 3) float, optional
        First guess and side of the normals; area-weighted vertex normals by default.

    Raises
    ------
    GeometryError
        A vertex has too few neighbours for a fit (it is on no triangle, or alone).

    Examples
    --------
    The points of a sphere of radius 5 have both curvatures -1/5, up to the second order in the edge length.
    """
    start = vertex_normals(points, triangles) if normals is None else np.asarray(normals, dtype=np.float64)
    offsets, neighbours = _adjacency(triangles, len(points))
    frame, curvatures, residual = _fit_all(
        np.ascontiguousarray(points, dtype=np.float64), np.ascontiguousarray(start), offsets, neighbours
    )
    lonely = np.flatnonzero(residual < 0)
    if len(lonely):
        raise GeometryError(
            f"vertex {lonely[0]} has too few neighbours for a quadric ({len(lonely)} in all); "
            "mesh the surface finer"
        )
    return DarbouxFrames(frame[:, 2], curvatures, frame[:, :2], residual)


def classify(curvatures: Floats, *, flat: float) -> Ints:
    """Return the kind of the local quadric at each point.

    Parameters
    ----------
    curvatures : (n, 2) float
        k1 >= k2 [1/mm].
    flat : float
        Curvature below which a direction counts as straight [1/mm].

    Returns
    -------
    (n,) int
        0 plane, 1 cylindrical, 2 elliptic (same signs), 3 hyperbolic (saddle).
    """
    bent = np.abs(curvatures) > flat
    count = bent.sum(axis=1)
    same = curvatures[:, 0] * curvatures[:, 1] > 0
    return np.where(count < 2, count, np.where(same, 2, 3)).astype(np.int64)


def _adjacency(triangles: Triangles, n: int) -> tuple[Ints, Ints]:
    """Neighbours of every vertex, one list after the other, and where each begins."""
    a, b, c = triangles.T.astype(np.int32)
    pairs = (np.concatenate([a, b, b, c, c, a]), np.concatenate([b, a, c, b, a, c]))
    graph = csr_array(coo_array((np.ones(6 * len(a), dtype=np.int8), pairs), shape=(n, n)))
    return graph.indptr.astype(np.int64), graph.indices.astype(np.int64)


@kernel
def _two_rings(i: int, offsets: Any, neighbours: Any, mark: Any, ids: Any) -> int:
    """Vertices within two edges of vertex i, and a third ring where these are few."""
    count = 0
    mark[i] = i
    begin, end = 0, 0
    for p in range(offsets[i], offsets[i + 1]):
        if count < _MOST:
            ids[count] = neighbours[p]
            mark[neighbours[p]] = i
            count += 1
    for ring in range(2):
        if ring == 1 and count >= 2 * _TERMS - 4:
            break
        begin, end = (0, count) if ring == 0 else (end, count)
        for k in range(begin, end):
            for p in range(offsets[ids[k]], offsets[ids[k] + 1]):
                j = neighbours[p]
                if mark[j] != i and count < _MOST:
                    mark[j] = i
                    ids[count] = j
                    count += 1
    return count


@kernel
def _solve(matrix: Any, rhs: Any, size: int) -> bool:
    """Cholesky solve in place of a small normal system."""
    for a in range(size):
        for b in range(a + 1):
            total = matrix[a, b]
            for c in range(b):
                total -= matrix[a, c] * matrix[b, c]
            if a == b:
                if total <= 1e-10:
                    return False
                matrix[a, a] = math.sqrt(total)
            else:
                matrix[a, b] = total / matrix[b, b]
    for a in range(size):
        for c in range(a):
            rhs[a] -= matrix[a, c] * rhs[c]
        rhs[a] /= matrix[a, a]
    for a in range(size - 1, -1, -1):
        for c in range(a + 1, size):
            rhs[a] -= matrix[c, a] * rhs[c]
        rhs[a] /= matrix[a, a]
    return True


@fast_kernel
def _monge(local: Any, count: int, size: int, solution: Any) -> float:
    """Fit the first ``size`` terms to points in units of the neighbourhood; mean squared residual, or -1."""
    matrix = np.zeros((_TERMS, _TERMS))
    row = np.zeros(_TERMS)
    solution[:] = 0.0
    squared = 0.0
    for k in range(count):
        _terms(local[k, 0], local[k, 1], row)
        z = local[k, 2]
        squared += z * z
        for a in range(_TERMS):
            solution[a] += row[a] * z
            for b in range(_TERMS):  # the whole row, so that it vectorises
                matrix[a, b] += row[a] * row[b]
    for a in range(size):
        for b in range(a + 1):
            matrix[a, b] /= count
        solution[a] /= count
    right = solution.copy()
    if not _solve(matrix, solution, size):
        return -1.0
    explained = 0.0
    for a in range(size):
        explained += right[a] * solution[a]
    return max(squared / count - explained, 0.0)


@kernel
def _terms(x: float, y: float, row: Any) -> None:
    row[0], row[1] = x, y
    row[2], row[3], row[4] = 0.5 * x * x, x * y, 0.5 * y * y
    row[5], row[6], row[7], row[8] = x * x * x, x * x * y, x * y * y, y * y * y


@kernel
def _fit_all(points: Any, normals: Any, offsets: Any, neighbours: Any) -> Any:
    n = points.shape[0]
    frames = np.zeros((n, 3, 3))
    curvatures = np.zeros((n, 2))
    residual = np.full(n, -1.0)
    mark = np.full(n, -1, dtype=np.int64)
    ids = np.zeros(_MOST, dtype=np.int64)
    local = np.zeros((_MOST, 3))
    solution = np.zeros(_TERMS)
    first, second = np.zeros(3), np.zeros(3)
    for i in range(n):
        count = _two_rings(i, offsets, neighbours, mark, ids)
        if count < 5:
            continue
        fill_tangents(normals[i], first, second)
        reach = 0.0
        for k in range(count):
            j = ids[k]
            x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
            local[k, 0] = x * first[0] + y * first[1] + z * first[2]
            local[k, 1] = x * second[0] + y * second[1] + z * second[2]
            local[k, 2] = x * normals[i, 0] + y * normals[i, 1] + z * normals[i, 2]
            reach = max(reach, x * x + y * y + z * z)
        reach = math.sqrt(reach)
        for k in range(count):
            for axis in range(3):
                local[k, axis] /= reach
        size = _TERMS if count >= _TERMS + 3 else 5
        error = _monge(local, count, size, solution)
        if error < 0.0 and size > 5:
            error = _monge(local, count, 5, solution)
        if error < 0.0:
            continue
        residual[i] = math.sqrt(error) * reach
        _frame(first, second, normals[i], solution, reach, frames[i], curvatures[i])
    return frames, curvatures, residual


@kernel
def _frame(
    first: Any, second: Any, normal: Any, solution: Any, reach: float, frame: Any, curvature: Any
) -> None:
    """Write normal, principal directions and curvatures of the fitted graph at the origin."""
    d, e = solution[0], solution[1]
    length = math.sqrt(1.0 + d * d + e * e)
    scale = 1.0 / (length * reach)
    a, b, c = solution[2] * scale, solution[3] * scale, solution[4] * scale
    for k in range(3):
        frame[2, k] = (normal[k] - d * first[k] - e * second[k]) / length
    # orthonormal tangents u = r_x / |r_x| and v = n x u; r_x = first + d n, r_y = second + e n
    size = math.sqrt(1.0 + d * d)
    # v = alpha r_x + beta r_y
    beta = size / length
    alpha = -d * e / (size * length)
    luu = a / (size * size)
    luv = (alpha * a + beta * b) / size
    lvv = alpha * alpha * a + 2.0 * alpha * beta * b + beta * beta * c
    middle, half = 0.5 * (luu + lvv), 0.5 * (luu - lvv)
    radius = math.hypot(half, luv)
    curvature[0], curvature[1] = middle + radius, middle - radius
    angle = 0.5 * math.atan2(luv, half)
    cosine, sine = math.cos(angle), math.sin(angle)
    for k in range(3):
        u = (first[k] + d * normal[k]) / size
        v = alpha * (first[k] + d * normal[k]) + beta * (second[k] + e * normal[k])
        frame[0, k] = cosine * u + sine * v
        frame[1, k] = cosine * v - sine * u
