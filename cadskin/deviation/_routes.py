"""Which algorithm samples a Gaussian field on a patch: chosen by size and smoothness, recorded in a note.

Measured on a 120 x 80 mm plane (errors are of the correlation, exact, over all pairs of points):

================  =====================================================  ==========================
route             used for                                               largest error
================  =====================================================  ==========================
dense             up to 600 points                                       1e-6 (float32)
karhunen_loeve    squared exponential, up to 10 000 points, rank <= 400  1e-4
grid              squared exponential, any size                          6e-4
two_level         squared exponential where the grid would be too large  1e-3
vecchia           all other kernels, and few points per length           1e-3 (Matern 5/2) to 8e-3
surface           thin patches, metric="surface"                         1.5e-3 (smooth) to 1e-2
================  =====================================================  ==========================
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.deviation._grid import MAX_CELLS, GridField, grid_cells
from cadskin.deviation._kriging import TwoLevelField, VecchiaField
from cadskin.deviation._patch_fields import DenseField, LowRankField, PatchField
from cadskin.deviation._patches import PatchPoints, is_thin
from cadskin.deviation._surface_levels import surface_field
from cadskin.deviation.coordinates import area_frame
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points

__all__ = ["METHODS", "METRICS", "make_field", "make_graded_field"]

METRICS = ("auto", "euclidean", "surface", "geodesic")
METHODS = ("auto", "dense", "karhunen_loeve", "grid", "two_level", "vecchia")

_DENSE_POINTS = 600
_LOW_RANK_POINTS = 10_000
_LOW_RANK = 400
_SPACING = {"squared_exponential": 0.2, "matern52": 1 / 6, "matern32": 1 / 6}
_DENSE_LIMIT = 20_000  # points beyond which a dense matrix is refused


def make_graded_field(patch: PatchPoints, lengths: Floats, kernel: str) -> PatchField:
    """Return the unit field of a patch whose correlation length (k,) [mm] varies from sample to sample."""
    of_point = np.zeros(len(patch.points))
    of_point[patch.point_of_sample] = lengths[patch.samples]
    middle = float(np.exp(np.log(of_point).mean()))
    return surface_field(
        patch.points / middle, patch.triangles, kernel, of_point / middle, normals=patch.normals
    )


def make_field(patch: PatchPoints, length: float, kernel: str, metric: str, method: str) -> PatchField:
    """Return the unit field of a patch.

    Raises
    ------
    DeviationError
        A metric or method that cannot serve this patch.
    """
    if metric == "geodesic" and not patch.flat:
        raise DeviationError(
            f"kernel {kernel!r} over geodesic distance is not positive definite on a curved patch; "
            "use metric='surface' (always positive definite) or metric='euclidean'"
        )
    if metric == "surface" or (metric == "auto" and method == "auto" and is_thin(patch, length)):
        if method != "auto":
            raise DeviationError(f"metric='surface' has its own method; leave out method={method!r}")
        return surface_field(patch.points / length, patch.triangles, kernel, normals=patch.normals)
    points = (patch.points - patch.points.min(axis=0)) / length
    chosen = _choose(patch, length, kernel) if method == "auto" else method
    if chosen == "grid":
        if kernel != "squared_exponential":
            raise DeviationError(f"method='grid' is for the squared exponential, not for {kernel!r}")
        return GridField(_grid_points(patch, length))
    if chosen == "dense":
        if len(points) > _DENSE_LIMIT:
            raise DeviationError(
                f"method='dense' on {len(points)} points needs {len(points) ** 2 * 8e-9:.0f} GB; "
                "use method='auto'"
            )
        return DenseField(points, kernel)
    if chosen == "karhunen_loeve":
        return LowRankField(points, kernel)
    if chosen == "two_level":
        return TwoLevelField(points, kernel, spacing=_SPACING.get(kernel, 1 / 8))
    return VecchiaField(points, kernel)


def _choose(patch: PatchPoints, length: float, kernel: str) -> str:
    count = len(patch.points)
    lengths = patch.area / length**2  # the area in squares of the correlation length
    if count <= _DENSE_POINTS:
        return "dense"
    if kernel == "squared_exponential" and count <= _LOW_RANK_POINTS and 3 * lengths + 20 <= _LOW_RANK:
        return "karhunen_loeve"
    if kernel == "squared_exponential" and _grid_pays(patch, length):
        return "grid"
    if kernel == "squared_exponential" and lengths / _SPACING[kernel] ** 2 < 0.1 * count:
        return "two_level"
    return "vecchia"


def _grid_points(patch: PatchPoints, length: float) -> Points:
    """Points in correlation lengths: in the plane of a flat patch, in space otherwise."""
    if not patch.flat:
        return patch.points / length
    frame = area_frame(patch.points, patch.triangles, patch.normals[0])
    return np.asarray((patch.points - frame.centroid) @ frame.axes[:2].T / length)


def _grid_pays(patch: PatchPoints, length: float) -> bool:
    """Whether the grid fits; in space it must not be much larger than the set of points."""
    cells = grid_cells(_grid_points(patch, length))
    return cells <= (MAX_CELLS if patch.flat else min(MAX_CELLS, max(20 * len(patch.points), 100_000)))
