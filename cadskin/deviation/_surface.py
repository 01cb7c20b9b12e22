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
from cadskin.deviation._elements import surface_elements, surface_operators
from cadskin.deviation._kriging import coarse_points, kriging_interpolation
from cadskin.deviation._linear import COLUMNS, columns_of, write_columns
from cadskin.deviation._patch_fields import PatchField, SampledPlaces
from cadskin.deviation._probes import probe_groups
from cadskin.deviation.kernels import smoothness
from cadskin.shape.operators import boundary_edges, lumped_mass

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints, Points, Triangles, Vectors

__all__ = ["ROBIN", "SurfaceField", "spectral_polynomial", "surface_operators"]

# Pole g / l², number of solves, wave number times l that the fit goes to, weight of the longest waves; in
# brackets the largest error of the correlation in the plane and on spheres of radius l and 2 l, measured.
_POLES = {
    "squared_exponential": (0.0641, 7, 12.0, 0.3),  # 3e-4
    "matern52": (0.1194, 6, 60.0, 3.0),  # 1.3e-4
    "matern32": (0.1467, 4, 200.0, 0.0),  # 1.3e-3
    "whittle": (0.5, 1, 60.0, 0.0),  # exact
    "exponential": (0.0691, 12, 150.0, 3.0),  # 4e-3
}
_DAMPING = 0.002  # of waves near the spacing, which quadratic elements exaggerate; in squared spacings
ROBIN = 0.7  # boundary term, per length, against the doubled variance at free edges (fourfold at corners)
_WORK = 800_000_000  # points x unknowns x solves up to which the variance is exact at every point
_GRADED_WORK = 2_000_000_000  # the same with a varying length
_SAMPLES = 8_192  # for the variance of larger meshes with a varying length
# Spacing of the points where larger meshes have it, in correlation lengths; half of it on the boundary.
_PROBE_SPACING = {
    "squared_exponential": 0.5,
    "matern52": 0.5,
    "matern32": 0.35,
    "whittle": 0.25,
    "exponential": 0.25,
}


