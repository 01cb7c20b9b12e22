"""Areal filters on triangulated surfaces: Gaussian and spline filter of ISO 16610 by the Laplace operator.

On the plane the Gaussian weighting function is the heat kernel at the time ``alpha^2 cutoff^2 / (4 pi)``; on
a curved surface the heat equation of its Laplace-Beltrami operator is the natural filter with the same
transmission (Jiang et al.). The spline filter minimises the deviation plus the bending energy.

References
----------
.. [1] ISO 16610-61 (areal Gaussian), -62 (areal spline), -71 (robust Gaussian regression).
.. [2] X. Jiang, P. Cooper, P. J. Scott, Freeform surface filtering using the diffusion equation, Proc. R.
   Soc. A 467 (2011), doi:10.1098/rspa.2010.0307.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import GeometryError
from cadskin.verify.filters import ALPHA

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Triangles

__all__ = ["gaussian_on_surface", "robust_gaussian_on_surface", "spline_on_surface"]


def gaussian_on_surface(points: Points, triangles: Triangles, values: Floats, cutoff: float) -> Floats:
    """Return the long-wave part (n,) of a field on a triangulated surface.

    Parameters
    ----------
    points : (n, 3) float
        Vertices of the nominal surface [mm].
    triangles : (m, 3) int
    values : (n,) float
        Deviation at the vertices [mm].
    cutoff : float
        Wavelength that passes by 50 % [mm].

    Raises
    ------
    GeometryError
        A cut-off that is not positive, or values that do not fit the vertices.
    """
    stiffness, mass = _operators(points, triangles, values, cutoff)
    return _diffused(stiffness, mass, np.asarray(values, dtype=np.float64)[:, None], cutoff)[:, 0]


def robust_gaussian_on_surface(
    points: Points,
    triangles: Triangles,
    values: Floats,
    cutoff: float,
    *,
    tol: float = 1e-4,
    max_iterations: int = 30,
) -> Floats:
    """Return the long-wave part (n,) with outliers weighted down (Tukey weights cut at 4.4478 median)."""
    stiffness, mass = _operators(points, triangles, values, cutoff)
    samples = np.asarray(values, dtype=np.float64)
    weights, last, smooth = np.ones(len(samples)), np.inf, samples
    for _ in range(max_iterations):
        pair = _diffused(stiffness, mass, np.column_stack([weights * samples, weights]), cutoff)
        smooth = pair[:, 0] / np.maximum(pair[:, 1], 1e-12)
        cut = 4.4478 * float(np.median(np.abs(samples - smooth)))
        if cut <= 0.0 or abs(last - cut) <= tol * cut:
            break
        weights = np.where(np.abs(samples - smooth) < cut, (1 - ((samples - smooth) / cut) ** 2) ** 2, 0.0)
        last = cut
    return np.asarray(smooth)


def spline_on_surface(points: Points, triangles: Triangles, values: Floats, cutoff: float) -> Floats:
    """Return the long-wave part (n,) by the spline filter: transmission ``1 / (1 + (cutoff / wave)^4)``."""
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    stiffness, mass = _operators(points, triangles, values, cutoff)
    bending = stiffness @ diags(1.0 / mass) @ stiffness
    matrix = diags(mass) + (cutoff / (2.0 * np.pi)) ** 4 * bending
    return np.asarray(splu(matrix.tocsc()).solve(mass * np.asarray(values, dtype=np.float64)))


def _operators(points: Points, triangles: Triangles, values: Floats, cutoff: float) -> tuple[Any, Floats]:
    """Return the cotangent stiffness matrix and the lumped mass (n,) of the vertices that triangles use."""
    from scipy.sparse import csr_matrix

    if not cutoff > 0:
        raise GeometryError(f"the cut-off must be positive, got {cutoff}")
    n = len(points)
    if len(values) != n:
        raise GeometryError(f"{len(values)} values for {n} vertices")
    rows, columns, entries, mass = [], [], [], np.zeros(n)
    area = 0.5 * np.linalg.norm(
        np.cross(
            points[triangles[:, 1]] - points[triangles[:, 0]],
            points[triangles[:, 2]] - points[triangles[:, 0]],
        ),
        axis=1,
    )
    for k in range(3):
        i, j, o = triangles[:, (k + 1) % 3], triangles[:, (k + 2) % 3], triangles[:, k]
        u, v = points[i] - points[o], points[j] - points[o]
        weight = 0.5 * (u * v).sum(axis=1) / np.maximum(2.0 * area, 1e-300)
        rows += [i, j, i, j]
        columns += [j, i, i, j]
        entries += [-weight, -weight, weight, weight]
        mass += np.bincount(o, weights=area / 3.0, minlength=n)
    matrix = csr_matrix(
        (np.concatenate(entries), (np.concatenate(rows), np.concatenate(columns))), shape=(n, n)
    )
    return matrix, np.where(mass > 0, mass, 1.0)


def _diffused(stiffness: Any, mass: Floats, fields: Floats, cutoff: float) -> Floats:
    """Return fields (n, k) after the heat equation has run for the time of the Gaussian filter."""
    from scipy.sparse import diags
    from scipy.sparse.linalg import splu

    time = (ALPHA * cutoff) ** 2 / (4.0 * np.pi)
    # Implicit steps of three sizes, extrapolated (Richardson): third order, and damped at short waves.
    results = []
    for steps in (8, 16, 32):
        solver = splu((diags(mass) + (time / steps) * stiffness).tocsc())
        state = fields
        for _ in range(steps):
            state = solver.solve(mass[:, None] * state)
        results.append(state)
    once = [2 * results[1] - results[0], 2 * results[2] - results[1]]
    return np.asarray((4 * once[1] - once[0]) / 3)
