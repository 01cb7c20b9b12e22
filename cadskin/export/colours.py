"""Colour maps for deviations and colours for features, safe for colour-blind readers.

The maps are made here from a few control points in OKLab, a space in which equal steps look equal; a
diverging map has the same lightness on both sides, so that neither sign looks stronger.

References
----------
B. Ottosson, "A perceptual color space for image processing" (2020), the OKLab matrices.
K. Moreland, "Diverging color maps for scientific visualization", ISVC 2009, doi:10.1007/978-3-642-10520-3_9.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from cadskin._arrays import frozen
from cadskin._typing import Floats
from cadskin.errors import ExportError

__all__ = [
    "COLORMAPS",
    "Colormap",
    "colormap_table",
    "feature_colours",
    "map_colours",
    "to_linear",
    "to_srgb",
]

Colormap: TypeAlias = "str | ArrayLike"

# Control points (position, lightness, chroma, hue in degrees) in OKLCh.
_CONTROLS: dict[str, tuple[tuple[float, float, float, float], ...]] = {
    "blue-red": (
        (0.00, 0.42, 0.150, 260.0),
        (0.22, 0.60, 0.135, 250.0),
        (0.40, 0.80, 0.070, 240.0),
        (0.50, 0.945, 0.006, 240.0),
        (0.50, 0.945, 0.006, 60.0),
        (0.60, 0.80, 0.085, 50.0),
        (0.78, 0.60, 0.160, 36.0),
        (1.00, 0.42, 0.155, 24.0),
    ),
    "green-purple": (
        (0.00, 0.42, 0.090, 165.0),
        (0.22, 0.60, 0.105, 165.0),
        (0.40, 0.80, 0.065, 165.0),
        (0.50, 0.945, 0.006, 165.0),
        (0.50, 0.945, 0.006, 315.0),
        (0.60, 0.80, 0.080, 315.0),
        (0.78, 0.60, 0.150, 310.0),
        (1.00, 0.42, 0.160, 305.0),
    ),
    "dark-light": (
        (0.00, 0.25, 0.090, 285.0),
        (0.35, 0.47, 0.130, 350.0),
        (0.70, 0.70, 0.140, 50.0),
        (1.00, 0.95, 0.080, 100.0),
    ),
}
COLORMAPS = tuple(_CONTROLS)
_N_COLOURS = 512
# M1^-1 and M2^-1 of OKLab: L, a, b -> l', m', s' and l, m, s -> linear sRGB.
_LAB_TO_LMS = np.array(
    [
        [1.0, 0.3963377774, 0.2158037573],
        [1.0, -0.1055613458, -0.0638541728],
        [1.0, -0.0894841775, -1.2914855480],
    ]
)
_LMS_TO_RGB = np.array(
    [
        [4.0767416621, -3.3077115913, 0.2309699292],
        [-1.2684380046, 2.6097574011, -0.3413193965],
        [-0.0041960863, -0.7034186147, 1.7076147010],
    ]
)


def to_linear(srgb: Floats) -> Floats:
    """Return linear light of sRGB values in 0..1 (IEC 61966-2-1)."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def to_srgb(linear: Floats) -> Floats:
    """Return sRGB values of linear light in 0..1 (IEC 61966-2-1)."""
    linear = np.clip(linear, 0.0, 1.0)
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


def colormap_table(colormap: Colormap = "blue-red") -> Floats:
    """Return the colours of a map, low to high.

    Parameters
    ----------
    colormap : str or (k, 3) array_like
        ``blue-red``, ``green-purple`` (diverging), ``dark-light`` (one-sided), or sRGB colours in 0..1.

    Returns
    -------
    (512, 3) float
        sRGB in 0..1.

    Raises
    ------
    ExportError
        No such map.

    Examples
    --------
    >>> colormap_table("blue-red").shape
    (512, 3)
    """
    if isinstance(colormap, str):
        return _named_table(colormap)
    colours = np.asarray(colormap, dtype=np.float64)
    if (
        colours.ndim != 2
        or colours.shape[1] != 3
        or len(colours) < 2
        or not ((colours >= 0) & (colours <= 1)).all()
    ):
        raise ExportError("a colormap is a name or two or more sRGB rows (k, 3) with values from 0 to 1")
    at = np.linspace(0, 1, _N_COLOURS)
    return np.stack([np.interp(at, np.linspace(0, 1, len(colours)), colours[:, k]) for k in range(3)], axis=1)


@lru_cache(maxsize=8)
def _named_table(name: str) -> Floats:
    try:
        position, lightness, chroma, hue = np.array(_CONTROLS[name]).T
    except KeyError:
        raise ExportError(f"there is no colormap {name!r}; known are {', '.join(COLORMAPS)}") from None
    at = np.linspace(0, 1, _N_COLOURS)
    # Interpolate a and b, not the hue, so that the map runs straight through the neutral middle.
    lab = np.stack(
        [
            np.interp(at, position, values)
            for values in (
                lightness,
                chroma * np.cos(np.deg2rad(hue)),
                chroma * np.sin(np.deg2rad(hue)),
            )
        ],
        axis=1,
    )
    return frozen(_oklab_to_srgb(lab))


def _oklab_to_srgb(lab: Floats) -> Floats:
    lms = (lab @ _LAB_TO_LMS.T) ** 3
    return to_srgb(lms @ _LMS_TO_RGB.T)


def map_colours(values: Floats, low: float, high: float, colormap: Colormap = "blue-red") -> Floats:
    """Return the sRGB colours (k, 3) in 0..1 of ``values`` (k,); what lies outside gets an end colour."""
    table = colormap_table(colormap)
    share = (np.asarray(values) - low) / (high - low if high > low else 1.0)
    at = np.clip(share, 0.0, 1.0) * (len(table) - 1)
    below = np.minimum(at.astype(np.int64), len(table) - 2)
    part = (at - below)[:, None]
    return np.asarray(table[below] * (1 - part) + table[below + 1] * part)


def feature_colours(count: int) -> Floats:
    """Return ``count`` soft sRGB colours (count, 3), neighbours far apart in hue."""
    index = np.arange(count)
    hue = 2 * np.pi * ((0.66 + index * 0.6180339887498949) % 1.0)  # golden-ratio steps never repeat
    lightness = np.array([0.80, 0.75, 0.87])[index % 3]
    chroma = np.array([0.085, 0.095, 0.065])[index % 3]
    lab = np.stack([lightness, chroma * np.cos(hue), chroma * np.sin(hue)], axis=1)
    return _oklab_to_srgb(lab)