def spectral_polynomial(kernel: str, damping: float = 0.0) -> tuple[float, Floats]:
    """Return g / l² and the coefficients c of p(w) = w sum_k c_k T_k(2 w - 1), T_k Chebyshev polynomials.

    Least squares in the plane's spectral measure k dk, with more weight on long waves, which small closed
    surfaces consist of. With a ``damping`` the density is that of (1 + damping k²)^-2 times the kernel's.
    """
    pole, solves, end, low = _POLES[kernel]
    k = np.linspace(1e-4, end, 20_000)
    nu = smoothness(kernel)
    target = np.exp(-(k**2) / 4) if np.isinf(nu) else (1 + k**2 / (2 * nu)) ** (-(nu + 1) / 2)
    w = 1.0 / (1.0 + pole * k**2)
    target /= 1.0 + damping * k**2
    basis = w[:, None] * chebyshev.chebvander(2 * w - 1, solves - 1)
    weight = np.sqrt(k + low / (1.0 + k**2))
    found = np.linalg.lstsq(basis * weight[:, None], target * weight, rcond=None)[0]
    return pole, np.asarray(found, dtype=np.float64)


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
    normals : (n, 3) float, optional
        Of the surface; without them it is that of the facets.
    collar : bool
        False: no unknowns beyond the free edges, so that `precision` is that of the points alone; the
        correlation within one length of a free edge is then off by up to 0.1 (rough) to 0.3 (smooth).

    Notes
    -----
    The marginal variance of the coloured noise is found exactly (as the row norms of the map) at all points
    where points times unknowns times solves are few, else at points a quarter to half a length apart with
    kriging between, and divided out.

    Beyond free edges the operator goes on over a collar two lengths wide, so that edges and corners do not
    show: the correlation of a plane, up to its edges, is within 1e-3 of the kernel for the squared
    exponential, 1.3e-3 for the Matern 5/2, and 1e-2 for rough kernels, from four vertices per length on.
    Around concave corners, between points that do not see each other, the law is that of the way along the
    surface.

    With a ``stretch`` and many points the variance comes from 8192 fixed samples: the standard
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
        normals: Vectors | None = None,
        collar: bool = True,
    ) -> None:
        local = np.ones(len(points)) if stretch is None else np.asarray(stretch, dtype=np.float64)
        parts = surface_elements(points, triangles, kernel, local, normals=normals, collar=collar)
        damping = _DAMPING * parts.spacing**2 if kernel == "exponential" else 0.0
        pole, self.coefficients = spectral_polynomial(kernel, damping)
        mass = csr_array(parts.factor @ parts.factor.T)
        robin = dia_array((ROBIN * pole * parts.edge[None], [0]), shape=mass.shape)
        self.matrix = csr_array(mass + pole * parts.laplacian + robin)
        self.places, self.lumped = parts.places, mass.diagonal()
        self.solver = SparseCholesky(self.matrix, self.places)
        self.order = self.solver.order
        self.place_of_point = np.argsort(self.order).astype(np.uint32)
        self.mass = csr_array(mass[self.order][:, self.order], dtype=np.float32)
        self.loads = _ordered(parts.factor, self.order)
        self.latent = self.loads.shape[1]
        variance = self._variance(points, triangles, kernel, graded=stretch is not None)
        self.scale = 1.0 / np.sqrt(variance)
        uneven = np.sqrt(variance.max() / variance.min())
        self.note = (
            f"surface field with {len(self.coefficients)} solves on {len(points)} points, {parts.note}, "
            f"{len(self.order)} unknowns, "
            f"standard deviations before scaling differ by a factor of {uneven:.4g}"
        )

    def write(
        self, noise: NDArray[np.float32], scratch: NDArray[np.float32], places: SampledPlaces, out: Floats
    ) -> None:
        """Colour the noise and write it in the order of the samples."""
        del scratch
        loads = self.loads @ columns_of(noise)
        rows = self.place_of_point[places.points]
        write_columns(
            self._coloured(loads), rows, places.scale * self.scale[places.points], places.samples, out
        )

    def precision(self) -> csr_array:
        """Return the precision matrix (n, n) of the unit field, for kernel ``whittle`` without a collar."""
        left = self.matrix.multiply(1.0 / self.scale[:, None]).tocsr()
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
        result: NDArray[np.float32] = self.mass @ values
        self.solver.solve_columns(result)
        return result

    def _variance(self, points: Points, triangles: Triangles, kernel: str, *, graded: bool) -> Floats:
        """Variance of the coloured noise at the points (n,)."""
        count = len(points)
        work = count * len(self.order) * len(self.coefficients)
        if work <= (_GRADED_WORK if graded else _WORK):
            return self._row_norms(np.arange(count))
        if graded:
            return self._sampled_variance(count)
        probes = coarse_points(points, _PROBE_SPACING[kernel])
        border = np.unique(boundary_edges(triangles))
        if len(border):
            probes = np.union1d(probes, border[coarse_points(points[border], 0.5 * _PROBE_SPACING[kernel])])
        found = np.log(self._local_row_norms(probes))
        # A rough field feels the size and shape of the elements.
        area, stiffness = np.log(lumped_mass(points, triangles)), np.log(self.matrix.diagonal()[:count])
        features = np.stack([np.ones(count), area - area.mean(), stiffness - stiffness.mean()], axis=1)
        trend = features @ np.linalg.lstsq(features[probes], found, rcond=None)[0]
        rest = kriging_interpolation(points[probes], found - trend[probes], points)
        return np.asarray(np.exp(trend + rest), dtype=np.float64)

    def _sampled_variance(self, count: int) -> Floats:
        """Variance of the coloured noise at the points (count,), from fixed samples."""
        generator = np.random.default_rng(0)
        total = np.zeros(len(self.order))
        for _ in range(_SAMPLES // COLUMNS):
            noise = generator.standard_normal((self.latent, COLUMNS), dtype=np.float32)
            coloured = self._coloured(self.loads @ noise)
            total[self.order] += np.einsum("ij,ij->i", coloured, coloured)
        return total[:count] / _SAMPLES

    def _row_norms(self, probes: Ints) -> Floats:
        """Variance at some points, exactly: p(A) C^-1 is symmetric, so a response is a row."""
        places = self.place_of_point[probes].astype(np.int64)
        norms = np.zeros(len(probes))
        for first in range(0, len(probes), COLUMNS):
            mine = places[first : first + COLUMNS]
            energy = self._response_energy(mine, np.arange(len(mine)))
            norms[first : first + COLUMNS] = energy.sum(axis=0)[: len(mine)]
        return norms

    def _local_row_norms(self, probes: Ints) -> Floats:
        """Variance at some points; those that are far apart share a solve."""
        places = self.place_of_point[probes].astype(np.int64)
        groups = probe_groups(self.places[probes])
        ordered = self.places[self.order]
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
        return norms

    def _response_energy(self, places: Ints, columns: Ints) -> Floats:
        """Squared responses (n, COLUMNS), times the mass, to unit loads at places, each in its column."""
        loads = np.zeros((len(self.order), COLUMNS), dtype=np.float32)
        loads[places, columns] = 1.0
        response = self._coloured(loads)
        energy: Floats = (response * (self.mass @ response)).astype(np.float64)
        return energy


def _ordered(factor: csr_array, order: Ints) -> csr_array:
    """Return the factor with its rows in ``order``, its columns in that of their first row."""
    rows = csr_array(factor[order], dtype=np.float32)
    first = np.full(rows.shape[1], rows.shape[0])
    np.minimum.at(first, rows.indices, np.repeat(np.arange(rows.shape[0]), np.diff(rows.indptr)))
    return csr_array(rows[:, np.argsort(first, kind="stable")])
