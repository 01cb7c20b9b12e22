"""What a deviation model is: one number per feature sample, composed by ``+``, ``*`` and ``.on(...)``."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from importlib.metadata import entry_points
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np

from cadskin._random import seed_sequence
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Bools, Floats, RNGLike
    from cadskin.shape import Feature, FeatureRef, NominalModel

__all__ = [
    "MM",
    "RAD",
    "DeviationModel",
    "FixedSampler",
    "RestrictedModel",
    "Sampler",
    "ScaledModel",
    "SumModel",
    "child_sequence",
    "from_dict",
    "model_class",
    "model_names",
    "register",
]

BLOCK = 32  # samples worked on at once; the result does not depend on it

_REGISTRY: dict[str, type[DeviationModel]] = {}
_Model = TypeVar("_Model", bound="type[DeviationModel]")


MM = {"unit": "mm"}  # metadata of a dataclass field: the unit in the text form
RAD = {"unit": "rad"}


class Sampler(ABC):
    """A model made ready for one nominal model: the set-up is done, each further sample is cheap.

    Attributes
    ----------
    n_samples : int
        Length n_c of a deviation field.
    notes : tuple of str
        What was decided in the set-up (the route of a Gaussian field, its certificate).
    """

    n_samples: int
    notes: tuple[str, ...] = ()

    @abstractmethod
    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Write one field per seed into ``out`` (len(seeds), n_c) [mm]; row i depends on seed i only."""

    def draw(self, seeds: Sequence[np.random.SeedSequence]) -> Floats:
        """Return one field per seed (len(seeds), n_c) float64 [mm]; row i depends on seed i only."""
        out = np.zeros((len(seeds), self.n_samples))
        self.fill(seeds, out)
        return out

    def sample(self, *, size: int = 1, rng: RNGLike = None) -> Floats:
        """Return ``size`` deviation fields (size, n_c) [mm]; see `DeviationModel.sample`."""
        if size < 0:
            raise DeviationError(f"size must be zero or more, got {size}")
        seed = seed_sequence(rng)
        return self.draw([child_sequence(seed, i) for i in range(size)])


class FixedSampler(Sampler):
    """The sampler of a systematic model: every sample is the same field (n_c,) [mm]."""

    def __init__(self, values: Floats, notes: tuple[str, ...] = ()) -> None:
        self.values = np.asarray(values, dtype=np.float64)
        self.n_samples = len(self.values)
        self.notes = notes

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        """Repeat the field."""
        out[: len(seeds)] = self.values


