"""Checks of model parameters: the message names the model, the parameter, the value and the limit."""

from __future__ import annotations

from typing import Any

import numpy as np

from cadskin.errors import DeviationError

__all__ = ["direction_of", "finite", "owner_name", "positive", "vector_of"]


def owner_name(owner: object) -> str:
    """Return the name of a model, or that of a function given as text."""
    return owner if isinstance(owner, str) else type(owner).__name__


def _number(value: Any, what: str, owner: object) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise DeviationError(f"{owner_name(owner)}: {what} must be a number, got {value!r}") from error
    return number


def finite(value: Any, what: str, unit: str, owner: object) -> float:
    """Return ``value`` as a float; refuse NaN, infinity and what is no number."""
    number = _number(value, what, owner)
    if not np.isfinite(number):
        raise DeviationError(f"{owner_name(owner)}: {what} must be finite, got {number} {unit}".rstrip())
    return number


def positive(value: Any, what: str, unit: str, owner: object) -> float:
    """Return ``value`` as a float; refuse everything but positive finite numbers."""
    number = finite(value, what, unit, owner)
    if number <= 0:
        raise DeviationError(
            f"{owner_name(owner)}: {what} must be greater than 0, got {number:.6g} {unit}".rstrip()
        )
    return number


def vector_of(value: Any, what: str, unit: str, owner: object) -> tuple[float, float, float]:
    """Return ``value`` as three floats; refuse everything but three finite numbers."""
    if np.shape(value) != (3,):
        raise DeviationError(f"{owner_name(owner)}: {what} must be three numbers, got {value!r}")
    x, y, z = (finite(component, what, unit, owner) for component in value)
    return x, y, z


def direction_of(value: Any, what: str, unit: str, owner: object) -> tuple[float, float, float]:
    """Return ``value`` as three floats that are not all zero."""
    vector = vector_of(value, what, unit, owner)
    if not any(vector):
        raise DeviationError(f"{owner_name(owner)}: {what} must not be zero")
    return vector
