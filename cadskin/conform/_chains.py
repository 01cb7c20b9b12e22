"""Compiled kernels that draw standard normal numbers whose heights stay inside bands."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin._jit import kernel
from cadskin.conform._bands import facet, widest
from cadskin.conform._trajectory import heights_of
from cadskin.deviation._philox import _fill

__all__ = ["coordinate_sweep", "first_passing", "slice_step"]

_SCREEN_SLACK = 1e-5  # of float32 heights; the full test decides what is nearer to the limit
_FARTHEST = 9.0  # standard deviations
_SQRT_HALF = math.sqrt(0.5)


@kernel
def first_passing(
    state: Any, first: int, count: int, factor: Any, bands: Any, noise: Any, refused: Any, least: Any
) -> Any:
    """Return the first of ``count`` pages of normals whose heights fit the bands, -1 without any.

    The page is left in ``noise`` (its padded length, float32). ``refused`` (c,) counts what each band turned
    away, ``least`` (c,) keeps the smallest width over its limit among these.
    """
    here, buffer = np.zeros(factor.shape[1], dtype=np.float32), np.zeros(factor.shape[1])
    weights, plane, reference = np.zeros(4), np.zeros(3), np.zeros(4, dtype=np.int64)
    for page in range(first, first + count):
        _fill(state[:2], state[2:], page, noise)
        heights_of(noise[: factor.shape[0]], factor, here)
        passing = True
        for c in range(bands.kinds.shape[0]):
            kind, start, stop = bands.kinds[c, 0], bands.kinds[c, 1], bands.kinds[c, 2]
            for i in range(start, stop):
                buffer[i - start] = bands.centre[i] + here[i]
            reference[:] = bands.references[c]
            limit = bands.limits[c] * (1.0 + _SCREEN_SLACK)
            lower, _ = facet(
                kind, bands.places[:, start:stop], buffer[: stop - start], limit, reference, weights, plane
            )
            if lower > limit:
                refused[c] += 1
                least[c] = min(least[c], lower / bands.limits[c])
                passing = False
                break
        if passing:
            return page
    return -1


@kernel
def slice_step(z: Any, fresh: Any, angle: float, uniforms: Any, factor: Any, bands: Any) -> Any:
    """Move ``z`` (k,) in place by one step of elliptical slice sampling; return the tests it took.

    References
    ----------
    .. [1] I. Murray, R. P. Adams, D. J. C. MacKay, Elliptical slice sampling, AISTATS 2010, arXiv:1001.0175.
    """
    m = factor.shape[1]
    here, there, moved, buffer = np.zeros(m), np.zeros(m), np.zeros(m), np.zeros(m)
    heights_of(z, factor, here)
    heights_of(fresh, factor, there)
    low, high = angle - 2.0 * math.pi, angle
    for turn in range(uniforms.size):
        cosine, sine = math.cos(angle), math.sin(angle)
        for i in range(m):
            moved[i] = cosine * here[i] + sine * there[i]
        if widest(moved, bands, buffer) <= 1.0:
            for k in range(z.size):
                z[k] = cosine * z[k] + sine * fresh[k]
            return turn + 1
        if angle < 0.0:
            low = angle
        else:
            high = angle
        angle = low + (high - low) * uniforms[turn]
    return uniforms.size


@kernel
def _farthest_inside(here: Any, step: Any, end: float, bands: Any, buffer: Any) -> float:
    """Return the multiple of ``step`` nearest to ``end`` for which all bands hold ``mean + here + s step``.

    A width is convex along the line: Newton's method on its functionals comes from outside and never passes.
    """
    weights, plane, reference = np.zeros(4), np.zeros(3), np.zeros(4, dtype=np.int64)
    for c in range(bands.kinds.shape[0]):
        kind, start, stop = bands.kinds[c, 0], bands.kinds[c, 1], bands.kinds[c, 2]
        reference[:] = bands.references[c]
        for _ in range(100):
            for i in range(start, stop):
                buffer[i - start] = bands.centre[i] + here[i] + end * step[i]
            lower, _ = facet(
                kind, bands.places[:, start:stop], buffer[: stop - start], 0.0, reference, weights, plane
            )
            if lower <= bands.limits[c] * (1.0 + 1e-10):
                break
            base, slope = 0.0, 0.0
            for j in range(4):
                base += weights[j] * (bands.centre[start + reference[j]] + here[start + reference[j]])
                slope += weights[j] * step[start + reference[j]]
            if slope * end <= 0.0:
                return 0.0  # outside already, by rounding
            nearer = (bands.limits[c] - base) / slope
            if nearer * end <= 0.0:
                return 0.0
            end = nearer if abs(nearer) < abs(end) else 0.999999 * end
    return end


@kernel
def _truncated_normal(low: float, high: float, uniform: float) -> float:
    """Return the standard normal number of a probability, given that it lies between two numbers."""
    if low > 0.0:
        return -_truncated_normal_left(-high, -low, uniform)
    return _truncated_normal_left(low, high, uniform)


@kernel
def _truncated_normal_left(low: float, high: float, uniform: float) -> float:
    below, above = 0.5 * math.erfc(-low * _SQRT_HALF), 0.5 * math.erfc(-high * _SQRT_HALF)
    wanted = below + uniform * (above - below)
    for _ in range(60):
        middle = 0.5 * (low + high)
        if 0.5 * math.erfc(-middle * _SQRT_HALF) < wanted:
            low = middle
        else:
            high = middle
        if high - low < 1e-12:
            break
    return 0.5 * (low + high)


@kernel
def coordinate_sweep(z: Any, uniforms: Any, factor: Any, bands: Any) -> None:
    """Draw each of the numbers ``z`` (k,) in turn, given the others and the bands (Gibbs sampling)."""
    m = factor.shape[1]
    here, buffer = np.zeros(m), np.zeros(m)
    heights_of(z, factor, here)
    for k in range(z.size):
        step = factor[k]
        up = _farthest_inside(here, step, _FARTHEST - z[k], bands, buffer)
        down = _farthest_inside(here, step, -_FARTHEST - z[k], bands, buffer)
        if up > down:
            moved = _truncated_normal(z[k] + down, z[k] + up, uniforms[k])
            for i in range(m):
                here[i] += (moved - z[k]) * step[i]
            z[k] = moved