class DeviationModel(ABC):
    """One formula for the deviation of a surface along its nominal normal [mm], + = material added.

    Subclasses are frozen dataclasses; they override `prepare`. ``a + b`` is the sum with independent random
    streams, ``2 * a`` scales, ``a.on(">Z")`` is zero outside of the selected features.

    Attributes
    ----------
    name : str
        Name in specification files and in the registry.
    """

    name: ClassVar[str] = ""

    @abstractmethod
    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Return the sampler for ``nominal``: all set-up work is done here, once.

        Parameters
        ----------
        nominal : NominalModel
        features : sequence of Feature, optional
            The features that matter; values on the others are not used. None for all.
        """

    def sample(self, nominal: NominalModel, *, size: int = 1, rng: RNGLike = None) -> Floats:
        """Return random deviation fields.

        Parameters
        ----------
        nominal : NominalModel
        size : int
            Number of fields.
        rng : int, SeedSequence, BitGenerator, Generator or None
            Field i depends on the child stream i of the seed only: the first fields of a larger ``size`` are
            the same.

        Returns
        -------
        (size, n_c) float
            Deviation along the nominal normal at each feature sample [mm].
        """
        return self.prepare(nominal).sample(size=size, rng=rng)

    def on(self, ref: FeatureRef | None = None, /, **filters: Any) -> DeviationModel:
        """Return this model on the features selected by `NominalModel.select`, zero elsewhere.

        Parameters
        ----------
        ref, **filters
            As for `NominalModel.select`; a selection that matches nothing raises `SelectionError` when the
            model meets a part.
        """
        return RestrictedModel(self, ref, dict(filters))

    def parameters(self) -> dict[str, Any]:
        """Return the parameters that differ from their defaults, for the specification file."""
        found = {}
        for item in fields(self):  # type: ignore[arg-type]
            value = getattr(self, item.name)
            default = item.default_factory() if callable(item.default_factory) else item.default
            if not _same(value, default):
                found[item.name] = _plain(value)
        return found

    def to_dict(self) -> dict[str, Any]:
        """Return ``{name: parameters}``; `from_dict` makes the same model again."""
        return {self.name: self.parameters()}

    def __add__(self, other: DeviationModel) -> DeviationModel:
        if not isinstance(other, DeviationModel):
            return NotImplemented
        return SumModel((*_terms(self), *_terms(other)))

    def __mul__(self, factor: float) -> DeviationModel:
        if not isinstance(factor, (int, float, np.number)):
            return NotImplemented
        return ScaledModel(float(factor), self)

    __rmul__ = __mul__

    def __neg__(self) -> DeviationModel:
        return ScaledModel(-1.0, self)

    def __sub__(self, other: DeviationModel) -> DeviationModel:
        if not isinstance(other, DeviationModel):
            return NotImplemented
        return self + (-other)

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(_same(getattr(self, f.name), getattr(other, f.name)) for f in fields(self))  # type: ignore[arg-type]

    def __hash__(self) -> int:
        return hash((type(self), str(self)))

    def __str__(self) -> str:
        units = {f.name: f.metadata.get("unit", "") for f in fields(self)}  # type: ignore[arg-type]
        inside = ", ".join(f"{key}={_text(getattr(self, key), units[key])}" for key in self.parameters())
        return f"{type(self).__name__}({inside})"

    __repr__ = __str__


def register(cls: _Model) -> _Model:
    """Class decorator: make the model known by its ``name``.

    Raises
    ------
    DeviationError
        The name is empty or taken by another class.
    """
    known = _REGISTRY.get(cls.name)
    if not cls.name or (known is not None and known.__qualname__ != cls.__qualname__):
        raise DeviationError(f"{cls.__name__}: the model name {cls.name!r} is empty or taken")
    _REGISTRY[cls.name] = cls
    return cls


def model_names() -> tuple[str, ...]:
    """Return the names of the models in the registry, without those of third parties not loaded yet."""
    return tuple(sorted(_REGISTRY))


def model_class(name: str) -> type[DeviationModel]:
    """Return the model class called ``name``; others announce theirs by entry point ``cadskin.deviations``.

    Raises
    ------
    DeviationError
        No such model; the message lists what there is.
    """
    if name not in _REGISTRY:
        for point in entry_points(group="cadskin.deviations", name=name):
            register(point.load())
    if name not in _REGISTRY:
        raise DeviationError(f"no deviation model is called {name!r}; there are {', '.join(model_names())}")
    return _REGISTRY[name]


def from_dict(data: Mapping[str, Any]) -> DeviationModel:
    """Return the model that `DeviationModel.to_dict` wrote.

    Raises
    ------
    DeviationError
        Not one table ``{name: parameters}``, an unknown name, or parameters the model does not have.
    """
    if not isinstance(data, Mapping) or len(data) != 1:
        raise DeviationError(f"a model is one table {{name = {{parameters}}}}, got {data!r}")
    ((name, values),) = data.items()
    if not isinstance(values, Mapping):
        raise DeviationError(f"the parameters of model {name!r} must be a table, got {values!r}")
    cls = model_class(name)
    allowed = [f.name for f in fields(cls)]  # type: ignore[arg-type]
    unknown = [key for key in values if key not in allowed]
    if unknown:
        raise DeviationError(
            f"model {name!r} has no parameter {', '.join(map(repr, unknown))}; it has {', '.join(allowed)}"
        )
    nested = {key: _revive(value) for key, value in values.items()}
    try:
        return cls(**nested)
    except TypeError as error:
        raise DeviationError(f"model {name!r}: {error}") from error


@register
@dataclass(frozen=True, eq=False, repr=False)
class SumModel(DeviationModel):
    """The sum of models; term t of sample i has its own random stream (i, t): the terms are independent."""

    name: ClassVar[str] = "sum"
    terms: tuple[DeviationModel, ...]

    def __post_init__(self) -> None:
        """Check the terms."""
        object.__setattr__(self, "terms", tuple(self.terms))
        if not self.terms or not all(isinstance(term, DeviationModel) for term in self.terms):
            raise DeviationError("a sum needs at least one deviation model")

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


@register
@dataclass(frozen=True, eq=False, repr=False)
class ScaledModel(DeviationModel):
    """A model times a number."""

    name: ClassVar[str] = "scaled"
    factor: float
    model: DeviationModel

    def __post_init__(self) -> None:
        """Check the factor."""
        if not np.isfinite(self.factor):
            raise DeviationError(f"the factor of a deviation model must be finite, got {self.factor}")

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Prepare the model that is scaled."""
        return _ScaledSampler(self.factor, self.model.prepare(nominal, features))

    def __str__(self) -> str:
        inner = str(self.model)
        return f"{self.factor:.12g} * " + (f"({inner})" if isinstance(self.model, SumModel) else inner)

    __repr__ = __str__


