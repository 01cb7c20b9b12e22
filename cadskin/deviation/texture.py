"""Waviness and roughness: periodic marks, profiles from a spectrum, self-affine (fractal) surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._linear import NodewiseSampler, weighted_sums
from cadskin.deviation._parameters import array_of, finite, positive, whole
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.algebra import SumModel
from cadskin.deviation.base import MM, RAD, DeviationModel
from cadskin.deviation.coordinates import around, surface_coordinates
from cadskin.deviation.field import GaussianField
from cadskin.deviation.form_model import scaled
from cadskin.deviation.registry import register
from cadskin.errors import DeviationError
from cadskin.shape.ideal import Cone, Cylinder, Sphere, Torus
from cadskin.shape.patches import smooth_patches

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Floats, Ints
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["Fractal", "FromSpectrum", "Lobing", "Waviness"]


def _along(feature: Feature, angle: float) -> Floats:
    """Position (k,) [mm] along a direction of the surface coordinates."""
    x, y = surface_coordinates(feature).T
    return np.asarray(np.cos(angle) * x + np.sin(angle) * y)


@register
@dataclass(frozen=True, eq=False, repr=False)
class Waviness(DeviationModel):
    """Regular marks: a sine along one direction of the surface coordinates (feed marks).

    Around a whole cylinder marks close if the wavelength divides the circumference; else they jump where its
    coordinates are cut.

    Parameters
    ----------
    amplitude : float
        Peak-to-valley height [mm].
    wavelength : float
        [mm], > 0.
    angle : float
        Direction across the marks, from the first surface coordinate [rad].
    phase : float
        [rad].
    """

    name: ClassVar[str] = "waviness"
    amplitude: Any = field(metadata=MM)
    wavelength: float = field(metadata=MM)
    angle: float = field(default=0.0, metadata=RAD)
    phase: float = field(default=0.0, metadata=RAD)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "amplitude", number_or_share(self.amplitude, "amplitude", self, finite))
        object.__setattr__(self, "wavelength", positive(self.wavelength, "wavelength", "mm", self))
        for key in ("angle", "phase"):
            object.__setattr__(self, key, finite(getattr(self, key), key, "rad", self))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Evaluate on every feature."""
        needs_numbers(self)
        return form_sampler(nominal, features, self._on)

    def _on(self, feature: Feature) -> Floats:
        turns = _along(feature, self.angle) / self.wavelength
        return np.asarray(0.5 * self.amplitude * np.sin(2 * np.pi * turns + self.phase))


