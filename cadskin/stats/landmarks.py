"""The landmark grid (i, j): heights of a nearly flat face at the centres of square cells, read with care.

The paper takes the mean point of each cell. That is biased wherever a cell is filled unevenly, and its x and
y differ from part to part. Here a robust plane is fitted in the cell and read at its centre; a cell without
points is NaN, never invented.

References
----------
Zhang et al. 2013, doi:10.1177/0954405412466987, figure 11.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import StatisticsError
from cadskin.stats._steps import tukey

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cadskin._typing import Floats, Ints, Points

__all__ = ["LandmarkGrid", "landmark_grid"]

_REACH = 4.685


@dataclass(frozen=True, eq=False)
class LandmarkGrid:
    """Square cells over a face.

    Parameters
    ----------
    cells : (d, 2) int
        Indices (i, j).
    size : float
        Side of a cell [mm].
    areas : (d,) float
        Share of each cell that the face covers, 1 for a full one.
    """

    cells: Ints
    size: float
    areas: Floats

    def __post_init__(self) -> None:
        """Check and freeze."""
        object.__setattr__(self, "cells", frozen(self.cells, dtype=np.int64, shape=(None, 2), name="cells"))
        object.__setattr__(self, "areas", frozen(self.areas, shape=(len(self.cells),), name="areas"))

    @property
    def centres(self) -> Floats:
        """Centres of the cells (d, 2) [mm]."""
        return np.asarray((self.cells + 0.5) * self.size)

    def trimmed(self, rings: int = 1) -> LandmarkGrid:
        """Return the grid without its outermost rings of cells: the rim of a face belongs to its edge.

        Raises
        ------
        StatisticsError
            Nothing is left.
        """
        cells, keep = self.cells, np.ones(len(self.cells), dtype=bool)
        for _ in range(rings):
            present = {(int(i), int(j)) for i, j in cells[keep]}
            around = [(di, dj) for di in (-1, 0, 1) for dj in (-1, 0, 1)]
            inner = [all((int(i) + di, int(j) + dj) in present for di, dj in around) for i, j in cells]
            keep = keep & np.array(inner, dtype=bool)
        if not keep.any():
            raise StatisticsError(f"no cell is left after trimming {rings} rings; use smaller cells")
        return LandmarkGrid(cells[keep], self.size, self.areas[keep])

    def heights(self, points: ArrayLike, *, reading: Literal["plane", "mean"] = "plane") -> Floats:
        """Return the height (d,) [mm] of each landmark.

        Parameters
        ----------
        points : (m, 3) array_like of float
            Measured points in the frame of the face: x and y along it, z out of the material [mm].
        reading : {"plane", "mean"}
            A robust plane in the cell, read at its centre (a quadratic over the 3 x 3 cells around where the
            cell's points are few or to one side); or the paper's mean point.

        Returns
        -------
        (d,) float
            NaN where too few points tell the height.
        """
        cloud = np.asarray(points, dtype=np.float64)
        if cloud.ndim != 2 or cloud.shape[1] != 3:
            raise StatisticsError(f"points must be (m, 3), got shape {cloud.shape}")
        if reading not in ("plane", "mean"):
            raise StatisticsError(f"reading must be plane or mean, got {reading!r}")
        cloud = cloud[np.isfinite(cloud).all(axis=1)]
        table = _by_cell(cloud, self.size)
        out = np.full(len(self.cells), np.nan)
        for k, (cell, centre) in enumerate(zip(self.cells, self.centres, strict=True)):
            own = table.get((int(cell[0]), int(cell[1])))
            if reading == "mean":
                out[k] = np.nan if own is None else cloud[own, 2].mean()
                continue
            out[k] = _plane_height(cloud, own, centre, self.size)
            if np.isnan(out[k]):
                out[k] = _quadratic_height(cloud, table, cell, centre, self.size)
        return out


def landmark_grid(points: ArrayLike, size: float, *, cover: float = 0.5) -> LandmarkGrid:
    """Return the cells that a face covers.

    Parameters
    ----------
    points : (m, 2 or 3) array_like of float
        Points that fill the face densely, in its frame [mm]: at least some in every sixteenth of a cell.
    size : float
        Side of a cell [mm].
    cover : float
        A cell counts when at least this share of its 4 x 4 parts holds points.

    Raises
    ------
    StatisticsError
        Size not positive, or no cell is covered.

    Examples
    --------
    >>> ticks = np.arange(0.05, 10, 0.1)
    >>> grid = landmark_grid(np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2), 5.0)
    >>> grid.centres.tolist()
    [[2.5, 2.5], [2.5, 7.5], [7.5, 2.5], [7.5, 7.5]]
    """
    if not (np.isfinite(size) and size > 0):
        raise StatisticsError(f"size must be positive [mm], got {size}")
    flat = np.asarray(points, dtype=np.float64)[:, :2]
    parts = np.unique(np.floor(flat / (size / 4)).astype(np.int64), axis=0)
    cells, counts = np.unique(parts // 4, axis=0, return_counts=True)
    keep = counts >= 16 * cover
    if not keep.any():
        raise StatisticsError(f"no cell of {size:g} mm is covered by the points; use larger cells")
    return LandmarkGrid(cells[keep], float(size), counts[keep] / 16.0)


def _by_cell(cloud: Points, size: float) -> dict[tuple[int, int], Ints]:
    index = np.floor(cloud[:, :2] / size).astype(np.int64)
    cells, inverse = np.unique(index, axis=0, return_inverse=True)
    order = np.argsort(inverse.reshape(-1), kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(inverse.reshape(-1)))[:-1])
    return {(int(i), int(j)): group for (i, j), group in zip(cells, groups, strict=True)}


def _plane_height(cloud: Points, own: Ints | None, centre: Floats, size: float) -> float:
    if own is None or len(own) < 6:
        return np.nan
    u = (cloud[own, :2] - centre) / size
    design = np.column_stack([np.ones(len(own)), u])
    least = np.linalg.svd(design, compute_uv=False)[-1]
    if least < 0.15 * np.sqrt(len(own) / 12.0):  # an even filling has a variance of 1/12 along x and y
        return np.nan
    if np.abs(u.mean(axis=0)).max() > 0.2:  # read at the centre, the plane would be extrapolated
        return np.nan
    return float(_robust_fit(design, cloud[own, 2], np.ones(len(own)))[0])


def _quadratic_height(
    cloud: Points, table: dict[tuple[int, int], Ints], cell: Ints, centre: Floats, size: float
) -> float:
    i, j = int(cell[0]), int(cell[1])
    if (i, j) not in table:
        return np.nan
    near = [table[i + di, j + dj] for di in (-1, 0, 1) for dj in (-1, 0, 1) if (i + di, j + dj) in table]
    around = np.concatenate(near)
    if len(around) < 12:
        return np.nan
    u, v = ((cloud[around, :2] - centre) / size).T
    design = np.column_stack([np.ones(len(u)), u, v, u * u, u * v, v * v])
    kernel = np.exp(-(u * u + v * v) / 0.72)
    if np.linalg.matrix_rank(design * np.sqrt(kernel)[:, None], tol=1e-3 * np.sqrt(len(u))) < 6:
        return np.nan
    return float(_robust_fit(design, cloud[around, 2], kernel)[0])


def _robust_fit(design: Floats, values: Floats, kernel: Floats) -> Floats:
    weights = np.asarray(kernel, dtype=np.float64)
    fit: Floats = np.zeros(design.shape[1])
    for _ in range(6):
        root = np.sqrt(weights)
        fit = np.asarray(np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0])
        rest = values - design @ fit
        scale = 1.4826 * float(np.median(np.abs(rest)))
        if scale <= 1e-12:
            break
        weights = kernel * tukey(rest / (_REACH * scale))
    return fit
