"""Dimensions as AP242 instances."""

from __future__ import annotations

import re

from cadskin.cad.pmi.compose import Composer
from cadskin.cad.pmi.tokens import Enumeration, Reference, Value
from cadskin.spec.dimension import Dimension, clean_sum
from cadskin.spec.fits import fit_deviations

__all__ = ["compose_dimensions"]

_NOTES = {"basic": "theoretical", "reference": "auxiliary"}
_FIT = re.compile(r"([A-Za-z]+)(\d+)\Z")
_SMALL = Enumeration("SMALL")


def compose_dimensions(composer: Composer, dimensions: tuple[Dimension, ...]) -> None:
    """Add the dimensions with their values and limits."""
    for dimension in dimensions:
        number = _characteristic(composer, dimension)
        fit = _limits_of_fit(dimension)
        deviations = None if fit else _deviations(dimension)
        items = _items(composer, dimension, with_limits=not fit and deviations is None)
        if items:
            out = composer.out
            shape = out.add("SHAPE_DIMENSION_REPRESENTATION", "", items, composer.context)
            out.add("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION", number, shape)
        if fit:
            _write_fit(composer, number, fit)
        elif deviations is not None:
            _write_deviations(composer, number, dimension, deviations)
        if dimension.fit and not fit:
            composer.lost.append(f"dimension {dimension.id}: fit {dimension.fit} (its limits differ)")


def _characteristic(composer: Composer, dimension: Dimension) -> Reference:
    out = composer.out
    angle: tuple[Value, ...] = (_SMALL,) if dimension.angular else ()
    if dimension.second != type(dimension.second)() and not dimension.kind.endswith("location"):
        composer.lost.append(f"dimension {dimension.id}: a size has no second feature")
    if dimension.kind.endswith("location"):
        pair = composer.aspect(dimension.feature), composer.aspect(dimension.second)
        kind = "ANGULAR_LOCATION" if dimension.angular else "DIMENSIONAL_LOCATION"
        return out.add(kind, dimension.name, "", *pair, *angle)
    kind = "ANGULAR_SIZE" if dimension.angular else "DIMENSIONAL_SIZE"
    return out.add(kind, composer.aspect(dimension.feature), dimension.name, *angle)


def _limits_of_fit(dimension: Dimension) -> str | None:
    """Return the fit where its limits are those of the dimension, so that they read back."""
    if dimension.fit is None or dimension.nominal is None or _FIT.match(dimension.fit) is None:
        return None
    try:
        low, high = fit_deviations(dimension.nominal, dimension.fit)
    except ValueError:
        return dimension.fit if dimension.lower is None and dimension.upper is None else None
    limits = clean_sum(dimension.nominal, low), clean_sum(dimension.nominal, high)
    return dimension.fit if limits == (dimension.lower, dimension.upper) else None


def _deviations(dimension: Dimension) -> tuple[float, float] | None:
    """Return the signed deviations where they read back as the same limits."""
    nominal, low, high = dimension.nominal, dimension.lower, dimension.upper
    if nominal is None or low is None or high is None:
        return None
    pair = clean_sum(low, -nominal), clean_sum(high, -nominal)
    candidates = (tuple(round(value, 12) for value in pair), pair)
    for first, second in candidates:
        if (clean_sum(nominal, first), clean_sum(nominal, second)) == (low, high):
            return first, second
    return None


def _items(composer: Composer, dimension: Dimension, *, with_limits: bool) -> tuple[Value, ...]:
    angular = dimension.angular
    items: list[Value] = []
    if dimension.nominal is not None:
        items.append(composer.item(dimension.nominal, "nominal value", angular=angular))
    if with_limits:
        for name, value in (("lower limit", dimension.lower), ("upper limit", dimension.upper)):
            if value is not None:
                items.append(composer.item(value, name, angular=angular))
    words = [_NOTES[dimension.qualifier]] if dimension.qualifier in _NOTES else []
    for word in (*words, *dimension.modifiers):
        items.append(composer.out.add("DESCRIPTIVE_REPRESENTATION_ITEM", "dimensional note", word))
    return tuple(items)


def _write_fit(composer: Composer, number: Reference, fit: str) -> None:
    match = _FIT.match(fit)
    assert match is not None
    zone = "hole" if match[1][0].isupper() else "shaft"
    limits = composer.out.add("LIMITS_AND_FITS", match[1], zone, match[2], "")
    composer.out.add("PLUS_MINUS_TOLERANCE", limits, number)


def _write_deviations(
    composer: Composer, number: Reference, dimension: Dimension, deviations: tuple[float, float]
) -> None:
    make = composer.angle if dimension.angular else composer.length
    low, high = (make(value) for value in deviations)
    value = composer.out.add("TOLERANCE_VALUE", low, high)
    composer.out.add("PLUS_MINUS_TOLERANCE", value, number)
