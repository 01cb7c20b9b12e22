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

from cadskin._jit import fast_kernel
from cadskin.deviation._linear import COLUMNS, STRIP, columns_of, weighted_sums
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
        self.offsets = _offsets(strides)
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
        stencil = (self.first, self.offsets, self.weights)
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


def _offsets(strides: Ints) -> NDArray[np.uint32]:
    """Node offsets of the stencil, the last axis running fastest."""
    grid = np.meshgrid(*[stride * np.arange(_STENCIL) for stride in strides], indexing="ij")
    return np.asarray(sum(grid), dtype=np.uint32).ravel()


@fast_kernel
def _interpolate(
    values: Any,
    first: Any,
    offsets: Any,
    weights: Any,
    places: Any,
    scale: Any,
    samples: Any,
    out: Any,
) -> None:
    """out[r, samples[s]] = scale[s] sum of axis weights times values[node, r], the stencil of places[s]."""
    _, d, stencil = weights.shape
    strip = np.zeros((STRIP, COLUMNS), dtype=np.float32)
    outer = offsets.size // (stencil * stencil)
    for begin in range(0, places.size, STRIP):
        end = min(begin + STRIP, places.size)
        for s in range(begin, end):
            i = places[s]
            row = strip[s - begin]
            for r in range(COLUMNS):
                row[r] = 0.0
            for a in range(outer):
                wa = weights[i, 0, a] if d == 3 else np.float32(1.0)
                for b in range(0, stencil, 2):  # two lines of four neighbours
                    u, v = wa * weights[i, d - 2, b], wa * weights[i, d - 2, b + 1]
                    w0, w1 = weights[i, d - 1, 0], weights[i, d - 1, 1]
                    w2, w3 = weights[i, d - 1, 2], weights[i, d - 1, 3]
                    j = first[i] + offsets[(a * stencil + b) * stencil]
                    k = first[i] + offsets[(a * stencil + b + 1) * stencil]
                    for r in range(COLUMNS):
                        row[r] += (
                            w0 * (u * values[j, r] + v * values[k, r])
                            + w1 * (u * values[j + 1, r] + v * values[k + 1, r])
                            + w2 * (u * values[j + 2, r] + v * values[k + 2, r])
                            + w3 * (u * values[j + 3, r] + v * values[k + 3, r])
                        )
        for r in range(out.shape[0]):
            for s in range(begin, end):
                out[r, samples[s]] = scale[s] * strip[s - begin, r]
