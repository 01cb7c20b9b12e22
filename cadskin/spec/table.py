"""A specification as a table for people."""

from __future__ import annotations

from collections.abc import Sequence

from cadskin.spec.dimension import Dimension
from cadskin.spec.frames import dimension_text, frame
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.specification import Specification
from cadskin.spec.tolerance import Tolerance

__all__ = ["rows", "table"]

_MOST_FACES = 8


def table(spec: Specification) -> str:
    """Return the tolerances, datums, dimensions and the unresolved list as aligned text.

    Examples
    --------
    >>> from cadskin.spec import Specification, flatness
    >>> print(table(Specification(flatness(3, 0.02))).splitlines()[1])
    flatness-1  ⏥ 0.02  flatness  mm  3
    """
    return "\n".join(
        line for title, heads, body in rows(spec) if body for line in [*_aligned(title, heads, body), ""]
    ).rstrip()


def rows(spec: Specification) -> list[tuple[str, tuple[str, ...], list[tuple[str, ...]]]]:
    """Return the parts of the table: title, column heads, rows."""
    tolerances = [_tolerance(tolerance) for tolerance in spec.tolerances]
    if spec.default is not None:
        tolerances.append(_tolerance(spec.default))
    datums: list[tuple[str, ...]] = [
        (datum.letter, short(datum.feature), " ".join(t.label for t in datum.targets), datum.source or "")
        for datum in spec.datums
    ]
    dimensions = [_dimension(dimension) for dimension in spec.dimensions]
    notes: list[tuple[str, ...]] = [(note,) for note in spec.notes]
    unresolved: list[tuple[str, ...]] = [(item.entity, item.kind, item.reason) for item in spec.unresolved]
    return [
        ("tolerances", ("id", "frame", "type", "unit", "faces", "source"), tolerances),
        ("datums", ("letter", "faces", "targets", "source"), datums),
        ("dimensions", ("id", "dimension", "name", "unit", "faces", "source"), dimensions),
        ("unresolved", ("entity", "kind", "reason"), unresolved),
        ("notes", ("note",), notes),
    ]


def short(feature: FeatureSelection) -> str:
    """Return the faces of a selection in at most a few words; members of a pattern are in brackets."""
    numbers = feature.faces or feature.step_faces
    if not numbers:
        return feature.text()
    mark = "" if feature.faces else "#"
    groups = feature.groups
    if groups:
        words = ["(" + " ".join(f"{mark}{face}" for face in group) + ")" for group in groups]
    else:
        words = [f"{mark}{face}" for face in numbers]
    shown = " ".join(words[:_MOST_FACES]) + (f" … {len(words)} in all" if len(words) > _MOST_FACES else "")
    head = "face " if len(numbers) == 1 else "faces "
    part = f"{feature.part}: " if feature.part else ""
    derived = "" if feature.derived == "none" else f" ({feature.derived.replace('_', ' ')})"
    return part + head + shown + derived


def _tolerance(tolerance: Tolerance) -> tuple[str, ...]:
    where = short(tolerance.feature)
    if tolerance.scope not in ("feature", "pattern"):
        where = f"{tolerance.scope.replace('_', ' ')}: {where}" if where else f"({tolerance.scope})"
    if tolerance.parent is not None:
        where += f" under {tolerance.parent}"
    return (
        tolerance.id,
        frame(tolerance),
        tolerance.type,
        tolerance.raw_unit or "mm",
        where or "unresolved",
        tolerance.source or "",
    )


def _dimension(dimension: Dimension) -> tuple[str, ...]:
    where = short(dimension.feature)
    if dimension.second:
        where += " to " + short(dimension.second)
    unit = dimension.raw_unit or ("deg" if dimension.angular else "mm")
    return dimension.id, dimension_text(dimension), dimension.name, unit, where, dimension.source or ""


def _aligned(title: str, heads: Sequence[str], body: Sequence[Sequence[str]]) -> list[str]:
    widths = [max(len(row[i]) for row in body) for i in range(len(heads))]
    lines = [
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in body
    ]
    return [f"{title} ({len(body)}): {', '.join(heads)}", *lines]
