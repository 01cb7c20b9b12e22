"""The tolerance zone of the paper: across the third principal axis of the points.

It is never narrower than the minimum zone of ISO 1101: a part whose flatness is within its tolerance here is
within it there too, and some parts are refused that the standard accepts.

References
----------
.. [1] Zhang, Anwer, Stockinger, Mathieu, Wartzack 2013, doi:10.1177/0954405412466987, equations (2) and (3),
   figure 2.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["PcaZone", "pca_zone"]


@dataclass(frozen=True, eq=False)
class PcaZone:
    """A zone between two parallel planes.

    Parameters
    ----------
    centroid : (3,) float
        [mm].
    axes : (3, 3) float
        Principal directions, one per row, by falling variance; the third is the direction of the zone.
    width : float
        [mm].
    """

    centroid: Points
    axes: Vectors
    width: float


def pca_zone(points: Points, normal: Floats | None = None) -> PcaZone:
    """Return the zone of points by principal components.

    Parameters
    ----------
    points : (n, 3) float
        [mm].
    normal : (3,) float, optional
        Nominal normal, which the third axis is turned to.

    Raises
    ------
    AssociationError
        Fewer than three points.

    Examples
    --------
    >>> x, y = np.meshgrid(np.arange(5.0), np.arange(3.0))
    >>> bowl = np.column_stack([x.ravel(), y.ravel(), 0.01 * (x.ravel() - 2) ** 2])
    >>> zone = pca_zone(bowl, np.array([0.0, 0.0, 1.0]))
    >>> round(zone.width, 9), zone.axes[2].round(9).tolist()
    (0.04, [0.0, 0.0, 1.0])
    """
    if len(points) < 3:
        raise AssociationError(f"principal axes need at least three points, got {len(points)}")
    centroid = points.mean(axis=0)
    centred = points - centroid
    axes = np.linalg.eigh(centred.T @ centred / len(points))[1].T[::-1].copy()
    if normal is not None and axes[2] @ normal < 0:
        axes[2] *= -1.0
    return PcaZone(centroid, axes, float(np.ptp(centred @ axes[2])))
