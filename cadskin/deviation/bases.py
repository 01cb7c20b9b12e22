"""Metrology bases: named orthonormal functions on the coordinates of a face.

Every function has mean square one over its domain, so that a coefficient is a root mean square in mm;
Chebyshev polynomials have it with the weight 1 / sqrt(1 - x²) of their orthogonality. Index pairs (i, j):

=================  ======================  =================================================================
basis              domain                  function
=================  ======================  =================================================================
legendre           rectangle               P_i(x) P_j(y)
chebyshev          rectangle               T_i(x) T_j(y)
dct                rectangle               cos(i pi x) cos(j pi y)
fourier_legendre   cylinder, cone, torus   i-th harmonic around (i < 0: sine) times P_j along the axis
fourier_chebyshev  the same                i-th harmonic around times T_j along the axis
zernike            disc                    radial degree i, azimuthal order j (j < 0: sine)
spherical          sphere                  degree i, order j (j < 0: sine)
=================  ======================  =================================================================

The axis of a torus is that of its tube, the second coordinate of the face. On a cylinder (0, 0) is size,
(0, 1) taper, (0, 2) barrel, (+-1, 0) offset, (+-1, 1) tilt, (+-1, 2) bend, (n, 0) an n-lobed form.

On a face that closes around, functions of the rectangle jump where its coordinates are cut; those of the
cylinder do not.

References
----------
Noll: Zernike polynomials and atmospheric turbulence, J. Opt. Soc. Am. 66 (1976), doi:10.1364/JOSA.66.000207;
Henke, Summerhays, Baldwin, Cassou, Brown: Methods for evaluation of systematic geometric deviations in
machined parts and their relationships to process variables, Precis. Eng. 23 (1999) 273-292 (Fourier x
Chebyshev and Fourier x Legendre on cylinders).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.polynomial import chebyshev, legendre
from scipy.special import eval_jacobi, gammaln, lpmv

from cadskin.deviation._parameters import choice, finite
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.coordinates import around, surface_coordinates
from cadskin.deviation.registry import register
from cadskin.errors import DeviationError
from cadskin.shape.ideal import Cone, Cylinder, Sphere, Torus

if TYPE_CHECKING:
    from cadskin._typing import Floats, Vectors
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = [
    "BASES",
    "BasisForm",
    "chebyshev_2d",
    "dct",
    "fourier_chebyshev",
    "fourier_legendre",
    "legendre_2d",
    "spherical",
    "zernike",
]


def legendre_2d(x: Floats, y: Floats, i: int, j: int) -> Floats:
    """Return P_i(x) P_j(y) with mean square one over -1 <= x, y <= 1."""
    return _legendre(x, i) * _legendre(y, j)


def chebyshev_2d(x: Floats, y: Floats, i: int, j: int) -> Floats:
    """Return T_i(x) T_j(y), mean square one with the weight 1 / sqrt((1 - x²) (1 - y²))."""
    return _chebyshev(x, i) * _chebyshev(y, j)


def dct(x: Floats, y: Floats, i: int, j: int) -> Floats:
    """Return cosines with mean square one over -1 <= x, y <= 1."""
    return _cosine(x, i) * _cosine(y, j)


def fourier_legendre(angle: Floats, z: Floats, i: int, j: int) -> Floats:
    """Return harmonic i of the angle [rad] times P_j(z), -1 <= z <= 1, mean square one over a full turn."""
    return _harmonic(angle, i) * _legendre(z, j)


def fourier_chebyshev(angle: Floats, z: Floats, i: int, j: int) -> Floats:
    """Return harmonic i of the angle [rad] times T_j(z), mean square one with the weight 1 / sqrt(1 - z²)."""
    return _harmonic(angle, i) * _chebyshev(z, j)


def zernike(radius: Floats, angle: Floats, i: int, j: int) -> Floats:
    """Return the Zernike polynomial of degree i and order j, mean square one over the disc radius <= 1.

    Raises
    ------
    DeviationError
        |j| > i, or i - j is odd.

    Examples
    --------
    >>> zernike(np.array([0.0, 1.0]), np.zeros(2), 2, 0).round(6).tolist()
    [-1.732051, 1.732051]
    """
    order = abs(j)
    if order > i or (i - order) % 2:
        raise DeviationError(f"there is no Zernike polynomial of degree {i} and order {j}")
    radial = radius**order * eval_jacobi((i - order) // 2, 0, order, 2 * radius**2 - 1)
    return np.asarray(np.sqrt(i + 1.0) * radial * _harmonic(angle, j))


def spherical(directions: Vectors, i: int, j: int) -> Floats:
    """Return the real spherical harmonic of degree i, order j at unit directions (k, 3), mean square one."""
    if abs(j) > i:
        raise DeviationError(f"there is no spherical harmonic of degree {i} and order {j}")
    turn = np.arctan2(directions[:, 1], directions[:, 0])
    scale = np.sqrt((2 * i + 1) * np.exp(gammaln(i - abs(j) + 1) - gammaln(i + abs(j) + 1)))
    return np.asarray(scale * lpmv(abs(j), i, np.clip(directions[:, 2], -1, 1)) * _harmonic(turn, j))


def _degree(i: int, of: str) -> None:
    if i < 0:
        raise DeviationError(f"there is no {of} of degree {i}; degrees are 0 or more")


def _legendre(x: Floats, i: int) -> Floats:
    _degree(i, "Legendre polynomial")
    return np.asarray(np.sqrt(2 * i + 1) * legendre.legval(x, [0] * i + [1]))


def _chebyshev(x: Floats, i: int) -> Floats:
    _degree(i, "Chebyshev polynomial")
    return np.asarray((np.sqrt(2.0) if i else 1.0) * chebyshev.chebval(x, [0] * i + [1]))


def _cosine(x: Floats, i: int) -> Floats:
    _degree(i, "cosine")
    return np.asarray((np.sqrt(2.0) if i else 1.0) * np.cos(i * np.pi * (x + 1) / 2))


def _harmonic(angle: Floats, i: int) -> Floats:
    if i == 0:
        return np.ones_like(angle)
    return np.asarray(np.sqrt(2.0) * (np.cos(i * angle) if i > 0 else np.sin(-i * angle)))


_ON_RECTANGLES = {"legendre": legendre_2d, "chebyshev": chebyshev_2d, "dct": dct}
_AROUND = {"fourier_legendre": fourier_legendre, "fourier_chebyshev": fourier_chebyshev}
BASES = (*_ON_RECTANGLES, *_AROUND, "zernike", "spherical")


@register
@dataclass(frozen=True, eq=False, repr=False)
class BasisForm(DeviationModel):
    """A systematic form as coefficients of a metrology basis.

    Parameters
    ----------
    basis : str
        One of those of the table of this module.
    coefficients : dict of str to float
        ``{"i,j": root mean square in mm}``.

    Raises
    ------
    DeviationError
        An unknown basis or index; or a feature the basis is not made for.

    Examples
    --------
    A hole with three lobes of 2 µm root mean square and a taper:

    >>> BasisForm("fourier_legendre", {"3,0": 0.002, "0,1": 0.001})
    BasisForm(basis='fourier_legendre', coefficients={'3,0': 0.002, '0,1': 0.001} mm)
    """

    name: ClassVar[str] = "basis"
    basis: str
    coefficients: Mapping[str, Any] = field(metadata=MM)

    def __post_init__(self) -> None:
        """Check the indices."""
        choice(self.basis, BASES, "basis", self)
        if not isinstance(self.coefficients, Mapping) or not self.coefficients:
            raise DeviationError(
                f"BasisForm: coefficients must be a table of one or more, got {self.coefficients!r}"
            )
        checked = {}
        for key, value in self.coefficients.items():
            _indices(key)
            checked[key] = number_or_share(value, "coefficients", self, finite)
        object.__setattr__(self, "coefficients", checked)

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Sum the functions on every feature."""
        needs_numbers(self)
        return form_sampler(nominal, features, self._on)

    def _on(self, feature: Feature) -> Floats:
        values = np.zeros(feature.n_points)
        for key, value in self.coefficients.items():
            values += value * self.function(feature, *_indices(key))
        return values

    def function(self, feature: Feature, i: int, j: int) -> Floats:
        """Return the function (i, j) at the samples of a feature (k,)."""
        ideal = feature.ideal
        if self.basis == "spherical":
            if not isinstance(ideal, Sphere):
                raise DeviationError(
                    f"BasisForm: {feature.name} is no sphere; restrict with .on(kind='sphere')"
                )
            return spherical((feature.points - ideal.centre) / ideal.radius, i, j)
        coordinates = surface_coordinates(feature)
        if self.basis in _AROUND:
            if not isinstance(ideal, (Cylinder, Cone, Torus)):
                raise DeviationError(
                    f"BasisForm: {feature.name} is no cylinder, cone or torus; restrict with "
                    ".on(kind='cylinder')"
                )
            turn = around(feature, coordinates[:, 0])
            return _AROUND[self.basis](turn, _scaled(coordinates[:, 1]), i, j)
        if self.basis == "zernike":
            radius = np.hypot(*coordinates.T)
            return zernike(radius / radius.max(), np.arctan2(coordinates[:, 1], coordinates[:, 0]), i, j)
        return _ON_RECTANGLES[self.basis](_scaled(coordinates[:, 0]), _scaled(coordinates[:, 1]), i, j)


def _scaled(values: Floats) -> Floats:
    """Scale to -1 .. 1."""
    low, high = values.min(), values.max()
    return np.asarray((2 * values - low - high) / (high - low)) if high > low else np.zeros_like(values)


def _indices(key: str) -> tuple[int, int]:
    try:
        i, j = (int(part) for part in str(key).split(","))
    except ValueError as error:
        raise DeviationError(f"BasisForm: a coefficient is named 'i,j', got {key!r}") from error
    return i, j
