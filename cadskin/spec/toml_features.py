"""Selections of features in a spec file."""

from __future__ import annotations

from typing import Any, get_args

from cadskin.errors import SpecificationError
from cadskin.spec.selection import Derived, FeatureSelection
from cadskin.spec.toml_table import SpecTable

__all__ = ["FEATURE_KEYS", "UNKNOWN", "guarded", "read_selection"]

UNKNOWN = "?"
FEATURE_KEYS = ("on", "faces", "step_faces", "groups", "derived", "part")


def read_selection(table: SpecTable) -> FeatureSelection:
    """Return the selection that the keys of a table give."""
    on = table.raw("on", [])
    selectors = on if isinstance(on, list) else [on]
    if not all(isinstance(item, int | str) and not isinstance(item, bool) for item in selectors):
        raise table.error(
            f"on must be a selector like '>Z', a face index, or a list of those, not {on!r}", "on"
        )
    groups = table.raw("groups", [])
    if not isinstance(groups, list) or not all(_is_indices(group) for group in groups):
        raise table.error(f"groups must be lists of face numbers, not {groups!r}", "groups")
    derived = table.text("derived", "none") or "none"
    if derived not in get_args(Derived):
        raise table.error(
            f"derived must be one of {', '.join(get_args(Derived))}, not {derived!r}", "derived"
        )
    found: FeatureSelection = guarded(
        table,
        FeatureSelection,
        faces=table.indices("faces"),
        step_faces=table.indices("step_faces"),
        selectors=tuple(selectors),
        groups=tuple(tuple(group) for group in groups),
        derived=derived,
        part=table.text("part"),
    )
    return found


def _is_indices(group: Any) -> bool:
    return isinstance(group, list) and all(isinstance(x, int) and not isinstance(x, bool) for x in group)


def guarded(table: SpecTable, make: Any, *args: Any, **values: Any) -> Any:
    """Make an object; put the line before what it complains about."""
    try:
        return make(*args, **values)
    except SpecificationError as error:
        raise table.error(str(error)) from None
