"""Distances from a surface that is known by samples with normals and curvatures."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors
    from cadskin.shape.association.models import ClosestPoints

__all__ = ["sampled_closest"]


def sampled_closest(
    points: Points, normals: Vectors, curvatures: Floats, directions: Floats
) -> ClosestPoints:
    """Return the closest-point function of a sampled surface, by osculating paraboloids.

    The paraboloid of the nearest sample is used. The distance is right to the third order of the tangential
    offset from that sample; for a skin model, whose points lie over their own samples, the offset is as small
    as the deviation.

    Parameters
    ----------
    points, normals : (n, 3) float
    curvatures : (n, 2) float
        Positive where the surface bends towards its normal [1/mm].
    directions : (n, 2, 3) float
        Principal directions.
    """
    from scipy.spatial import cKDTree

    tree = cKDTree(points)

    def closest(query: Points) -> tuple[Floats, Vectors]:
        _, nearest = tree.query(query)
        relative = query - points[nearest]
        normal, bend, axes = normals[nearest], curvatures[nearest], directions[nearest]
        along = np.einsum("nij,nj->ni", axes, relative)
        height = np.einsum("ij,ij->i", relative, normal) - 0.5 * (bend * along**2).sum(axis=1)
        slope = bend * along
        tilted = normal - np.einsum("ni,nij->nj", slope, axes)
        length = np.sqrt(1.0 + (slope**2).sum(axis=1))
        return height / length, tilted / length[:, None]

    return closest
