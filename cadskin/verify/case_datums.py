"""The datums of a case: from its words to datum features."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.verify.datums import DatumCriterion, DatumFeature, DatumKind, Standard

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.verify.cases import Case

__all__ = ["datum_features", "override_of", "standard_of"]

_CRITERIA: tuple[tuple[str, DatumCriterion], ...] = (
    (r"constrained|l2", "constrained least squares"),
    (r"gauss|least.squares|\bls\b", "least squares"),
    (r"circumscribed|\bn\b", "circumscribed"),
    (r"inscribed|\bx\b", "inscribed"),
    (r"minimax|chebyshev|minimum zone|external to material", "minimax"),
)


def standard_of(case: Case) -> Standard:
    """Return the standard that the case names; ISO 5459:2011 by default."""
    words = " ".join(str(case.get(name, "")) for name in ("standard", "datum_association"))
    return "ASME Y14.5.1-2019" if "asme" in words.lower() else "ISO 5459:2011"


def override_of(case: Case) -> DatumCriterion | None:
    """Return the datum criterion that the quantity itself names ("value if LS datum")."""
    text = (case.quantity or "").lower().replace("_", " ")
    if "datum" not in text:
        return None
    return next((word for pattern, word in _CRITERIA[:2] if re.search(pattern, text)), None)


def datum_features(case: Case, criterion: DatumCriterion | None = None) -> list[DatumFeature]:
    """Return the datum features of a case in their order of precedence.

    Raises
    ------
    SpecificationError
        A datum letter without points, or datums in words only.
    """
    entries = case.get("datums") or []
    if not entries:
        raise SpecificationError(f"case {case.id}: {case.characteristic} needs a datum")
    return [_datum_feature(case, entry, criterion) for entry in entries]


def _datum_feature(case: Case, entry: Any, criterion: DatumCriterion | None) -> DatumFeature:
    if not isinstance(entry, Mapping) or "label" not in entry:
        raise SpecificationError(f"case {case.id}: datum {entry!r} has no label and points")
    label, words = str(entry["label"]), str(entry.get("feature_type", "plane")).lower()
    kind = _kind(words)
    association = str(entry.get("association", "")).lower()
    stated = next((word for pattern, word in _CRITERIA if re.search(pattern, association)), None)
    internal = "internal" in words or "hole" in words or "slot" in words or stated == "inscribed"
    first, second = _points(case, entry, label, kind)
    hint = entry.get("outward_normal_hint", entry.get("axis_hint", case.get("axis_hint")))
    direction = None if hint is None else np.asarray(hint, dtype=np.float64)
    if direction is None and kind == "plane":
        direction = _outward_guess(case, first)
    chosen = criterion or stated
    if criterion is not None and kind != "plane" and criterion != "least squares":
        chosen = stated
    if stated == "minimax" and kind in ("cylinder", "sphere", "width"):
        chosen = None  # the default of the standard for features of size
    return DatumFeature(label, kind, first, internal, direction, chosen, second)


def _kind(words: str) -> DatumKind:
    if ("two" in words and "plane" in words) or "width" in words:
        return "width"
    if re.search(r"cylinder|axis|shaft|hole", words):
        return "cylinder"
    if "sphere" in words:
        return "sphere"
    if "plane" in words:
        return "plane"
    raise SpecificationError(
        f"a datum of type {words!r} is not known; plane, cylinder, sphere, two planes are"
    )


def _points(
    case: Case, entry: Mapping[str, Any], label: str, kind: DatumKind
) -> tuple[Points, Points | None]:
    if kind != "width":
        return case.points(str(entry.get("feature", label))), None
    names = entry.get("features") or sorted(
        n for n in case.features if re.fullmatch(rf"{re.escape(label)}\d+", n)
    )
    if len(names) != 2:
        raise SpecificationError(
            f"case {case.id}: datum {label} needs the points of its two faces, found {names}"
        )
    return case.points(str(names[0])), case.points(str(names[1]))


def _outward_guess(case: Case, points: Points) -> Vectors | None:
    """Away from the rest of the part."""
    everything = np.concatenate(list(case.features.values()))
    away = points.mean(axis=0) - everything.mean(axis=0)
    return away if np.linalg.norm(away) > 1e-9 else None
