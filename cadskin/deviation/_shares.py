"""Parameters given as a share of a tolerance zone: ``"from tolerance"`` or ``"0.2 of tolerance"``.

The default shares, which ``"from tolerance"`` means:

============  =====  =================================================================================
parameter     share  so that
============  =====  =================================================================================
sigma         1/8    a point lies in the zone with probability 0.99994 (four sigma to either side)
amplitude     1/2    the form takes half of the zone, the rest is left to random deviations
offset        1/4    the surface goes half of the way from the middle of the zone to its border
amplitudes    1/8    each: they are root mean squares, as sigma is one
coefficients  1/8    the same
============  =====  =================================================================================
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any

from cadskin.deviation._parameters import positive
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin.deviation.base import DeviationModel

__all__ = ["DEFAULT_SHARES", "needs_numbers", "number_or_share", "with_tolerance"]

DEFAULT_SHARES = {
    "sigma": 0.125,
    "amplitude": 0.5,
    "offset": 0.25,
    "amplitudes": 0.125,
    "coefficients": 0.125,
}
_DEFAULT = "from tolerance"
_SHARE = re.compile(r"\s*(\S+) of tolerance\s*")


def _share(value: Any, what: str, owner: object) -> float | None:
    """Return the share of the zone that a text stands for, None for anything but such a text."""
    if not isinstance(value, str):
        return None
    if value.strip() == _DEFAULT:
        return DEFAULT_SHARES[what]
    found = _SHARE.fullmatch(value)
    if found is None:
        raise DeviationError(
            f"{type(owner).__name__}: {what} must be a number, 'from tolerance' or a share like "
            f"'0.2 of tolerance', got {value!r}"
        )
    try:
        share = float(found[1])
    except ValueError as error:
        raise DeviationError(
            f"{type(owner).__name__}: the share of {what} is no number: {value!r}"
        ) from error
    return positive(share, f"share of {what}", "", owner)


def number_or_share(
    value: Any, what: str, owner: object, check: Callable[[Any, str, str, object], float] = positive
) -> Any:
    """Return ``value`` as a checked number [mm], or as it is where it is the text of a share."""
    return check(value, what, "mm", owner) if _share(value, what, owner) is None else value


def needs_numbers(model: DeviationModel) -> None:
    """Refuse a model that still waits for its tolerance.

    Raises
    ------
    DeviationError
        The message names the parameter and the way out.
    """
    for key in DEFAULT_SHARES:
        if any(isinstance(value, str) for value in _entries(getattr(model, key, None))):
            raise DeviationError(
                f"{model}: {key} is a share of a tolerance; say which one: "
                "model.resolved(tolerance=0.1), in mm"
            )


def with_tolerance(model: DeviationModel, tolerance: float) -> DeviationModel:
    """Return a copy of a model, and of those inside of it, with numbers [mm] in place of shares."""
    changed: dict[str, Any] = {}
    for item in fields(model):  # type: ignore[arg-type]
        value = getattr(model, item.name)
        if item.name in DEFAULT_SHARES and any(isinstance(entry, str) for entry in _entries(value)):
            changed[item.name] = _numbers(value, item.name, model, tolerance)
        elif hasattr(value, "resolved"):
            changed[item.name] = value.resolved(tolerance=tolerance)
        elif isinstance(value, tuple) and any(hasattr(part, "resolved") for part in value):
            changed[item.name] = tuple(part.resolved(tolerance=tolerance) for part in value)
    return replace(model, **changed) if changed else model  # type: ignore[type-var]


def _entries(value: Any) -> tuple[Any, ...]:
    """Return the numbers or shares of a parameter: those of a list or a table, or the one."""
    if isinstance(value, Mapping):
        return tuple(value.values())
    return value if isinstance(value, tuple) else (value,)


def _numbers(value: Any, what: str, model: DeviationModel, tolerance: float) -> Any:
    if isinstance(value, Mapping):
        return {key: _numbers(entry, what, model, tolerance) for key, entry in value.items()}
    if isinstance(value, tuple):
        return tuple(_numbers(entry, what, model, tolerance) for entry in value)
    share = _share(value, what, model)
    return value if share is None else tolerance * share
