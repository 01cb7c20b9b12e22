"""Surface operators on triangle meshes: lumped mass, cotangent Laplacian, boundary mass.

With C the mass and G the Laplacian, u . C u is the integral of u², u . G u the integral of |grad u|², and
the eigenvalues of G x = lambda C x are those of the Laplace-Beltrami operator with free edges.

References
----------
Pinkall, Polthier: Computing discrete minimal surfaces and their conjugates, Exp. Math. 2 (1993),
doi:10.1080/10586458.1993.10504266.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_array, csr_array

from cadskin._typing import Floats, Points, Triangles
from cadskin.errors import GeometryError

__all__ = ["boundary_edges", "boundary_mass", "cotangent_laplacian", "lumped_mass"]

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
    corners = points[triangles]
    sides = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # side k is opposite to corner k
    doubled = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    longest = np.einsum("tki,tki->tk", sides, sides).max(axis=1, initial=0.0)
    bad = np.flatnonzero(~(doubled > _FLAT * longest))
    if len(bad):
        raise GeometryError(
            f"triangle {bad[0]} is degenerate ({len(bad)} in all): its corners {triangles[bad[0]].tolist()} "
            "lie on a line; mesh the part again with another edge length"
        )
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
