"""The nearest places on a mesh, in numpy: for some thousand places (targets), or the labels of a scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.shape.discrete import triangle_normals

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Vectors

__all__ = ["closest_on_triangles"]

_CANDIDATES = 24
_BEHIND = 1e12  # mm²


def closest_on_triangles(
    places: Points, points: Points, triangles: Ints, *, normals: Vectors | None = None
) -> tuple[Ints, Floats]:
    """Return the nearest triangle (n,) of each place, and the barycentric weights (n, 3) of its foot.

    Parameters
    ----------
    places : (n, 3) float
    points, triangles : (m, 3) float, (t, 3) int
    normals : (n, 3) float, optional
        Of the places: triangles that look the other way come last (the other side of a thin wall).
    """
    from scipy.spatial import cKDTree

    facing = None if normals is None else triangle_normals(points, triangles)

    corners = points[triangles]
    _, near = cKDTree(corners.mean(axis=1)).query(places, k=min(_CANDIDATES, len(triangles)))
    near = near.reshape(len(places), -1)
    best = np.full(len(places), np.inf)
    index, weights = near[:, 0].copy(), np.zeros((len(places), 3))
    for column in near.T:
        candidate = _foot_weights(places, corners[column])
        foot = np.einsum("nk,nkj->nj", candidate, corners[column])
        apart = ((foot - places) ** 2).sum(axis=1)
        if facing is not None and normals is not None:
            apart = apart + np.where(np.einsum("ni,ni->n", facing[column], normals) < 0, _BEHIND, 0.0)
        better = apart < best
        best[better], index[better], weights[better] = apart[better], column[better], candidate[better]
    return index, weights


def _foot_weights(places: Points, corners: Floats) -> Floats:
    """Return the barycentric weights (n, 3) of the points of triangles (n, 3, 3) nearest to places."""
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    normal = np.cross(b - a, c - a)
    twice = np.maximum((normal**2).sum(axis=1), 1e-300)
    inner: Floats = np.stack(
        [
            np.einsum("ni,ni->n", np.cross(c - b, places - b), normal) / twice,
            np.einsum("ni,ni->n", np.cross(a - c, places - c), normal) / twice,
            np.einsum("ni,ni->n", np.cross(b - a, places - a), normal) / twice,
        ],
        axis=1,
    )
    options = [np.where(np.all(inner >= 0, axis=1)[:, None], inner, np.nan)]
    for i, j in ((0, 1), (1, 2), (2, 0)):
        side = corners[:, j] - corners[:, i]
        share = np.einsum("ni,ni->n", places - corners[:, i], side) / np.maximum(
            (side**2).sum(axis=1), 1e-300
        )
        edge = np.zeros((len(places), 3))
        edge[:, j] = np.clip(share, 0.0, 1.0)
        edge[:, i] = 1.0 - edge[:, j]
        options.append(edge)
    stacked = np.stack(options)
    feet = np.einsum("onk,nkj->onj", stacked, corners)
    apart = ((feet - places) ** 2).sum(axis=2)
    best = np.argmin(np.where(np.isnan(apart), np.inf, apart), axis=0)
    return np.asarray(stacked[best, np.arange(len(places))])
