"""What sums of modes have in common: amplitudes from a first mode on, given or drawn."""

from __future__ import annotations

import itertools
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np

from cadskin.deviation._parameters import choice, finite, is_listed, positive, truth, whole
from cadskin.deviation._patch_fields import FactorField
from cadskin.deviation._patches import PatchPoints, check_triangles, patch_points
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
        if not is_listed(self.amplitudes) or not len(self.amplitudes):
            raise DeviationError(
                f"{type(self).__name__}: amplitudes must be a list of one or more, got {self.amplitudes!r}"
            )
        checked = tuple(number_or_share(value, "amplitudes", self, finite) for value in self.amplitudes)
        object.__setattr__(self, "amplitudes", checked)
        object.__setattr__(self, "first", whole(self.first, "first", 0, self))
        object.__setattr__(self, "random", truth(self.random, "random", self))
        choice(self.edges, self.EDGES, "edges", self)

    @classmethod
    def over(
        cls,
        numbers: Sequence[int],
        *,
        amplitudes: Sequence[Any] | None = None,
        rms: float | None = None,
        decay: float = 1.0,
        **options: Any,
    ) -> Self:
        """Return a sum over a range of modes, with given amplitudes or with amplitudes that decay.

        Parameters
        ----------
        numbers : range or sequence of int
            Numbers of the modes, 0 or more, increasing.
        amplitudes : sequence of float, optional
            One for each of them [mm].
        rms : float, optional
            Root mean square of the whole sum [mm], in place of the amplitudes: these are proportional to
            k^-decay, k = 1, 2, ... along ``numbers``.
        decay : float
            0: all alike.
        **options
            The other parameters of the model.

        Raises
        ------
        DeviationError
            Numbers that do not increase, or not one of ``amplitudes`` and ``rms``.

        Examples
        --------
        >>> from cadskin.deviation import Modes
        >>> round(Modes.over(range(3, 6), rms=0.03, decay=1.0, random=True).amplitudes[0], 6)
        0.025714
        """
        name = cls.__name__
        chosen = [whole(number, "number of a mode", 0, name) for number in numbers]
        if not chosen or any(b <= a for a, b in itertools.pairwise(chosen)):
            raise DeviationError(f"{name}.over: the numbers of the modes must increase, got {numbers!r}")
        if (amplitudes is None) == (rms is None):
            raise DeviationError(f"{name}.over: give either amplitudes or rms, with its decay")
        if amplitudes is None:
            shape = np.arange(1.0, len(chosen) + 1) ** -finite(decay, "decay", "", name)
            amplitudes = (positive(rms, "rms", "mm", name) / np.linalg.norm(shape) * shape).tolist()
        if len(amplitudes) != len(chosen):
            raise DeviationError(f"{name}.over: {len(amplitudes)} amplitudes for {len(chosen)} modes")
        every: list[Any] = [0.0] * (chosen[-1] - chosen[0] + 1)
        for number, amplitude in zip(chosen, amplitudes, strict=True):
            every[number - chosen[0]] = amplitude
        return cls(tuple(every), first=chosen[0], **options)

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
            check_triangles(patch, self)
            modes, note = self.modes(patch, wanted)
            factors.append(FactorField((modes[self.first :] * np.array(self.amplitudes)[:, None]).T, note))
        sampler = PatchwiseSampler(patches, factors, np.ones(nominal.n_samples))
        if self.random:
            return sampler
        return FixedSampler(sampler.transform(np.ones((1, sampler.latent)))[0], sampler.notes)
