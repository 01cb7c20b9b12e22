"""What the deviation map of a skin object shows: its settings, its colours and its legend.

The settings are properties of the view object, so that they are saved with the document and can be changed in
the property editor, by the panel or by a macro alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from .colormap import PALETTES, RANGE_MODES, ColorMap, color_map, color_tuples, format_deviation
from .result import SkinResult

__all__ = [
    "EXAGGERATIONS",
    "LEGEND_POSITIONS",
    "MapSettings",
    "add_map_properties",
    "colors_of",
    "legend_lines",
    "settings_of",
    "vertex_colors",
    "zone_of",
]

#: Steps of the exaggeration in the panel.
EXAGGERATIONS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
#: Corner of the view; the right ones may lie under the task panel of newer FreeCADs.
LEGEND_POSITIONS = ("Top left", "Bottom left", "Top right", "Bottom right", "Hidden")

_GROUP = "Deviation map"


@dataclass(frozen=True)
class MapSettings:
    """The settings of a deviation map, with their defaults.

    Parameters
    ----------
    show : bool
        Deviation colours at all.
    exaggeration : float
        1 to 1000.
    range_mode, palette, bands
        See `colormap.color_map`.
    low, high : float
        The range of the mode ``Manual`` [mm].
    legend : str
        One of `LEGEND_POSITIONS`.
    """

    show: bool = True
    exaggeration: float = 1.0
    range_mode: str = "Symmetric"
    low: float = -0.05
    high: float = 0.05
    palette: str = "Blue-red"
    bands: int = 0
    legend: str = "Top left"


#: Properties of the view object: type, name, field of `MapSettings`,
#: choices or (default, lowest, highest, step), text.
_PROPERTIES = (
    ("App::PropertyBool", "DeviationMap", "show", None, "Show the deviations as colours"),
    (
        "App::PropertyFloatConstraint",
        "Exaggeration",
        "exaggeration",
        (1.0, 1.0, 1000.0, 1.0),
        "How many times larger than they are the deviations are drawn, 1 to 1000",
    ),
    (
        "App::PropertyEnumeration",
        "RangeMode",
        "range_mode",
        RANGE_MODES,
        "How the range of colours is chosen",
    ),
    ("App::PropertyFloat", "RangeLow", "low", None, "Lower end of a manual range, in mm"),
    ("App::PropertyFloat", "RangeHigh", "high", None, "Upper end of a manual range, in mm"),
    ("App::PropertyEnumeration", "Palette", "palette", tuple(PALETTES), "Colours"),
    (
        "App::PropertyIntegerConstraint",
        "Bands",
        "bands",
        (0, 0, 32, 1),
        "Number of steps of colour, 0 for a smooth passage",
    ),
    ("App::PropertyEnumeration", "Legend", "legend", LEGEND_POSITIONS, "Where the legend is drawn"),
)
PROPERTY_NAMES = tuple(name for _, name, _, _, _ in _PROPERTIES)


def add_map_properties(view_object: Any) -> None:
    """Give a view object the properties of a deviation map that it has not yet."""
    defaults = MapSettings()
    for kind, name, field, choices, text in _PROPERTIES:
        if name in view_object.PropertiesList:
            continue
        view_object.addProperty(kind, name, _GROUP, text)
        if kind == "App::PropertyEnumeration":
            setattr(view_object, name, list(choices))
        elif choices is not None:
            setattr(view_object, name, choices)
            continue
        setattr(view_object, name, getattr(defaults, field))


def settings_of(view_object: Any) -> MapSettings:
    """Return the settings of a view object; the defaults where there is none (without a GUI)."""
    defaults = MapSettings()
    if view_object is None:
        return defaults
    return MapSettings(
        **{
            field: getattr(view_object, name, getattr(defaults, field))
            for _, name, field, _, _ in _PROPERTIES
        }
    )


def zone_of(obj: Any) -> float | None:
    """Return the narrowest tolerance [mm] of a skin object; None without tolerances."""
    widths = [float(getattr(tolerance.Value, "Value", tolerance.Value)) for tolerance in _tolerances(obj)]
    return min((width for width in widths if width > 0.0), default=None)


def _tolerances(obj: Any) -> list[Any]:
    return [entry for entry in getattr(obj, "Tolerances", None) or [] if hasattr(entry, "Value")]


def colors_of(extremes: tuple[float, float], settings: MapSettings, zone: float | None = None) -> ColorMap:
    """Return the colours of a result by its `SkinResult.range`: all its instances can be compared.

    A manual range that is none (low ≥ high) falls back on the symmetric one, as properties can only be set
    one by one.
    """
    mode = settings.range_mode
    if mode == "Manual" and not settings.low < settings.high:
        mode = "Symmetric"
    return color_map(
        extremes,
        mode,
        zone=zone,
        limits=(settings.low, settings.high),
        palette=settings.palette,
        bands=settings.bands,
    )


def vertex_colors(
    result: SkinResult, instance: int, colors: ColorMap
) -> list[tuple[float, float, float, float]]:
    """Return the value of ``VertexColors``: one FreeCAD colour per mesh vertex."""
    return color_tuples(colors.colors(), colors.ids(result.vertex_deviation(instance)))


def legend_lines(
    statistics: tuple[float, float, float], instance: int, size: int, exaggeration: float
) -> tuple[str, ...]:
    """Return the small print of the legend; `statistics` as of `SkinResult.statistics`."""
    lowest, highest, rms = statistics
    lines = [f"min {format_deviation(lowest, signed=True)}", f"max {format_deviation(highest, signed=True)}"]
    lines.append(f"RMS {format_deviation(rms)}")
    if size > 1:
        lines.append(f"part {instance + 1} of {size}")
    if exaggeration != 1.0:
        lines.append(f"drawn × {exaggeration:g}")
    return tuple(lines)
