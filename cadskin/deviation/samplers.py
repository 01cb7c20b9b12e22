"""Models made ready for one nominal model: every further field is cheap."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._random import seed_sequence
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, RNGLike

__all__ = ["BLOCK", "FixedSampler", "Sampler", "child_sequence"]

BLOCK = 32  # samples worked on at once; the result does not depend on it


class Sampler(ABC):
    """A model made ready for one nominal model: the set-up is done, each further sample is cheap.

    Attributes
    ----------
    n_samples : int
        Length n_c of a deviation field.
    notes : tuple of str
        What was decided in the set-up (the route of a Gaussian field, its certificate).
    latent : int
        Number of independent standard normal numbers that a field is an affine function of; -1 where it is
        none, or not known to be one. See `transform`.
    """

    n_samples: int
    notes: tuple[str, ...] = ()
    latent: int = -1

    @abstractmethod
    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Write one field per seed into ``out`` (len(seeds), n_c) [mm]; row i depends on seed i only."""

    def draw(self, seeds: Sequence[np.random.SeedSequence]) -> Floats:
        """Return one field per seed (len(seeds), n_c) float64 [mm]; row i depends on seed i only."""
        out = np.zeros((len(seeds), self.n_samples))
        self.fill(seeds, out)
        return out

    def transform(self, noise: NDArray[Any]) -> Floats:
        """Return the deviation fields (k, n_c) [mm] of standard normal numbers (k, latent).

        Raises
        ------
        DeviationError
            The model is not known to be an affine function of normal numbers.
        """
        raise DeviationError(
            f"{type(self).__name__} is no linear function of {noise.shape[-1]} normal numbers"
        )

    def sample(self, *, size: int = 1, rng: RNGLike = None) -> Floats:
        """Return ``size`` deviation fields (size, n_c) [mm]; see `DeviationModel.sample`."""
        if size < 0:
            raise DeviationError(f"size must be zero or more, got {size}")
        seed = seed_sequence(rng)
        return self.draw([child_sequence(seed, i) for i in range(size)])


class FixedSampler(Sampler):
    """The sampler of a systematic model: every sample is the same field (n_c,) [mm]."""

    def __init__(self, values: Floats, notes: tuple[str, ...] = ()) -> None:
        self.values = np.asarray(values, dtype=np.float64)
        self.latent = 0
        self.n_samples = len(self.values)
        self.notes = notes

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Repeat the field."""
        out[: len(seeds)] = self.values

    def transform(self, noise: NDArray[Any]) -> Floats:
        """Repeat the field."""
        return np.repeat(self.values[None, :], len(noise), axis=0)


def child_sequence(seed: np.random.SeedSequence, index: int) -> np.random.SeedSequence:
    """Child ``index`` of a seed sequence, without spawning (see `cadskin._random.child`)."""
    return np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, index), pool_size=seed.pool_size)
