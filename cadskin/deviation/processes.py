"""Signatures of manufacturing processes: models with parameters that have a meaning on the machine.

Each function returns a model of this package; restrict it with ``.on(...)`` and add others to it. Marks that
are finer than the mesh cannot be seen: four points per wavelength are the least.

The sources give the formulas. No capability of a machine is built in: the numbers (feed, radius, lobing,
taper, sigma) are yours, measured or learned from parts with `cadskin.stats.learn_process`; the few defaults
(marks ten times as long as wide, three lobes) are typical, no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from cadskin.deviation._parameters import direction_of, positive
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.field import GaussianField
from cadskin.deviation.form_model import FormModel
from cadskin.deviation.registry import register
from cadskin.deviation.rigid import Taper
from cadskin.deviation.texture import Lobing, Waviness

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["ClampedBow", "LayerSteps", "clamped_plate", "drilled", "ground", "milled", "printed", "turned"]


def turned(*, feed: float, nose_radius: float, ovality: float = 0.0, taper: float = 0.0) -> DeviationModel:
    """Return a turned cylinder: feed marks along the axis, ovality of the clamping, taper of the deflection.

    The marks have the height feed² / (8 nose_radius) of arcs side by side whose radius is large against the
    feed, here as a sine. Ovality and taper are yours to state; the source gives the marks.

    Parameters
    ----------
    feed : float
        Feed per revolution [mm].
    nose_radius : float
        Nose radius of the tool [mm].
    ovality : float
        Peak-to-valley height of the two-lobed form [mm].
    taper : float
        Difference of radius between the ends [mm].

    References
    ----------
    Boothroyd, Knight: Fundamentals of machining and machine tools, chapter on surface finish (feed marks).

    Examples
    --------
    >>> turned(feed=0.4, nose_radius=0.8)
    Waviness(amplitude=0.025 mm, wavelength=0.4 mm, angle=1.57079632679 rad)
    """
    tool = positive(nose_radius, "nose_radius", "mm", "turned")
    height = positive(feed, "feed", "mm", "turned") ** 2 / (8.0 * tool)
    model: DeviationModel = Waviness(height, feed, angle=np.pi / 2)
    if ovality:
        model = model + Lobing(ovality, lobes=2)
    return model + Taper(taper) if taper else model


def milled(*, feed_per_tooth: float, diameter: float, angle: float = 0.0) -> DeviationModel:
    """Return a plane made by peripheral milling: tooth marks of the height feed² / (4 diameter).

    The limit of the trochoid that a tooth describes for a feed that is small against the cutter, here as a
    sine.

    Parameters
    ----------
    feed_per_tooth : float
        [mm].
    diameter : float
        Diameter of the cutter [mm].
    angle : float
        Direction of the feed, from the first surface coordinate [rad].

    References
    ----------
    Martellotti: An analysis of the milling process, Trans. ASME 63 (1941) (surface of the tooth paths).

    Examples
    --------
    >>> milled(feed_per_tooth=2.0, diameter=40)
    Waviness(amplitude=0.025 mm, wavelength=2 mm)
    """
    across = positive(diameter, "diameter", "mm", "milled")
    feed = positive(feed_per_tooth, "feed_per_tooth", "mm", "milled")
    return Waviness(feed**2 / (4.0 * across), feed, angle=angle)


def ground(
    *,
    sigma: float | str,
    length: float,
    ratio: float = 10.0,
    lay: tuple[float, float, float] = (1.0, 0.0, 0.0),
) -> DeviationModel:
    """Return a ground surface: a Gaussian field with exponential correlation, its marks longer along the lay.

    Parameters
    ----------
    sigma : float or str
        Root mean square height [mm], or a share of a tolerance.
    length : float
        Correlation length across the lay [mm].
    ratio : float
        Length along the lay over the length across.
    lay : (3,) float
        Direction of the lay in space.

    References
    ----------
    Whitehouse, Archard: The properties of random surfaces of significance in their contact, Proc. R. Soc. A
    316 (1970) 97-121, doi:10.1098/rspa.1970.0068 (Gaussian heights, exponential autocorrelation; their
    correlation length is where it has fallen to a tenth, 2.3 times ours).

    Examples
    --------
    >>> ground(sigma=0.002, length=3, ratio=5).anisotropy
    5.0
    """
    return GaussianField(sigma, length, "exponential", metric="euclidean", anisotropy=ratio, direction=lay)


def drilled(*, lobing: float | str, taper: float = 0.0, lobes: int = 3) -> DeviationModel:
    """Return a drilled hole: an odd number of lobes, three for a drill with two lips, and a bell mouth.

    The source explains lobes by whirling at near multiples of the speed; their height is yours to state.

    Parameters
    ----------
    lobing : float or str
        Peak-to-valley height around [mm], or a share of a tolerance.
    taper : float
        Difference of radius between the ends [mm].
    lobes : int
        For a tool with N lips N + 1 or N - 1.

    References
    ----------
    Bayly, Lamar, Calvert: Low-frequency regenerative vibration and the formation of lobed holes in drilling,
    J. Manuf. Sci. Eng. 124 (2002) 275.

    Examples
    --------
    >>> drilled(lobing=0.01, taper=0.02)
    Lobing(amplitude=0.01 mm) + Taper(amplitude=0.02 mm)
    """
    model: DeviationModel = Lobing(lobing, lobes=lobes)
    return model + Taper(taper) if taper else model


def printed(*, layer: float, direction: tuple[float, float, float] = (0.0, 0.0, 1.0)) -> DeviationModel:
    """Return a part built in layers: see `LayerSteps`.

    Parameters
    ----------
    layer : float
        Layer thickness [mm].
    direction : (3,) float
        Building direction.

    Examples
    --------
    >>> printed(layer=0.2)
    LayerSteps(thickness=0.2 mm)
    """
    return LayerSteps(layer, direction)


def clamped_plate(*, bow: float | str) -> DeviationModel:
    """Return a plate that springs back after it was clamped at its edges: see `ClampedBow`.

    Examples
    --------
    >>> clamped_plate(bow=0.05)
    ClampedBow(amplitude=0.05 mm)
    """
    return ClampedBow(bow)


@register
@dataclass(frozen=True, eq=False, repr=False)
class ClampedBow(FormModel):
    """The bow of a plate whose edges are clamped, z = amplitude (1 - s²)² (1 - t²)², s and t from -1 to 1.

    Positive: the middle stands out of the material. A plate held down while its face is cut, and released,
    has the deflection under the clamping turned over.

    Parameters
    ----------
    amplitude : float or str
        Height of the middle over the edges [mm], or a share of a tolerance.

    References
    ----------
    Timoshenko, Woinowsky-Krieger: Theory of plates and shells, 2nd edition 1959, chapter on rectangular
    plates with built-in edges (this product meets the edge conditions; its centre deflection under uniform
    load by Ritz's method is 0.00133 q a⁴/D for a square, the exact one 0.00126 q a⁴/D).
    """

    name: ClassVar[str] = "clamped_bow"

    def height(self, x: Floats, y: Floats) -> Floats:
        """Return the bow over the extent of the feature."""
        sides = [np.clip(axis / max(float(np.abs(axis).max()), 1e-300), -1.0, 1.0) for axis in (x, y)]
        return np.asarray(self.amplitude * (1 - sides[0] ** 2) ** 2 * (1 - sides[1] ** 2) ** 2)


@register
@dataclass(frozen=True, eq=False, repr=False)
class LayerSteps(DeviationModel):
    """The stair steps of a part built in layers that cover it, on faces oblique to the building direction.

    Across a face at the angle phi to the layers a step is a triangle of height thickness cos(phi) on it:
    d = thickness / sin(phi) min(u cot(phi), (1 - u) tan(phi)), u from 0 to 1 within a layer. Walls along the
    building direction have no steps; faces square to it lie on the next layer.

    Parameters
    ----------
    thickness : float
        Layer thickness [mm], > 0.
    direction : (3,) float
        Building direction; layers start at the origin.

    References
    ----------
    Dolenc, Mäkelä: Slicing procedures for layered manufacturing techniques, Comput. Aided Des. 26 (1994),
    doi:10.1016/0010-4485(94)90032-9 (cusp height; the profile between the cusps is the geometry of stairs).
    """

    name: ClassVar[str] = "layers"
    thickness: float = field(metadata=MM)
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "thickness", positive(self.thickness, "thickness", "mm", self))
        object.__setattr__(self, "direction", direction_of(self.direction, "direction", "", self))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Evaluate the saw tooth on every feature."""
        return form_sampler(nominal, features, self._on)

    def _on(self, feature: Feature) -> Floats:
        build = np.array(self.direction) / np.linalg.norm(self.direction)
        cosine = np.clip(feature.normals @ build, -1.0, 1.0)
        sine = np.maximum(np.sqrt(1.0 - cosine**2), 1e-12)
        layer = feature.points @ build / self.thickness
        part = layer - np.floor(layer + 1e-9)
        part = np.clip(np.where(cosine > 0, part, -np.where(part > 1e-9, part - 1.0, 0.0)), 0.0, 1.0)
        rising = np.where(part > 1e-9, part, 0.0) * np.abs(cosine) / sine**2
        falling = (1.0 - part) / np.maximum(np.abs(cosine), 1e-12)
        return np.asarray(self.thickness * np.minimum(rising, falling))
