"""Gaussian models are linear, deviation = sigma * (A z): here noise goes in and fields come out.

Everything is worked in blocks of `COLUMNS` fields, the last one filled up: the bits of a field do not depend
on the fields beside it, and the compiled loops have a fixed length.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit

from cadskin.deviation._philox import fill_normals, padded_count
from cadskin.deviation.base import Sampler

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints

__all__ = ["COLUMNS", "LinearSampler", "columns_of", "rows_of"]

COLUMNS = 32  # a literal: the compiled code has it inside, and its cache looks at this file only


class LinearSampler(Sampler):
    """A sampler that maps independent standard normal numbers linearly to deviations.

    Parameters
    ----------
    node_of_sample : (n_c,) int
        Node whose value each feature sample takes.
    scale : (n_c,) float
        Standard deviation at each feature sample [mm].
    latent : int
        Number of standard normal numbers of one field.
    n_nodes : int
    """

    def __init__(self, node_of_sample: Ints, scale: Floats, latent: int, n_nodes: int) -> None:
        self.node_of_sample = np.ascontiguousarray(node_of_sample, dtype=np.int32)
        self.scale = np.ascontiguousarray(scale, dtype=np.float64)
        self.latent = latent
        self.n_nodes = n_nodes
        self.n_samples = len(self.node_of_sample)

    @abstractmethod
    def colour(self, noise: NDArray[np.float32], out: NDArray[np.float32]) -> None:
        """Write the unit fields of noise (COLUMNS, latent) into ``out`` (COLUMNS, n_nodes)."""

    def transform(self, noise: NDArray[Any]) -> Floats:
        """Return the deviation fields (k, n_c) [mm] of standard normal numbers (k, latent)."""
        out = np.zeros((len(noise), self.n_samples))
        block = np.zeros((COLUMNS, self.latent), dtype=np.float32)
        fields = np.zeros((COLUMNS, self.n_nodes), dtype=np.float32)
        for start in range(0, len(noise), COLUMNS):
            rows = noise[start : start + COLUMNS]
            block[: len(rows)] = rows
            self.colour(block, fields)
            _spread(fields, self.node_of_sample, self.scale, out[start : start + COLUMNS])
        return out

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Draw the noise of each seed and colour it."""
        block = np.zeros((COLUMNS, padded_count(self.latent)), dtype=np.float32)
        fields = np.zeros((COLUMNS, self.n_nodes), dtype=np.float32)
        for start in range(0, len(seeds), COLUMNS):
            fill_normals(seeds[start : start + COLUMNS], block)
            self.colour(block[:, : self.latent], fields)
            _spread(fields, self.node_of_sample, self.scale, out[start : start + COLUMNS])


@njit(cache=True, nogil=True)
def _spread(fields: Any, node_of_sample: Any, scale: Any, out: Any) -> None:
    """Deviation of each sample = scale * field of its node."""
    for row in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[row, i] = scale[i] * fields[row, node_of_sample[i]]


@njit(cache=True, nogil=True)
def columns_of(rows: Any) -> Any:
    """Transpose rows (COLUMNS, n) to a new array (n, COLUMNS)."""
    out = np.zeros((rows.shape[1], COLUMNS), dtype=np.float32)
    for i in range(rows.shape[1]):
        for r in range(COLUMNS):
            out[i, r] = rows[r, i]
    return out


@njit(cache=True, nogil=True)
def rows_of(columns: Any, place: Any, out: Any) -> None:
    """Write columns (n, COLUMNS) into rows: out[:, place[i]] = columns[i]."""
    for i in range(columns.shape[0]):
        for r in range(COLUMNS):
            out[r, place[i]] = columns[i, r]
