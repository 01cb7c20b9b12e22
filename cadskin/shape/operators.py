"""Surface operators on triangle meshes: lumped mass, cotangent Laplacian, boundary mass, quadratic elements.

With C the mass and G the Laplacian, u . C u is the integral of u², u . G u the integral of |grad u|², and
the eigenvalues of G x = lambda C x are those of the Laplace-Beltrami operator with free edges.

References
----------
Pinkall, Polthier: Computing discrete minimal surfaces and their conjugates, Exp. Math. 2 (1993),
doi:10.1080/10586458.1993.10504266.
Ciarlet: The Finite Element Method for Elliptic Problems, North-Holland 1978, sections 2.2 and 4.1 (quadratic
elements, quadrature that keeps their order).
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from cadskin._typing import Floats, Ints, Points, Triangles
from cadskin.errors import GeometryError

__all__ = [
    "boundary_edges",
    "boundary_mass",
    "cotangent_laplacian",
    "lumped_mass",
    "mesh_edges",
    "quadratic_operators",
]

_FLAT = 1e-12  # doubled area over longest edge squared below which a triangle has no usable shape


def lumped_mass(points: Points, triangles: Triangles) -> Floats:
    """Return a third of the area of the triangles around each vertex.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int

    Returns
    -------
    (n,) float
        [mm²]; the sum is the area of the surface.
    """
    a, b, c = (points[triangles[:, k]] for k in range(3))
    areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    total = np.bincount(triangles.ravel(), weights=np.repeat(areas / 3.0, 3), minlength=len(points))
    return np.asarray(total, dtype=np.float64)


def cotangent_laplacian(points: Points, triangles: Triangles, *, weights: Floats | None = None) -> csr_array:
    """Return the stiffness matrix of linear elements: symmetric, positive semidefinite, rows sum to zero.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int
    weights : (m,) float, optional
        Coefficient w of each triangle: u . G u is then the integral of w |grad u|².

    Returns
    -------
    (n, n) csr_array of float
        Without weights entry (i, j) is minus half the sum of the cotangents of the angles opposite to
        edge ij.

    Raises
    ------
    GeometryError
        A triangle is degenerate; the message names it.

    Examples
    --------
    >>> g = cotangent_laplacian(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    >>> g.toarray()
    array([[ 1. , -0.5, -0.5],
           [-0.5,  0.5,  0. ],
           [-0.5,  0. ,  0.5]])
    """
    sides, doubled = _sides_and_areas(points[triangles], triangles)
    doubled = doubled if weights is None else doubled / weights
    rows, columns, values = [], [], []
    for k in range(3):
        i, j = triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3]
        cosine = np.einsum("ti,ti->t", sides[:, (k + 1) % 3], sides[:, (k + 2) % 3])
        half = -0.5 * cosine / doubled  # half the cotangent of the angle at corner k
        rows += [i, j, i, j]
        columns += [j, i, i, j]
        values += [-half, -half, half, half]
    n = len(points)
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    matrix = csr_array(coo_array(entries, shape=(n, n)))
    matrix.sum_duplicates()
    return matrix


def _sides_and_areas(corners: Points, triangles: Triangles) -> tuple[Points, Floats]:
    """Return the sides (m, 3, 3), side k opposite to corner k, and the doubled areas (m,), none zero."""
    sides = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    doubled = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    longest = np.einsum("tki,tki->tk", sides, sides).max(axis=1, initial=0.0)
    bad = np.flatnonzero(~(doubled > _FLAT * longest))
    if len(bad):
        raise GeometryError(
            f"triangle {bad[0]} is degenerate ({len(bad)} in all): its corners {triangles[bad[0]].tolist()} "
            "lie on a line; mesh the part again with another edge length"
        )
    return sides, doubled


def mesh_edges(triangles: Triangles) -> tuple[Ints, Ints]:
    """Return the edges (e, 2), sorted, and those of each triangle (m, 3): 01, 12, 20."""
    sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    count = int(triangles.max(initial=0)) + 1
    keys, number = np.unique(sides[:, 0] * count + sides[:, 1], return_inverse=True)
    return np.stack([keys // count, keys % count], axis=1), number.reshape(-1, 3)


def quadratic_operators(
    triangles: Triangles,
    corners: Points,
    count: int,
    *,
    weights: Floats | None = None,
    areas: Floats | None = None,
) -> tuple[csr_array, csr_array]:
    """Return the Laplacian of quadratic elements, and a factor F of their mass F F^T.

    The unknowns are the values at the ``count`` vertices and then those midway along the edges, in the order
    of `mesh_edges`. The mass is integrated by seven points per triangle, exactly for cubics, which keeps the
    order of the elements; white noise on the surface, tested with the elements, is F z with z independent
    standard normal numbers, one per unknown and one per triangle.

    Parameters
    ----------
    triangles : (m, 3) int
    corners : (m, 3, 3) float
        Corners of each triangle for itself, so that a surface may be given by its lengths alone [mm].
    count : int
    weights : (m, 3) float, optional
        Coefficient w at the corners: u . G u is the integral of w |grad u|², w linear in each triangle.
    areas : (m,) float, optional
        Areas for the mass where they are not those of the corners [mm²].

    Returns
    -------
    laplacian : (count + e, count + e) csr_array of float
    factor : (count + e, count + e + m) csr_array of float

    Raises
    ------
    GeometryError
        A triangle is degenerate; the message names it.
    """
    sides, doubled = _sides_and_areas(corners, triangles)
    edges, edge_of_side = mesh_edges(triangles)
    unknowns = np.concatenate([triangles, edge_of_side + count], axis=1)
    total = count + len(edges)
    gradients = np.einsum("tid,tjd->tij", sides, sides) / doubled[:, None, None]  # times the doubled area
    stiffness = np.zeros((len(triangles), 6, 6))
    for place, weight in zip(_PLACES, _WEIGHTS, strict=True):
        slopes = _quadratic_slopes(place)
        local = weight if weights is None else weight * (weights @ place)[:, None, None]
        stiffness += 0.5 * local * (slopes @ gradients @ slopes.T)
    rows, columns = np.repeat(unknowns, 6, axis=1).ravel(), np.tile(unknowns, (1, 6)).ravel()
    laplacian = csr_array(coo_array((stiffness.ravel(), (rows, columns)), shape=(total, total)))
    area = 0.5 * doubled if areas is None else areas
    lumps = np.bincount(unknowns.ravel(), weights=(area[:, None] * _LUMPS).ravel(), minlength=total)
    own = np.arange(total)
    middle = np.sqrt(_MIDDLE * area)[:, None] * _AT_CENTRE
    of_triangle = total + np.repeat(np.arange(len(triangles)), 6)
    entries = (
        np.concatenate([np.sqrt(lumps), middle.ravel()]),
        (np.concatenate([own, unknowns.ravel()]), np.concatenate([own, of_triangle])),
    )
    return laplacian, csr_array(coo_array(entries, shape=(total, total + len(triangles))))


# Quadrature of degree 4 (Dunavant 1985) for the stiffness; of degree 3, with the unknowns among its points,
# for the mass: lumps at corners and mid-edges, the rest at the centre.
_ONE, _TWO = 0.445948490915965, 0.091576213509771
_PLACES = np.array(
    [
        [_ONE, _ONE, 1 - 2 * _ONE],
        [_ONE, 1 - 2 * _ONE, _ONE],
        [1 - 2 * _ONE, _ONE, _ONE],
        [_TWO, _TWO, 1 - 2 * _TWO],
        [_TWO, 1 - 2 * _TWO, _TWO],
        [1 - 2 * _TWO, _TWO, _TWO],
    ]
)
_WEIGHTS = np.array([0.223381589678011] * 3 + [0.109951743655322] * 3)
_LUMPS = np.array([1 / 20] * 3 + [2 / 15] * 3)
_MIDDLE = 9 / 20
_AT_CENTRE = np.array([-1 / 9] * 3 + [4 / 9] * 3)


def _quadratic_slopes(place: Floats) -> Floats:
    """Return derivatives (6, 3) of the shape functions to the barycentric coordinates at a place."""
    a, b, c = place
    return np.array(
        [
            [4 * a - 1, 0, 0],
            [0, 4 * b - 1, 0],
            [0, 0, 4 * c - 1],
            [4 * b, 4 * a, 0],
            [0, 4 * c, 4 * b],
            [4 * c, 0, 4 * a],
        ]
    )


def boundary_edges(triangles: Triangles) -> Triangles:
    """Return the edges (b, 2) that belong to one triangle only."""
    sides = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    edges, count = np.unique(sides, axis=0, return_counts=True)
    return np.asarray(edges[count == 1], dtype=np.int64)


def boundary_mass(points: Points, triangles: Triangles) -> Floats:
    """Return half the length of the boundary edges at each vertex.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int

    Returns
    -------
    (n,) float
        [mm]; the sum is the length of the boundary, zero for a closed surface.
    """
    edges = boundary_edges(triangles)
    length = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    total = np.bincount(edges.ravel(), weights=np.repeat(0.5 * length, 2), minlength=len(points))
    return np.asarray(total, dtype=np.float64)
