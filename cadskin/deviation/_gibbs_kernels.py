"""Single-site Gibbs sweeps over a sparse precision matrix, many chains at once; exact truncated normals.

References
----------
Wichura: Algorithm AS 241, The percentage points of the normal distribution, Applied Statistics 37 (1988).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cadskin._jit import fast_kernel, kernel
from cadskin.deviation._linear import COLUMNS

__all__ = ["colours", "sweep", "truncated_normal", "truncated_sweep"]

_SQRT2 = math.sqrt(2.0)


@kernel
def colours(starts: Any, columns: Any) -> Any:
    """Greedy colouring: sites of one colour are not neighbours, so they are independent given the others."""
    n = starts.size - 1
    colour = np.full(n, -1, dtype=np.int64)
    used = np.full(n + 1, -1, dtype=np.int64)
    for i in range(n):
        for p in range(starts[i], starts[i + 1]):
            j = columns[p]
            if j != i and colour[j] >= 0:
                used[colour[j]] = i
        k = 0
        while used[k] == i:
            k += 1
        colour[i] = k
    return colour


@fast_kernel
def sweep(order: Any, starts: Any, columns: Any, weights: Any, deviation: Any, noise: Any, x: Any) -> None:
    """One sweep: x_i = sum_j w_ij x_j + s_i z_i, sites in order; ``x`` is (n, COLUMNS), a chain each."""
    for i in order:
        scale = deviation[i]
        for r in range(COLUMNS):
            x[i, r] = scale * noise[r, i]
        p, end = starts[i], starts[i + 1]
        while p + 4 <= end:
            w0, w1, w2, w3 = weights[p], weights[p + 1], weights[p + 2], weights[p + 3]
            a, b, c, d = columns[p], columns[p + 1], columns[p + 2], columns[p + 3]
            for r in range(COLUMNS):
                x[i, r] += w0 * x[a, r] + w1 * x[b, r] + w2 * x[c, r] + w3 * x[d, r]
            p += 4
        while p < end:
            w0, a = weights[p], columns[p]
            for r in range(COLUMNS):
                x[i, r] += w0 * x[a, r]
            p += 1


@kernel
def truncated_sweep(
    order: Any,
    starts: Any,
    columns: Any,
    weights: Any,
    deviation: Any,
    noise: Any,
    low: Any,
    high: Any,
    x: Any,
) -> None:
    """One sweep with every site between its limits; the normal noise is turned to uniform numbers first."""
    mean = np.zeros(COLUMNS)
    for i in order:
        mean[:] = 0.0
        for p in range(starts[i], starts[i + 1]):
            for r in range(COLUMNS):
                mean[r] += weights[p] * x[columns[p], r]
        s = deviation[i]
        for r in range(COLUMNS):
            uniform = 0.5 * math.erfc(-noise[r, i] / _SQRT2)
            drawn = mean[r] + s * truncated_normal(uniform, (low[i] - mean[r]) / s, (high[i] - mean[r]) / s)
            x[i, r] = min(max(drawn, low[i]), high[i])


@kernel
def truncated_normal(uniform: float, low: float, high: float) -> float:
    """Return a standard normal number between limits, by inversion in the tail that keeps its digits."""
    sign = 1.0
    if high <= 0.0 or -low > high:  # work on the upper side
        sign, low, high, uniform = -1.0, -high, -low, 1.0 - uniform
    upper = 0.5 * math.erfc(low / _SQRT2)
    beyond = 0.5 * math.erfc(high / _SQRT2)
    if upper < 1e-290:  # so far out that the tail is exponential
        ratio = math.exp(max(-low * (high - low), -700.0))
        return sign * (low - math.log1p(-uniform * (1.0 - ratio)) / low)
    return -sign * _normal_quantile(upper - uniform * (upper - beyond))


@kernel
def _ratio(t: float, numerator: Any, denominator: Any) -> float:
    above, below = 0.0, 0.0
    for k in range(7, -1, -1):
        above = above * t + numerator[k]
        below = below * t + denominator[k]
    return above / below


_A = np.array(
    [3.3871328727963666080, 1.3314166789178437745e2, 1.9715909503065514427e3,
     1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
     3.3430575583588128105e4, 2.5090809287301226727e3]
)  # fmt: skip
_B = np.array(
    [1.0, 4.2313330701600911252e1, 6.8718700749205790830e2,
     5.3941960214247511077e3, 2.1213794301586595867e4, 3.9307895800092710610e4,
     2.8729085735721942674e4, 5.2264952788528545610e3]
)  # fmt: skip
_C = np.array(
    [1.42343711074968357734, 4.63033784615654529590, 5.76949722146069140550,
     3.64784832476320460504, 1.27045825245236838258, 2.41780725177450611770e-1,
     2.27238449892691845833e-2, 7.74545014278341407640e-4]
)  # fmt: skip
_D = np.array(
    [1.0, 2.05319162663775882187, 1.67638483018380384940,
     6.89767334985100004550e-1, 1.48103976427480074590e-1, 1.51986665636164571966e-2,
     5.47593808499534494600e-4, 1.05075007164441684324e-9]
)  # fmt: skip
_E = np.array(
    [6.65790464350110377720, 5.46378491116411436990, 1.78482653991729133580,
     2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
     2.71155556874348757815e-5, 2.01033439929228813265e-7]
)  # fmt: skip
_F = np.array(
    [1.0, 5.99832206555887937690e-1, 1.36929880922735805310e-1,
     1.48753612908506148525e-2, 7.86869131145613259100e-4, 1.84631831751005468180e-5,
     1.42151175831644588870e-7, 2.04426310338993978564e-15]
)  # fmt: skip


@kernel
def _normal_quantile(p: float) -> float:
    """Quantile of the normal distribution, relative error 1e-15 (AS 241, PPND16)."""
    q = p - 0.5
    if abs(q) <= 0.425:
        return q * _ratio(0.180625 - q * q, _A, _B)
    r = math.sqrt(-math.log(p if q < 0.0 else 1.0 - p))
    value = _ratio(r - 1.6, _C, _D) if r <= 5.0 else _ratio(r - 5.0, _E, _F)
    return -value if q < 0.0 else value
