"""The rows that say how a made part stands against its tolerances."""

from __future__ import annotations

import re
from typing import Any

from ..colormap import format_deviation, unit_of
from ..qt import translate
from .base import shown_name, symbol_of

__all__ = ["place_of", "result_rows", "verdict"]


def result_rows(
    rows: list[dict[str, Any]], names: dict[str, tuple[str, str]]
) -> list[tuple[list[str], str, str]]:
    """Return the rows of a table: tolerance, value of limit, pass or fail; with kind and tooltip.

    Parameters
    ----------
    rows : list of dict
        ``id characteristic value limit ok certified reason`` each.
    names : dict
        (Faces, label) of the tolerance of an id.
    """
    return [_row(row, names) for row in rows]


def _row(row: dict[str, Any], names: dict[str, tuple[str, str]]) -> tuple[list[str], str, str]:
    name, ok = row["characteristic"], row.get("ok")
    symbol = symbol_of(name)
    place = place_of(str(row["id"]))
    faces, label = names.get(row["id"], (place, " ".join((shown_name(name), place)).strip()))
    mark, kind = {True: ("✓", "good"), False: ("✗", "bad")}.get(ok, ("?", "caution"))
    tip = [label, f"{shown_name(name)} {faces}: {format_deviation(row.get('value'))}"]
    tip.append(f"{translate('limit')}: {format_deviation(row.get('limit'))}")
    if row.get("certified"):
        tip.append(translate("the value is proved"))
    if row.get("reason"):
        tip.append(str(row["reason"]))
    words = (symbol, faces) if symbol and faces else (symbol, shown_name(name), faces)
    return [" ".join(words).strip(), _value_of_limit(row), mark], kind, "\n".join(tip)


def place_of(identifier: str) -> str:
    """Return the faces of a row of the general tolerance, counted as FreeCAD does.

    >>> place_of("general@faces3+4")
    'Face4+5'
    """
    numbers = re.findall(r"[0-9]+", identifier.partition("@")[2])
    return "Face" + "+".join(str(int(number) + 1) for number in numbers) if numbers else ""


def _value_of_limit(row: dict[str, Any]) -> str:
    """Return ``12.3 / 50 µm``: short enough for a narrow panel."""
    value, limit = row.get("value"), row.get("limit")
    if value is None or limit is None:
        return f"– / {format_deviation(limit)}"
    factor, unit = unit_of(limit, limit)
    return f"{value * factor:.3g} / {limit * factor:.4g} {unit}"


def verdict(rows: list[dict[str, Any]]) -> tuple[str, str]:
    """Return (sentence, kind) over all tolerances: the first reason is named, the others are in the table."""
    failed = [row for row in rows if row.get("ok") is False]
    unknown = [row for row in rows if row.get("ok") is None]
    if not rows:
        return translate("no tolerance to hold"), ""
    reason = next((str(row["reason"]) for row in failed or unknown if row.get("reason")), "")
    if failed:
        text = f"{len(failed)} / {len(rows)} {translate('tolerances not held')}"
        return (f"{text}: {reason}" if reason else text), "bad"
    if unknown:
        text = f"{len(unknown)} / {len(rows)} {translate('tolerances not evaluated')}"
        return (f"{text}: {reason}" if reason else text), "caution"
    return translate("all tolerances are held"), "good"
