"""Contradictions in a specification: what cannot be, and what is probably not meant."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from cadskin.errors import CadskinWarning, SpecificationError
from cadskin.spec.frames import number

if TYPE_CHECKING:
    from cadskin.spec.datums import Datum
    from cadskin.spec.specification import Specification
    from cadskin.spec.tolerance import Tolerance

__all__ = ["Finding", "check", "enforce"]

_FORM_KINDS: Mapping[str, tuple[str, ...]] = {
    "cylindricity": ("cylinder",),
    "roundness": ("cylinder", "cone", "sphere", "torus", "revolution"),
    "flatness": ("plane",),
    "straightness": ("plane", "cylinder", "cone", "extrusion"),
}
# Inner to outer: a zone of an outer group also bounds the inner ones on the same surface.
_NESTING = ("form", "orientation", "location")


@dataclass(frozen=True)
class Finding:
    """One contradiction: ``error`` cannot be met or has no meaning, ``warning`` is probably not meant."""

    severity: Literal["error", "warning"]
    tolerances: tuple[str, ...]
    message: str


def check(spec: Specification) -> tuple[Finding, ...]:
    """Return all contradictions of a specification; each message names the tolerances it is about."""
    datums = {datum.letter: datum for datum in spec.datums}
    tolerances = spec.tolerances if spec.default is None else (*spec.tolerances, spec.default)
    found = [
        *_identities(tolerances, spec.datums),
        *(finding for tolerance in tolerances for finding in _one(tolerance, datums)),
        *_parents(tolerances),
        *_nested(spec.tolerances),
    ]
    return tuple(found)


def enforce(spec: Specification, *, lenient: bool = False) -> tuple[str, ...]:
    """Refuse contradictions, and warn of what is probably not meant.

    Parameters
    ----------
    spec : Specification
    lenient : bool
        What a STEP file says of its own tolerances (their ids begin with ``#``) is returned instead: real
        files contradict themselves, and their reader cannot help it.

    Returns
    -------
    tuple of str
        Findings about the tolerances of a STEP file.

    Raises
    ------
    SpecificationError
        The specification contradicts itself; the message names the tolerances.
    """
    notes, errors = [], []
    for finding in check(spec):
        own = finding.tolerances and not all(name.startswith("#") for name in finding.tolerances)
        if lenient and not own:
            notes.append(f"{finding.severity}: {finding.message}")
        elif finding.severity == "error":
            errors.append(finding.message)
        else:
            warnings.warn(finding.message, CadskinWarning, stacklevel=4)
    if errors:
        raise SpecificationError("; ".join(errors))
    return tuple(notes)


def _identities(tolerances: Sequence[Tolerance], datums: Iterable[Datum]) -> Iterator[Finding]:
    for name, count in Counter(tolerance.id for tolerance in tolerances).items():
        if count > 1:
            yield Finding("error", (name,), f"{count} tolerances have the id {name!r}; ids must be unique")
    for letter, count in Counter(datum.letter for datum in datums).items():
        if count > 1:
            yield Finding("error", (), f"datum {letter} is defined {count} times")


def _label(tolerance: Tolerance) -> str:
    where = tolerance.feature.text()
    place = f" on {where}" if where else ""
    return f"tolerance {tolerance.id} ({tolerance.type} {number(tolerance.value)}{place})"


def _one(tolerance: Tolerance, datums: Mapping[str, Datum]) -> Iterator[Finding]:
    own, label, facts = (tolerance.id,), _label(tolerance), tolerance.characteristic
    referred = [tolerance.datums, *(indicator.datums for indicator in tolerance.indicators)]
    for letter in dict.fromkeys(letter for system in referred for letter in system.letters):
        if letter not in datums:
            defined = ", ".join(sorted(datums)) or "none"
            yield Finding(
                "error", own, f"{label} refers to datum {letter}, which is not defined (defined: {defined})"
            )
    letters = [letter for reference in tolerance.datums.references for letter in reference.letters]
    for letter, count in Counter(letters).items():
        if count > 1:
            yield Finding("warning", own, f"{label} names datum {letter} {count} times")
    if len(tolerance.datums) > 3:
        yield Finding(
            "error", own, f"{label} has {len(tolerance.datums)} datums; three fix every degree of freedom"
        )
    if facts.datums == "never" and tolerance.datums:
        yield Finding("error", own, f"{label} has datums {tolerance.datums.text()}; {facts.group} takes none")
    if facts.datums == "always" and not tolerance.datums:
        yield Finding("error", own, f"{label} needs at least one datum")
    wanted = _FORM_KINDS.get(tolerance.type)
    wrong = [kind for kind in tolerance.feature.kinds if wanted and kind not in wanted and kind != "other"]
    if wanted and wrong and tolerance.feature.derived == "none":
        yield Finding(
            "error", own, f"{label} is on a {wrong[0]}; {tolerance.type} is for a {' or '.join(wanted)}"
        )
    yield from _values(tolerance)


def _values(tolerance: Tolerance) -> Iterator[Finding]:
    own, label = (tolerance.id,), _label(tolerance)
    if tolerance.value is None:
        yield Finding("warning", own, f"{label} has no value")
        return
    if tolerance.value == 0 and tolerance.material == "RFS":
        yield Finding("error", own, f"{label} is zero without a material modifier: no real part can meet it")
    outside = tolerance.zone.outside
    if outside is not None and not 0 <= outside <= tolerance.value:
        side = "outside" if outside > tolerance.value else "inside"
        yield Finding(
            "warning", own, f"{label}: Ⓤ {number(outside)} leaves the nominal surface wholly {side} its zone"
        )
    if not tolerance.feature and tolerance.scope not in ("general", "all_over"):
        yield Finding("error", own, f"{label} is on no feature; give one, or make it the default")


def _parents(tolerances: Sequence[Tolerance]) -> Iterator[Finding]:
    by_id = {tolerance.id: tolerance for tolerance in tolerances}
    for tolerance in tolerances:
        seen = {tolerance.id}
        parent = tolerance.parent
        while parent is not None:
            if parent not in by_id:
                yield Finding(
                    "error",
                    (tolerance.id,),
                    f"{_label(tolerance)} has the parent {parent!r}, which is not there",
                )
                break
            if parent in seen:
                yield Finding(
                    "error",
                    (tolerance.id, parent),
                    f"{_label(tolerance)} is its own parent, through {parent!r}",
                )
                break
            seen.add(parent)
            parent = by_id[parent].parent
        upper = by_id.get(tolerance.parent or "")
        if upper is not None and _larger(tolerance, upper):
            message = f"{_label(tolerance)} is larger than its upper segment {_label(upper)}"
            yield Finding("warning", (tolerance.id, upper.id), message)


def _larger(inner: Tolerance, outer: Tolerance) -> bool:
    return inner.value is not None and outer.value is not None and inner.value > outer.value


def _rank(tolerance: Tolerance) -> int | None:
    """Place in the nesting; a profile with datums locates the surface, without it is its form."""
    if tolerance.feature.derived != "none" or tolerance.zone.shape != "width" or tolerance.material != "RFS":
        return None
    if tolerance.type == "surface_profile":
        return 2 if tolerance.datums else 0
    group = tolerance.characteristic.group
    return _NESTING.index(group) if group in _NESTING else None


def _nested(tolerances: Sequence[Tolerance]) -> Iterator[Finding]:
    by_feature: dict[tuple[object, ...], list[tuple[int, Tolerance]]] = {}
    for tolerance in tolerances:
        rank = _rank(tolerance)
        if (
            rank is not None
            and tolerance.feature
            and tolerance.zone.per_length is None
            and tolerance.zone.per_area is None
        ):
            feature = tolerance.feature
            key = (feature.part, frozenset(feature.faces or feature.step_faces or feature.selectors))
            by_feature.setdefault(key, []).append((rank, tolerance))
    for group in by_feature.values():
        for inner_rank, inner in group:
            for outer_rank, outer in group:
                if inner_rank < outer_rank and _larger(inner, outer):
                    message = f"{_label(inner)} is larger than {_label(outer)}, which already bounds it"
                    yield Finding("warning", (inner.id, outer.id), message)
