"""Tie a specification to a part: selectors become faces, faces are checked to be there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

from cadskin.errors import SelectionError, SpecificationError
from cadskin.shape.fingerprint import fingerprint
from cadskin.shape.nominal import Face, Feature, NominalModel
from cadskin.shape.selectors import select_faces
from cadskin.spec.checks import enforce
from cadskin.spec.datums import Datum
from cadskin.spec.dimension import Dimension
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.specification import Specification
from cadskin.spec.tolerance import Tolerance

__all__ = ["bind", "bind_faces", "bound_to", "map_features"]


@dataclass(frozen=True)
class _Part:
    faces: tuple[Face, ...]
    groups: tuple[tuple[int, ...], ...]
    features: tuple[Feature, ...]


_STALE = 1e-3  # of the part's size

Change: TypeAlias = Callable[[FeatureSelection, str], FeatureSelection]


def bind(spec: Specification, nominal: NominalModel) -> Specification:
    """Return the specification on the faces of a part.

    Parameters
    ----------
    spec : Specification
    nominal : NominalModel

    Returns
    -------
    Specification
        Every selection has its face indices and the kinds of its surfaces; selectors are kept. A selector
        that matches several features makes a pattern with one member for each.

    Raises
    ------
    SpecificationError
        A selector matches nothing, or a face does not exist; the message names the tolerance and where it
        is written. Or the tolerance has no meaning on this surface (cylindricity on a plane).
    """
    groups = tuple(feature.face_indices for feature in nominal.features)
    return bind_faces(spec, nominal.faces, groups, features=nominal.features)


def bound_to(spec: Specification, nominal: NominalModel) -> Specification:
    """Return the specification on the faces of a part: itself where it stands on faces already.

    It stands on faces when something in it selects any, every tolerance and datum that selects something has
    its faces, and no selector of a datum target or dimension waits for them. (A file may give targets and
    dimensions on curves, which are no face of the part.) A specification without a selection, such as one of
    a general tolerance alone, is bound: that refuses contradictions, and fingerprints of another part.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> part = cs.nominal(cq.Workplane().box(4, 4, 2), edge_length=2.0)
    >>> bound = bound_to(cs.Specification(cs.flatness(">Z", 0.1)), part)
    >>> bound["flatness-1"].feature.faces, bound_to(bound, part) is bound
    ((5,), True)
    """
    main = [*(item.feature for item in spec), *(datum.feature for datum in spec.datums)]
    other = [target.feature for datum in spec.datums for target in datum.targets]
    other += [end for one in spec.dimensions for end in (one.feature, one.second)]
    waits = any(one and not one.faces for one in main) or any(
        one.selectors and not one.faces for one in other
    )
    return spec.bind(nominal) if waits or not any((*main, *other)) else spec


def bind_faces(
    spec: Specification,
    faces: Sequence[Face],
    groups: Sequence[Sequence[int]],
    *,
    features: Sequence[Feature] = (),
) -> Specification:
    """Return the specification on the faces of a part that is not meshed; see `bind`.

    Parameters
    ----------
    spec : Specification
    faces : sequence of Face
    groups : sequence of sequence of int
        Face indices of each feature.
    features : sequence of Feature
        For selectors by feature name.
    """
    part = _Part(tuple(faces), tuple(tuple(group) for group in groups), tuple(features))
    _refuse_stale(spec, part)
    bound = map_features(spec, lambda feature, label: _bound(feature, part, label))
    known = spec.tolerances if spec.default is None else (*spec.tolerances, spec.default)
    from_step = any(item.id.startswith("#") for item in known)
    return bound.changed(notes=tuple(dict.fromkeys((*bound.notes, *enforce(bound, lenient=from_step)))))


def _refuse_stale(spec: Specification, part: _Part) -> None:
    """Refuse face indices of another export: the fingerprints tell."""
    extent = max((float(abs(face.bounds).max()) for face in part.faces), default=1.0)
    for record in spec.fingerprints:
        there = record.face < len(part.faces)
        if there and record.fingerprint.distance(fingerprint(part.faces[record.face])) <= _STALE * extent:
            continue
        what = "has another shape or place" if there else "does not exist"
        raise SpecificationError(
            f"face {record.face} {what} in this part: the specification was written for another export; "
            "put it onto this one with reattach() or `cadskin spec SPEC.toml --on PART.step`"
        )


def map_features(spec: Specification, change: Change) -> Specification:
    """Return a specification with every selection changed; ``change`` gets it and a label for messages."""

    def of_tolerance(tolerance: Tolerance) -> Tolerance:
        label = _label(f"tolerance {tolerance.id} ({tolerance.type})", tolerance.source)
        feature = change(tolerance.feature, label)
        scope = tolerance.scope
        if scope in ("feature", "pattern"):
            scope = "pattern" if len(feature.groups) > 1 else "feature"
        return replace(tolerance, feature=feature, scope=scope)

    def of_datum(datum: Datum) -> Datum:
        label = _label(f"datum {datum.letter}", datum.source)
        targets = tuple(
            replace(t, feature=change(t.feature, f"{label}, target {t.label}")) for t in datum.targets
        )
        return replace(datum, feature=change(datum.feature, label), targets=targets)

    def of_dimension(dimension: Dimension) -> Dimension:
        label = _label(f"dimension {dimension.id}", dimension.source)
        return replace(
            dimension, feature=change(dimension.feature, label), second=change(dimension.second, label)
        )

    return spec.changed(
        *(of_tolerance(tolerance) for tolerance in spec.tolerances),
        datums=tuple(of_datum(datum) for datum in spec.datums),
        dimensions=tuple(of_dimension(dimension) for dimension in spec.dimensions),
    )


def _label(what: str, source: str | None) -> str:
    return f"{source}: {what}" if source else what


def _bound(feature: FeatureSelection, part: _Part, label: str) -> FeatureSelection:
    if not feature:
        return feature
    if feature.faces and not feature.selectors:
        return replace(feature, kinds=_kinds(_existing(feature.faces, part, label)))
    if feature.selectors:
        return _selected(feature, part, label)
    return _by_step_number(feature, part, label)


def _existing(indices: Sequence[int], part: _Part, label: str) -> list[Face]:
    for index in indices:
        if not 0 <= index < len(part.faces):
            raise SpecificationError(
                f"{label} is on face {index}; the part has faces 0 to {len(part.faces) - 1}"
            )
    return [part.faces[index] for index in indices]


def _kinds(faces: Sequence[Face]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(face.kind for face in faces))


def _selected(feature: FeatureSelection, part: _Part, label: str) -> FeatureSelection:
    chosen: set[int] = set()
    for selector in feature.selectors:
        try:
            chosen.update(select_faces(part.faces, selector, features=part.features))
        except SelectionError as error:
            raise SpecificationError(f"{label}: {error}") from error
    members = [group for group in part.groups if chosen.intersection(group)]
    faces = [part.faces[index] for member in members for index in member]
    return replace(
        feature,
        faces=tuple(face.index for face in faces),
        step_faces=tuple(face.step_id for face in faces if face.step_id is not None),
        groups=tuple(members) if len(members) > 1 else (),
        kinds=_kinds(faces),
    )


def _by_step_number(feature: FeatureSelection, part: _Part, label: str) -> FeatureSelection:
    by_number = {face.step_id: face for face in part.faces if face.step_id is not None}
    known = [by_number[number] for number in feature.step_faces if number in by_number]
    if not known:
        shown = ", ".join(f"#{number}" for number in feature.step_faces[:5])
        raise SpecificationError(
            f"{label} is on the STEP faces {shown}, which the part "
            "does not have; is it the file that the specification was read from?"
        )
    groups = tuple(
        tuple(by_number[number].index for number in group if number in by_number) for group in feature.groups
    )
    return replace(
        feature,
        faces=tuple(sorted(face.index for face in known)),
        groups=tuple(group for group in groups if group),
        kinds=_kinds(known),
    )
