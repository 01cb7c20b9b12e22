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
from scipy.optimize import minimize

from cadskin.shape.check import inverted_triangles
from cadskin.shape.discrete import triangle_normals

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, Ints, Triangles, Vectors
    from cadskin.shape import DiscreteShape

__all__ = ["unfold"]

ENOUGH = 0.02  # part of the nominal area that a triangle keeps
_ROUNDS = 8
_FIRST_RINGS = 3


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
    rings = _FIRST_RINGS
    for _ in range(_ROUNDS):
        folded = inverted_triangles(surface.points + moved, surface.points, surface.triangles, tol=ENOUGH)
        if not folded.any():
            break
        region = _region(surface, folded, free, rings)
        before = moved[region.vertices]
        moved[region.vertices] = before + _slide(region, before)
        rings *= 2
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
    """Minimise the energy over the free moves, eps falling with the worst determinant."""
    move = np.zeros_like(displacement)
    for _ in range(_ROUNDS):
        worst = float(_determinants(region, displacement + move).min())
        if worst > 2 * ENOUGH:
            break
        epsilon = np.sqrt(1e-4 + 0.04 * min(worst, 0.0) ** 2)
        found = minimize(
            _energy,
            move.ravel(),
            args=(region, displacement, epsilon),
            jac=True,
            method="L-BFGS-B",
            options={"maxiter": 60, "maxcor": 12},
        )
        move = np.einsum("kij,kj->ki", region.free, found.x.reshape(-1, 3))
    return move


def _jacobians(region: _Region, displacement: Vectors) -> Floats:
    """Jacobian (t, 2, 2) of the move in each triangle's plane: identity + gradient of the displacement."""
    in_plane = np.einsum("tai,tki->tka", region.frames, displacement[region.triangles])
    return np.asarray(np.eye(2) + np.einsum("tka,tkb->tab", in_plane, region.gradients))


def _determinants(region: _Region, displacement: Vectors) -> Floats:
    jacobian = _jacobians(region, displacement)
    return np.asarray(jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] * jacobian[:, 1, 0])


def _energy(move: Floats, region: _Region, displacement: Vectors, epsilon: float) -> tuple[float, Floats]:
    """Value and gradient of the regularised energy, per mean area."""
    free_move = np.einsum("kij,kj->ki", region.free, move.reshape(-1, 3))
    jacobian = _jacobians(region, displacement + free_move)
    determinant = jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] * jacobian[:, 1, 0]
    root = np.sqrt(determinant**2 + epsilon**2)
    chi = np.where(
        determinant > 0,
        0.5 * (determinant + root),
        0.5 * epsilon**2 / np.where(determinant > 0, 1.0, root - determinant),
    )
    chi_slope = chi / root
    squares = (jacobian**2).sum(axis=(1, 2))
    weight = region.areas / region.areas.mean()
    value = float((weight * squares / chi).sum())
    cofactor = np.stack(
        [
            np.stack([jacobian[:, 1, 1], -jacobian[:, 1, 0]], axis=1),
            np.stack([-jacobian[:, 0, 1], jacobian[:, 0, 0]], axis=1),
        ],
        axis=1,
    )
    by_jacobian = weight[:, None, None] * (
        2 * jacobian / chi[:, None, None] - (squares * chi_slope / chi**2)[:, None, None] * cofactor
    )
    by_corner = np.einsum("tai,tab,tkb->tki", region.frames, by_jacobian, region.gradients)
    gradient = np.stack(
        [
            np.bincount(
                region.triangles.ravel(), weights=by_corner[..., i].ravel(), minlength=len(region.vertices)
            )
            for i in range(3)
        ],
        axis=1,
    )
    return value, np.einsum("kij,kj->ki", region.free, gradient).ravel()
