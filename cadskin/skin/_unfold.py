"""Unfold triangles by sliding vertices along their faces and edges.

The regularised fold-over-free energy of [1]_: every triangle, seen along its nominal normal, has the Jacobian
J of its move; ``area * |J|² / chi(det J)`` with ``chi(D) = (D + sqrt(D² + eps²)) / 2`` is finite for a folded
triangle and grows without bound for a flat one as eps goes to 0. It is minimised over the moves that no
deviation forbids.

References
----------
.. [1] V. Garanzha, I. Kaporin, L. Kudryavtseva, F. Protais, N. Ray, D. Sokolov, "Foldover-free maps in 50
   lines of code", ACM Trans. Graph. 40(4) 102, 2021, doi:10.1145/3450626.3459847.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from scipy.optimize import minimize

from cadskin.shape.check import inverted_triangles
from cadskin.shape.discrete import triangle_normals

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Triangles, Vectors
    from cadskin.shape import DiscreteShape

__all__ = ["unfold"]

ENOUGH = 0.02  # part of the nominal area that a triangle keeps
_RINGS = (3, 8, 24)  # of triangles around a fold that may slide, in successive attempts
_ROUNDS = 10
_ITERATIONS = 50


@dataclass(frozen=True, eq=False)
class _Region:
    """The triangles (t, 3) around folds, their local vertices, and the moves those are free to make."""

    triangles: Triangles
    vertices: Ints
    free: Floats  # (k, 3, 3)
    gradients: Floats  # (t, 3 corners, 2): nominal gradients of the hat functions in the triangle's plane
    frames: Floats  # (t, 2, 3): orthonormal directions in the triangle's plane
    areas: Floats  # (t,)


def unfold(surface: DiscreteShape, displacement: Vectors, free: Floats) -> Vectors:
    """Return a displacement without folds that realises the same deviations, as far as there is one.

    Parameters
    ----------
    surface : DiscreteShape
        The nominal mesh.
    displacement : (n, 3) float
        [mm].
    free : (n, 3, 3) float
        Projector on the directions in which each vertex may slide.

    Returns
    -------
    (n, 3) float
        [mm]. Folds that no slide removes stay; `weld_report` counts them.
    """
    moved = np.array(displacement)
    for rings in _RINGS:
        folded = inverted_triangles(surface.points + moved, surface.points, surface.triangles, tol=ENOUGH)
        if not folded.any():
            break
        region = _region(surface, folded, free, rings)
        before = moved[region.vertices]
        moved[region.vertices] = before + _slide(region, before)
    return moved


def _region(surface: DiscreteShape, folded: Bools, free: Floats, rings: int) -> _Region:
    """Take the triangles with a vertex within ``rings`` of a fold; the vertices of their border stay."""
    near = np.zeros(surface.n_points, dtype=bool)
    near[surface.triangles[folded]] = True
    for _ in range(rings - 1):
        near[surface.triangles[near[surface.triangles].any(axis=1)]] = True
    chosen = surface.triangles[near[surface.triangles].any(axis=1)]
    vertices, local = np.unique(chosen, return_inverse=True)
    movable = np.where(near[vertices][:, None, None], free[vertices], 0.0)
    corners = surface.points[chosen]
    normals = triangle_normals(surface.points, chosen, unit=False)
    doubled = np.linalg.norm(normals, axis=1)
    good = doubled > 0
    corners, normals, doubled = corners[good], normals[good] / doubled[good, None], doubled[good]
    first = corners[:, 1] - corners[:, 0]
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    frames = np.stack([first, np.cross(normals, first)], axis=1)
    opposite = np.roll(corners, -2, axis=1) - np.roll(corners, -1, axis=1)
    turned = np.cross(normals[:, None, :], opposite) / doubled[:, None, None]
    gradients = np.einsum("tai,tki->tka", frames, turned)
    return _Region(local.reshape(-1, 3)[good], vertices, movable, gradients, frames, 0.5 * doubled)


def _slide(region: _Region, displacement: Vectors) -> Vectors:
    """Minimise the energy over the free moves; eps falls with the worst determinant, while that improves."""
    move = np.zeros_like(displacement)
    weight = region.areas / region.areas.mean()
    worst, idle = _worst_determinant(region, displacement), 0
    for _ in range(_ROUNDS):
        if worst > 2 * ENOUGH or idle == 2:
            break
        epsilon = np.sqrt(1e-4 + 0.04 * min(worst, 0.0) ** 2)
        found = minimize(
            _energy,
            move.ravel(),
            args=(region, displacement, weight, epsilon),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": _ITERATIONS, "maxcor": 12},
        )
        candidate = np.einsum("kij,kj->ki", region.free, found.x.reshape(-1, 3))
        reached = _worst_determinant(region, displacement + candidate)
        idle = 0 if reached > worst + 0.05 * abs(worst) else idle + 1
        move, worst = candidate, reached
    return move


def _worst_determinant(region: _Region, displacement: Vectors) -> float:
    """Smallest determinant of the moves of the triangles, each seen in its nominal plane."""
    in_plane = np.einsum("tai,tki->tka", region.frames, displacement[region.triangles])
    jacobian = np.eye(2) + np.einsum("tka,tkb->tab", in_plane, region.gradients)
    return float(np.linalg.det(jacobian).min())


def _energy(
    move: Floats, region: _Region, displacement: Vectors, weight: Floats, epsilon: float
) -> tuple[float, Floats]:
    """Value and gradient of the regularised energy, per mean area."""
    moved = displacement + np.einsum("kij,kj->ki", region.free, move.reshape(-1, 3))
    gradient = np.zeros_like(moved)
    value = _energy_kernel(
        moved, region.triangles, region.gradients, region.frames, weight, epsilon, gradient
    )
    return float(value), np.einsum("kij,kj->ki", region.free, gradient).ravel()


@njit(cache=True)
def _energy_kernel(moved, triangles, gradients, frames, weight, epsilon, gradient):  # type: ignore[no-untyped-def]
    """Sum up ``weight |J|² / chi(det J)`` and add its derivative by the moves to ``gradient``."""
    total = 0.0
    jacobian = np.zeros((2, 2))
    for t in range(len(triangles)):
        for a in range(2):
            for b in range(2):
                jacobian[a, b] = 1.0 if a == b else 0.0
            for k in range(3):
                v = triangles[t, k]
                along = (
                    frames[t, a, 0] * moved[v, 0]
                    + frames[t, a, 1] * moved[v, 1]
                    + frames[t, a, 2] * moved[v, 2]
                )
                jacobian[a, 0] += along * gradients[t, k, 0]
                jacobian[a, 1] += along * gradients[t, k, 1]
        determinant = jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0]
        squares = jacobian[0, 0] ** 2 + jacobian[0, 1] ** 2 + jacobian[1, 0] ** 2 + jacobian[1, 1] ** 2
        root = np.sqrt(determinant**2 + epsilon**2)
        # (D + root) / 2, without the loss of digits for D < 0
        chi = 0.5 * (determinant + root) if determinant > 0 else 0.5 * epsilon**2 / (root - determinant)
        total += weight[t] * squares / chi
        of_jacobian = 2.0 * weight[t] / chi
        of_determinant = -weight[t] * squares / (chi * root)  # chi' = chi / root
        for a in range(2):
            sign = 1.0 if a == 0 else -1.0
            by_0 = of_jacobian * jacobian[a, 0] + sign * of_determinant * jacobian[1 - a, 1]
            by_1 = of_jacobian * jacobian[a, 1] - sign * of_determinant * jacobian[1 - a, 0]
            for k in range(3):
                by_move = by_0 * gradients[t, k, 0] + by_1 * gradients[t, k, 1]
                v = triangles[t, k]
                for i in range(3):
                    gradient[v, i] += by_move * frames[t, a, i]
    return total
