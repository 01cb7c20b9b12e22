"""Gaussian fields on curved surfaces: functions of the Laplace-Beltrami operator, always positive definite.

White noise z is coloured by a = p(W), W = (I + g S)^-1, S the Laplacian between square roots of the mass: one
sparse factor of C + g G serves all kernels. The polynomial p is fitted so that p(1 / (1 + g s)) is the square
root of the kernel's spectral density in the plane,

    squared exponential  exp(-s l² / 4)
    Matern nu            (1 + s l² / (2 nu))^(-(nu + 1) / 2)

For nu = 1, p(w) = w is exact: the field solves (kappa² - Laplace) x = white noise.

References
----------
Lindgren, Rue, Lindström: An explicit link between Gaussian fields and Gaussian Markov random fields, J. R.
Stat. Soc. B 73 (2011), doi:10.1111/j.1467-9868.2011.00777.x.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial import chebyshev
from scipy.sparse import csr_array, dia_array

from cadskin.deviation._cholesky import SparseCholesky
from cadskin.deviation._collar import WIDTH, make_collar
from cadskin.deviation._kriging import coarse_points, kriging_interpolation
from cadskin.deviation._linear import COLUMNS, columns_of, write_columns
from cadskin.deviation._patch_fields import PatchField, SampledPlaces
from cadskin.deviation._probes import probe_groups
from cadskin.deviation.kernels import smoothness
from cadskin.shape.operators import boundary_edges, boundary_mass, cotangent_laplacian, lumped_mass

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints, Points, Triangles
    from cadskin.deviation._collar import Collar

__all__ = ["ROBIN", "SurfaceField", "spectral_polynomial", "surface_operators"]

# Pole g / l² and number of solves; in brackets the error of the correlation in the plane, measured.
_POLES = {
    "squared_exponential": (0.0504, 6),  # 7e-4
    "matern52": (0.1236, 4),  # 5e-4
    "matern32": (0.1352, 4),  # 1.3e-3
    "whittle": (0.5, 1),  # exact
    "exponential": (0.0659, 8),  # 5e-3
}
ROBIN = 0.7  # boundary term, per length, against the doubled variance at free edges (fourfold at corners)
_ALL_PROBES = 8_000  # meshes up to this size have the exact variance at every point
_SAMPLES = 8_192  # for the variance of larger meshes with a varying length
_PROBE_SPACING = 0.25  # of the points where larger meshes have it, in correlation lengths
_BORDER_SPACING = 0.12  # of those on the boundary


def surface_operators(
    points: Points, triangles: Triangles, border: Collar | None, local: Floats
) -> tuple[csr_array, Floats, Floats]:
    """Laplacian with the squared local length, mass, and boundary mass with the local length."""
    even = bool((local == 1.0).all())
    squares = None if even else (local**2)[triangles].mean(axis=1)
    laplacian = cotangent_laplacian(points, triangles, weights=squares)
    mass = lumped_mass(points, triangles)
    if border is None:
        return laplacian, mass, local * boundary_mass(points, triangles)
    everywhere = np.concatenate([local, local[border.origin]])
    beyond = None if even else (everywhere**2)[border.triangles].mean(axis=1)
    more, extra, edge = border.operators(len(everywhere), beyond)
    laplacian.resize(more.shape)
    return csr_array(laplacian + more), extra + np.pad(mass, (0, len(border.origin))), everywhere * edge


def spectral_polynomial(kernel: str) -> tuple[float, Floats]:
    """Return g / l² and the coefficients c of p(w) = w sum_k c_k T_k(2 w - 1), T_k Chebyshev polynomials.

    Least squares in the plane's spectral measure k dk.
    """
    pole, solves = _POLES[kernel]
    k = np.linspace(1e-4, 12.0 if kernel == "squared_exponential" else 60.0, 20_000)
    nu = smoothness(kernel)
    target = np.exp(-(k**2) / 4) if np.isinf(nu) else (1 + k**2 / (2 * nu)) ** (-(nu + 1) / 2)
    w = 1.0 / (1.0 + pole * k**2)
    basis = w[:, None] * chebyshev.chebvander(2 * w - 1, solves - 1)
    weight = np.sqrt(k)
    return pole, np.linalg.lstsq(basis * weight[:, None], target * weight, rcond=None)[0]


class SurfaceField(PatchField):
    """A field along the surface: two sides of a thin wall are far apart, whatever the distance in space.

    Parameters
    ----------
    points : (n, 3) float
        Divided by the correlation length.
    triangles : (m, 3) int
    kernel : str
    stretch : (n,) float, optional
        Local correlation length over the one that ``points`` are divided by: a non-stationary field, whose
        operator is 1 - div(length² grad).
    collar : bool
        False: no unknowns beyond the free edges, so that `precision` is that of the points alone; the
        correlation within one length of a free edge is then off by up to 0.1 (rough) to 0.3 (smooth).

    Notes
    -----
    The marginal variance of the coloured noise is found exactly (as the row norms of the map) at all points
    of a mesh up to 8000 points, else at points a quarter length apart with kriging between (measured: within
    1 % for 99 % of the points at 7 vertices per length, all kernels), and divided out.

    Beyond free edges the operator goes on over a collar two lengths wide, so that edges and corners do not
    show: the correlation of a plane, up to its edges, is within 0.02 to 0.03 of the kernel at 7 vertices per
    length and within 0.012 at 20 (the exponential 0.016). Around concave corners, between points that do not
    see each other, the law is that of the way along the surface.

    With a ``stretch`` and more than 8000 points the variance comes from 8192 fixed samples: the standard
    deviation has a relative error of 0.8 % (one sigma).

    References
    ----------
    Fuglstad, Lindgren, Simpson, Rue: Exploring a new class of non-stationary spatial Gaussian random fields
    with varying local anisotropy, Stat. Sin. 25 (2015), doi:10.5705/ss.2013.106w.
    """

    def __init__(
        self,
        points: Points,
        triangles: Triangles,
        kernel: str,
        stretch: Floats | None = None,
        *,
        collar: bool = True,
    ) -> None:
        pole, self.coefficients = spectral_polynomial(kernel)
        local = np.ones(len(points)) if stretch is None else np.asarray(stretch, dtype=np.float64)
        border = make_collar(points, triangles, WIDTH * local) if collar else None
        laplacian, mass, edge = surface_operators(points, triangles, border, local)
        diagonal = mass + ROBIN * pole * edge
        matrix = (laplacian * pole + dia_array((diagonal[None], [0]), shape=laplacian.shape)).tocsr()
        self.matrix, self.lumped = matrix, mass
        places = points if border is None else border.extended(points, triangles)
        self.places = places
        self.solver = SparseCholesky(matrix, places)
        self.order = self.solver.order
        self.place_of_point = np.argsort(self.order).astype(np.uint32)
        self.mass = mass[self.order].astype(np.float32)[:, None]
        self.latent = len(mass)
        graded = stretch is not None and len(points) > _ALL_PROBES
        variance = self._sampled_variance() if graded else self._variance(places, triangles, len(points))
        variance = variance[: len(points)]
        scale = np.concatenate([1.0 / np.sqrt(variance), np.ones(len(mass) - len(points))])
        self.scale = scale[self.order].astype(np.float32)[:, None]
        uneven = np.sqrt(variance.max() / variance.min())
        self.note = (
            f"surface field with {len(self.coefficients)} solves on {len(points)} points, "
            f"standard deviations before scaling differ by a factor of {uneven:.3g}"
        )

    def write(
        self, noise: NDArray[np.float32], scratch: NDArray[np.float32], places: SampledPlaces, out: Floats
    ) -> None:
        """Colour the noise and write it in the order of the samples."""
        del scratch
        loads = columns_of(noise)
        loads *= np.sqrt(self.mass)
        rows = self.place_of_point[places.points]
        write_columns(self._coloured(loads), rows, places.scale * self.scale[rows, 0], places.samples, out)

    def precision(self) -> csr_array:
        """Return the precision matrix (n, n) of the unit field, for kernel ``whittle``: a sparse matrix."""
        scale = np.zeros(self.latent)
        scale[self.order] = self.scale[:, 0]
        left = self.matrix.multiply(1.0 / scale[:, None]).tocsr()
        return csr_array(left @ left.multiply(1.0 / self.lumped[None, :]).T)

    def _coloured(self, loads: NDArray[np.float32]) -> NDArray[np.float32]:
        """Return p(A) C^-1 of loads (n, COLUMNS) in the order of the factor, in place; A = (C + g G)^-1 C."""
        self.solver.solve_columns(loads)
        previous = loads
        if len(self.coefficients) == 1:
            previous *= np.float32(self.coefficients[0])
            return previous
        total = previous * np.float32(self.coefficients[0])
        current = previous
        for k, coefficient in enumerate(self.coefficients[1:], start=1):
            following = self._smoothed(current)
            following *= np.float32(2.0 if k == 1 else 4.0)
            following -= current if k == 1 else 2 * current + previous
            total += np.float32(coefficient) * following
            previous, current = current, following
        return total

    def _smoothed(self, values: NDArray[np.float32]) -> NDArray[np.float32]:
        result: NDArray[np.float32] = values * self.mass
        self.solver.solve_columns(result)
        return result

    def _variance(self, places: Points, triangles: Triangles, count: int) -> Floats:
        """Variance of the coloured noise at the first ``count`` places, those of the surface (count,)."""
        if count <= _ALL_PROBES:
            return self._row_norms(np.arange(count))
        points = places[:count]
        border = np.unique(boundary_edges(triangles))
        probes = coarse_points(points, _PROBE_SPACING)
        if len(border):
            probes = np.union1d(probes, border[coarse_points(points[border], _BORDER_SPACING)])
        found = np.log(self._local_row_norms(places, probes))
        size = np.log(self.lumped[:count])  # a rough field feels the size of the elements
        features = np.stack([np.ones(count), size - size.mean()], axis=1)
        trend = features @ np.linalg.lstsq(features[probes], found, rcond=None)[0]
        rest = kriging_interpolation(points[probes], found - trend[probes], points)
        return np.asarray(np.exp(trend + rest), dtype=np.float64)

    def _sampled_variance(self) -> Floats:
        """Variance of the coloured noise at every point (n,), from fixed samples."""
        generator = np.random.default_rng(0)
        total = np.zeros(self.latent)
        for _ in range(_SAMPLES // COLUMNS):
            noise = generator.standard_normal((self.latent, COLUMNS), dtype=np.float32)
            coloured = self._coloured((noise * np.sqrt(self.mass)).astype(np.float32))
            total[self.order] += np.einsum("ij,ij->i", coloured, coloured)
        return total / _SAMPLES

    def _row_norms(self, probes: Ints) -> Floats:
        """Variance at some points, exactly: p(W) is symmetric, so a response is a row."""
        places = np.argsort(self.order)[probes]
        norms = np.zeros(len(probes))
        for first in range(0, len(probes), COLUMNS):
            mine = places[first : first + COLUMNS]
            energy = self._response_energy(mine, np.arange(len(mine)))
            norms[first : first + COLUMNS] = energy.sum(axis=0)[: len(mine)]
        return np.asarray(norms / self.mass[places, 0], dtype=np.float64)

    def _local_row_norms(self, points: Points, probes: Ints) -> Floats:
        """Variance at some points; those that are far apart share a solve."""
        places = np.argsort(self.order)[probes]
        groups = probe_groups(points[probes])
        ordered = points[self.order]
        norms = np.zeros(len(probes))
        family = -1
        for first in range(0, groups.count, COLUMNS):
            mine = np.flatnonzero((groups.group >= first) & (groups.group < first + COLUMNS))
            energy = self._response_energy(places[mine], groups.group[mine] - first)
            for group in range(first, min(first + COLUMNS, groups.count)):
                if groups.family[group] != family:
                    family = int(groups.family[group])
                    box_of_probe, box_of_point = groups.boxes(family, ordered)
                sums = np.bincount(box_of_point, weights=energy[:, group - first])
                probes_here = mine[groups.group[mine] == group]
                norms[probes_here] = sums[box_of_probe[probes_here]]
        return np.asarray(norms / self.mass[places, 0], dtype=np.float64)

    def _response_energy(self, places: Ints, columns: Ints) -> Floats:
        """Squared responses (n, COLUMNS), times the mass, to unit noise at places, each in its column."""
        loads = np.zeros((self.latent, COLUMNS), dtype=np.float32)
        loads[places, columns] = np.sqrt(self.mass[places, 0])
        response = self._coloured(loads)
        response *= response
        response *= self.mass
        return response.astype(np.float64)
