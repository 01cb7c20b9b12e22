"""How a picture looks: its options, checked once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, TypeAlias, TypedDict

import numpy as np

from cadskin._typing import Floats
from cadskin.errors import ExportError
from cadskin.export.colours import Colormap, colormap_table
from cadskin.view.camera import View, view_direction
from cadskin.view.numbers import LengthUnit, best_unit, round_limit

__all__ = ["ColourScale", "Engine", "Limits", "Style", "StyleOptions", "checked_size", "colour_scale"]

Engine: TypeAlias = Literal["software", "pyvista"]
Limits: TypeAlias = float | tuple[float, float]

_ENGINES = ("software", "pyvista")
_LEAST_SIDE, _MOST_SIDE = 64, 8192


class StyleOptions(TypedDict, total=False):
    """The keyword options of `cadskin.view.picture` and `cadskin.view.sheet`."""

    view: View
    exaggeration: float | None
    clim: Limits | None
    unit: str | None
    colormap: Colormap
    edges: bool
    lit: bool
    legend: bool
    engine: Engine


@dataclass(frozen=True, eq=False)
class Style:
    """The options of a picture; see `cadskin.view.picture`.

    Raises
    ------
    ExportError
        An option that has no meaning.
    """

    view: View = "auto"
    exaggeration: float | None = None
    clim: Limits | None = None
    unit: str | None = None
    colormap: Colormap = "blue-red"
    edges: bool = True
    lit: bool = True
    legend: bool = True
    engine: Engine = "software"

    def __post_init__(self) -> None:
        """Check every option before any work is done."""
        if self.engine not in _ENGINES:
            raise ExportError(f"engine must be one of {', '.join(_ENGINES)}, got {self.engine!r}")
        if self.exaggeration is not None and not (np.isfinite(self.exaggeration) and self.exaggeration > 0):
            raise ExportError(f"exaggeration must be positive and finite, got {self.exaggeration}")
        if not (isinstance(self.view, str) and self.view == "auto"):
            view_direction(self.view)
        if self.clim is not None:
            _limits(self.clim)
        best_unit(1.0, self.unit)
        colormap_table(self.colormap)


@dataclass(frozen=True, eq=False)
class ColourScale:
    """Which colour means which deviation.

    Parameters
    ----------
    low, high : float
        Deviations at the ends [mm].
    unit : {"µm", "mm"}
        Of the labels.
    table : (k, 3) float
        sRGB in 0..1, from low to high.
    beyond : tuple of bool
        Whether there are deviations below ``low`` and above ``high``; the bar gets a pointed end there.
    """

    low: float
    high: float
    unit: LengthUnit
    table: Floats
    beyond: tuple[bool, bool] = (False, False)


def colour_scale(deviation: Floats, style: Style) -> ColourScale:
    """Return the colour scale for deviations (k,) [mm]; NaN is "not measured"."""
    deviation = deviation[np.isfinite(deviation)]
    smallest, greatest = float(deviation.min(initial=0.0)), float(deviation.max(initial=0.0))
    if style.clim is None:
        limit = max(-smallest, greatest)
        low, high = _limits(round_limit(limit) if limit > 0 else 1e-3)
    else:
        low, high = _limits(style.clim)
    return ColourScale(
        low,
        high,
        best_unit(max(abs(low), abs(high)), style.unit),
        colormap_table(style.colormap),
        (smallest < low * (1 + 1e-9), greatest > high * (1 + 1e-9)),
    )


def checked_size(size: tuple[int, int]) -> tuple[int, int]:
    """Return width and height [pixel].

    Raises
    ------
    ExportError
        Not two whole numbers from 64 to 8192.
    """
    try:
        width, height = (int(side) for side in size)
        fine = (width, height) == tuple(size) and all(
            _LEAST_SIDE <= side <= _MOST_SIDE for side in (width, height)
        )
    except (TypeError, ValueError):
        fine = False
    if not fine:
        raise ExportError(
            f"size must be width and height in whole pixels from {_LEAST_SIDE} to {_MOST_SIDE}, got {size!r}"
        )
    return width, height


def _limits(clim: Limits) -> tuple[float, float]:
    values = np.atleast_1d(np.asarray(clim, dtype=np.float64))
    low, high = (
        (-values[0], values[0]) if values.shape == (1,) else values if values.shape == (2,) else (0, 0)
    )
    if not (np.isfinite(low) and np.isfinite(high) and low < high):
        raise ExportError(f"clim must be a positive number or (low, high) with low < high [mm], got {clim!r}")
    return float(low), float(high)
