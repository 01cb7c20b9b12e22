"""Random streams: one seed, one child stream per sample, independent of workers and chunking (SPEC 7)."""

from __future__ import annotations

import numpy as np

from cadskin._typing import RNGLike

__all__ = ["child", "seed_sequence"]


def seed_sequence(rng: RNGLike) -> np.random.SeedSequence:
    """Return the seed sequence behind ``rng``.

    A `Generator` gives up 128 bits of its stream, so that two calls with the same generator differ and a
    generator in the same state gives the same result. None takes fresh entropy from the system.

    Examples
    --------
    >>> seed_sequence(7).entropy
    7
    """
    if isinstance(rng, np.random.SeedSequence):
        return rng
    if rng is None or isinstance(rng, (int, np.integer)):
        return np.random.SeedSequence(None if rng is None else int(rng))
    words = np.random.default_rng(rng).integers(0, 2**32, size=4, dtype=np.uint32)
    return np.random.SeedSequence([int(w) for w in words])


def child(seed: np.random.SeedSequence, index: int) -> np.random.Generator:
    """Return the generator of sample ``index``: equal to ``seed.spawn(n)[index]`` without spawning.

    Examples
    --------
    >>> a = child(np.random.SeedSequence(7), 3).random()
    >>> b = np.random.default_rng(np.random.SeedSequence(7).spawn(4)[3]).random()
    >>> bool(a == b)
    True
    """
    key = (*seed.spawn_key, index)
    return np.random.default_rng(
        np.random.SeedSequence(seed.entropy, spawn_key=key, pool_size=seed.pool_size)
    )
