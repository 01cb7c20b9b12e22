"""One pass over the columns of a population: mean and Gram matrix; a second one for the modes.

All that statistics needs of n parts of d samples is the n x n Gram matrix of the centred fields. Columns come
in chunks, so that a population larger than memory (a `numpy.memmap`) costs one chunk. Products of float32
data are done in single precision within a chunk and summed over the chunks in double.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.linalg import blas

from cadskin._jit import kernel
from cadskin._progress import report
from cadskin.errors import StatisticsError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints, Progress

__all__ = ["Columns", "FirstPass", "gram_and_mean", "recentred", "weighted_combinations"]

_CHUNK_VALUES = 1 << 16  # numbers per chunk: it stays in the second-level cache
_LEAST_WIDTH = 2048  # columns; narrower products waste the processor
_FEW_PARTS = 32  # up to here a general product beats the symmetric one


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

    def room(self) -> NDArray[Any]:
        """Return an array that holds any chunk, for `read`."""
        start, stop = self.chunks()[0]
        return np.zeros(self.n * (stop - start), dtype=self.dtype)

    def read(self, start: int, stop: int, room: NDArray[Any] | None = None) -> NDArray[Any]:
        """Return columns start to stop (n, stop - start) in C order, copied into ``room`` if given."""
        wanted = slice(start, stop) if self.rows is None else self.rows[start:stop]
        if room is None:
            return np.array(self.fields[:, wanted], dtype=self.dtype, order="C")
        chunk = _shaped(room, self.n, stop - start)
        chunk[:] = self.fields[:, wanted]
        return chunk


@dataclass(frozen=True, eq=False)
class FirstPass:
    """What the first pass over a population leaves.

    Parameters
    ----------
    gram : (n, n) float64
        Inner products of the fields about their plain mean; without meaning where a field holds NaN.
    mean : (d,) float64
        The plain mean; NaN where a field is.
    part_means : (n,) float64
        Weighted mean over the samples of each field less the plain mean.
    """

    gram: Floats
    mean: Floats
    part_means: Floats


def gram_and_mean(columns: Columns, weights: Floats, *, progress: Progress | None = None) -> FirstPass:
    """Return Gram matrix, mean, and the mean of each part.

    Parameters
    ----------
    columns : Columns
    weights : (d,) float
        Weights of the inner product ``<u, v> = sum_j w_j u_j v_j``.
    """
    gram = np.zeros((columns.n, columns.n))
    mean, part_means = np.zeros(columns.d), np.zeros(columns.n)
    chunks = columns.chunks()
    room, other = columns.room(), columns.room()
    for done, (start, stop) in enumerate(chunks, start=1):
        block = columns.read(start, stop, room)
        centred = _shaped(other, *block.shape)
        roots = np.sqrt(weights[start:stop])
        _centre_on_mean(block, roots, mean[start:stop], centred)
        gram += _self_product(centred)
        part_means += centred @ roots.astype(columns.dtype)
        report(progress, done, len(chunks))
    lower = np.tril(gram)
    gram = lower + np.tril(lower, -1).T
    share = np.full(columns.n, 1.0 / columns.n)
    return FirstPass(recentred(gram, share), mean, part_means - part_means.mean())


def recentred(gram: Floats, share: Floats) -> Floats:
    """Return ``(I - 1 p') G (I - p 1')``: the Gram matrix about the mean with part shares p (n,)."""
    pull = gram @ share
    return np.asarray(gram - pull[:, None] - pull[None, :] + share @ pull)


def weighted_combinations(
    columns: Columns, centre: Floats, combine: Floats
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return ``combine' (X - centre)`` of coefficients (n, k), and the peaks: a second pass.

    Returns
    -------
    combinations : (k, d) of the columns' type
    peaks : (2, k) float
        The largest value of each combination, and of its negative.
    """
    out = np.zeros((combine.shape[1], columns.d), dtype=columns.dtype)
    peaks = np.full((2, combine.shape[1]), -np.inf)
    factors = np.ascontiguousarray(combine.T, dtype=columns.dtype)
    room = columns.room()
    for start, stop in columns.chunks():
        block = columns.read(start, stop, room)
        _subtract(block, centre[start:stop])
        product = factors @ block
        np.maximum(peaks[0], product.max(axis=1, initial=-np.inf), out=peaks[0])
        np.maximum(peaks[1], -product.min(axis=1, initial=np.inf), out=peaks[1])
        out[:, start:stop] = product
    return out, peaks


def _self_product(rows: NDArray[Any]) -> NDArray[Any]:
    """Return ``A A'``; of many rows only the lower triangle is worked out."""
    if len(rows) <= _FEW_PARTS:
        return np.asarray(rows @ rows.T)
    product = blas.ssyrk if rows.dtype == np.float32 else blas.dsyrk
    return np.asarray(product(1.0, rows.T, trans=1, lower=1))


@kernel
def _centre_on_mean(block: Floats, roots: Floats, mean: Floats, centred: Floats) -> None:
    """Fill the mean (width,) of the rows of a block, and the rows about it times ``roots``."""
    n, width = block.shape
    for i in range(n):
        for j in range(width):
            mean[j] += block[i, j]
    for j in range(width):
        mean[j] /= n
    for i in range(n):
        for j in range(width):
            centred[i, j] = (block[i, j] - mean[j]) * roots[j]


@kernel
def _subtract(block: Floats, centre: Floats) -> None:
    """Take the centre from the rows of a block."""
    n, width = block.shape
    for i in range(n):
        for j in range(width):
            block[i, j] -= centre[j]


def _shaped(room: NDArray[Any], n: int, width: int) -> NDArray[Any]:
    """Return the front of a flat array as (n, width)."""
    return room[: n * width].reshape(n, width)
