"""Systematic deviations: second-order shapes with a peak-to-valley amplitude in mm.

All round shapes are one formula, the biconic sag (`biconic_sag`), which is stable for huge radii.

References
----------
Zhang et al. 2013, doi:10.1177/0954405412466987, section on systematic deviations, figure 3. ISO 10110-12
(biconic surfaces).
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.optimize import brentq

from cadskin.deviation._parameters import finite, positive
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.base import MM, RAD, DeviationModel
from cadskin.deviation.coordinates import Vector3
from cadskin.deviation.form_model import FormModel, check_frame, placed, scaled
from cadskin.deviation.registry import register
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = [
    "Cone",
    "Cylinder",
    "Ellipsoid",
    "FormModel",
    "Paraboloid",
    "Quadric",
    "Saddle",
    "Sphere",
    "biconic_sag",
    "morph",
]


def biconic_sag(  # the six symbols of the formula
    x: Floats, y: Floats, cx: float, cy: float, kx: float = 0.0, ky: float = 0.0
) -> Floats:
    """Return the height of a biconic surface over its tangent plane.

    z = a / (1 + sqrt(1 - (1 + kx) (cx x)² - (1 + ky) (cy y)²)),  a = cx x² + cy y²; no difference of large
    numbers, so the relative error stays at rounding for any radius 1/c, and c = 0 is the plane.

    Parameters
    ----------
    x, y : (k,) float
        [mm].
    cx, cy : float
        Curvatures at the apex [1/mm].
    kx, ky : float
        Conic constants: -1 paraboloid, 0 sphere (where cx = cy), others ellipsoid and hyperboloid.

    Returns
    -------
    (k,) float
        [mm]; NaN beyond the equator.

    Examples
    --------
    >>> float(biconic_sag(np.array(100.0), np.array(0.0), 1e-6, 1e-6).round(9))
    0.005
    """
    height = cx * x * x + cy * y * y
    under_root = 1.0 - (1.0 + kx) * (cx * x) ** 2 - (1.0 + ky) * (cy * y) ** 2
    root = np.sqrt(np.where(under_root >= 0, under_root, np.nan))
    return np.asarray(height / (1.0 + root))


@register
@dataclass(frozen=True, eq=False, repr=False)
class Paraboloid(FormModel):
    """A paraboloid, z = a (x² + ratio y²) scaled to its peak-to-valley: dished (+) or crowned (-).

    The apex is at zero; with a positive amplitude the border stands out of the material.

    Parameters
    ----------
    amplitude : float
        Peak-to-valley height over the samples of the feature [mm].
    centre : (2,) float
        Apex in the feature's coordinates [mm].
    rotation : float
        Angle of the x axis [rad].
    ratio : float
        Curvature along y over curvature along x: 1 round, 0 a parabolic cylinder, -1 a saddle.

    References
    ----------
    Zhang et al. 2013, doi:10.1177/0954405412466987, section on systematic deviations, figure 3.

    Examples
    --------
    >>> Paraboloid(0.05)
    Paraboloid(amplitude=0.05 mm)
    """

    name: ClassVar[str] = "paraboloid"
    ratio: float = 1.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        super().__post_init__()
        object.__setattr__(self, "ratio", finite(self.ratio, "ratio", "", self))

    def height(self, x: Floats, y: Floats) -> Floats:
        """Return amplitude times the normalised quadratic form."""
        return scaled(x * x + self.ratio * (y * y), self.amplitude)


@register
@dataclass(frozen=True, eq=False, repr=False)
class Saddle(FormModel):
    """A saddle, z = a (x² - y²): up along the first axis, down along the second.

    Examples
    --------
    >>> Saddle(0.02)
    Saddle(amplitude=0.02 mm)
    """

    name: ClassVar[str] = "saddle"

    def height(self, x: Floats, y: Floats) -> Floats:
        """Return amplitude times the normalised quadratic form."""
        return Paraboloid(self.amplitude, ratio=-1.0).height(x, y)


@register
@dataclass(frozen=True, eq=False, repr=False)
class Cone(FormModel):
    """A cone, z = a r, with its apex at the centre.

    Examples
    --------
    >>> Cone(-0.02)
    Cone(amplitude=-0.02 mm)
    """

    name: ClassVar[str] = "cone"

    def height(self, x: Floats, y: Floats) -> Floats:
        """Return amplitude times the normalised radius."""
        return scaled(np.hypot(x, y), self.amplitude)


@dataclass(frozen=True, eq=False, repr=False)
class _RoundForm(FormModel):
    """A biconic form whose curvature follows from its amplitude."""

    @abstractmethod
    def sag(self, x: Floats, y: Floats, curvature: float) -> Floats:
        """Return the height (k,) for a curvature [1/mm] along x."""

    def height(self, x: Floats, y: Floats) -> Floats:
        """Return the sag with the curvature that gives the amplitude."""
        if self.amplitude == 0 or not len(x):
            return np.zeros_like(x)
        curvature = self._curvature(x, y)
        return np.asarray(np.sign(self.amplitude) * self.sag(x, y, curvature))

    def _curvature(self, x: Floats, y: Floats) -> float:
        wanted = float(abs(self.amplitude))
        unit = float(np.ptp(self.sag(x, y, 1e-9 / _reach(x, y)))) * _reach(x, y) / 1e-9
        if unit == 0:
            raise DeviationError(f"{self}: the feature has no extent across the form; turn it by rotation")
        guess = wanted / unit  # flat limit: the height is linear in the curvature

        def excess(curvature: float) -> float:
            return float(np.ptp(self.sag(x, y, curvature))) / wanted - 1.0

        steepest = self._steepest(x, y)
        if guess < 1e-6 * steepest:  # the next term is smaller than rounding
            return float(guess / (1.0 + excess(guess)))
        if not excess(steepest) > 0:
            raise DeviationError(
                f"{self}: the feature is too small for this amplitude, the most is "
                f"{wanted * (1 + excess(steepest)):.4g} mm (a half sphere)"
            )
        return float(
            brentq(excess, 0.1 * guess if guess < steepest else 0.0, steepest, xtol=1e-300, rtol=1e-14)
        )

    def _steepest(self, x: Floats, y: Floats) -> float:
        """Largest curvature that still covers the feature."""
        low, high = 0.0, 1e3 / _reach(x, y)
        for _ in range(80):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if np.isfinite(self.sag(x, y, middle)).all() else (low, middle)
        return low


@register
@dataclass(frozen=True, eq=False, repr=False)
class Sphere(_RoundForm):
    """A spherical cap; dished (+) or crowned (-).

    Examples
    --------
    >>> Sphere(0.05)
    Sphere(amplitude=0.05 mm)
    """

    name: ClassVar[str] = "sphere"

    def sag(self, x: Floats, y: Floats, curvature: float) -> Floats:
        """Return the sag of a sphere."""
        return biconic_sag(np.hypot(x, y), np.zeros_like(y), curvature, 0.0)


@register
@dataclass(frozen=True, eq=False, repr=False)
class Cylinder(_RoundForm):
    """A strip of a cylinder that is curved along x, its axis along y; ``rotation`` turns it.

    Examples
    --------
    >>> Cylinder(0.05, rotation=0.5)
    Cylinder(amplitude=0.05 mm, rotation=0.5 rad)
    """

    name: ClassVar[str] = "cylinder"

    def sag(self, x: Floats, y: Floats, curvature: float) -> Floats:
        """Return the sag of a cylinder."""
        return biconic_sag(x, np.zeros_like(y), curvature, 0.0)


@register
@dataclass(frozen=True, eq=False, repr=False)
class Ellipsoid(_RoundForm):
    """A cap of an ellipsoid with semi-axes R along x, R / sqrt(ratio) along y and R along z.

    Parameters
    ----------
    amplitude, centre, rotation
        As for `FormModel`.
    ratio : float
        Curvature along y over curvature along x, > 0.

    Examples
    --------
    >>> Ellipsoid(0.05, ratio=2.0)
    Ellipsoid(amplitude=0.05 mm, ratio=2)
    """

    name: ClassVar[str] = "ellipsoid"
    ratio: float = 1.0

    def __post_init__(self) -> None:
        """Check the parameters."""
        super().__post_init__()
        object.__setattr__(self, "ratio", positive(self.ratio, "ratio", "", self))

    def sag(self, x: Floats, y: Floats, curvature: float) -> Floats:
        """Return the sag of an ellipsoid: the sphere over stretched coordinates."""
        return biconic_sag(np.hypot(x, np.sqrt(self.ratio) * y), np.zeros_like(y), curvature, 0.0)


@register
@dataclass(frozen=True, eq=False, repr=False)
class Quadric(DeviationModel):
    """A form given by its curvatures: the biconic sag with principal curvatures k1, k2.

    Parameters
    ----------
    k1, k2 : float
        Curvatures along the form's axes [1/mm]; positive bends out of the material.
    angle : float
        Angle of the first axis from the feature's first axis [rad].
    centre : (2,) float
        Apex in the feature's coordinates [mm].
    conic : float
        Conic constant of both directions: -1 paraboloid, 0 sphere or toroid.
    origin, direction : (3,) float, optional
        A frame in space, as for `FormModel`.

    Raises
    ------
    DeviationError
        A parameter is not finite, or the feature reaches beyond the equator of the form.

    Examples
    --------
    >>> Quadric(k1=1e-6, k2=-1e-6)
    Quadric(k1=1e-06 1/mm, k2=-1e-06 1/mm)
    """

    name: ClassVar[str] = "quadric"
    k1: float = field(metadata={"unit": "1/mm"})
    k2: float = field(metadata={"unit": "1/mm"})
    angle: float = field(default=0.0, metadata=RAD)
    centre: tuple[float, float] = field(default=(0.0, 0.0), metadata=MM)
    conic: float = 0.0
    origin: Vector3 | None = field(default=None, metadata=MM, kw_only=True)
    direction: Vector3 | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        """Check the parameters."""
        for key, unit in (("k1", "1/mm"), ("k2", "1/mm"), ("angle", "rad"), ("conic", "")):
            object.__setattr__(self, key, finite(getattr(self, key), key, unit, self))
        check_frame(self)

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Evaluate the sag on every feature."""
        return form_sampler(nominal, features, self._on)

    def _on(self, feature: Feature) -> Floats:
        x, y = placed(feature, self, self.angle)
        sag = biconic_sag(x, y, self.k1, self.k2, self.conic, self.conic)
        if np.isnan(sag).any():
            raise DeviationError(f"{self}: {feature.name} reaches beyond the equator of the form")
        return sag


def morph(start: DeviationModel, end: DeviationModel, share: float) -> DeviationModel:
    """Return the shape between two: (1 - share) start + share end.

    Examples
    --------
    >>> morph(Sphere(0.05), Saddle(0.02), 0.25)
    0.75 * Sphere(amplitude=0.05 mm) + 0.25 * Saddle(amplitude=0.02 mm)
    """
    return (1.0 - share) * start + share * end


def _reach(x: Floats, y: Floats) -> float:
    return max(float(np.hypot(x, y).max()), 1e-300)
