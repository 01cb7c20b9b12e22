"""Dimensions in a spec file."""

from __future__ import annotations

from math import radians

from cadskin.spec.dimension import Dimension, clean_sum
from cadskin.spec.fits import fit_deviations
from cadskin.spec.toml_features import FEATURE_KEYS, UNKNOWN, guarded, read_selection
from cadskin.spec.toml_table import SpecTable

__all__ = ["read_dimension"]

_DIMENSION_KEYS = (
    *FEATURE_KEYS,
    *("size", "distance", "angle", "angle_rad", "to", "name", "fit", "limits", "deviations", "plus_minus"),
    *("lower", "upper", "qualifier", "modifiers", "raw_unit", "kind", "id", "source"),
)


def read_dimension(item: SpecTable) -> Dimension:
    """Return the dimension of one table."""
    heads = [key for key in ("size", "distance", "angle", "angle_rad") if key in item]
    if len(heads) != 1:
        item.skip(_DIMENSION_KEYS)
        item.finish(_DIMENSION_KEYS)
        raise item.error("a dimension is one of size = ..., distance = ..., angle = ... (degrees)")
    head = heads[0]
    to = item.raw("to")
    second = SpecTable(
        to if isinstance(to, dict) else {"on": [] if to is None else to}, (*item.path, "to"), item.where
    )
    kinds = {"size": "size", "distance": "location"}
    kind = item.text("kind") or kinds.get(head, "angular_location" if to is not None else "angular_size")
    scale = radians(1.0) if head == "angle" else 1.0
    value = item.raw(head)
    nominal = None if value == UNKNOWN else _scaled(item.as_number(value, head), head)
    fit = item.text("fit")
    low, high = _limits(item, nominal, fit, scale)
    found: Dimension = guarded(
        item,
        Dimension,
        id=item.text("id", "") or "",
        kind=kind,
        name=item.text("name", "") or "",
        nominal=nominal,
        lower=low,
        upper=high,
        feature=read_selection(item),
        second=read_selection(second),
        fit=fit,
        qualifier=item.text("qualifier", "none"),
        modifiers=item.texts("modifiers"),
        raw_unit=item.text("raw_unit"),
        source=item.text("source") or item.source,
    )
    second.finish(FEATURE_KEYS)
    item.finish(_DIMENSION_KEYS)
    return found


def _scaled(value: float, head: str) -> float:
    return radians(value) if head == "angle" else value


def _limits(
    item: SpecTable, nominal: float | None, fit: str | None, scale: float
) -> tuple[float | None, float | None]:
    ways = [key for key in ("limits", "deviations", "plus_minus") if key in item]
    single = [key for key in ("lower", "upper") if key in item]
    if len(ways) + bool(single) > 1:
        raise item.error(f"give the limits once, not as {' and '.join([*ways, *single])}")
    if single:
        low, high = item.number("lower"), item.number("upper")
        return (None if low is None else low * scale), (None if high is None else high * scale)
    if not ways:
        if fit is None or nominal is None:
            return None, None
        pair = guarded(item, fit_deviations, nominal, fit)
        return clean_sum(nominal, pair[0]), clean_sum(nominal, pair[1])
    if ways == ["limits"]:
        limits = item.numbers("limits", 2)
        return (None, None) if limits is None else (limits[0] * scale, limits[1] * scale)
    if nominal is None:
        raise item.error(f"{ways[0]} needs a nominal value")
    if ways == ["plus_minus"]:
        half = item.number("plus_minus") or 0.0
        return clean_sum(nominal, -half * scale), clean_sum(nominal, half * scale)
    deviations = item.numbers("deviations", 2) or (0.0, 0.0)
    return clean_sum(nominal, deviations[0] * scale), clean_sum(nominal, deviations[1] * scale)
