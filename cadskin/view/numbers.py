"""Numbers for people: units, round limits, ticks, signs."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np

from cadskin._typing import Floats
from cadskin.errors import ExportError

__all__ = ["FACTORS", "LengthUnit", "best_unit", "number", "round_limit", "signed", "tick_labels", "ticks"]

LengthUnit: TypeAlias = Literal["µm", "mm"]
FACTORS: dict[str, float] = {"mm": 1.0, "µm": 1e3, "um": 1e3, "μm": 1e3}
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


def ticks(low: float, high: float, *, most: int = 9) -> Floats:
    """Return round numbers, evenly spaced, within ``low`` and ``high``; 0 is one of them if it is inside.

    Examples
    --------
    >>> ticks(-50, 50).tolist()
    [-50.0, -25.0, 0.0, 25.0, 50.0]
    """
    span = high - low
    power = 10.0 ** np.floor(np.log10(span / most))
    for factor in (1.0, 2.0, 2.5, 5.0, 10.0, 20.0):
        step = factor * power
        first, last = np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9)
        ends_meet = factor != 2.0 or abs(high / step - round(high / step)) < 1e-6
        if last - first + 1 <= most and ends_meet:
            break
    return np.asarray(step * np.arange(first, last + 1))


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


def signed(value: float) -> str:
    """Return three significant digits with a sign.

    Examples
    --------
    >>> signed(-0.04831), signed(123.4), signed(0)
    ('−0.0483', '+123', '0')
    """
    if value == 0:
        return "0"
    return ("+" if value > 0 else "−") + number(abs(value))


def number(value: float) -> str:
    """Return at most four digits, never an exponent where it can be avoided.

    Examples
    --------
    >>> number(1234.5), number(0.5), number(200.0), number(12.345)
    ('1234', '0.5', '200', '12.3')
    """
    if value >= 100:
        return f"{value:.0f}"
    return f"{value:.3g}"
