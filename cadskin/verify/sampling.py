"""How much a value of points falls short of that of the surface between them."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from cadskin._random import child, seed_sequence
from cadskin.errors import GeometryError

if TYPE_CHECKING:
    from cadskin._typing import Points, RNGLike

__all__ = ["sampling_shortfall"]


def sampling_shortfall(
    points: Points,
    value: Callable[[Points], float],
    *,
    subsets: int = 8,
    rng: RNGLike = 0,
) -> tuple[float, float]:
    """Estimate how far a peak-to-valley value of points lies below that of the surface.

    A quarter of the points is a sample of twice the spacing. On a smooth surface the extreme of samples falls
    short by the square of the spacing, so that the missing part is a third of what a quarter of the points
    loses. It is an estimate, and says nothing about waves shorter than the spacing.

    Parameters
    ----------
    points : (n, 3) float
    value : callable
        Points to value, for example ``lambda p: flatness(p).value``.
    subsets : int
        Random quarters that are averaged.
    rng : seed or generator

    Returns
    -------
    value : float
        Of all points [mm].
    shortfall : float
        What the surface probably has on top [mm].

    Raises
    ------
    GeometryError
        Fewer than 64 points.
    """
    cloud = np.asarray(points, dtype=np.float64)
    if len(cloud) < 64:
        raise GeometryError(f"an estimate of the sampling needs at least 64 points, got {len(cloud)}")
    seed, full = seed_sequence(rng), float(value(cloud))
    parts = []
    for index in range(subsets):
        chosen = child(seed, index).permutation(len(cloud))[: len(cloud) // 4]
        parts.append(float(value(cloud[np.sort(chosen)])))
    return full, max(0.0, (full - float(np.mean(parts))) / 3.0)