@register
@dataclass(frozen=True, eq=False, repr=False)
class Lobing(DeviationModel):
    """A form with n lobes around; drilled holes tend to three.

    On a cylinder, cone or torus d = a/2 cos(n theta) around its axis. Scaled to the amplitude: on a sphere
    sin(phi)^n cos(n theta) around the mean normal (the sectoral harmonic); on other faces r^n cos(n theta)
    around the centroid (Zernike's polynomial of degree and order n).

    Parameters
    ----------
    amplitude : float
        Peak-to-valley height [mm].
    lobes : int
        > 0.
    """

    name: ClassVar[str] = "lobing"
    amplitude: Any = field(metadata=MM)
    lobes: int = 3

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "amplitude", number_or_share(self.amplitude, "amplitude", self, finite))
        object.__setattr__(self, "lobes", whole(self.lobes, "lobes", 1, self))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Evaluate the harmonic on every feature."""
        needs_numbers(self)
        return form_sampler(nominal, features, self._on)

    def _on(self, feature: Feature) -> Floats:
        ideal, (x, y) = feature.ideal, surface_coordinates(feature).T
        if isinstance(ideal, (Cylinder, Cone, Torus)):
            return np.asarray(0.5 * self.amplitude * np.cos(self.lobes * around(feature, x)))
        radius = np.hypot(x, y)
        reach = (
            np.sin(radius / ideal.radius) if isinstance(ideal, Sphere) else radius / max(radius.max(), 1e-300)
        )
        return scaled(reach**self.lobes * np.cos(self.lobes * np.arctan2(y, x)), self.amplitude)


@register
@dataclass(frozen=True, eq=False, repr=False)
class FromSpectrum(DeviationModel):
    """A random profile with a given power spectral density, along one direction of the surface coordinates.

    z(s) = sum_k sqrt(S_k df_k) (a_k cos 2 pi f_k s + b_k sin 2 pi f_k s), a and b standard normal; each
    feature has its own profile; where features meet tangentially a point has the mean. With equal steps df
    the profile repeats after 1 / df. `self_affine` makes the spectrum of a rough profile from its Hurst
    exponent.

    Parameters
    ----------
    frequencies : (m,) float
        Spatial frequencies [1/mm], increasing, > 0; at least two.
    psd : (m,) float
        One-sided power spectral density [mm³], 0 or more; the variance is its integral (trapezoidal).
    angle : float
        Direction across the lay, from the first surface coordinate [rad].

    References
    ----------
    Shinozuka, Deodatis: Simulation of stochastic processes by spectral representation, Appl. Mech. Rev. 44
    (1991), doi:10.1115/1.3119501; ISO 25178-2 (power spectral density).
    """

    name: ClassVar[str] = "spectrum"
    frequencies: Floats = field(metadata={"unit": "1/mm"})
    psd: Floats = field(metadata={"unit": "mm³"})
    angle: float = field(default=0.0, metadata=RAD)

    def __post_init__(self) -> None:
        """Check the spectrum."""
        frequencies = array_of(self.frequencies, (None,), "frequencies", self)
        if len(frequencies) < 2 or frequencies[0] <= 0 or (np.diff(frequencies) <= 0).any():
            raise DeviationError("FromSpectrum: frequencies must be positive and increasing, two or more")
        psd = array_of(self.psd, (len(frequencies),), "psd", self)
        if (psd < 0).any() or not psd.any():
            raise DeviationError("FromSpectrum: psd must be 0 or more, and more than 0 somewhere")
        object.__setattr__(self, "frequencies", frequencies)
        object.__setattr__(self, "psd", psd)
        object.__setattr__(self, "angle", finite(self.angle, "angle", "rad", self))

    @classmethod
    def self_affine(  # one spectrum has these six numbers
        cls,
        sigma: float,
        hurst: float,
        *,
        longest: float,
        shortest: float,
        angle: float = 0.0,
        count: int = 256,
    ) -> FromSpectrum:
        """Return a self-affine profile: psd ~ f^-(1 + 2 H) between two wavelengths.

        Its structure function E (z(s + d) - z(s))² grows like d^(2 H) between the two lengths.

        Parameters
        ----------
        sigma : float
            Standard deviation of the profile [mm], > 0.
        hurst : float
            Hurst exponent H, over 0 and below 1; small is rough.
        longest, shortest : float
            Wavelengths at the ends of the spectrum [mm].
        angle : float
            As for the class [rad].
        count : int
            Number of frequencies, in equal ratios.

        Raises
        ------
        DeviationError
            A parameter out of its range.

        References
        ----------
        Jacobs, Junge, Pastewka: Quantitative characterization of surface topography using spectral
        analysis, Surf. Topogr.: Metrol. Prop. 5 (2017) 013001, doi:10.1088/2051-672X/aa51f8 (spectrum of
        self-affine profiles).

        Examples
        --------
        >>> round(FromSpectrum.self_affine(0.002, 0.8, longest=20, shortest=0.5).variance * 1e6, 9)
        4.0
        """
        deviation = positive(sigma, "sigma", "mm", cls.__name__)
        low, high = (
            positive(v, k, "mm", cls.__name__) for k, v in (("shortest", shortest), ("longest", longest))
        )
        if not 0 < finite(hurst, "hurst", "", cls.__name__) < 1 or not low < high or int(count) < 2:
            raise DeviationError(
                f"FromSpectrum.self_affine: hurst must be over 0 and below 1, shortest below longest and "
                f"count 2 or more, got {hurst}, {shortest} mm, {longest} mm and {count}"
            )
        frequencies = np.geomspace(1.0 / high, 1.0 / low, int(count))
        shape = frequencies ** -(1.0 + 2.0 * hurst)
        return cls(frequencies, shape * (deviation**2 / (shape * _widths(frequencies)).sum()), angle)

    @property
    def variance(self) -> float:
        """Variance of the profile [mm²]."""
        return float((self.psd * _widths(self.frequencies)).sum())

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Tabulate the waves on every feature."""
        chosen = tuple(nominal.features if features is None else features)
        waves = np.sqrt(self.psd * _widths(self.frequencies))[:, None]
        node_of_sample = smooth_patches(nominal).node_of_sample
        nodes = [node_of_sample[feature.rows] for feature in chosen]
        sharing = np.bincount(np.concatenate(nodes), minlength=int(node_of_sample.max(initial=-1)) + 1)
        blocks = []
        for feature, own in zip(chosen, nodes, strict=True):
            phase = 2 * np.pi * self.frequencies[:, None] * _along(feature, self.angle)
            block = np.concatenate([waves * np.cos(phase), waves * np.sin(phase)]) / sharing[own]
            blocks.append(block.astype(np.float32))
        return _ProfileSampler(node_of_sample, nodes, blocks)


