"""Thin shells of flat triangles: stiffness of the membrane (constant strain) and of bending (DKT).

Six unknowns per vertex, displacement and rotation in space. Each triangle bends by the discrete Kirchhoff
element, stretches by the constant-strain element, and has a weak spring against rotation about its normal.

References
----------
Batoz, Bathe, Ho: A study of three-node triangular plate bending elements, Int. J. Numer. Methods Eng. 15
(1980), doi:10.1002/nme.1620151205; Zienkiewicz, Taylor: The finite element method, volume 2 (flat facets).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array, csr_array

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Triangles, Vectors

__all__ = ["plate_stiffness", "shell_stiffness"]

_MIDPOINTS = np.array([[0.5, 0.0], [0.5, 0.5], [0.0, 0.5]])  # of the sides: exact for quadratic integrands
_DRILLING = 1e-3  # of Young's modulus times the volume: spring against rotation about the normal


def plate_stiffness(x: Floats, y: Floats, triangles: Triangles, poisson: float) -> csr_array:
    """Return the bending stiffness (3 n, 3 n) of a plate of rigidity one: w, theta_x, theta_y per vertex.

    theta_x = dw/dy and theta_y = -dw/dx.
    """
    corners = np.stack([x, y], axis=1)[triangles]
    local = _bending(corners, poisson)
    return _assembled(local, triangles, 3, len(x))


def shell_stiffness(points: Points, triangles: Triangles, thickness: float, poisson: float) -> csr_array:
    """Return the stiffness (6 n, 6 n) of a shell of rigidity one: displacement and rotation per vertex.

    Rigidity one means Young's modulus 12 (1 - poisson²) / thickness³.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    triangles : (m, 3) int
    thickness : float
        [mm].
    poisson : float
    """
    axes, corners = _facets(points, triangles)
    extension = 12.0 / thickness**2
    local = np.zeros((len(triangles), 18, 18))
    for unknowns, stiffness in (
        ([0, 1], _membrane(corners, poisson) * extension),
        ([2, 3, 4], _bending(corners, poisson)),
        ([0, 1, 5], _drilling(corners) * extension * (1 - poisson**2)),
    ):
        at = (6 * np.arange(3)[:, None] + unknowns).ravel()
        local[:, at[:, None], at] += stiffness
    turn = np.zeros((len(triangles), 18, 18))
    for k in range(0, 18, 3):
        turn[:, k : k + 3, k : k + 3] = axes
    return _assembled(np.swapaxes(turn, 1, 2) @ local @ turn, triangles, 6, len(points))


def _facets(points: Points, triangles: Triangles) -> tuple[Vectors, Floats]:
    """Axes (m, 3, 3) of the triangles as rows, and their corners (m, 3, 2) in them."""
    corners = points[triangles]
    first = corners[:, 1] - corners[:, 0]
    first = first / np.linalg.norm(first, axis=1, keepdims=True)
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
    axes = np.stack([first, np.cross(normal, first), normal], axis=1)
    return axes, np.einsum("tij,tkj->tki", axes[:, :2], corners - corners[:, :1])


def _doubled(corners: Floats) -> Floats:
    one, two = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.asarray(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])


def _elastic(poisson: float) -> Floats:
    """Plane stress law of rigidity one."""
    return np.array([[1.0, poisson, 0.0], [poisson, 1.0, 0.0], [0.0, 0.0, 0.5 * (1.0 - poisson)]])


def _drilling(corners: Floats) -> Floats:
    """Return springs (m, 9, 9) between rotations about the normal and that of the triangle in its plane."""
    side = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    doubled = _doubled(corners)
    difference = np.zeros((len(corners), 3, 9))
    difference[:, :, 0::3] = 0.5 * (side[:, :, 0] / doubled[:, None])[:, None]
    difference[:, :, 1::3] = 0.5 * (side[:, :, 1] / doubled[:, None])[:, None]
    difference[:, np.arange(3), [2, 5, 8]] += 1.0
    weight = _DRILLING * doubled / 6.0
    return np.asarray(np.swapaxes(difference, 1, 2) @ difference * weight[:, None, None])


def _membrane(corners: Floats, poisson: float) -> Floats:
    """Constant strain triangles (m, 6, 6)."""
    side = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)  # opposite to corner k
    doubled = _doubled(corners)
    strain = np.zeros((len(corners), 3, 6))
    strain[:, 0, 0::2] = -side[:, :, 1]
    strain[:, 1, 1::2] = side[:, :, 0]
    strain[:, 2, 0::2] = side[:, :, 0]
    strain[:, 2, 1::2] = -side[:, :, 1]
    strain /= doubled[:, None, None]
    return np.asarray(
        np.einsum("tia,ij,tjb->tab", strain, _elastic(poisson), strain) * (0.5 * doubled)[:, None, None]
    )


def _bending(corners: Floats, poisson: float) -> Floats:
    """Discrete Kirchhoff triangles (m, 9, 9): w, theta_x, theta_y at each corner."""
    doubled = _doubled(corners)
    total = np.zeros((len(corners), 9, 9))
    for xi, eta in _MIDPOINTS:
        curvature = _curvature(corners, doubled, xi, eta)
        total += np.einsum("tia,ij,tjb->tab", curvature, _elastic(poisson), curvature)
    return np.asarray(total * (doubled / 6.0)[:, None, None])


def _curvature(corners: Floats, doubled: Floats, xi: float, eta: float) -> Floats:
    """Curvatures (m, 3, 9) at a point; sides 4 = 23, 5 = 31, 6 = 12 as in Batoz, Bathe, Ho."""
    delta = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)  # x_ij = x_i - x_j of the sides
    x, y = delta[:, :, 0], delta[:, :, 1]
    squared = x**2 + y**2
    p, t = -6.0 * x / squared, -6.0 * y / squared
    q, r = 3.0 * x * y / squared, 3.0 * y**2 / squared
    x_xi, x_eta = _slopes_x(p, q, r, xi, eta)
    y_xi, y_eta = _slopes_y(t, q, r, xi, eta)
    x31, y31, x12, y12 = x[:, 1, None], y[:, 1, None], x[:, 2, None], y[:, 2, None]
    rows = [
        y31 * x_xi + y12 * x_eta,
        -x31 * y_xi - x12 * y_eta,
        -x31 * x_xi - x12 * x_eta + y31 * y_xi + y12 * y_eta,
    ]
    return np.stack(rows, axis=1) / doubled[:, None, None]


def _slopes_x(p: Floats, q: Floats, r: Floats, xi: float, eta: float) -> tuple[Floats, Floats]:
    """Return the derivatives (m, 9) of the shape functions H_x by xi and eta."""
    (p4, p5, p6), (q4, q5, q6), (r4, r5, r6) = p.T, q.T, r.T
    a, b, both = 1.0 - 2.0 * xi, 1.0 - 2.0 * eta, -4.0 + 6.0 * (xi + eta)
    by_xi = [
        p6 * a + (p5 - p6) * eta,
        q6 * a - (q5 + q6) * eta,
        both + r6 * a - eta * (r5 + r6),
        -p6 * a + eta * (p4 + p6),
        q6 * a - eta * (q6 - q4),
        -2 + 6 * xi + r6 * a + eta * (r4 - r6),
        -eta * (p5 + p4),
        eta * (q4 - q5),
        -eta * (r5 - r4),
    ]
    by_eta = [
        -p5 * b - xi * (p6 - p5),
        q5 * b - xi * (q5 + q6),
        both + r5 * b - xi * (r5 + r6),
        xi * (p4 + p6),
        xi * (q4 - q6),
        -xi * (r6 - r4),
        p5 * b - xi * (p4 + p5),
        q5 * b + xi * (q4 - q5),
        -2 + 6 * eta + r5 * b + xi * (r4 - r5),
    ]
    return np.stack(by_xi, axis=1), np.stack(by_eta, axis=1)


def _slopes_y(t: Floats, q: Floats, r: Floats, xi: float, eta: float) -> tuple[Floats, Floats]:
    """Return the derivatives (m, 9) of the shape functions H_y by xi and eta."""
    (t4, t5, t6), (q4, q5, q6), (r4, r5, r6) = t.T, q.T, r.T
    a, b = 1.0 - 2.0 * xi, 1.0 - 2.0 * eta
    by_xi = [
        t6 * a + eta * (t5 - t6),
        1 + r6 * a - eta * (r5 + r6),
        -q6 * a + eta * (q5 + q6),
        -t6 * a + eta * (t4 + t6),
        -1 + r6 * a + eta * (r4 - r6),
        -q6 * a - eta * (q4 - q6),
        -eta * (t4 + t5),
        eta * (r4 - r5),
        -eta * (q4 - q5),
    ]
    by_eta = [
        -t5 * b - xi * (t6 - t5),
        1 + r5 * b - xi * (r5 + r6),
        -q5 * b + xi * (q5 + q6),
        xi * (t4 + t6),
        xi * (r4 - r6),
        -xi * (q4 - q6),
        t5 * b - xi * (t4 + t5),
        -1 + r5 * b + xi * (r4 - r5),
        -q5 * b - xi * (q4 - q5),
    ]
    return np.stack(by_xi, axis=1), np.stack(by_eta, axis=1)


def _assembled(local: Floats, triangles: Triangles, per_vertex: int, count: int) -> csr_array:
    places: Ints = (triangles[:, :, None] * per_vertex + np.arange(per_vertex)).reshape(len(triangles), -1)
    width = places.shape[1]
    rows, columns = np.repeat(places, width, axis=1), np.tile(places, (1, width))
    size = (per_vertex * count,) * 2
    return csr_array(coo_array((local.reshape(-1), (rows.ravel(), columns.ravel())), shape=size))
