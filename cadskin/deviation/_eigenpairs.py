"""The lowest modes of a stiffness and a lumped mass."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array, dia_array
from scipy.sparse.linalg import eigsh

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints

__all__ = ["lowest_modes"]


def lowest_modes(
    stiffness: csr_array, mass: Floats, kept: Ints, count: int, *, shift: float, tolerance: float = 0.0
) -> tuple[Floats, Floats]:
    """Return eigenvalues (count,) and vectors (count, n), zero where unknowns are held.

    Parameters
    ----------
    stiffness : (n, n) csr_array
        Positive semidefinite.
    mass : (n,) float
        Diagonal of the mass matrix; the vectors have unit mass.
    kept : (k,) int
        Unknowns that are free.
    count : int
        Number of modes, the lowest ones.
    shift : float
        Below the spectrum; the pencil is factored there.
    tolerance : float
        Of the eigenvalues, relative; 0 for the precision of the machine.
    """
    inner = stiffness[kept][:, kept].tocsc()
    weights = dia_array((mass[kept][None], [0]), shape=inner.shape).tocsc()
    start = np.cos(np.arange(len(kept)) * 1.2345)  # any fixed vector: the result is repeatable
    values, vectors = eigsh(inner, k=count, M=weights, sigma=shift, v0=start, tol=tolerance)
    order = np.argsort(values)
    full = np.zeros((count, len(mass)))
    full[:, kept] = vectors[:, order].T
    return values[order], full