def _widths(frequencies: Floats) -> Floats:
    """Trapezoidal weights."""
    steps = np.diff(frequencies)
    return np.asarray(0.5 * (np.append(steps, 0.0) + np.insert(steps, 0, 0.0)))


class _ProfileSampler(NodewiseSampler):
    """Own waves on each feature; nodes of several features take the mean."""

    def __init__(
        self, node_of_sample: Ints, nodes: Sequence[Ints], blocks: Sequence[NDArray[np.float32]]
    ) -> None:
        latent = sum(len(block) for block in blocks)
        n_nodes = int(node_of_sample.max(initial=-1)) + 1
        super().__init__(node_of_sample, np.ones(len(node_of_sample)), latent, n_nodes)
        self.nodes, self.blocks = tuple(nodes), tuple(blocks)

    def colour(self, noise: NDArray[np.float32], scratch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Multiply each feature's noise by its waves."""
        scratch[:] = 0.0
        start = 0
        for nodes, block in zip(self.nodes, self.blocks, strict=True):
            own = np.zeros((len(scratch), len(nodes)), dtype=np.float32)
            weighted_sums(noise[:, start : start + len(block)], block, False, own)
            scratch[:, nodes] += own
            start += len(block)
        return scratch


@register
@dataclass(frozen=True, eq=False, repr=False)
class Fractal(DeviationModel):
    """A self-affine surface between two lengths: a sum of Gaussian fields, an octave apart, sigma_k ~ l_k^H.

    Its structure function grows like d^(2 H) between the two lengths; within a factor of three from the ends
    it is steeper (short) and flatter (long). Of octaves of one smooth kernel the exponent is met within 0.2.

    Parameters
    ----------
    sigma : float
        Standard deviation of the whole [mm], > 0.
    hurst : float
        Hurst exponent H, over 0 and below 1; small is rough.
    longest, shortest : float
        Correlation lengths of the first and last octave [mm].

    References
    ----------
    Mandelbrot, Van Ness: Fractional Brownian motions, fractional noises and applications, SIAM Rev. 10
    (1968), doi:10.1137/1010093.

    Examples
    --------
    >>> len(Fractal(0.01, 0.7, longest=40, shortest=5).octaves().terms)
    4
    """

    name: ClassVar[str] = "fractal"
    sigma: Any = field(metadata=MM)
    hurst: float
    longest: float = field(metadata=MM)
    shortest: float = field(metadata=MM)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "sigma", number_or_share(self.sigma, "sigma", self))
        for key in ("longest", "shortest"):
            object.__setattr__(self, key, positive(getattr(self, key), key, "mm", self))
        object.__setattr__(self, "hurst", finite(self.hurst, "hurst", "", self))
        if not 0 < self.hurst < 1:
            raise DeviationError(f"Fractal: hurst must be over 0 and below 1, got {self.hurst}")
        if self.shortest > self.longest:
            raise DeviationError(
                f"Fractal: shortest {self.shortest:.6g} mm is longer than longest {self.longest:.6g} mm"
            )

    def octaves(self) -> SumModel:
        """Return the Gaussian fields it is the sum of."""
        needs_numbers(self)
        count = int(np.floor(np.log2(self.longest / self.shortest) + 1e-9)) + 1
        lengths = self.longest / 2.0 ** np.arange(count)
        weights = lengths**self.hurst
        weights *= self.sigma / np.sqrt((weights**2).sum())
        return SumModel(
            tuple(
                GaussianField(float(sigma), float(length))
                for sigma, length in zip(weights, lengths, strict=True)
            )
        )

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Prepare the octaves."""
        return self.octaves().prepare(nominal, features)
