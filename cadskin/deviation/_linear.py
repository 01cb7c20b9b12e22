"""Gaussian models are linear, deviation = sigma * (A z): here noise goes in and fields come out.

Everything is worked in blocks of `COLUMNS` fields, the last one filled up: the bits of a field do not depend
on the fields beside it, and the compiled loops have a fixed length.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import fast_kernel, kernel
from cadskin.deviation._lanes import COLUMNS, TILE, four_products, one_product, read_tile, write_tile
from cadskin.deviation._philox import fill_normals, padded_count
from cadskin.deviation.samplers import Sampler

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints

__all__ = [
    "COLUMNS",
    "STRIP",
    "LinearSampler",
    "NodewiseSampler",
    "columns_of",
    "fill_columns",
    "matrix_product",
    "spread",
    "weighted_sums",
    "write_columns",
]

_STRIP = 256  # columns whose sums stay in the first-level cache
STRIP = 64  # points whose values stay there until they are written


class LinearSampler(Sampler):
    """A sampler that maps independent standard normal numbers linearly to deviations.

    Parameters
    ----------
    n_samples : int
    latent : int
        Number of standard normal numbers of one field.
    n_nodes : int
        Rows of the scratch memory that `write` gets.
    """

    def __init__(self, n_samples: int, latent: int, n_nodes: int) -> None:
        self.n_samples = n_samples
        self.latent = latent
        self.n_nodes = n_nodes

    @abstractmethod
    def write(self, noise: NDArray[np.float32], fields: NDArray[np.float32], out: Floats) -> None:
        """Write the deviations of noise (COLUMNS, latent); ``fields`` (n_nodes, COLUMNS) is scratch."""

    def transform(self, noise: NDArray[Any]) -> Floats:
        """Return the deviation fields (k, n_c) [mm] of standard normal numbers (k, latent)."""
        out = np.zeros((len(noise), self.n_samples))
        block = np.zeros((COLUMNS, self.latent), dtype=np.float32)
        fields = np.zeros((self.n_nodes, COLUMNS), dtype=np.float32)
        for start in range(0, len(noise), COLUMNS):
            rows = noise[start : start + COLUMNS]
            block[: len(rows)] = rows
            self.write(block, fields, out[start : start + COLUMNS])
        return out

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Draw the noise of each seed and colour it."""
        block = np.zeros((COLUMNS, padded_count(self.latent)), dtype=np.float32)
        fields = np.zeros((self.n_nodes, COLUMNS), dtype=np.float32)
        for start in range(0, len(seeds), COLUMNS):
            fill_normals(seeds[start : start + COLUMNS], block)
            self.write(block[:, : self.latent], fields, out[start : start + COLUMNS])


