"""Models by name: the registry, entry points of third parties, models from tables."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from importlib.metadata import entry_points
from typing import Any, TypeVar

from cadskin.deviation.base import DeviationModel
from cadskin.errors import DeviationError

__all__ = ["from_dict", "model_class", "model_names", "register"]

_REGISTRY: dict[str, type[DeviationModel]] = {}
_Model = TypeVar("_Model", bound="type[DeviationModel]")


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


def _revive(value: Any) -> Any:
    """Turn nested model tables into models; everything else stays."""
    if isinstance(value, Mapping) and len(value) == 1:
        ((name, inside),) = value.items()
        if isinstance(inside, Mapping) and isinstance(name, str):
            return from_dict(value)
    if isinstance(value, (list, tuple)):
        return tuple(_revive(item) for item in value)
    return value
