"""Gaussian models are linear, deviation = sigma * (A z): here noise goes in and fields come out."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit

from cadskin.deviation._philox import standard_normals
from cadskin.deviation.base import BLOCK, Sampler

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints

__all__ = ["LinearSampler"]


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
    """

    def __init__(self, node_of_sample: Ints, scale: Floats, latent: int) -> None:
        self.node_of_sample = np.asarray(node_of_sample, dtype=np.int64)
        self.scale = np.ascontiguousarray(scale, dtype=np.float64)
        self.latent = latent
        self.n_samples = len(self.node_of_sample)

    @abstractmethod
    def nodes(self, noise: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return the unit-variance node fields (k, n_nodes) of noise (k, latent), for k <= `BLOCK`."""

    def transform(self, noise: NDArray[Any]) -> Floats:
        """Return the deviation fields (k, n_c) [mm] of standard normal numbers (k, latent)."""
        values = np.ascontiguousarray(noise, dtype=np.float32)
        out = np.zeros((len(values), self.n_samples))
        for start in range(0, len(values), BLOCK):
            rows = slice(start, start + BLOCK)
            _spread(self.nodes(values[rows]), self.node_of_sample, self.scale, out[rows])
        return out

    def draw(self, seeds: Sequence[np.random.SeedSequence]) -> Floats:
        out = np.zeros((len(seeds), self.n_samples))
        for start in range(0, len(seeds), BLOCK):
            rows = slice(start, start + BLOCK)
            fields = self.nodes(standard_normals(seeds[rows], self.latent))
            _spread(fields, self.node_of_sample, self.scale, out[rows])
        return out


@njit(cache=True, nogil=True)
def _spread(fields: Any, node_of_sample: Any, scale: Any, out: Any) -> None:
    """Deviation of each sample = scale * field of its node."""
    for row in range(out.shape[0]):
        for i in range(out.shape[1]):
            out[row, i] = scale[i] * fields[row, node_of_sample[i]]
