"""Numbers for people: units, round limits, ticks, signs."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np

from cadskin._typing import Floats
from cadskin.errors import ExportError

__all__ = [
    "FACTORS",
    "LengthUnit",
    "best_unit",
    "number",
    "round_limit",
    "signed_range",
    "tick_labels",
    "ticks",
]

LengthUnit: TypeAlias = Literal["µm", "mm"]
FACTORS: dict[str, float] = {"mm": 1.0, "µm": 1e3, "um": 1e3, "μm": 1e3}
_TICK_STEPS = (
    (1.0, 0),
    (2.0, 0),
    (2.5, 1),
    (4.0, 2),
    (5.0, 0),
    (10.0, 0),
    (20.0, 0),
    (25.0, 1),
)  # step, cost
_LIMITS = np.array([1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0])


def best_unit(limit: float, unit: str | None = None) -> LengthUnit:
    """Return the unit in which ``limit`` [mm] reads well, or the one that is asked for.

    Raises
    ------
    ExportError
        Neither mm nor µm.

    Examples
    --------
    >>> best_unit(0.05), best_unit(2.0), best_unit(2.0, "um")
    ('µm', 'mm', 'µm')
    """
    if unit is None:
        return "µm" if limit < 0.5 else "mm"
    if unit not in FACTORS:
        raise ExportError(f"unit must be 'mm' or 'µm' (or 'um'), got {unit!r}")
    return "mm" if unit == "mm" else "µm"


def round_limit(value: float) -> float:
    """Return the next round number that is not below ``value``.

    Examples
    --------
    >>> round_limit(0.0483), round_limit(11.0)
    (0.05, 12.0)
    """
    if not value > 0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(value))
    fitting = _LIMITS[_LIMITS * power >= value * (1 - 1e-9)]
    return float(f"{fitting[0] * power:.3g}")


def ticks(low: float, high: float) -> Floats:
    """Return 5 to 11 round numbers, evenly spaced, from ``low`` to ``high``.

    Both ends are ticks where a round step allows it, and 0 is one if it lies between.

    Examples
    --------
    >>> ticks(-50, 50).tolist(), ticks(-1.2, 1.2).tolist()
    ([-50.0, -25.0, 0.0, 25.0, 50.0], [-1.2, -0.8, -0.4, 0.0, 0.4, 0.8, 1.2])
    """
    power = 10.0 ** np.floor(np.log10((high - low) / 10))
    best, least_cost = np.array([low, high]), np.inf
    for factor, awkward in _TICK_STEPS:
        step = factor * power
        first, last = np.ceil(low / step - 1e-6), np.floor(high / step + 1e-6)
        count = int(last - first) + 1
        missed = (first * step - low + high - last * step) / (high - low) > 1e-6
        if 5 <= count <= 11 and 8 * missed + awkward + abs(count - 7) < least_cost:
            best, least_cost = step * np.arange(first, last + 1), 8 * missed + awkward + abs(count - 7)
    return np.asarray(np.round(best, 12))


def tick_labels(values: Floats) -> list[str]:
    """Return the labels of ticks: equal decimals, a true minus sign, a plus sign where both signs occur.

    Examples
    --------
    >>> tick_labels(np.array([-0.5, 0.0, 0.5]))
    ['−0.5', '0', '+0.5']
    """
    step = float(np.diff(values).min()) if len(values) > 1 else float(abs(values[0])) or 1.0
    decimals = next((d for d in range(9) if abs(step * 10**d - round(step * 10**d)) < 1e-6 * step * 10**d), 9)
    both = bool((values < 0).any() and (values > 0).any())
    texts = [f"{value:+.{decimals}f}" if both else f"{value:.{decimals}f}" for value in values]
    return ["0" if float(t) == 0 else t.replace("-", "−") for t in texts]


def signed_range(low: float, high: float) -> str:
    """Return ``low to high`` with signs and equal decimals, three digits for the greater.

    Examples
    --------
    >>> signed_range(-24.02, 23.71), signed_range(-0.0012, 0.0), signed_range(0.0, 0.0)
    ('−24.0 to +23.7', '−0.00120 to 0', '0 to 0')
    """
    greatest = max(abs(low), abs(high))
    if greatest == 0:
        return "0 to 0"
    decimals = max(0, 2 - int(np.floor(np.log10(greatest))))
    texts = (f"{value:+.{decimals}f}" for value in (low, high))
    return " to ".join("0" if float(text) == 0 else text.replace("-", "−") for text in texts)


def number(value: float) -> str:
    """Return at most four digits, never an exponent where it can be avoided.

    Examples
    --------
    >>> number(1234.5), number(0.5), number(200.0), number(12.345)
    ('1234', '0.5', '200', '12.3')
    """
    if value >= 100:
        return f"{value:.0f}"
    return f"{0.0 if abs(value) < 1e-9 else value:.3g}"  # the height of a flat face is rounding
