"""Compiled kernels of exact Hamiltonian Monte Carlo for Gaussian numbers inside bands.

The state is ``z`` (latent standard normal numbers); its heights over some points are ``centre + z @ factor``.
A trajectory turns ``z`` and a velocity into each other, ``z cos t + v sin t``, which keeps the Gaussian law,
and is reflected where a band becomes as wide as its limit. The first such moment is found with a proof:
between two moments at which the widths are known, a seminorm of the heights cannot exceed a sinusoid through
them.

References
----------
.. [1] A. Pakman, L. Paninski, Exact Hamiltonian Monte Carlo for truncated multivariate Gaussians, J. Comput.
   Graph. Stat. 23 (2014), doi:10.1080/10618600.2013.788448.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin._jit import fast_kernel, kernel
from cadskin.conform._bands import facet

__all__ = ["heights_of", "trajectory"]

_TOLERANCE = 1e-8  # relative excess of a width that counts as none
_MOST_BOUNCES = 2000
_STACK = 64


@fast_kernel
def heights_of(z: Any, factor: Any, out: Any) -> None:
    """Write ``z @ factor`` into ``out`` (m,); ``factor`` (k, m)."""
    out[:] = 0.0
    whole = z.size - z.size % 4
    for k in range(0, whole, 4):
        a, b, c, d = z[k], z[k + 1], z[k + 2], z[k + 3]
        for i in range(out.size):
            out[i] += a * factor[k, i] + b * factor[k + 1, i] + c * factor[k + 2, i] + d * factor[k + 3, i]
    for k in range(whole, z.size):
        for i in range(out.size):
            out[i] += z[k] * factor[k, i]


@fast_kernel
def _at_angle(mean: Any, here: Any, there: Any, angle: float, start: int, stop: int, out: Any) -> None:
    cosine, sine = math.cos(angle), math.sin(angle)
    for i in range(start, stop):
        out[i - start] = mean[i] + cosine * here[i] + sine * there[i]


@kernel
def _stays_below(left: float, right: float, angle: float, offset: float, limit: float) -> bool:
    """Tell whether a width cannot exceed ``limit`` between two moments ``angle`` apart.

    A seminorm F is convex and homogeneous: with a mean m of width F(m) = ``offset``, F + F(m) lies below the
    sinusoid through its ends.
    """
    a, b = left + offset, right + offset
    cosine, sine = math.cos(angle), math.sin(angle)
    top = max(a, b)
    if b > a * cosine and a > b * cosine:
        top = math.sqrt(max(a * a + b * b - 2.0 * a * b * cosine, 0.0)) / sine
    return top - offset <= limit * (1.0 + _TOLERANCE)


@kernel
def _crossing(base: float, here: float, there: float, limit: float, least: float) -> float:
    """Return the first angle from ``least`` on at which a sinusoid about ``base`` rises through a limit."""
    radius = math.hypot(here, there)
    if radius <= 0.0:
        return np.inf
    share = (limit - base) / radius
    if share >= 1.0:
        return np.inf
    angle = math.atan2(there, here) - math.acos(max(share, -1.0))
    while angle < least - 1e-10:
        angle += 2.0 * math.pi
    while angle >= least - 1e-10 + 2.0 * math.pi:
        angle -= 2.0 * math.pi
    return max(angle, least)


@kernel
def _width(
    c: int, bands: Any, here: Any, there: Any, angle: float, reference: Any, weights: Any, buffer: Any
) -> Any:
    """Return bounds of the width of a band at an angle; its functional goes to ``reference``, ``weights``."""
    plane, limit = np.zeros(3), bands.limits[c]
    kind, start, stop = bands.kinds[c, 0], bands.kinds[c, 1], bands.kinds[c, 2]
    _at_angle(bands.centre, here, there, angle, start, stop, buffer)
    heights = buffer[: stop - start]
    lower, upper = facet(kind, bands.places[:, start:stop], heights, 0.0, reference, weights, plane)
    if lower > limit:
        return lower, upper
    return upper, upper


@kernel
def _first_hit(
    c: int,
    bands: Any,
    here: Any,
    there: Any,
    horizon: float,
    first: float,
    reference: Any,
    weights: Any,
    buffer: Any,
) -> Any:
    """Return the first angle up to ``horizon`` at which a band is as wide as its limit (-1: none), and calls.

    ``first`` is its width at angle 0. The functional that is hit goes to ``reference`` and ``weights`` (4,).
    """
    start, limit, offset = bands.kinds[c, 1], bands.limits[c], bands.offsets[c]
    stack_angle, stack_width = np.zeros(_STACK), np.zeros(_STACK)
    trial, trial_weights = reference.copy(), weights.copy()
    done, width_done, hit = 0.0, first, -1.0
    depth, calls = 0, 0
    candidate = horizon
    while True:
        if candidate >= 0.0:  # a moment from which the search goes back to the first crossing
            for _ in range(100):
                found, _ = _width(c, bands, here, there, candidate, trial, trial_weights, buffer)
                calls += 1
                if found <= limit * (1.0 + 0.1 * _TOLERANCE):
                    break
                base, x, y = 0.0, 0.0, 0.0
                for k in range(4):
                    base += trial_weights[k] * bands.centre[start + trial[k]]
                    x += trial_weights[k] * here[start + trial[k]]
                    y += trial_weights[k] * there[start + trial[k]]
                earlier = _crossing(base, x, y, limit, done)
                reference[:] = trial
                weights[:] = trial_weights
                hit = min(earlier, candidate) if earlier < candidate else done
                if hit >= candidate - 1e-13 or hit <= done:
                    candidate = hit
                    found = limit
                    break
                candidate = hit
            while depth > 0 and stack_angle[depth - 1] >= candidate:
                depth -= 1
            for k in range(depth, 0, -1):
                stack_angle[k], stack_width[k] = stack_angle[k - 1], stack_width[k - 1]
            stack_angle[0], stack_width[0] = candidate, found
            depth += 1
            candidate = -1.0
        while depth > 0:  # the nearest moment is on top of the stack
            near, width_near = stack_angle[depth - 1], stack_width[depth - 1]
            if not _stays_below(width_done, width_near, near - done, offset, limit):
                break
            done, width_done = near, width_near
            depth -= 1
        if depth == 0:
            return hit, calls
        middle = 0.5 * (done + stack_angle[depth - 1])
        found, _ = _width(c, bands, here, there, middle, trial, trial_weights, buffer)
        calls += 1
        if found > limit * (1.0 + 0.1 * _TOLERANCE):
            depth = 0
            candidate = middle
        elif depth < _STACK - 1:
            stack_angle[depth], stack_width[depth] = middle, found
            depth += 1
        else:
            return hit, calls


@kernel
def trajectory(z: Any, velocity: Any, factor: Any, bands: Any, duration: float) -> Any:
    """Move ``z`` (k,) in place along one trajectory; return reflections (-1: refused) and evaluations.

    Parameters
    ----------
    z, velocity : (k,) float
    factor : (k, m) float
    bands : Bands
    duration : float
        Angle.
    """
    m = factor.shape[1]
    here, there, buffer = np.zeros(m), np.zeros(m), np.zeros(m)
    start_z = z.copy()
    heights_of(z, factor, here)
    heights_of(velocity, factor, there)
    left, calls, bounces = duration, 0, 0
    warm = bands.references.copy()
    warm_weights = np.zeros((bands.kinds.shape[0], 4))
    normal, change = np.zeros(z.size), np.zeros(m)
    widths = np.zeros(bands.kinds.shape[0])
    for c in range(bands.kinds.shape[0]):
        widths[c], _ = _width(c, bands, here, there, 0.0, warm[c], warm_weights[c], buffer)
        calls += 1
    while True:
        when, which = left, -1
        for c in range(bands.kinds.shape[0]):
            hit, more = _first_hit(c, bands, here, there, when, widths[c], warm[c], warm_weights[c], buffer)
            calls += more
            if hit >= 0.0:
                when, which = hit, c
        cosine, sine = math.cos(when), math.sin(when)
        for k in range(z.size):
            z[k], velocity[k] = cosine * z[k] + sine * velocity[k], cosine * velocity[k] - sine * z[k]
        left -= when
        if which < 0:
            return bounces, calls
        bounces += 1
        if bounces > _MOST_BOUNCES:
            z[:] = start_z
            return -1, calls
        for i in range(m):
            here[i], there[i] = cosine * here[i] + sine * there[i], cosine * there[i] - sine * here[i]
        normal[:] = 0.0
        for j in range(4):
            weight, row = warm_weights[which, j], bands.kinds[which, 1] + warm[which, j]
            if weight != 0.0:
                for k in range(z.size):
                    normal[k] += weight * factor[k, row]
        size, along = 0.0, 0.0
        for k in range(z.size):
            size += normal[k] * normal[k]
            along += normal[k] * velocity[k]
        if along <= 0.0:  # it goes inwards already (rounding)
            along = 0.0
        for k in range(z.size):
            normal[k] *= 2.0 * along / size
            velocity[k] -= normal[k]
        heights_of(normal, factor, change)
        for i in range(m):
            there[i] -= change[i]
        for c in range(bands.kinds.shape[0]):
            if c == which:
                widths[c] = bands.limits[c]
            else:
                widths[c], _ = _width(c, bands, here, there, 0.0, warm[c], warm_weights[c], buffer)
                calls += 1
