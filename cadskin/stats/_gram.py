"""One pass over the columns of a population: mean and Gram matrix; a second one for the modes.

All that statistics needs of n parts of d samples is the n x n Gram matrix of the centred fields. Columns come
in chunks, so that a population larger than memory (a `numpy.memmap`) costs one chunk. Products of float32
data are done in single precision within a chunk and summed over the chunks in double.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import blas

from cadskin._progress import report
from cadskin.errors import StatisticsError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints, Progress

__all__ = ["Columns", "gram_and_mean", "recentred", "weighted_combinations"]

_CHUNK_VALUES = 1 << 17  # numbers per chunk: it stays in the second-level cache
_LEAST_WIDTH = 2048  # columns; narrower products waste the processor


class Columns:
    """The fields of a population (n, d), read by column chunks; ``rows`` picks samples of each field."""

    def __init__(self, fields: Any, rows: Ints | None = None) -> None:
        if getattr(fields, "ndim", 0) != 2:
            raise StatisticsError(
                f"a population is an (n, d) array, one row per part, got shape {np.shape(fields)}"
            )
        self.fields = fields
        self.rows = rows
        self.n = int(fields.shape[0])
        self.d = int(fields.shape[1]) if rows is None else len(rows)
        self.dtype = np.dtype(np.float32 if fields.dtype == np.float32 else np.float64)

    def chunks(self) -> list[tuple[int, int]]:
        """Return (start, stop) of the chunks."""
        width = max(min(_CHUNK_VALUES, _LEAST_WIDTH), _CHUNK_VALUES // max(self.n, 1))
        return [(start, min(start + width, self.d)) for start in range(0, self.d, width)]

    def read(self, start: int, stop: int) -> NDArray[Any]:
        """Return columns start to stop (n, stop - start)."""
        wanted = slice(start, stop) if self.rows is None else self.rows[start:stop]
        return np.asarray(self.fields[:, wanted], dtype=self.dtype)


def gram_and_mean(
    columns: Columns, weights: Floats, *, progress: Progress | None = None
) -> tuple[Floats, Floats]:
    """Return the Gram matrix (n, n) of the fields about their plain mean, and that mean (d,).

    Parameters
    ----------
    columns : Columns
    weights : (d,) float
        Weights of the inner product ``<u, v> = sum_j w_j u_j v_j``.

    Returns
    -------
    gram : (n, n) float64
        NaN where a field holds NaN.
    mean : (d,) float64
    """
    gram = np.zeros((columns.n, columns.n))
    mean = np.zeros(columns.d)
    roots = np.sqrt(weights).astype(columns.dtype)
    product = blas.ssyrk if columns.dtype == np.float32 else blas.dsyrk
    equal = np.full(columns.n, 1.0 / columns.n, dtype=columns.dtype)
    chunks = columns.chunks()
    for done, (start, stop) in enumerate(chunks, start=1):
        block = columns.read(start, stop)
        shift = equal @ block
        centred = np.subtract(block, shift, order="C")  # what the shift lacks of the mean goes in `recentred`
        mean[start:stop] = shift.astype(np.float64) + equal @ centred
        centred *= roots[start:stop]
        gram += product(1.0, centred.T, trans=1, lower=1)
        report(progress, done, len(chunks))
    lower = np.tril(gram)
    gram = lower + np.tril(lower, -1).T
    return recentred(gram, equal.astype(np.float64)), mean


def recentred(gram: Floats, share: Floats) -> Floats:
    """Return ``(I - 1 p') G (I - p 1')``: the Gram matrix about the mean with part shares p (n,)."""
    pull = gram @ share
    return np.asarray(gram - pull[:, None] - pull[None, :] + share @ pull)


def weighted_combinations(columns: Columns, centre: Floats, combine: Floats) -> Floats:
    """Return ``combine' (X - centre)``: (k, d) for coefficients (n, k); a second pass over the columns."""
    out = np.zeros((combine.shape[1], columns.d))
    factors = np.ascontiguousarray(combine.T, dtype=columns.dtype)
    for start, stop in columns.chunks():
        block = columns.read(start, stop) - centre[start:stop].astype(columns.dtype)
        out[:, start:stop] = factors @ block
    return out
