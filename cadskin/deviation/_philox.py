"""Counter-based normal noise: Philox4x32-10 and Box-Muller in float32, a function of seed and place.

References
----------
Salmon, Moraes, Dror, Shaw: Parallel random numbers: as easy as 1, 2, 3. SC'11, doi:10.1145/2063384.2063405.
The logarithm and the sine are minimax polynomials in single precision (Cephes, `logf` and `sincosf`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import float32, int32, uint32, uint64
from numba.extending import register_jitable
from numpy.typing import NDArray

from cadskin._jit import fast_kernel, kernel

__all__ = ["fill_normals", "fill_page", "padded_count", "philox4x32", "standard_normals", "stream_of"]

_LANES = 256  # counters worked on together, so that the compiler can vectorise
_GROUP = 4 * _LANES  # normals made from them


@register_jitable(inline="always")  # a call to a compiled function keeps the loop from being vectorised: 4 x
def _rounds(c0: Any, c1: Any, c2: Any, c3: Any, k0: Any, k1: Any) -> Any:
    """Ten rounds of Philox4x32 on 32-bit words held in uint64."""
    low = uint64(0xFFFFFFFF)
    for _ in range(10):
        p0 = c0 * uint64(0xD2511F53)
        p1 = c2 * uint64(0xCD9E8D57)
        n0 = (p1 >> uint64(32)) ^ c1 ^ k0
        n2 = (p0 >> uint64(32)) ^ c3 ^ k1
        c1 = p1 & low
        c3 = p0 & low
        c0 = n0
        c2 = n2
        k0 = (k0 + uint64(0x9E3779B9)) & low
        k1 = (k1 + uint64(0xBB67AE85)) & low
    return c0, c1, c2, c3


@kernel
def philox4x32(counter: Any, key: Any) -> Any:
    """Return the four output words (4,) uint32 of Philox4x32-10.

    Parameters
    ----------
    counter : (4,) uint32
    key : (2,) uint32
    """
    words = _rounds(
        uint64(counter[0]), uint64(counter[1]), uint64(counter[2]), uint64(counter[3]),
        uint64(key[0]), uint64(key[1]),
    )  # fmt: skip
    out = np.zeros(4, dtype=np.uint32)
    for i in range(4):
        out[i] = uint32(words[i])
    return out


@fast_kernel
def _radii(words: Any, mantissa: Any, exponent: Any, row: Any) -> None:
    """Box-Muller radius sqrt(-2 ln u), u = (word + 1) / 2^32; ``mantissa`` is a float32 view of ``words``."""
    for i in range(words.shape[1]):
        mantissa[row, i] = (float32(words[row, i]) + float32(1.0)) * float32(2.3283064e-10)
    for i in range(words.shape[1]):
        bits = int32(words[row, i])
        exponent[i] = float32((bits >> int32(23)) - int32(126))
        words[row, i] = uint32((bits & int32(0x7FFFFF)) | int32(0x3F000000))
    for i in range(words.shape[1]):
        m = mantissa[row, i]
        small = m < float32(0.70710678)
        e = exponent[i] - float32(1.0) if small else exponent[i]
        f = (m + m - float32(1.0)) if small else (m - float32(1.0))
        z = f * f
        y = float32(7.0376836292e-2)
        y = y * f - float32(1.1514610310e-1)
        y = y * f + float32(1.1676998740e-1)
        y = y * f - float32(1.2420140846e-1)
        y = y * f + float32(1.4249322787e-1)
        y = y * f - float32(1.6668057665e-1)
        y = y * f + float32(2.0000714765e-1)
        y = y * f - float32(2.4999993993e-1)
        y = y * f + float32(3.3333331174e-1)
        y = y * f * z - float32(0.5) * z
        squared = float32(-2.0) * (f + y + e * float32(0.69314718))
        squared = squared if squared > float32(0.0) else float32(0.0)
        exponent[i] = float32(math.sqrt(squared))


@fast_kernel
def _fill(key: Any, stream: Any, page: Any, out: Any) -> None:
    """Fill ``out`` (length a multiple of `_GROUP`) with normals of one page of a stream."""
    words = np.zeros((4, _LANES), dtype=np.uint32)
    mantissa = words.view(np.float32)
    radius = np.zeros(_LANES, dtype=np.float32)
    k0, k1, c2, c3 = uint64(key[0]), uint64(key[1]), uint64(stream[0]), uint64(stream[1])
    c1 = uint64(page)
    for block in range(out.size // _GROUP):
        first = uint32(block * _LANES)
        for i in range(_LANES):
            w0, w1, w2, w3 = _rounds(uint64(uint32(first + uint32(i))), c1, c2, c3, k0, k1)
            words[0, i] = uint32(w0)
            words[1, i] = uint32(w1)
            words[2, i] = uint32(w2)
            words[3, i] = uint32(w3)
        for pair in range(2):
            _radii(words, mantissa, radius, 2 * pair)
            start = (4 * block + 2 * pair) * _LANES
            for i in range(_LANES):
                angle = words[2 * pair + 1, i]
                quadrant = angle >> uint32(30)
                offset = int32(angle & uint32(0x3FFFFFFF)) - int32(0x20000000)
                t = float32(offset) * float32(1.4629180792671596e-09)  # pi/4 / 2^29
                z = t * t
                sine = float32(-1.9515295891e-4) * z + float32(8.3321608736e-3)
                sine = (sine * z - float32(1.6666654611e-1)) * z * t + t
                cosine = float32(2.443315711809948e-5) * z - float32(1.388731625493765e-3)
                cosine = (cosine * z + float32(4.166664568298827e-2)) * z * z
                cosine = cosine - float32(0.5) * z + float32(1.0)
                swap = (quadrant & uint32(1)) != 0
                sign = float32(1.0) - float32(quadrant & uint32(2))
                r = radius[i] * sign
                out[start + i] = r * (sine if swap else cosine)
                out[start + _LANES + i] = r * (cosine if swap else sine)


def standard_normals(seeds: Sequence[np.random.SeedSequence], count: int) -> NDArray[np.float32]:
    """Return ``count`` standard normal numbers per seed, (len(seeds), count) float32.

    Row i is a function of seed i alone; with a larger ``count`` it starts with the same numbers.

    Parameters
    ----------
    seeds : sequence of SeedSequence
    count : int

    Examples
    --------
    >>> rows = standard_normals([np.random.SeedSequence(1), np.random.SeedSequence(2)], 1000)
    >>> rows.shape, bool(abs(rows.mean()) < 0.1)
    ((2, 1000), True)
    """
    out = np.zeros((len(seeds), padded_count(count)), dtype=np.float32)
    fill_normals(seeds, out)
    return out[:, :count]


def padded_count(count: int) -> int:
    """Return the next length that `fill_normals` can fill."""
    return -(-count // _GROUP) * _GROUP


def fill_normals(seeds: Sequence[np.random.SeedSequence], out: NDArray[np.float32]) -> None:
    """Fill the first rows of ``out`` (>= len(seeds), `padded_count`), one per seed, with normals."""
    fill_page([stream_of(seed) for seed in seeds], 0, out)


def stream_of(seed: np.random.SeedSequence, number: int = 0) -> NDArray[np.uint32]:
    """Return key and counter words (4,) of stream ``number`` of a seed."""
    words = seed.generate_state(4 * (number + 1), np.uint32)
    return np.asarray(words[4 * number :], dtype=np.uint32)


def fill_page(states: Sequence[NDArray[np.uint32]], page: int, out: NDArray[np.float32]) -> None:
    """Fill rows with one page of the streams of generated states (4,); page 0 is that of `fill_normals`."""
    for row, state in zip(out, states, strict=False):
        _fill(state[:2], state[2:], page, row)
