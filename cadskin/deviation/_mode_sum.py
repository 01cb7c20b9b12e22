"""What sums of modes have in common: amplitudes from a first mode on, given or drawn."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._parameters import finite, truth, whole
from cadskin.deviation._patch_fields import FactorField
from cadskin.deviation._patches import PatchPoints, patch_points
from cadskin.deviation._shares import needs_numbers, number_or_share
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.field import PatchwiseSampler
from cadskin.deviation.samplers import FixedSampler
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["ModeSum"]


@dataclass(frozen=True, eq=False, repr=False)
class ModeSum(DeviationModel):
    """A sum of modes of each smooth patch, lowest first.

    Parameters
    ----------
    amplitudes : sequence of float
        Root mean square of each mode [mm], or a share of a tolerance, from mode ``first`` on.
    first : int
        Number of the first mode.
    random : bool
        True: the amplitudes are standard deviations of independent normal factors.
    edges : str
        One of `EDGES`.
    """

    EDGES: ClassVar[tuple[str, ...]] = ()
    amplitudes: tuple[Any, ...] = field(metadata=MM)
    first: int = 0
    random: bool = False
    edges: str = "free"

    def __post_init__(self) -> None:
        """Check the parameters."""
        name = type(self).__name__
        if np.ndim(self.amplitudes) != 1 or not len(self.amplitudes):
            raise DeviationError(f"{name}: give at least one amplitude, in a list, got {self.amplitudes!r}")
        checked = tuple(number_or_share(value, "amplitudes", self, finite) for value in self.amplitudes)
        object.__setattr__(self, "amplitudes", checked)
        object.__setattr__(self, "first", whole(self.first, "first", 0, self))
        object.__setattr__(self, "random", truth(self.random, "random", self))
        if self.edges not in self.EDGES:
            raise DeviationError(f"{name}: edges must be {' or '.join(self.EDGES)}, got {self.edges!r}")

    @abstractmethod
    def modes(self, patch: PatchPoints, count: int) -> tuple[Floats, str]:
        """Return the first modes (count, n) of a patch, of mean square one, and a note."""

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Find the modes of each patch."""
        needs_numbers(self)
        patches = patch_points(nominal, features)
        wanted = self.first + len(self.amplitudes)
        factors = []
        for patch in patches:
            modes, note = self.modes(patch, wanted)
            factors.append(FactorField((modes[self.first :] * np.array(self.amplitudes)[:, None]).T, note))
        sampler = PatchwiseSampler(patches, factors, np.ones(nominal.n_samples))
        if self.random:
            return sampler
        return FixedSampler(sampler.transform(np.ones((1, sampler.latent)))[0], sampler.notes)
