"""The squared exponential on a regular grid: a product over the axes, so that all matrices are small.

The field on the grid is exact (one Cholesky factor per axis); a point takes its value from the four nearest
grid planes of each axis by one-dimensional kriging, whose weights multiply as well.

References
----------
Saatci: Scalable inference for structured Gaussian process models, thesis, Cambridge 2011, chapter 5.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._jit import kernel
from cadskin.deviation._lanes import COLUMNS, add_square
from cadskin.deviation._linear import STRIP, columns_of, weighted_sums, write_columns
from cadskin.deviation._patch_fields import PatchField, SampledPlaces, unit_cholesky
from cadskin.deviation.kernels import correlation
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints, Points

__all__ = ["GridField", "grid_cells"]

_STENCIL = 4
SPACING = 0.25  # of the grid, in correlation lengths
MAX_CELLS = 3_000_000


def grid_cells(points: Points) -> int:
    """Return the number of grid nodes around points (n, d) given in correlation lengths."""
    return int(np.prod(_shape(points), dtype=np.float64))


def _shape(points: Points) -> Ints:
    return np.asarray(np.floor(np.ptp(points, axis=0) / SPACING), dtype=np.int64) + _STENCIL


class GridField(PatchField):
    """A squared-exponential field of any number of points in a box of two or three dimensions.

    Parameters
    ----------
    points : (n, d) float
        Divided by the correlation length; d is 2 or 3.

    Attributes
    ----------
    certificate : float
        Largest kriging variance; the values are scaled to unit variance.

    Raises
    ------
    DeviationError
        The grid would have more than `MAX_CELLS` nodes.
    """

    def __init__(self, points: Points) -> None:
        self.shape = tuple(int(count) for count in _shape(points))
        if np.prod(self.shape, dtype=np.float64) > MAX_CELLS:
            raise DeviationError(
                f"a grid of {' x '.join(map(str, self.shape))} nodes is too large for method='grid'; "
                "use method='auto' or a larger length"
            )
        self.factors = [_axis_factor(count) for count in self.shape]
        place = (points - points.min(axis=0)) / SPACING
        cell = np.minimum(np.floor(place).astype(np.int64), np.array(self.shape) - _STENCIL)
        weights, kept = _axis_weights(place - cell)
        self.weights = weights
        strides = np.cumprod([1, *self.shape[:0:-1]])[::-1]
        self.first = (cell @ strides).astype(np.uint32)
        self.strides = strides.astype(np.int64)
        self.latent = int(np.prod(self.shape))
        self.certificate = float((1.0 - kept).max())
        self.note = (
            f"separable grid of {' x '.join(map(str, self.shape))} nodes for {len(points)} points, "
            f"largest kriging variance {self.certificate:.2g}"
        )

    def write(
        self, noise: NDArray[np.float32], scratch: NDArray[np.float32], places: SampledPlaces, out: Floats
    ) -> None:
        """Colour the noise along each axis, then interpolate."""
        del scratch
        values = columns_of(noise)
        for axis, factor in enumerate(self.factors):
            before = int(np.prod(self.shape[:axis]))
            slabs = values.reshape(before, self.shape[axis], -1)
            coloured = np.zeros_like(slabs)
            for slab, target in zip(slabs, coloured, strict=True):
                weighted_sums(factor, slab, True, target)
            values = coloured
        stencil = (self.first, self.strides, self.weights)
        placed = (places.points, places.scale, places.samples)
        _interpolate(values.reshape(self.latent, COLUMNS), *stencil, *placed, out)


def _axis_factor(count: int) -> NDArray[np.float32]:
    distance = SPACING * np.abs(np.subtract.outer(np.arange(count), np.arange(count)))
    factor = unit_cholesky(correlation(distance, 1.0), "the squared exponential on a line")
    return np.ascontiguousarray(factor, dtype=np.float32)


def _axis_weights(place: Floats) -> tuple[NDArray[np.float32], Floats]:
    """Unit-variance kriging weights (n, d, 4) on the stencil, and the variance share kept (n,).

    ``place`` (n, d) is the position in cells from the first node of the stencil: the two middle nodes are 1
    and 2, positions from 0 to 3.
    """
    nodes = np.arange(_STENCIL)
    matrix = correlation(SPACING * np.abs(np.subtract.outer(nodes, nodes)), 1.0)
    cross = correlation(SPACING * np.abs(place[..., None] - nodes), 1.0)
    weights = cross @ np.linalg.inv(matrix)
    kept = np.einsum("nda,nda->nd", weights, cross)
    return (weights / np.sqrt(kept)[..., None]).astype(np.float32), kept.prod(axis=1)


@kernel
def _interpolate(
    values: Any,
    first: Any,
    strides: Any,
    weights: Any,
    places: Any,
    scale: Any,
    samples: Any,
    out: Any,
) -> None:
    """out[r, samples[s]] = scale[s] sum of axis weights times values[node, r], the stencil of places[s]."""
    strip = np.zeros((STRIP, COLUMNS), dtype=np.float32)
    lines = np.arange(STRIP).astype(np.uint32)
    d = strides.size
    one, none = np.float32(1.0), np.float32(0.0)
    for begin in range(0, places.size, STRIP):
        end = min(begin + STRIP, places.size)
        for s in range(begin, end):
            i = places[s]
            add_square(
                values,
                first[i],
                strides[d - 2],
                weights,
                i,
                weights[i, 0, 0] if d == 3 else one,
                none,
                strip,
                s - begin,
            )
            for a in range(1, _STENCIL if d == 3 else 1):
                node = first[i] + a * strides[0]
                add_square(values, node, strides[d - 2], weights, i, weights[i, 0, a], one, strip, s - begin)
        write_columns(strip, lines[: end - begin], scale[begin:end], samples[begin:end], out)
