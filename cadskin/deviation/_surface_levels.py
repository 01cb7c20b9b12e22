"""Surface fields on fine meshes: a coarse field in smooth functions, carried to all vertices.

The law is that of `_surface.SurfaceField`, the operator that of the whole mesh in a coarse space
(`_coarse_space`). The covariance of the coefficients is worked out once, C = S M S with S = p(W) M^-1, and
factored; a field is then D P A z, with D the exact row scaling.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import fast_kernel, kernel
from cadskin.deviation._cholesky import SparseCholesky
from cadskin.deviation._coarse_samplers import SequentialField, conditional, low_rank_field
from cadskin.deviation._coarse_space import CoarseSpace, make_coarse_space
from cadskin.deviation._elements import surface_elements
from cadskin.deviation._kriging import TwoLevelField
from cadskin.deviation._lanes import COLUMNS
from cadskin.deviation._surface import SurfaceField, spectral_polynomial

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csr_array

    from cadskin._typing import Floats, Points, Triangles, Vectors
    from cadskin.deviation._patch_fields import PatchField

__all__ = ["SurfaceLevelsField", "surface_field", "surface_levels"]

# Spacing of the nodes in correlation lengths, and predecessors of each (0: low rank). Largest errors of the
# correlation on planes and spheres, measured: 1.4e-3, 1.5e-3, 8e-3, 1e-2.
_PLANS = {
    "squared_exponential": (1 / 7, 0),
    "matern52": (1 / 10, 96),
    "matern32": (1 / 10, 64),
    "whittle": (1 / 12, 48),
}
_LEAST_POINTS = 2000  # below, all points are cheap
_MOST_NODES = 5500  # whose covariance is worked out as a whole
_SHARE = 0.55  # of the points that may be nodes
_MARGIN = 1.4  # more vertices per length for linear elements: their error and that of the space add up
_STENCIL = 16  # nodes each value is carried over from
_NUGGET = 1e-5  # of the variance, against rounding
_NODES_PER_CELL = 0.75  # number of nodes times the square of the spacing over the area, about


def surface_field(
    points: Points,
    triangles: Triangles,
    kernel: str,
    stretch: Floats | None = None,
    *,
    normals: Vectors | None = None,
) -> PatchField:
    """Return the field along a surface: in a coarse space where the mesh is fine enough, else on all points.

    Parameters as of `SurfaceField`.
    """
    local = np.ones(len(points)) if stretch is None else np.asarray(stretch, dtype=np.float64)
    levels = surface_levels(points, triangles, kernel, local, normals)
    return SurfaceField(points, triangles, kernel, stretch, normals=normals) if levels is None else levels


def surface_levels(
    points: Points, triangles: Triangles, kernel: str, local: Floats, normals: Vectors | None = None
) -> SurfaceLevelsField | None:
    """Return the field on a mesh that is fine enough for a coarse space, None on others.

    Parameters
    ----------
    points : (n, 3) float
        Divided by the correlation length.
    triangles : (m, 3) int
    kernel : str
    local : (n,) float
        Local correlation length over the one that ``points`` are divided by.
    normals : (n, 3) float, optional
        Of the surface.
    """
    if kernel not in _PLANS or len(points) < _LEAST_POINTS:
        return None
    spacing, _ = _PLANS[kernel]
    corners = points[triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = 0.5 * np.linalg.norm(normal, axis=1) / local[triangles].mean(axis=1) ** 2
    most = min(_MOST_NODES, _SHARE * len(points))
    if _NODES_PER_CELL * lengths.sum() / spacing**2 > most:
        return None
    pole, coefficients = spectral_polynomial(kernel)
    elements = surface_elements(points, triangles, kernel, local, normals=normals, margin=_MARGIN)
    space = make_coarse_space(elements, len(points), spacing * elements.local, pole)
    if space is None or space.surface > most:
        return None
    return SurfaceLevelsField(space, kernel, coefficients)


class SurfaceLevelsField(TwoLevelField):
    """A unit field on the points of a surface, made of the functions of a coarse space.

    Parameters
    ----------
    space : CoarseSpace
    kernel : str
    coefficients : (k,) float
        Of the polynomial p, see `_surface.spectral_polynomial`.

    Attributes
    ----------
    certificate : float
        Largest share of a point's variance that its nodes do not determine; the rows are scaled to it.
    """

    def __init__(self, space: CoarseSpace, kernel: str, coefficients: Floats) -> None:
        covariance = coefficient_covariance(space, coefficients)
        to_nodes = space.at_nodes
        cross = np.asarray(covariance @ to_nodes.T)
        at_nodes = np.asarray(to_nodes @ cross)
        neighbours = _PLANS[kernel][1]
        self.coarse = (
            SequentialField(at_nodes, space.places[: space.surface], neighbours=neighbours)
            if neighbours
            else low_rank_field(at_nodes)
        )
        self.latent = self.coarse.latent
        rows = (space.starts, space.seen, space.weights)
        nodes, self.weights, variance, missing = _kriging_rows(*rows, covariance, cross, at_nodes)
        self.neighbours = self.coarse.place_of_point[nodes]
        self.certificate = float((missing / variance).max())
        uneven = float(np.sqrt(variance.max() / variance.min()))
        self.note = (
            f"surface field on {space.surface} nodes for {len(variance)} points ({self.coarse.note}), "
            f"{space.note}, "
            f"largest kriging variance {self.certificate:.2g}, "
            f"standard deviations before scaling differ by a factor of {uneven:.3g}"
        )


def coefficient_covariance(space: CoarseSpace, coefficients: Floats) -> Floats:
    """Return the covariance (inside, inside) of the coefficients of the surface's nodes."""
    solver = SparseCholesky(space.matrix, space.places)
    order = solver.order
    mass = space.mass[order][:, order].astype(np.float32).tocsr()
    place = np.argsort(order)[: space.inside]
    responses = np.zeros((len(order), space.inside), dtype=np.float32)
    for first in range(0, space.inside, COLUMNS):
        mine = place[first : first + COLUMNS]
        loads = np.zeros((len(order), COLUMNS), dtype=np.float32)
        loads[mine, np.arange(len(mine))] = 1.0
        coloured = _coloured(solver, mass, coefficients, loads)
        responses[:, first : first + COLUMNS] = coloured[:, : len(mine)]
    covariance = np.asarray(responses.T @ (mass @ responses), dtype=np.float64)
    return 0.5 * (covariance + covariance.T)


