"""Tolerances as text: the feature control frame of a drawing on one line."""

from __future__ import annotations

from math import degrees
from typing import TYPE_CHECKING

from cadskin.spec.modifiers import modifier_symbol

if TYPE_CHECKING:
    from cadskin.spec.dimension import Dimension
    from cadskin.spec.tolerance import Tolerance
    from cadskin.spec.zone import ToleranceZone

__all__ = ["dimension_text", "frame", "number"]


def number(value: float | None) -> str:
    """Return a length as text without noise of the conversion from inch: at most seven digits."""
    return "?" if value is None else f"{value:.7g}"


def frame(tolerance: Tolerance) -> str:
    """Return the feature control frame as text.

    Examples
    --------
    >>> from cadskin.spec import position
    >>> frame(position("%CYLINDER", 0.1, datums="A|B|C", diameter=True, material="MMR"))
    '⌖ ⌀0.1 Ⓜ | A | B | C'
    """
    zone = tolerance.zone
    sign = {"diameter": "⌀", "spherical_diameter": "S⌀"}.get(zone.shape, "")
    parts = [tolerance.characteristic.symbol, sign + number(tolerance.value), *_per_unit(zone)]
    if tolerance.material != "RFS":
        parts.append({"MMR": "Ⓜ", "LMR": "Ⓛ"}[tolerance.material])
    parts += _zone_words(zone)
    parts += [modifier_symbol(name) for name in tolerance.modifiers]
    compartments = [reference.symbols() for reference in tolerance.datums.references]
    return "  ".join([" | ".join([" ".join(parts), *compartments]), *map(str, tolerance.indicators)])


def _per_unit(zone: ToleranceZone) -> list[str]:
    words = []
    if zone.per_length is not None:
        words.append(f"/ {number(zone.per_length)}")
    if zone.per_area is not None:
        sides = [number(side) for side in (zone.per_area.size, zone.per_area.second) if side is not None]
        mark = {"circular": "⌀", "square": "□"}.get(zone.per_area.shape, "")
        words.append("/ " + mark + "×".join(sides or [zone.per_area.shape]))
    return words


def _zone_words(zone: ToleranceZone) -> list[str]:
    words = []
    if zone.outside is not None:
        words.append(f"Ⓤ {number(zone.outside)}")
    if zone.projected is not None:
        words.append(f"Ⓟ {number(zone.projected)}")
    if zone.maximum is not None:
        words.append(f"{number(zone.maximum)} MAX")
    return words


def dimension_text(dimension: Dimension) -> str:
    """Return a dimension as text: ``⌀8 +0.015/0``, ``[25]`` for a basic one, ``(25)`` for a reference.

    Angles are shown in degrees.
    """

    def show(value: float) -> str:
        return f"{degrees(value):.7g}°" if dimension.angular else f"{value:.7g}"

    prefix = {"diameter": "⌀", "radius": "R", "spherical diameter": "S⌀", "spherical radius": "SR"}
    head = prefix.get(dimension.name.lower(), "")
    if dimension.nominal is None:
        limits = (dimension.lower, dimension.upper)
        return head + " … ".join("?" if limit is None else show(limit) for limit in limits)
    body = head + show(dimension.nominal)
    if dimension.qualifier == "basic":
        return f"[{body}]"
    if dimension.qualifier == "reference":
        return f"({body})"
    if dimension.fit:
        body += f" {dimension.fit}"
    low, high = dimension.deviations
    if low is None and high is None:
        return body
    if low is not None and high is not None and abs(low + high) <= 1e-9 * max(1.0, abs(high)):
        return f"{body} ±{show(abs(high))}"
    words = [
        "?" if value is None else f"{'+' if value > 0 else ''}{show(value + 0.0)}" for value in (high, low)
    ]
    return f"{body} {'/'.join(words)}"
