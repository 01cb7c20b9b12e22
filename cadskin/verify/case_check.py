"""Is a question well formed? What an evaluation reads must be of the kind that it expects."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from cadskin.errors import SpecificationError

__all__ = ["KNOWN", "array_of", "checked_question", "number_of", "vector_of", "without_nulls"]


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _is_vector(value: Any) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(_is_number(item) for item in value)


def _is_direction(value: Any) -> bool:
    return _is_vector(value) and any(item != 0 for item in value)


def _is_pose(value: Any) -> bool:
    if not isinstance(value, Mapping) or not _is_vector(value.get("origin")):
        return False
    axes = value.get("axes")
    if not (isinstance(axes, list) and len(axes) == 3 and all(_is_vector(row) for row in axes)):
        return False
    products = [sum(axes[k][i] * axes[k][j] for k in range(3)) for i in range(3) for j in range(3)]
    return all(abs(p - float(n in (0, 4, 8))) < 1e-6 for n, p in enumerate(products))


def _is_place(value: Any) -> bool:
    if _is_number(value):
        return True
    if not isinstance(value, list) or not value:
        return False
    return (len(value) <= 3 and all(map(_is_number, value))) or all(
        isinstance(item, Mapping) and "feature" in item for item in value
    )


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_object(value: Any) -> bool:
    return isinstance(value, Mapping)


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, str) for item in value)


def _are_objects(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, Mapping) for item in value)


def _are_datums(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(item, str | Mapping) for item in value)


def _is_tolerance(value: Any) -> bool:
    return _is_number(value) or _is_object(value)


# Entry -> (test, what is expected).
KNOWN: dict[str, tuple[Callable[[Any], bool], str]] = {
    "id": (lambda value: isinstance(value, str | int), "a name"),
    "csv": (_is_text, "the name of a file"),
    "characteristic": (_is_text, "a word"),
    "association": (_is_text, "words"),
    "feature_type": (_is_text, "words"),
    "zone": (_is_text, "words"),
    "standard": (_is_text, "words"),
    "datum_association": (_is_text, "words"),
    "datums": (_are_datums, "a list of objects with 'label'"),
    "toleranced": (_is_object, "an object with 'feature' and 'type'"),
    "tolerance": (_is_tolerance, "a number or an object with 't' [mm]"),
    "TED": (_is_place, "one to three numbers [mm], or a list of objects with 'feature' and 'xy' or 'xyz'"),
    "TED_axes": (_is_text, "words"),
    "TED_angle_deg": (_is_number, "a number [deg]"),
    "zone_offset_UZ": (_is_number, "a number [mm]"),
    "free_dof": (_are_texts, "a list of tx, ty, tz, rx, ry, rz"),
    "nominal": (_are_objects, "a list of objects with 'type'"),
    "start_pose": (_is_pose, "an object with 'origin' (3 numbers) and 'axes' (3 x 3, orthonormal)"),
    "datum_frame": (_is_pose, "an object with 'origin' (3 numbers) and 'axes' (3 x 3, orthonormal)"),
    "section_plane_normal": (_is_direction, "three numbers, not all zero"),
    "axis_hint": (_is_direction, "three numbers, not all zero"),
    "outward_normal_hint": (_is_direction, "three numbers, not all zero"),
    "normal_hint": (_is_direction, "three numbers, not all zero"),
    "filter": (_is_object, "an object with 'type' and a cut-off"),
}
# What else a file may say about itself.
_REMARKS = (
    "also", "author", "comment", "comments", "description", "iso14405", "licence", "license", "note", "notes",
    "pattern", "proof", "quantity", "reference", "source", "title", "tolerance_abs", "units",
    "zone_offset_OZ",
)  # fmt: skip


def without_nulls(value: Any) -> Any:
    """Return JSON data without the entries of objects that are null: they are the same as missing ones."""
    if isinstance(value, Mapping):
        return {key: without_nulls(item) for key, item in value.items() if item is not None}
    if isinstance(value, list):
        return [without_nulls(item) for item in value]
    return value


def number_of(entry: Mapping[str, Any], key: str) -> float:
    """Return a number of a nominal surface.

    Raises
    ------
    KeyError
        It is missing.
    SpecificationError
        It is no number.
    """
    value = entry[key]
    if not _is_number(value):
        raise SpecificationError(
            f"{key!r} of the nominal {entry.get('type')} must be a number, got {value!r:.80}"
        )
    return float(value)


def vector_of(entry: Mapping[str, Any], key: str, *, direction: bool = False) -> Any:
    """Return three numbers of a nominal surface; see `number_of`."""
    value = entry[key]
    if not (_is_direction(value) if direction else _is_vector(value)):
        raise SpecificationError(
            f"{key!r} of the nominal {entry.get('type')} must be three numbers"
            f"{', not all zero' if direction else ''}, got {value!r:.80}"
        )
    return value


def array_of(entry: Mapping[str, Any], key: str, *, last: tuple[int, ...]) -> Any:
    """Return a net of numbers of a nominal surface of shape (m, n) and ``last``; see `number_of`."""
    try:
        value = np.asarray(entry[key], dtype=np.float64)
    except (TypeError, ValueError):
        value = np.zeros(0)
    if (
        value.ndim != 2 + len(last)
        or value.shape[2:] != last
        or not np.isfinite(value).all()
        or not value.size
    ):
        shape = " x ".join(["m", "n", *map(str, last)])
        raise SpecificationError(f"{key!r} of the nominal {entry.get('type')} must be {shape} numbers")
    return value


def checked_question(name: str, question: Mapping[str, Any]) -> tuple[str, ...]:
    """Check the entries of a case; return those that no evaluation reads.

    Raises
    ------
    SpecificationError
        An entry of another kind than expected, or an unknown one that is nearly the name of a missing one.
    """
    for key, (test, expected) in KNOWN.items():
        value = question.get(key)
        if value is not None and not test(value):
            raise SpecificationError(f"case {name}: {key!r} must be {expected}, got {value!r:.80}")
    unread = tuple(key for key in question if key not in KNOWN and key not in _REMARKS)
    missing = [key for key in KNOWN if key not in question]
    for key in unread:
        near = difflib.get_close_matches(key, missing, n=1, cutoff=0.8)
        if near:
            raise SpecificationError(f"case {name}: unknown entry {key!r}; did you mean {near[0]!r}?")
    for entry in question.get("datums") or ():
        if isinstance(entry, Mapping):
            _check_datum(name, entry)
    return unread


def _check_datum(name: str, entry: Mapping[str, Any]) -> None:
    label = entry.get("label")
    for key in ("outward_normal_hint", "axis_hint"):
        if entry.get(key) is not None and not _is_direction(entry[key]):
            raise SpecificationError(
                f"case {name}: {key!r} of datum {label} must be three numbers, not all zero, "
                f"got {entry[key]!r:.80}"
            )
