"""Checks of model parameters: the message names the model, the parameter, the value and the limit."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import DeviationError, GeometryError

if TYPE_CHECKING:
    from cadskin._typing import Floats

__all__ = [
    "array_of",
    "choice",
    "direction_of",
    "finite",
    "is_listed",
    "number_of",
    "owner_name",
    "positive",
    "truth",
    "vector_of",
    "whole",
]


def is_listed(value: Any) -> bool:
    """Return whether a value is several: a list or an array, not a number."""
    return isinstance(value, (list, tuple)) or (isinstance(value, np.ndarray) and value.ndim > 0)


def owner_name(owner: object) -> str:
    """Return the name of a model, or that of a function given as text."""
    return owner if isinstance(owner, str) else type(owner).__name__


def number_of(value: Any, what: str, owner: object) -> float:
    """Return ``value`` as a float, which may be infinite or NaN; refuse what is no number."""
    if isinstance(value, (bool, np.bool_, str, bytes)) or is_listed(value):
        raise DeviationError(f"{owner_name(owner)}: {what} must be a number, got {value!r}")
    try:
        number = float(value)
    except (TypeError, ValueError) as error:
        raise DeviationError(f"{owner_name(owner)}: {what} must be a number, got {value!r}") from error
    return number


def finite(value: Any, what: str, unit: str, owner: object) -> float:
    """Return ``value`` as a float; refuse NaN, infinity and what is no number."""
    number = number_of(value, what, owner)
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


def whole(value: Any, what: str, least: int, owner: object) -> int:
    """Return ``value`` as an int; refuse fractions and what is below ``least``."""
    number = finite(value, what, "", owner)
    if number != int(number) or number < least:
        raise DeviationError(
            f"{owner_name(owner)}: {what} must be a whole number of {least} or more, got {number:.12g}"
        )
    return int(number)


def truth(value: Any, what: str, owner: object) -> bool:
    """Return ``value`` as a bool; refuse everything but true and false."""
    if not isinstance(value, (bool, np.bool_)):
        raise DeviationError(f"{owner_name(owner)}: {what} must be true or false, got {value!r}")
    return bool(value)


def choice(value: Any, known: Sequence[str], what: str, owner: object) -> str:
    """Return ``value``, one of some names."""
    if not isinstance(value, str) or value not in known:
        raise DeviationError(f"{owner_name(owner)}: {what} must be one of {', '.join(known)}, got {value!r}")
    return value


def array_of(
    value: Any, shape: tuple[int | None, ...], what: str, owner: object, *, finite: bool = True
) -> Floats:
    """Return ``value`` as a read-only array of a shape, None for any length; refuse what is not numbers."""
    name = f"{owner_name(owner)}: {what}"
    try:
        given = np.asarray(value)
    except ValueError as error:
        raise DeviationError(f"{name} must be an array of numbers: {error}") from error
    if given.dtype.kind not in "iuf":
        raise DeviationError(f"{name} must be an array of numbers, got {given.dtype} {str(value)[:40]}")
    try:
        return frozen(given, shape=shape, name=name, finite=finite)
    except GeometryError as error:
        raise DeviationError(str(error)) from error


def vector_of(value: Any, what: str, unit: str, owner: object) -> tuple[float, float, float]:
    """Return ``value`` as three floats; refuse everything but three finite numbers."""
    if not isinstance(value, (tuple, list, np.ndarray)) or len(value) != 3:
        raise DeviationError(f"{owner_name(owner)}: {what} must be three numbers, got {value!r}")
    x, y, z = (finite(component, what, unit, owner) for component in value)
    return x, y, z


def direction_of(value: Any, what: str, unit: str, owner: object) -> tuple[float, float, float]:
    """Return ``value`` as three floats that are not all zero."""
    vector = vector_of(value, what, unit, owner)
    if not any(vector):
        raise DeviationError(f"{owner_name(owner)}: {what} must not be zero")
    return vector
