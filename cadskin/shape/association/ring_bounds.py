"""Global certificates of circles and spheres: minimum zone and maximum inscribed.

Move the centre by ``d``. A point at the distance ``a`` in the direction ``e`` from the old centre then lies
at least ``a - e.d`` and at most ``a - e.d + d^2 / (2 a)`` from the new one. For the contacts of a zone this
gives ``width(d) >= width + m |d| - d^2 / (2 r)`` with ``r`` the inner radius and ``m`` the least support of
the differences of directions, inner minus outer: no better centre within ``2 m r``. Farther off the points
all around say it: some lie within the angle ``g`` of any direction, so that the new zone is at least as wide
as ::

    sqrt(r^2 + 2 r |d| cos g + d^2) - sqrt(max over a in (r, r + width) of (a^2 - 2 a |d| cos g + d^2))

which grows with ``|d|``. The same two bounds hold for the radius of an inscribed circle or sphere.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cadskin._typing import Floats

__all__ = ["inscribed_within", "least_support", "zone_is_least"]


def least_support(vectors: Floats) -> float:
    """Return the least over unit directions of the largest projection of vectors (k, 2) or (k, 3).

    It is the distance of the origin from their convex hull's boundary; 0 where the origin is not inside.

    Examples
    --------
    >>> least_support(np.array([[1.0, 0], [-1, 0], [0, 1], [0, -1]])).__round__(12)
    0.707106781187
    """
    from scipy.spatial import ConvexHull, QhullError

    if len(vectors) <= vectors.shape[1]:
        return 0.0
    try:
        hull = ConvexHull(vectors)
    except QhullError:
        return 0.0
    return max(0.0, float(-hull.equations[:, -1].max()))


def _covered(around: Floats) -> float:
    """Return the cosine of the angle within which every direction has a point; 0 for 90 degrees or more."""
    return least_support(around / np.linalg.norm(around, axis=1)[:, None])


def zone_is_least(around: Floats, outer: Floats, inner: Floats, radii: tuple[float, float]) -> bool:
    """Tell whether no centre has a narrower zone.

    Parameters
    ----------
    around : (n, 2) or (n, 3) float
        Some of the points, from the centre [mm].
    outer, inner : (k, 2) or (k, 3) float
        The contacts, from the centre.
    radii : (float, float)
        Least and largest distance of all points from the centre [mm].
    """
    low, high = radii
    if not (len(outer) and len(inner)) or low <= 0.0:
        return False
    out, into = (part / np.linalg.norm(part, axis=1)[:, None] for part in (outer, inner))
    reach = 2.0 * low * least_support((into[:, None] - out[None, :]).reshape(-1, around.shape[1]))
    cosine = _covered(around)
    if not (reach > 0.0 and cosine > 0.0):
        return False
    far = np.sqrt(low**2 + 2.0 * low * reach * cosine + reach**2)
    near = max(radius**2 - 2.0 * radius * reach * cosine + reach**2 for radius in (low, high))
    return bool(far - np.sqrt(near) >= (high - low) * (1.0 + 1e-9))


def inscribed_within(around: Floats, inner: Floats, radii: tuple[float, float]) -> float:
    """Return the distance within which no centre has a larger inscribed circle or sphere [mm]; 0 if unknown.

    The parameters are those of `zone_is_least`.
    """
    low, high = radii
    if low <= 0.0 or not len(inner):
        return 0.0
    reach = 2.0 * low * least_support(inner / np.linalg.norm(inner, axis=1)[:, None])
    cosine = _covered(around)
    # A point at the distance a gives a^2 - 2 a d cos + d^2 <= low^2: between two roots for the farthest,
    # up to 2 low cos for the nearest.
    root = (high * cosine) ** 2 - (high**2 - low**2)
    if reach <= 0.0 or root <= 0.0 or high * cosine - np.sqrt(root) > reach:
        return reach
    return max(reach, float(min(high * cosine + np.sqrt(root), 2.0 * low * cosine)))
