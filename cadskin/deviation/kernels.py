"""Correlation functions of Gaussian fields; ``length`` l means the same in all of them.

With d the distance and r = d / l:

=====================  =========================================  ==================
name                   correlation                                Matern smoothness
=====================  =========================================  ==================
squared_exponential    exp(-r^2 / 2)                              infinite
matern52               (1 + a + a^2/3) exp(-a),  a = sqrt(5) r    5/2
matern32               (1 + a) exp(-a),          a = sqrt(3) r    3/2
whittle                a K_1(a),                 a = sqrt(2) r    1
exponential            exp(-r)                                    1/2
=====================  =========================================  ==================

The last four are the Matern family with a = sqrt(2 nu) d / l.

References
----------
Rasmussen, Williams: Gaussian Processes for Machine Learning, MIT Press 2006, equations (4.9) and (4.14).
"""

from __future__ import annotations

import math
from typing import Any, Literal, TypeAlias

import numpy as np

from cadskin._jit import kernel
from cadskin._typing import Floats, Points
from cadskin.errors import DeviationError

__all__ = ["KERNELS", "Kernel", "correlation", "correlation_matrix", "kernel_code", "smoothness"]

Kernel: TypeAlias = Literal["squared_exponential", "exponential", "matern32", "matern52", "whittle"]

KERNELS: dict[str, int] = {
    "squared_exponential": 0,
    "exponential": 1,
    "matern32": 2,
    "matern52": 3,
    "whittle": 4,
}
_SMOOTHNESS = {
    "squared_exponential": math.inf,
    "exponential": 0.5,
    "matern32": 1.5,
    "matern52": 2.5,
    "whittle": 1.0,
}


def kernel_code(kernel: str) -> int:
    """Return the number of a kernel in the compiled code.

    Raises
    ------
    DeviationError
        Unknown kernel.
    """
    if not isinstance(kernel, str) or kernel not in KERNELS:
        raise DeviationError(f"kernel {kernel!r} is not known; there are {', '.join(KERNELS)}")
    return KERNELS[kernel]


def smoothness(kernel: str) -> float:
    """Return the Matern smoothness nu of a kernel (infinite for the squared exponential)."""
    kernel_code(kernel)
    return _SMOOTHNESS[kernel]


def correlation(distance: Floats, length: float, kernel: str = "squared_exponential") -> Floats:
    """Return the correlation at given distances.

    Parameters
    ----------
    distance : (...) float
        [mm].
    length : float
        Correlation length l [mm].
    kernel : str

    Returns
    -------
    (...) float

    Examples
    --------
    >>> float(correlation(np.array(15.0), 15.0).round(6))
    0.606531
    """
    code = kernel_code(kernel)
    squared = (np.asarray(distance, dtype=np.float64) / length) ** 2
    return np.asarray(_correlations(squared.ravel(), code).reshape(squared.shape), dtype=np.float64)


def correlation_matrix(points: Points, others: Points, kernel: str) -> Floats:
    """Return the correlations (n, m) between points (n, d) and others (m, d), both already divided by l."""
    left, right = (np.ascontiguousarray(rows, dtype=np.float64) for rows in (points, others))
    return np.asarray(_matrix(left, right, kernel_code(kernel)), dtype=np.float64)


@kernel
def _bessel_k1_scaled(x: float) -> float:
    """Return x K_1(x), relative error below 1e-13 for 0 <= x.

    Small x: the power series; large x: the trapezoidal rule on K_1(x) = int exp(-x cosh t) cosh t dt, which
    converges exponentially.
    """
    if x < 1e-9:
        return 1.0
    if x > 700.0:
        return 0.0
    if x < 1.0:
        quarter = 0.25 * x * x
        term = 1.0
        digamma = -0.5772156649015329  # psi(1)
        total = 0.0
        for k in range(20):
            total += term * (math.log(0.5 * x) - digamma - 0.5 / (k + 1.0))
            digamma += 1.0 / (k + 1.0)
            term *= quarter / ((k + 1.0) * (k + 2.0))
        return 1.0 + 2.0 * quarter * total
    step = 0.1
    total = 0.5 * math.exp(-x)
    t = step
    while True:
        value = math.exp(-x * math.cosh(t)) * math.cosh(t)
        total += value
        if value < 1e-18 * total:
            break
        t += step
    return x * total * step


@kernel
def correlation_of(squared: float, code: int) -> float:
    """Correlation at the squared distance in units of the length."""
    if code == 0:
        return math.exp(-0.5 * squared)
    r = math.sqrt(squared)
    if code == 1:
        return math.exp(-r)
    if code == 2:
        a = math.sqrt(3.0) * r
        return (1.0 + a) * math.exp(-a)
    if code == 3:
        a = math.sqrt(5.0) * r
        return (1.0 + a + a * a / 3.0) * math.exp(-a)
    return _bessel_k1_scaled(math.sqrt(2.0) * r)


@kernel
def _correlations(squared: Any, code: int) -> Any:
    out = np.zeros(squared.size)
    for i in range(squared.size):
        out[i] = correlation_of(squared[i], code)
    return out


@kernel
def squared_distance(points: Any, i: int, others: Any, j: int) -> float:
    """Squared Euclidean distance of row i and row j."""
    total = 0.0
    for k in range(points.shape[1]):
        step = points[i, k] - others[j, k]
        total += step * step
    return total


@kernel
def _matrix(points: Any, others: Any, code: int) -> Any:
    out = np.zeros((points.shape[0], others.shape[0]))
    for i in range(points.shape[0]):
        for j in range(others.shape[0]):
            out[i, j] = correlation_of(squared_distance(points, i, others, j), code)
    return out
