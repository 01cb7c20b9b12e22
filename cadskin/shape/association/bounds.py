"""Global certificates: bounds that no plane, line or enclosing cylinder can beat."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Vectors

__all__ = [
    "enclosing_line_bound",
    "hull_width",
    "is_arc_open",
    "slab_is_narrowest",
    "slab_margin",
    "widest_weights",
    "width_in_plane",
]


def slab_margin(upper: Points, lower: Points, normal: Vectors, *, within: Vectors | None = None) -> float:
    """Return how fast the width of a slab grows when it is tilted.

    Tilted by phi in any direction, a slab that holds the contacts ``upper`` and ``lower`` has at least the
    width ``t cos(phi) + margin sin(phi)``: see `slab_is_narrowest`.

    Parameters
    ----------
    upper, lower : (k, 3) float
        Points in contact with the two planes.
    normal : (3,) float
        Unit normal from lower to upper.
    within : (3,) float, optional
        Normal of a section plane, when only tilts within it are possible.

    Returns
    -------
    float
        The margin [mm]; 0 or less when the contacts do not alternate.
    """
    differences = (upper[:, None, :] - lower[None, :, :]).reshape(-1, 3)
    if within is not None:
        along = differences @ np.cross(within, normal)
        return float(min(along.max(), -along.min()))
    helper = np.eye(3)[int(np.argmin(np.abs(normal)))]
    e1 = np.cross(normal, helper)
    e1 /= np.linalg.norm(e1)
    flat = differences @ np.stack([e1, np.cross(normal, e1)], axis=1)
    sides = flat[None, :, :] - flat[:, None, :]
    length = np.linalg.norm(sides, axis=2)
    across = np.stack([sides[..., 1], -sides[..., 0]], axis=2)[length > 0] / length[length > 0][:, None]
    if not len(across):
        return 0.0
    # The least support lies at the normal of an edge of the polygon of differences.
    return float((np.concatenate([across, -across]) @ flat.T).max(axis=1).min())


def slab_is_narrowest(margin: float, extent: float, width: float) -> bool:
    """Tell whether no slab is narrower than one of ``width``, by two bounds on the slabs tilted by phi.

    The contacts give ``width cos(phi) + margin sin(phi)``: at least the width where ``tan(phi / 2)`` is at
    most ``margin / width``. Points that lie ``extent`` apart along every direction of the slab, less than
    ``width`` across it, give ``extent sin(phi) - width cos(phi)``: at least the width where ``tan(phi / 2)``
    is no less than ``width / extent``. Together they cover all angles when ``margin extent >= width^2``.

    Examples
    --------
    >>> slab_is_narrowest(0.001, 50.0, 0.05), slab_is_narrowest(0.001, 2.0, 0.05)
    (True, False)
    """
    return margin > 0.0 and max(margin, extent) * margin >= width * width * (1 + 1e-9)


def enclosing_line_bound(points: Points, weights: Floats) -> float:
    """Return a lower bound of the radius of every cylinder that encloses the points [mm].

    For weights w >= 0 of sum 1 and every line, ``max dist² >= sum w dist² >= trace(M) - lambda_max(M)`` with
    M the weighted second moments about the weighted mean.
    """
    weights = weights / weights.sum()
    centred = points - weights @ points
    moments = (centred * weights[:, None]).T @ centred
    eigenvalues = np.linalg.eigvalsh(moments)
    return float(np.sqrt(max(eigenvalues[0] + eigenvalues[1], 0.0)))


def widest_weights(jacobian: Floats, height: Floats) -> Floats | None:
    """Return the Kuhn-Tucker multipliers (n,) of tied points whose heights along the axis spread most.

    Where more points touch an enclosing cylinder than it has freedoms, the multipliers are not unique; the
    dual bound needs those for which the axis is the direction of the largest moment.
    """
    from scipy.optimize import linprog

    matrix = np.concatenate([jacobian.T, np.ones((1, len(height)))])
    right = np.zeros(len(matrix))
    right[-1] = 1.0
    options = {"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10}
    size = float(np.ptp(height))
    if size < 1e-9:
        return None  # all contacts at one height: the bound is that of their circle
    weights, mean = np.zeros(0), 0.5 * float(height.min() + height.max())
    for _ in range(20):  # Frank and Wolfe on the variance of the heights, exact line search
        cost = -((height - mean) ** 2) / size**2
        found = linprog(cost, A_eq=matrix, b_eq=right, bounds=(0, None), method="highs", options=options)
        if found.x is None:
            return None
        if not len(weights):
            weights = found.x
        else:
            ahead = found.x - weights
            rise, bend = (
                float(-cost @ ahead),
                float(height @ ahead / size) ** 2,
            )
            if rise <= 1e-12:
                break
            weights = weights + min(1.0, rise / (2.0 * bend) if bend > 0 else 1.0) * ahead
        mean = float(weights @ height)
    used = weights > 1e-9
    left = right - matrix @ weights
    weights[used] += np.linalg.lstsq(matrix[:, used], left, rcond=None)[0]
    return np.asarray(np.maximum(weights, 0.0))


def is_arc_open(across: Floats) -> tuple[bool, float]:
    """Tell whether points (n, 2) around a centre leave a gap of 180 degrees or more.

    Returns
    -------
    open : bool
    gap : float
        The largest angle without a point [rad].
    """
    angles = np.sort(np.arctan2(across[:, 1], across[:, 0]))
    gap = float(np.diff(angles, append=angles[0] + 2 * np.pi).max())
    return gap >= np.pi * (1 - 1e-12), gap


def hull_width(points: Points, *, limit: int = 4000) -> tuple[float, Vectors] | None:
    """Return the width of a point set over all directions, and the direction (3,).

    Exact: the narrowest slab touches a face and a vertex, or two edges, of the convex hull.

    Parameters
    ----------
    points : (n, 3) float
    limit : int
        None is returned when the hull has more edges than this.

    References
    ----------
    .. [1] M. E. Houle, G. T. Toussaint, Computing the width of a set, IEEE PAMI 10 (1988),
       doi:10.1109/34.6790.
    """
    from scipy.spatial import ConvexHull, QhullError

    centred = points - points.mean(axis=0)
    _, spread, right = np.linalg.svd(centred[:: max(1, len(points) // 10_000)], full_matrices=False)
    if spread[2] <= 1e-13 * spread[0]:
        return None
    scaled = (centred @ right.T) / (spread / spread[0])  # a thin slab is hulled as a fat one
    try:
        hull = ConvexHull(scaled)
    except QhullError:
        return None
    corners = np.unique(hull.simplices)
    vertices = centred[corners]
    faces = centred[hull.simplices]
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    size = np.linalg.norm(normals, axis=1)
    normals = normals[size > 0] / size[size > 0][:, None]
    best, direction = _narrowest(normals, vertices)
    edges = _edges(hull.simplices)
    if len(edges) > limit:
        return None
    ends = centred[edges]
    along = ends[:, 1] - ends[:, 0]
    for i in range(len(edges) - 1):
        crossed = np.cross(along[i], along[i + 1 :])
        length = np.linalg.norm(crossed, axis=1)
        ok = length > 1e-12 * np.linalg.norm(along[i]) * np.linalg.norm(along[i + 1 :], axis=1)
        crossed = crossed[ok] / length[ok][:, None]
        gap = np.abs(((ends[i + 1 :, 0] - ends[i, 0])[ok] * crossed).sum(axis=1))
        # A slab through two edges is at least as wide as the set only where nothing lies beyond it.
        near = crossed[gap < best * (1 - 1e-12)]
        if len(near):
            width, at = _narrowest(near, vertices)
            if width < best:
                best, direction = width, at
    return float(best), direction


def width_in_plane(points: Points, section: Vectors) -> float | None:
    """Return the least distance of two parallel lines that hold the points, seen along ``section`` [mm]."""
    from scipy.spatial import ConvexHull, QhullError

    helper = np.eye(3)[int(np.argmin(np.abs(section)))]
    first = np.cross(section, helper)
    first /= np.linalg.norm(first)
    flat = (points - points.mean(axis=0)) @ np.stack([first, np.cross(section, first)], axis=1)
    _, spread, right = np.linalg.svd(flat[:: max(1, len(flat) // 10_000)], full_matrices=False)
    if spread[1] <= 1e-13 * spread[0]:
        return None
    try:
        hull = ConvexHull((flat @ right.T) / (spread / spread[0]))  # a thin strip is hulled as a wide one
    except QhullError:
        return None
    corners = flat[hull.vertices]
    sides = np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(sides, axis=1)
    normals = np.stack([sides[:, 1], -sides[:, 0]], axis=1)[length > 0] / length[length > 0][:, None]
    return float(np.ptp(corners @ normals.T, axis=0).min())


def _narrowest(normals: Vectors, vertices: Points) -> tuple[float, Vectors]:
    best, direction = np.inf, normals[0]
    for start in range(0, len(normals), 512):
        block = normals[start : start + 512]
        heights = vertices @ block.T
        width = heights.max(axis=0) - heights.min(axis=0)
        k = int(np.argmin(width))
        if width[k] < best:
            best, direction = float(width[k]), block[k]
    return best, direction


def _edges(simplices: Ints) -> Ints:
    sides = np.sort(simplices[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return np.asarray(np.unique(sides, axis=0))
