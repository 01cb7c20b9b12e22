"""Random amplitudes: a model times a number that each sample draws from a distribution."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import scipy.stats
from scipy.stats.distributions import rv_frozen

from cadskin.deviation._parameters import finite
from cadskin.deviation.algebra import check_model
from cadskin.deviation.base import DeviationModel
from cadskin.deviation.registry import register
from cadskin.deviation.samplers import Sampler, child_sequence
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats
    from cadskin.shape import Feature, NominalModel

__all__ = ["Randomised"]


@register
@dataclass(frozen=True, eq=False, repr=False)
class Randomised(DeviationModel):
    """A model whose amplitude varies from part to part.

    Parameters
    ----------
    model : DeviationModel
        Usually a systematic form.
    distribution : str or frozen distribution
        Name of a continuous distribution of `scipy.stats`, or one with its parameters, such as
        ``scipy.stats.norm(1.0, 0.25)``.
    arguments : sequence of float
        Its shape, location and scale parameters, in scipy's order.

    Raises
    ------
    DeviationError
        No such distribution, or parameters it does not take.

    Examples
    --------
    A form of 20 µm on average, with a standard deviation of 5 µm:

    >>> from cadskin.deviation import Paraboloid
    >>> Randomised(Paraboloid(0.02), "norm", (1.0, 0.25))
    Randomised(model=Paraboloid(amplitude=0.02 mm), distribution='norm', arguments=(1.0, 0.25))
    """

    name: ClassVar[str] = "randomised"
    model: DeviationModel
    distribution: Any
    arguments: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Check that the distribution exists and takes the arguments."""
        if isinstance(self.distribution, rv_frozen):
            if self.arguments:
                raise DeviationError("Randomised: a frozen distribution has its arguments already")
            name, arguments = _parts(self.distribution)
            object.__setattr__(self, "distribution", name)
            object.__setattr__(self, "arguments", arguments)
        if not isinstance(self.arguments, (tuple, list, np.ndarray)):
            raise DeviationError(f"Randomised: arguments must be numbers in a list, got {self.arguments!r}")
        arguments = tuple(finite(value, "arguments", "", self) for value in self.arguments)
        object.__setattr__(self, "arguments", arguments)
        check_model(self.model, self)
        quantiles = self._quantile(np.array([0.25, 0.75]))
        if not np.isfinite(quantiles).all():
            raise DeviationError(
                f"Randomised: scipy.stats.{self.distribution} does not take the arguments {self.arguments}"
            )

    def _quantile(self, probability: Any) -> Any:
        found = getattr(scipy.stats, str(self.distribution), None)
        if not isinstance(found, scipy.stats.rv_continuous):
            raise DeviationError(
                f"Randomised: scipy.stats has no continuous distribution {self.distribution!r}"
            )
        try:
            return found.ppf(probability, *self.arguments)
        except TypeError as error:
            raise DeviationError(
                f"Randomised: scipy.stats.{self.distribution} does not take {len(self.arguments)} arguments"
            ) from error

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Prepare the model."""
        return _RandomisedSampler(self, self.model.prepare(nominal, features))


def _parts(frozen: Any) -> tuple[str, tuple[float, ...]]:
    """Name and parameters, in scipy's order, of a frozen distribution."""
    shapes, location, scale = frozen.dist._parse_args(*frozen.args, **frozen.kwds)
    return str(frozen.dist.name), (*shapes, location, scale)


class _RandomisedSampler(Sampler):
    """The model takes child stream 0 of each sample, the factor child stream 1."""

    def __init__(self, owner: Randomised, inner: Sampler) -> None:
        self.owner, self.inner = owner, inner
        self.n_samples, self.notes = inner.n_samples, inner.notes

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Draw the model and its factor."""
        self.inner.fill([child_sequence(seed, 0) for seed in seeds], out)
        uniform = [np.random.default_rng(child_sequence(seed, 1)).random() for seed in seeds]
        out *= self.owner._quantile(np.array(uniform))[:, None]