class NodewiseSampler(LinearSampler):
    """A field on nodes whose values the samples take.

    Parameters
    ----------
    node_of_sample : (n_c,) int
        Node whose value each feature sample takes.
    scale : (n_c,) float
        Standard deviation at each feature sample [mm].
    latent : int
    n_nodes : int
    """

    def __init__(self, node_of_sample: Ints, scale: Floats, latent: int, n_nodes: int) -> None:
        super().__init__(len(node_of_sample), latent, n_nodes)
        self.node_of_sample = np.ascontiguousarray(node_of_sample, dtype=np.uint32)
        self.scale = np.ascontiguousarray(scale, dtype=np.float64)
        self._everywhere = np.arange(self.n_samples, dtype=np.uint32)

    @abstractmethod
    def colour(self, noise: NDArray[np.float32], scratch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the unit fields (COLUMNS, n_nodes) of noise (COLUMNS, latent), in ``scratch`` or not."""

    def write(self, noise: NDArray[np.float32], fields: NDArray[np.float32], out: Floats) -> None:
        """Make the field, then scale it at the samples."""
        rows = self.colour(noise, fields.reshape(COLUMNS, self.n_nodes))
        spread(rows, self.node_of_sample, self.scale, self._everywhere, out)


@kernel
def spread(fields: Any, places: Any, scale: Any, samples: Any, out: Any) -> None:
    """out[:, samples[i]] = scale[i] fields[:, places[i]]."""
    for first in range(0, samples.size, STRIP):
        stop = min(first + STRIP, samples.size)
        if _is_run(samples, first, stop) and _is_run(places, first, stop):
            source, target = np.intp(places[first]), np.intp(samples[first])
            for row in range(out.shape[0]):
                for i in range(stop - first):
                    out[row, target + i] = scale[first + i] * fields[row, source + i]
        else:
            for row in range(out.shape[0]):
                for i in range(first, stop):
                    out[row, samples[i]] = scale[i] * fields[row, places[i]]


@kernel
def _is_run(numbers: Any, first: int, stop: int) -> bool:
    for i in range(first, stop - 1):  # noqa: SIM110  # numba compiles no generator
        if numbers[i + 1] - numbers[i] != 1:
            return False
    return True


def columns_of(rows: NDArray[np.float32]) -> NDArray[np.float32]:
    """Transpose rows (COLUMNS, n) to a new array (n, COLUMNS)."""
    out = np.zeros((rows.shape[1], COLUMNS), dtype=np.float32)
    fill_columns(rows, out)
    return out


@kernel
def fill_columns(rows: Any, out: Any) -> None:
    """Transpose rows (COLUMNS, n) into ``out`` (n, COLUMNS)."""
    count = rows.shape[1]
    whole = count - count % TILE
    for i in range(0, whole, TILE):
        for r in range(0, COLUMNS, TILE):
            read_tile(rows, r, i, out, i)
    for i in range(whole, count):
        for r in range(COLUMNS):
            out[i, r] = rows[r, i]


@kernel
def write_columns(columns: Any, places: Any, scale: Any, samples: Any, out: Any) -> None:
    """out[r, samples[s]] = scale[s] columns[places[s], r], in squares where the samples follow each other."""
    s = 0
    while s < samples.size:
        if out.shape[0] == COLUMNS and s + TILE <= samples.size and _is_run(samples, s, s + TILE):
            for r in range(0, COLUMNS, TILE):
                write_tile(columns, places, scale, s, r, out, samples[s])
            s += TILE
        else:
            for r in range(out.shape[0]):
                out[r, samples[s]] = scale[s] * columns[places[s], r]
            s += 1


@kernel
def matrix_product(weights: Any, rows: Any, triangular: bool, out: Any) -> None:
    """Matrix product of weights (p, q), lower triangular or not, and rows (q, COLUMNS); float32."""
    count, terms = weights.shape
    if terms == 0:
        out[:count] = 0.0
        return
    whole = count - count % 4
    for i in range(0, whole, 4):
        four_products(weights, rows, i, min(i + 4, terms) if triangular else terms, out)
    for i in range(whole, count):
        one_product(weights, rows, i, min(i + 1, terms) if triangular else terms, out)


@fast_kernel
def weighted_sums(weights: Any, rows: Any, triangular: bool, out: Any) -> None:
    """Matrix product ``out = weights @ rows``, row by row in a fixed order.

    A BLAS product gives a row other last bits when it stands at another place of the block; this does not.

    Parameters
    ----------
    weights : (p, q) float32
    rows : (q, w) float32
    triangular : bool
        True where ``weights`` is lower triangular.
    out : (p, w) float32
    """
    count, terms = weights.shape
    width = rows.shape[1]
    whole = terms - terms % 4
    for start in range(0, width, _STRIP):
        stop = min(start + _STRIP, width)
        for a in range(count):
            out[a, start:stop] = 0.0
        for c in range(0, whole, 4):
            r0, r1 = rows[c, start:stop], rows[c + 1, start:stop]
            r2, r3 = rows[c + 2, start:stop], rows[c + 3, start:stop]
            for a in range(c if triangular else 0, count):
                w0, w1, w2, w3 = weights[a, c], weights[a, c + 1], weights[a, c + 2], weights[a, c + 3]
                _add_four(out[a, start:stop], r0, r1, r2, r3, w0, w1, w2, w3)
        for c in range(whole, terms):
            for a in range(c if triangular else 0, count):
                _add_one(out[a, start:stop], rows[c, start:stop], weights[a, c])


@fast_kernel
def _add_four(total: Any, r0: Any, r1: Any, r2: Any, r3: Any, w0: Any, w1: Any, w2: Any, w3: Any) -> None:
    for i in range(total.size):
        total[i] += w0 * r0[i] + w1 * r1[i] + w2 * r2[i] + w3 * r3[i]


@fast_kernel
def _add_one(total: Any, row: Any, weight: Any) -> None:
    for i in range(total.size):
        total[i] += weight * row[i]