def _coloured(
    solver: SparseCholesky, mass: csr_array, coefficients: Floats, loads: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Return p(W) M^-1 of loads (m, COLUMNS) in the order of the factor, W = K^-1 M."""
    solver.solve_columns(loads)
    previous = loads
    total = previous * np.float32(coefficients[0])
    current = previous
    for k, coefficient in enumerate(coefficients[1:], start=1):
        following = np.zeros_like(current)
        _multiply(mass.indptr, mass.indices, mass.data, current, following)
        solver.solve_columns(following)
        following *= np.float32(2.0 if k == 1 else 4.0)
        following -= current if k == 1 else 2 * current + previous
        total += np.float32(coefficient) * following
        previous, current = current, following
    return total


@fast_kernel
def _multiply(starts: Any, columns: Any, values: Any, x: Any, out: Any) -> None:
    """Add matrix @ x to ``out``, both (m, COLUMNS)."""
    for i in range(out.shape[0]):
        p = starts[i]
        while p + 4 <= starts[i + 1]:
            v0, v1, v2, v3 = values[p], values[p + 1], values[p + 2], values[p + 3]
            a, b, c, d = columns[p], columns[p + 1], columns[p + 2], columns[p + 3]
            for r in range(COLUMNS):
                out[i, r] += v0 * x[a, r] + v1 * x[b, r] + v2 * x[c, r] + v3 * x[d, r]
            p += 4
        while p < starts[i + 1]:
            for r in range(COLUMNS):
                out[i, r] += values[p] * x[columns[p], r]
            p += 1


@kernel
def _kriging_rows(starts: Any, seen: Any, weights: Any, covariance: Any, cross: Any, at_nodes: Any) -> Any:
    """Nodes (n, _STENCIL), unit-variance weights, variances (n,) and their parts that the nodes lack."""
    n = starts.size - 1
    nodes = np.zeros((n, _STENCIL), dtype=np.uint32)
    factors = np.zeros((n, _STENCIL), dtype=np.float32)
    variance, missing = np.zeros(n), np.zeros(n)
    matrix = np.zeros((_STENCIL, _STENCIL))
    right = np.zeros(_STENCIL)
    for i in range(n):
        count = 0
        total = 0.0
        for p in range(starts[i], starts[i + 1]):
            a = seen[p]
            if a < at_nodes.shape[0] and count < _STENCIL:
                nodes[i, count] = a
                count += 1
            part = 0.5 * weights[p] * covariance[a, a]
            for q in range(starts[i], p):
                part += weights[q] * covariance[a, seen[q]]
            total += 2.0 * weights[p] * part
        for k in range(count):
            right[k] = 0.0
            for p in range(starts[i], starts[i + 1]):
                right[k] += weights[p] * cross[seen[p], nodes[i, k]]
            for j in range(k + 1):
                matrix[k, j] = at_nodes[nodes[i, k], nodes[i, j]]
            matrix[k, k] *= 1.0 + _NUGGET
        known = conditional(matrix, right, count)
        spread = 0.0
        for k in range(count):
            part = 0.5 * right[k] * at_nodes[nodes[i, k], nodes[i, k]]
            for j in range(k):
                part += right[j] * at_nodes[nodes[i, k], nodes[i, j]]
            spread += 2.0 * right[k] * part
        variance[i], missing[i] = total, total - known
        for k in range(count):
            factors[i, k] = right[k] / np.sqrt(spread)
    return nodes, factors, variance, missing