class _ScaledSampler(Sampler):
    def __init__(self, factor: float, inner: Sampler) -> None:
        self.factor, self.inner = factor, inner
        self.n_samples, self.notes = inner.n_samples, inner.notes

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        self.inner.fill(seeds, out)
        out *= self.factor


@register
@dataclass(frozen=True, eq=False, repr=False)
class RestrictedModel(DeviationModel):
    """A model on selected features, zero elsewhere; made by ``model.on(...)``."""

    name: ClassVar[str] = "on"
    model: DeviationModel
    ref: Any = None
    filters: dict[str, Any] = field(default_factory=dict)

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
        self.n_samples, self.notes = inner.n_samples, inner.notes

    def fill(self, seeds: Sequence[np.random.SeedSequence], out: Floats) -> None:
        self.inner.fill(seeds, out)
        out[:, self.outside] = 0.0


def child_sequence(seed: np.random.SeedSequence, index: int) -> np.random.SeedSequence:
    """Child ``index`` of a seed sequence, without spawning (see `cadskin._random.child`)."""
    return np.random.SeedSequence(seed.entropy, spawn_key=(*seed.spawn_key, index), pool_size=seed.pool_size)


def _terms(model: DeviationModel) -> tuple[DeviationModel, ...]:
    return model.terms if isinstance(model, SumModel) else (model,)


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        try:
            return bool(np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True))
        except TypeError:
            return False
    return bool(a is b or a == b)


def _plain(value: Any) -> Any:
    """Numbers, strings, lists and tables only, as TOML has them."""
    if isinstance(value, DeviationModel):
        return value.to_dict()
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, (tuple, list)):
        return [_plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    return value


def _revive(value: Any) -> Any:
    """Turn nested model tables into models; everything else stays."""
    if isinstance(value, Mapping) and len(value) == 1:
        ((name, inside),) = value.items()
        if isinstance(inside, Mapping) and isinstance(name, str):
            return from_dict(value)
    if isinstance(value, (list, tuple)):
        return tuple(_revive(item) for item in value)
    return value


def _text(value: Any, unit: str) -> str:
    if isinstance(value, (float, int)) and not isinstance(value, bool):
        return f"{value:.12g}" + (f" {unit}" if unit else "")
    if isinstance(value, (list, tuple, np.ndarray)) and len(value) > 8:
        return f"<{len(value)} values>" + (f" {unit}" if unit else "")
    return repr(value) + (f" {unit}" if unit and not isinstance(value, str) else "")
