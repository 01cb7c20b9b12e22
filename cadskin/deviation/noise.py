"""White noise: independent deviations at the points of the mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._linear import NodewiseSampler
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.registry import register
from cadskin.shape.patches import smooth_patches

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["WhiteNoise"]


@register
@dataclass(frozen=True, eq=False, repr=False)
class WhiteNoise(DeviationModel):
    """One-dimensional Gaussian noise: an independent normal deviation at every point.

    Its range grows with the number of points: the range of n independent normal numbers is 5.8 sigma at
    n = 273, 7.0 sigma at 2392 and 8.8 sigma at 100 000 points, so the mesh sets the form deviation. Use
    `GaussianField`, which has a correlation length in mm, where the result shall not depend on the mesh.
    Features that meet tangentially share one value at a common point.

    Parameters
    ----------
    sigma : float
        Standard deviation [mm], > 0.

    Raises
    ------
    DeviationError
        ``sigma`` is not positive and finite.

    References
    ----------
    Zhang et al. 2013, doi:10.1177/0954405412466987, section on random deviations, "one-dimensional Gaussian".

    Examples
    --------
    >>> WhiteNoise(0.01)
    WhiteNoise(sigma=0.01 mm)
    """

    name: ClassVar[str] = "noise"
    sigma: Any = field(metadata=MM)

    def __post_init__(self) -> None:
        """Check the standard deviation."""
        object.__setattr__(self, "sigma", number_or_share(self.sigma, "sigma", self))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """One normal number per node."""
        needs_numbers(self)
        del features
        patches = smooth_patches(nominal)
        scale = np.full(nominal.n_samples, self.sigma)
        return _NoiseSampler(patches.node_of_sample, scale, patches.n_nodes, patches.n_nodes)


class _NoiseSampler(NodewiseSampler):
    def colour(self, noise: NDArray[np.float32], scratch: NDArray[np.float32]) -> NDArray[np.float32]:
        """Take the noise as it is."""
        del scratch
        return noise
