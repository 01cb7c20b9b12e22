"""Fields from few modes: Karhunen-Loeve expansion, eigenfunctions of the Laplace-Beltrami operator.

References
----------
Samper, Formosa: Form defects tolerancing by natural modes analysis, J. Comput. Inf. Sci. Eng. 7 (2007),
doi:10.1115/1.2424247.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.sparse import csr_array

from cadskin.deviation._eigenpairs import lowest_modes
from cadskin.deviation._mode_sum import ModeSum
from cadskin.deviation._parameters import finite, positive, whole
from cadskin.deviation._patch_fields import FactorField, LowRankField
from cadskin.deviation._patches import PatchPoints, patch_points
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.field import PatchwiseSampler
from cadskin.deviation.kernels import kernel_code
from cadskin.deviation.registry import register
from cadskin.errors import DeviationError
from cadskin.shape.operators import boundary_edges, cotangent_laplacian, lumped_mass

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Triangles
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["KarhunenLoeve", "Modes", "laplacian_modes", "upright"]


@register
@dataclass(frozen=True, eq=False, repr=False)
class KarhunenLoeve(DeviationModel):
    """A Gaussian field cut to its first modes: the best expansion with that many terms, in the mean square.

    The variance of the modes left out is missing; the note of the sampler says how much.

    Parameters
    ----------
    sigma : float
        Standard deviation of the full field [mm], > 0.
    length : float
        Correlation length [mm], > 0.
    kernel : str
    energy : float
        Share of the variance to keep, 0 to 1; used when ``count`` is None.
    count : int, optional
        Number of modes of each smooth patch.

    Raises
    ------
    DeviationError
        Parameters without meaning, or a field too rough for the modes wanted.

    Examples
    --------
    >>> KarhunenLoeve(0.01, 30, count=10)
    KarhunenLoeve(sigma=0.01 mm, length=30 mm, count=10)
    """

    name: ClassVar[str] = "karhunen_loeve"
    sigma: Any = field(metadata=MM)
    length: float = field(metadata=MM)
    kernel: str = "squared_exponential"
    energy: float = 0.99
    count: int | None = None

    def __post_init__(self) -> None:
        """Check the parameters."""
        object.__setattr__(self, "sigma", number_or_share(self.sigma, "sigma", self))
        object.__setattr__(self, "length", positive(self.length, "length", "mm", self))
        kernel_code(self.kernel)
        object.__setattr__(self, "energy", finite(self.energy, "energy", "", self))
        if not 0 < self.energy <= 1:
            raise DeviationError(f"KarhunenLoeve: energy must be over 0 and at most 1, got {self.energy}")
        if self.count is not None:
            object.__setattr__(self, "count", whole(self.count, "count", 1, self))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Find the modes of each smooth patch."""
        needs_numbers(self)
        patches = patch_points(nominal, features)
        unit_fields = [self._modes(patch) for patch in patches]
        return PatchwiseSampler(patches, unit_fields, np.full(nominal.n_samples, self.sigma))

    def _modes(self, patch: PatchPoints) -> FactorField:
        tolerance = min(1e-3, max(0.1 * (1.0 - self.energy), 1e-6)) if self.count is None else 1e-3
        full = LowRankField(patch.points / self.length, self.kernel, tolerance=tolerance).factor.T.astype(
            float
        )
        mass = lumped_mass(patch.points, patch.triangles)
        if not mass.sum() > 0:
            raise DeviationError(
                f"KarhunenLoeve: a patch of {len(mass)} points has no area; remove that face, or restrict "
                "the model to others with .on(...)"
            )
        variances, rotation = np.linalg.eigh((full * mass) @ full.T / mass.sum())
        order = np.argsort(-variances)
        kept = np.cumsum(variances[order])
        count = (
            int(np.searchsorted(kept, self.energy * kept[-1] * (1 - 1e-12))) + 1
            if self.count is None
            else min(self.count, len(order))
        )
        modes = rotation[:, order[:count]].T @ full
        modes *= np.sign(modes[np.arange(count), np.abs(modes).argmax(axis=1)])[:, None]
        return FactorField(
            modes.T, f"Karhunen-Loeve: {count} modes hold {kept[count - 1] / kept[-1]:.4g} of the variance"
        )


@register
@dataclass(frozen=True, eq=False, repr=False)
class Modes(ModeSum):
    """A sum of eigenfunctions of the Laplace-Beltrami operator of each smooth patch, lowest first.

    Each mode has mean square one over the area, so that an amplitude is a root mean square in mm. The
    constant mode (number 0 with free edges) is the size.

    Parameters
    ----------
    amplitudes : sequence of float
        [mm], or shares of a tolerance; one per mode from ``first`` on.
    first : int
        Number of the first mode.
    random : bool
        True: the amplitudes are standard deviations of independent normal factors.
    edges : str
        ``free`` or ``fixed`` (zero at the boundary of the patch).

    Examples
    --------
    >>> Modes([0.01, 0.005], first=1, random=True)
    Modes(amplitudes=(0.01, 0.005) mm, first=1, random=True)
    """

    name: ClassVar[str] = "modes"
    EDGES: ClassVar[tuple[str, ...]] = ("free", "fixed")

    def modes(self, patch: PatchPoints, count: int) -> tuple[Floats, str]:
        """Find the eigenfunctions."""
        values, functions = laplacian_modes(patch.points, patch.triangles, count, edges=self.edges)
        wavelength = 2 * np.pi / np.sqrt(max(float(values[-1]), 1e-300))
        return functions, f"modes {self.first} to {count - 1}, shortest wavelength {wavelength:.4g} mm"


def laplacian_modes(
    points: Points, triangles: Triangles, count: int, *, edges: str = "free"
) -> tuple[Floats, Floats]:
    """Return the lowest eigenvalues (count,) [1/mm²] and eigenfunctions (count, n) of a surface.

    The functions have mean square one over the area and their largest entry is positive.

    Raises
    ------
    DeviationError
        More modes than a third of the points are asked for.
    """
    mass = lumped_mass(points, triangles)
    matrix = csr_array(cotangent_laplacian(points, triangles))
    inside = np.arange(len(points))
    if edges == "fixed":
        inside = np.setdiff1d(inside, boundary_edges(triangles))
    if 3 * count > len(inside):
        raise DeviationError(
            f"{count} modes on {len(inside)} points: the mesh is too coarse, at most a third"
        )
    shift = -1e-2 * 4 * np.pi / mass.sum()
    values, vectors = lowest_modes(matrix, mass, inside, count, shift=shift, tolerance=1e-10)
    return values, upright(vectors * np.sqrt(mass.sum()))


def upright(functions: Floats) -> Floats:
    """Return functions (k, n) with signs such that the largest entry of each is positive."""
    peaks = np.abs(functions).max(axis=1, keepdims=True)
    first = np.argmax(np.abs(functions) > 0.999 * peaks, axis=1)
    return np.asarray(functions * np.sign(functions[np.arange(len(functions)), first])[:, None])
