"""Sparse Cholesky for meshes: nested dissection, multifrontal factor, many right sides at once.

References
----------
Davis: Direct Methods for Sparse Linear Systems, SIAM 2006; Davis, Rajamanickam, Sid-Lakhdar: A survey of
direct methods for sparse linear systems, Acta Numer. 25 (2016), doi:10.1017/S0962492916000076.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import kernel
from cadskin.deviation._blocks import LINES, add_products, gather_products
from cadskin.deviation._dissection import halves_of, renumbered
from cadskin.deviation._frontal import factorised
from cadskin.deviation._supernodes import find_supernodes
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from numpy.typing import NDArray
    from scipy.sparse import csr_array

    from cadskin._typing import Ints, Points

__all__ = ["SparseCholesky"]


class SparseCholesky:
    """The factor L of a symmetric positive definite matrix, P A P^T = L L^T.

    Worked out in double precision, kept in single precision.

    Parameters
    ----------
    matrix : (n, n) csr_array
        Symmetric, with all its entries.
    points : (n, d) float
        Positions of the unknowns; they steer the ordering.

    Attributes
    ----------
    order : (n,) int
        Row of the matrix that stands at each place of the factor.

    Raises
    ------
    DeviationError
        The matrix is not positive definite.
    """

    def __init__(self, matrix: csr_array, points: Points) -> None:
        halves = halves_of(points)
        local = renumbered(matrix, halves.order)
        nodes = find_supernodes(local, halves)
        panels = factorised(local, nodes)
        if panels is None:
            raise DeviationError("the matrix is not positive definite: the mesh has degenerate triangles")
        self.order: Ints = halves.order[nodes.order].astype(np.int64)
        self._panels = panels

    def solve_columns(self, columns: NDArray[np.float32]) -> None:
        """Solve in place for right sides (n, COLUMNS) in the order of the factor, in single precision."""
        _forward(self._panels, columns)
        _backward(self._panels, columns)


@kernel
def _forward(panels: Any, x: Any) -> None:
    """Solve L y = x in place: for each panel x2 -= L21 D^-1 x1 after x1 = D^-1 x1."""
    keep, drop = np.float32(1.0), np.float32(0.0)
    for p in range(panels.start.size - 1):
        first, width = panels.start[p], panels.start[p + 1] - panels.start[p]
        line, place, step = panels.line[p], panels.place[p], LINES * width
        own = (width + LINES - 1) // LINES
        for i in range(own - 1, -1, -1):  # the lower rows first: they need the old upper ones
            count = min(width, LINES * (i + 1))
            left = min(LINES, width - LINES * i)
            at = place + step * i
            add_products(panels.values, at, count, x, first, drop, panels.rows, line + LINES * i, left)
        for i in range(own, (panels.line[p + 1] - line) // LINES):
            at = place + step * i
            add_products(panels.values, at, width, x, first, keep, panels.rows, line + LINES * i, LINES)


@kernel
def _backward(panels: Any, x: Any) -> None:
    """Solve L^T y = x in place: for each panel x1 = D^-T (x1 - L21^T x2)."""
    keep, drop = np.float32(1.0), np.float32(0.0)
    for p in range(panels.start.size - 2, -1, -1):
        first, width = panels.start[p], panels.start[p + 1] - panels.start[p]
        line, place, step = panels.line[p], panels.place[p], LINES * width
        own = (width + LINES - 1) // LINES
        below = line + LINES * own
        if below < panels.line[p + 1]:
            for k in range(0, width, LINES):
                at, span = place + step * own + LINES * k, (below, panels.line[p + 1])
                left = min(LINES, width - k)
                gather_products(panels.values, at, step, panels.rows, span, x, first + k, keep, left)
        for k in range(0, width, LINES):  # the upper rows first: they need the old lower ones
            at, span = place + (step + LINES * LINES) * (k // LINES), (line + k, below)
            left = min(LINES, width - k)
            gather_products(panels.values, at, step, panels.rows, span, x, first + k, drop, left)
