"""Indicators in a spec file: ``intersection_plane = "parallel A"``."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, radians
from typing import Any

from cadskin.spec.datums import as_datum_system
from cadskin.spec.indicators import INDICATOR_KINDS, Indicator, IndicatorKind, as_indicator
from cadskin.spec.toml_features import guarded
from cadskin.spec.toml_table import SpecTable

__all__ = ["indicator_values", "read_indicators"]


def read_indicators(item: SpecTable) -> Iterator[Indicator]:
    """Yield the indicators that the keys of a tolerance give."""
    for kind in INDICATOR_KINDS:
        value = item.raw(kind)
        if isinstance(value, str):
            yield guarded(item, as_indicator, kind, value)
        elif value is not None:
            yield _from_table(item, kind)


def _from_table(item: SpecTable, kind: IndicatorKind) -> Indicator:
    table = item.table(kind) or SpecTable({}, item.path, item.where)
    angle, in_radians = table.number("angle_deg"), table.number("angle_rad")
    found: Indicator = guarded(
        table,
        lambda: Indicator(
            kind,
            table.text("relation", "parallel"),  # type: ignore[arg-type]
            as_datum_system(table.text("datums")),
            in_radians if angle is None else radians(angle),
            table.numbers("direction", 3),  # type: ignore[arg-type]
        ),
    )
    table.finish(("relation", "datums", "angle_deg", "angle_rad", "direction"))
    return found


def indicator_values(indicators: tuple[Indicator, ...]) -> dict[str, Any]:
    """Return the indicators as values of a spec file."""
    return {item.kind: item.text() or _table(item) for item in indicators}


def _table(item: Indicator) -> dict[str, Any]:
    angle = {} if item.angle is None else _angle(item.angle)
    return {
        "relation": item.relation,
        "datums": item.datums.text() or None,
        **angle,
        "direction": item.direction,
    }


def _angle(value: float) -> dict[str, float]:
    for candidate in (round(degrees(value), 9), degrees(value)):
        if radians(candidate) == value:
            return {"angle_deg": candidate}
    return {"angle_rad": value}
