"""Deviations to colours: ranges, palettes with or without bands, ticks and labels. numpy only.

A palette has 256 entries. Entry 0 is for values below the range and entry 255 for values above it; the 254
between them cover the range. All values are in mm.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

__all__ = [
    "PALETTES",
    "RANGE_MODES",
    "ColorMap",
    "color_map",
    "color_tuples",
    "format_deviation",
    "nice_step",
    "palette_colors",
    "palette_ids",
    "ticks",
    "unit_of",
]

N_COLORS = 256
_N_INNER = N_COLORS - 2

#: Equally spaced colours of each palette, interpolated between.
PALETTES = {
    "Blue-red": "3b4cc0 6282ea 8db0fe b8d0f9 dddddd f5c4ad f49a7b de604d b40426",
    "Rainbow": "3026a8 2878e0 22b8d8 3cb95a b4d438 f7c52e f07a24 c4201e",
    "Viridis": "440154 472d7b 3b528b 2c728e 21918c 28ae80 5ec962 addc30 fde725",
    "Grey": "2b2b2b e6e6e6",
}
#: How the range of the colours is chosen.
RANGE_MODES = ("Automatic", "Symmetric", "Tolerance", "Manual")
#: How much darker than its end of the palette a value outside the range is drawn.
_OUTSIDE_SHADE = 0.45


@dataclass(frozen=True)
class ColorMap:
    """A range of deviations and the colours for it.

    Parameters
    ----------
    low, high : float
        Ends of the range [mm], low < high.
    palette : str
        One of `PALETTES`.
    bands : int
        Number of steps of colour; 0 for a smooth passage.
    """

    low: float
    high: float
    palette: str = "Blue-red"
    bands: int = 0

    @property
    def span(self) -> float:
        """Width of the range [mm]."""
        return self.high - self.low

    def colors(self) -> np.ndarray:
        """Return the palette, (256, 3) uint8."""
        return palette_colors(self.palette, self.bands)

    def ids(self, values: Any) -> np.ndarray:
        """Return the palette entry of each deviation, uint8."""
        return palette_ids(values, self.low, self.high)

    def texture_transform(self) -> tuple[float, float]:
        """Return (scale, shift): a deviation [mm] times scale plus shift is its place along the palette."""
        # Drawn in from both ends by a hundredth of a colour: single precision must not push them out.
        scale = (_N_INNER - 0.02) / N_COLORS / self.span
        return scale, 1.01 / N_COLORS - self.low * scale

    def ticks(self, most: int = 9) -> list[tuple[float, str]]:
        """Return (value [mm], label) of the ticks: the edges of the bands, or round numbers."""
        factor, _ = unit_of(self.low, self.high)
        if self.bands:
            step = max(1, math.ceil(self.bands / (most - 1)))
            values = np.linspace(self.low, self.high, self.bands + 1)[::step]
            return _labelled(values, factor, _decimals_to_tell_apart(values * factor))
        return ticks(self.low, self.high, most=most)


def color_map(
    values: Any,
    mode: str = "Symmetric",
    *,
    zone: float | None = None,
    limits: tuple[float, float] | None = None,
    palette: str = "Blue-red",
    bands: int = 0,
) -> ColorMap:
    """Return the colours for some deviations.

    Parameters
    ----------
    values : array of float
        Deviations [mm], or only their extremes.
    mode : str
        ``Automatic`` spans the values, ``Symmetric`` has zero in the middle, ``Tolerance`` is ± half of
        `zone`, ``Manual`` is `limits`. The first two are rounded outwards to round numbers.
    zone : float, optional
        Width of the tolerance zone [mm]; without one, ``Tolerance`` falls back on ``Symmetric``.
    limits : (float, float), optional
        The range of ``Manual`` [mm].

    Raises
    ------
    ValueError
        An unknown mode or palette, or limits that are no range.
    """
    if mode not in RANGE_MODES:
        raise ValueError(f"{mode!r} is no way to choose a range; the ways are {', '.join(RANGE_MODES)}")
    if palette not in PALETTES:
        raise ValueError(f"{palette!r} is no palette; the palettes are {', '.join(PALETTES)}")
    chosen = ColorMap(-1.0, 1.0, palette, max(0, int(bands)))
    if mode == "Manual":
        low, high = limits if limits is not None else (0.0, 0.0)
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise ValueError(f"the range of colours goes from {low:g} mm to {high:g} mm; it needs low < high")
        return replace(chosen, low=float(low), high=float(high))
    if mode == "Tolerance" and zone is not None and zone > 0.0:
        return replace(chosen, low=-zone / 2.0, high=zone / 2.0)
    low, high = _extremes(values)
    if mode != "Automatic":
        high = max(abs(low), abs(high))
        low = -high
    low, high = _rounded_outwards(low, high)
    return replace(chosen, low=low, high=high)


def palette_colors(name: str, bands: int = 0) -> np.ndarray:
    """Return the 256 colours (256, 3) uint8 of a palette; the first and the last are for values outside."""
    anchors = np.array([list(bytes.fromhex(text)) for text in PALETTES[name].split()], dtype=float)
    places = (np.arange(_N_INNER) + 0.5) / _N_INNER
    if bands:
        places = np.floor(places * bands) / max(bands - 1, 1) if bands > 1 else np.full(_N_INNER, 0.5)
    at = np.linspace(0.0, 1.0, len(anchors))
    inner = np.stack([np.interp(places, at, anchors[:, channel]) for channel in range(3)], axis=1)
    outside = anchors[[0, -1]] * _OUTSIDE_SHADE
    return np.rint(np.concatenate([outside[:1], inner, outside[1:]])).astype(np.uint8)


def palette_ids(values: Any, low: float, high: float) -> np.ndarray:
    """Return the palette entry of each deviation: 0 below the range (and for NaN), 255 above, else 1..254."""
    scaled = np.asarray(values, dtype=np.float32) - np.float32(low)
    scaled *= np.float32(_N_INNER / (high - low))
    slack = np.float32(1e-2)
    scaled[np.isnan(scaled)] = -1.0
    below, above = scaled < -slack, scaled > _N_INNER + slack
    np.clip(scaled, 0.0, _N_INNER - 1, out=scaled)
    ids = scaled.astype(np.uint8)
    ids += 1
    ids[below] = 0
    ids[above] = N_COLORS - 1
    return ids


def color_tuples(palette: np.ndarray, ids: np.ndarray) -> list[tuple[float, float, float, float]]:
    """Return one FreeCAD colour per id; the 256 tuples are shared, which is what makes it fast."""
    shared = [(red / 255.0, green / 255.0, blue / 255.0, 0.0) for red, green, blue in palette.tolist()]
    return [shared[entry] for entry in ids.tolist()]


def nice_step(span: float, most: int) -> float:
    """Return the smallest 1, 2 or 5 times a power of ten that divides a span into at most `most` parts."""
    raw = span / max(most, 1)
    power = 10.0 ** math.floor(math.log10(raw))
    for factor in (1.0, 2.0, 5.0, 10.0):
        if factor * power >= raw * (1.0 - 1e-9):
            return factor * power
    return 10.0 * power


def ticks(low: float, high: float, *, most: int = 9) -> list[tuple[float, str]]:
    """Return (value [mm], label) at round numbers inside a range, in the unit of `unit_of`."""
    factor, _ = unit_of(low, high)
    scaled_low, scaled_high = low * factor, high * factor
    step = nice_step(scaled_high - scaled_low, most - 1)
    first = math.ceil(scaled_low / step - 1e-6)
    last = math.floor(scaled_high / step + 1e-6)
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    values = np.array([round(k * step, decimals + 3) for k in range(first, last + 1)]) / factor
    return _labelled(values, factor, decimals)


def unit_of(low: float, high: float) -> tuple[float, str]:
    """Return (factor, unit): µm where the whole range is below 1 mm, else mm."""
    return (1.0, "mm") if max(abs(low), abs(high)) >= 1.0 else (1000.0, "µm")


def format_deviation(value: float | None, *, signed: bool = False) -> str:
    """Return a length as people read it: ``12.3 µm``, ``0.04 µm``, ``1.25 mm``; a dash for no value."""
    if value is None or not math.isfinite(value):
        return "–"
    factor, unit = unit_of(value, value)
    scaled = value * factor
    decimals = 1 if abs(scaled) >= 10.0 else 2
    if unit == "mm":
        decimals = 3
    text = f"{scaled:.{decimals}f}"
    if float(text) == 0.0:
        return f"0 {unit}"
    return f"{'+' if signed and scaled > 0 else ''}{text} {unit}"


def _extremes(values: Any) -> tuple[float, float]:
    array = np.asarray(values, dtype=float)
    array = array[np.isfinite(array)]
    if not array.size:
        return 0.0, 0.0
    return float(array.min()), float(array.max())


def _rounded_outwards(low: float, high: float) -> tuple[float, float]:
    """Return the next round numbers outside a range; ± 1 µm where there is no deviation at all."""
    if high - low < 1e-9:
        reach = max(1e-3, 2.0 * abs(low))
        low, high = low - reach, high + reach
    step = nice_step(high - low, 10)
    digits = max(0, 3 - math.floor(math.log10(step)))
    lower = round(math.floor(low / step + 1e-6) * step, digits)
    upper = round(math.ceil(high / step - 1e-6) * step, digits)
    return lower, upper


def _labelled(values: np.ndarray, factor: float, decimals: int) -> list[tuple[float, str]]:
    labels = []
    for value in values:
        text = f"{value * factor:+.{decimals}f}"
        labels.append("0" if float(text) == 0.0 else text)
    return [(float(value), label) for value, label in zip(values, labels)]


def _decimals_to_tell_apart(values: np.ndarray) -> int:
    for decimals in range(6):
        rounded = np.round(values, decimals)
        if np.allclose(rounded, values, atol=0.02 * abs(values[-1] - values[0]) / max(len(values) - 1, 1)):
            return decimals
    return 6
