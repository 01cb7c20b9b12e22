"""Models made of models: sums, multiples, restrictions to features."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from cadskin.deviation._parameters import finite
from cadskin.deviation.base import DeviationModel
from cadskin.deviation.registry import register
from cadskin.deviation.samplers import BLOCK, FixedSampler, Sampler, child_sequence
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from cadskin._typing import Bools, Floats
    from cadskin.shape import Feature, NominalModel

__all__ = ["RestrictedModel", "ScaledModel", "SumModel", "added", "check_model"]


def check_model(model: Any, owner: object) -> None:
    """Refuse what is no deviation model."""
    if not isinstance(model, DeviationModel):
        raise DeviationError(f"{type(owner).__name__}: model must be a deviation model, got {model!r}")


def added(left: DeviationModel, right: DeviationModel) -> SumModel:
    """Return the sum of two models; the terms of sums stand side by side."""
    return SumModel((*_terms(left), *_terms(right)))


@register
@dataclass(frozen=True, eq=False, repr=False)
class SumModel(DeviationModel):
    """The sum of models; term t of sample i has its own random stream (i, t): the terms are independent.

    References
    ----------
    Zhang et al. 2013, doi:10.1177/0954405412466987, figures 9 and 10 (systematic and random deviations on one
    face).
    """

    name: ClassVar[str] = "sum"
    terms: tuple[DeviationModel, ...]

    def __post_init__(self) -> None:
        """Check the terms."""
        terms = tuple(self.terms) if isinstance(self.terms, (tuple, list)) else (self.terms,)
        object.__setattr__(self, "terms", terms)
        if not terms or not all(isinstance(term, DeviationModel) for term in terms):
            raise DeviationError(f"SumModel: terms must be deviation models, one or more, got {self.terms!r}")

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Prepare every term."""
        return _SumSampler([term.prepare(nominal, features) for term in self.terms])

    def __str__(self) -> str:
        return " + ".join(str(term) for term in self.terms)

    __repr__ = __str__


class _SumSampler(Sampler):
    def __init__(self, terms: Sequence[Sampler]) -> None:
        self.terms = tuple(terms)
        self.n_samples = self.terms[0].n_samples
        self.notes = tuple(note for term in self.terms for note in term.notes)
        known = [term.latent for term in self.terms]
        self.latent = sum(known) if min(known) >= 0 else -1

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        self.terms[0].fill([child_sequence(seed, 0) for seed in seeds], out)
        extra = np.zeros((min(BLOCK, len(seeds)), self.n_samples))
        for t, term in enumerate(self.terms[1:], start=1):
            for start in range(0, len(seeds), BLOCK):
                rows = out[start : start + BLOCK]
                term.fill(
                    [child_sequence(seed, t) for seed in seeds[start : start + BLOCK]], extra[: len(rows)]
                )
                rows += extra[: len(rows)]

    def transform(self, noise: NDArray[Any]) -> Floats:
        out, start = np.zeros((len(noise), self.n_samples)), 0
        for term in self.terms:
            stop = start + term.latent
            out += term.transform(noise[:, start:stop])
            start = stop
        return out


@register
@dataclass(frozen=True, eq=False, repr=False)
class ScaledModel(DeviationModel):
    """A model times a number."""

    name: ClassVar[str] = "scaled"
    factor: float
    model: DeviationModel

    def __post_init__(self) -> None:
        """Check the factor."""
        object.__setattr__(self, "factor", finite(self.factor, "factor", "", self))
        check_model(self.model, self)

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Prepare the model that is scaled."""
        return _ScaledSampler(self.factor, self.model.prepare(nominal, features))

    def __str__(self) -> str:
        inner = str(self.model)
        return f"{self.factor:.12g} * " + (
            f"({inner})" if isinstance(self.model, (SumModel, ScaledModel)) else inner
        )

    __repr__ = __str__


class _ScaledSampler(Sampler):
    def __init__(self, factor: float, inner: Sampler) -> None:
        self.factor, self.inner = factor, inner
        self.n_samples, self.notes, self.latent = inner.n_samples, inner.notes, inner.latent

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        self.inner.fill(seeds, out)
        out *= self.factor

    def transform(self, noise: NDArray[Any]) -> Floats:
        return self.factor * self.inner.transform(noise)


@register
@dataclass(frozen=True, eq=False, repr=False)
class RestrictedModel(DeviationModel):
    """A model on selected features, zero elsewhere; made by ``model.on(...)``."""

    name: ClassVar[str] = "on"
    model: DeviationModel
    ref: Any = None
    filters: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Make tuples of lists, so that a model from a file equals the one that was written."""
        check_model(self.model, self)
        if not isinstance(self.filters, Mapping):
            raise DeviationError(f"RestrictedModel: filters must be a table, got {self.filters!r}")
        tidy = {key: tuple(item) if isinstance(item, list) else item for key, item in self.filters.items()}
        object.__setattr__(self, "filters", tidy)
        if isinstance(self.ref, list):
            object.__setattr__(self, "ref", tuple(self.ref))

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Prepare the inner model for the selected features."""
        chosen: Iterable[Feature] = nominal.select(self.ref, **self.filters)
        if features is not None:
            wanted = {feature.id for feature in features}
            chosen = [feature for feature in chosen if feature.id in wanted]
        chosen = tuple(chosen)
        if not chosen:
            return FixedSampler(np.zeros(nominal.n_samples))
        mask = np.zeros(nominal.n_samples, dtype=bool)
        for feature in chosen:
            mask[feature.rows] = True
        return _MaskedSampler(self.model.prepare(nominal, chosen), mask)

    def __str__(self) -> str:
        arguments = [repr(self.ref)] if self.ref is not None else []
        arguments += [f"{key}={value!r}" for key, value in self.filters.items()]
        inner = str(self.model)
        return (f"({inner})" if isinstance(self.model, (SumModel, ScaledModel)) else inner) + (
            f".on({', '.join(arguments)})"
        )

    __repr__ = __str__


class _MaskedSampler(Sampler):
    def __init__(self, inner: Sampler, mask: Bools) -> None:
        self.inner, self.outside = inner, ~mask
        self.n_samples, self.notes, self.latent = inner.n_samples, inner.notes, inner.latent

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        self.inner.fill(seeds, out)
        out[:, self.outside] = 0.0

    def transform(self, noise: NDArray[Any]) -> Floats:
        out = self.inner.transform(noise)
        out[:, self.outside] = 0.0
        return out


def _terms(model: DeviationModel) -> tuple[DeviationModel, ...]:
    return model.terms if isinstance(model, SumModel) else (model,)
