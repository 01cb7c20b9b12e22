"""Put a specification onto a part that was exported again or changed a little."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from cadskin.errors import SpecificationError
from cadskin.shape.face import Face
from cadskin.shape.fingerprint import FaceFingerprint, FaceMatch, fingerprint, match_faces
from cadskin.spec.binding import map_features
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.specification import FaceRecord, Specification, Unresolved

__all__ = ["Reattachment", "fingerprinted", "reattach"]


@dataclass(frozen=True)
class Reattachment:
    """What became of a specification on a new part.

    Parameters
    ----------
    spec : Specification
        On the new faces. A selection whose face is lost or not clear is left without that face, and is in
        ``unresolved``.
    moved : tuple of (part, int, int)
        Part, old and new index of the faces that are at another place or have another outline.
    renumbered : int
        How many faces are the same but have another index.
    refused : tuple of str
        Faces that are gone or that could be several, in words.
    """

    spec: Specification
    moved: tuple[tuple[str | None, int, int], ...] = ()
    renumbered: int = 0
    refused: tuple[str, ...] = ()


def fingerprinted(spec: Specification, faces: Sequence[Face], *, part: str | None = None) -> Specification:
    """Return the specification with the fingerprints of the faces that it uses.

    Parameters
    ----------
    spec : Specification
        Bound to these faces.
    faces : sequence of Face
        Of the part, in the order of their index.
    part : str, optional
        Name of the part, as its selections have it.
    """
    used: set[int] = set()

    def collect(feature: FeatureSelection, _: str) -> FeatureSelection:
        if feature.part == part:
            used.update(face for face in feature.faces if face < len(faces))
        return feature

    map_features(spec, collect)
    own = tuple(FaceRecord(part, index, _short(fingerprint(faces[index]))) for index in sorted(used))
    others = tuple(record for record in spec.fingerprints if record.part != part)
    return spec.with_fingerprints((*others, *own))


def _short(found: FaceFingerprint) -> FaceFingerprint:
    """Round to what a file needs: nanometres, and nine digits of an area."""
    return replace(
        found,
        area=float(f"{found.area:.9g}"),
        centre=_rounded(found.centre),
        normal=_rounded(found.normal),
        axis=None if found.axis is None else _rounded(found.axis),
        radius=None if found.radius is None else round(found.radius, 6),
        size=None if found.size is None else round(found.size, 6),
    )


def _rounded(vector: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (round(value, 6) + 0.0 for value in vector)
    return x, y, z


def reattach(
    spec: Specification,
    faces: Sequence[Face] | Mapping[str, Sequence[Face]],
    *,
    tolerance: float | None = None,
) -> Reattachment:
    """Find the faces of a specification again, by what they are.

    Parameters
    ----------
    spec : Specification
        With fingerprints, as ``cadskin spec PART.step`` writes them.
    faces : sequence of Face, or mapping of part name to that
        The faces of the part as it is now.
    tolerance : float, optional
        Distance [mm] up to which a face counts as the same; see `cadskin.shape.fingerprint.match_faces`.

    Returns
    -------
    Reattachment
        Nothing is guessed: a face that could be one of several is refused.

    Raises
    ------
    SpecificationError
        The specification has no fingerprints, or the file has no part of that name.
    """
    if not spec.fingerprints:
        raise SpecificationError(
            "the specification has no fingerprints of its faces, so it cannot be put onto another export; "
            "write it again from the part it belongs to"
        )
    places: dict[tuple[str | None, int], tuple[FaceMatch, Face | None]] = {}
    names = {record.part for record in spec.fingerprints}
    for part in names:
        own = [record for record in spec.fingerprints if record.part == part]
        now = _faces_of(faces, part, len(names))
        for record, match in zip(
            own, match_faces([r.fingerprint for r in own], now, tolerance=tolerance), strict=True
        ):
            places[part, record.face] = match, None if match.new is None else now[match.new]
    problems: list[Unresolved] = []

    def change(feature: FeatureSelection, label: str) -> FeatureSelection:
        return _changed(feature, label, places, problems)

    moved_spec = map_features(spec, change)
    found = {key: face for key, (match, face) in places.items() if face is not None}
    records = [FaceRecord(part, face.index, _short(fingerprint(face))) for (part, _), face in found.items()]
    result = moved_spec.with_fingerprints(sorted(records, key=lambda r: (r.part or "", r.face)))
    return Reattachment(
        result.with_unresolved((*spec.unresolved, *problems)),
        tuple(
            (part, old, face.index)
            for (part, old), face in found.items()
            if places[part, old][0].status == "moved"
        ),
        sum(face.index != old for (_, old), face in found.items()),
        tuple(_refusal(part, old, match) for (part, old), (match, face) in places.items() if face is None),
    )


def _faces_of(
    faces: Sequence[Face] | Mapping[str, Sequence[Face]], part: str | None, n_parts: int
) -> Sequence[Face]:
    if not isinstance(faces, Mapping):
        return faces
    if part is not None and part in faces:
        return faces[part]
    if n_parts == 1 and len(faces) == 1:
        return next(iter(faces.values()))
    raise SpecificationError(
        f"the file has no part {part!r}; it has {', '.join(faces)}: choose one with --part"
    )


def _refusal(part: str | None, old: int, match: FaceMatch) -> str:
    name = f"face {old}" + (f" of {part}" if part else "")
    if match.status == "ambiguous":
        return f"{name} could be face {' or '.join(map(str, match.candidates))}"
    return f"{name} is not there any more"


def _changed(
    feature: FeatureSelection,
    label: str,
    places: Mapping[tuple[str | None, int], tuple[FaceMatch, Face | None]],
    problems: list[Unresolved],
) -> FeatureSelection:
    if not feature.faces:
        return feature
    new: dict[int, Face] = {}
    for old in feature.faces:
        place = places.get((feature.part, old))
        if place is None:
            problems.append(Unresolved(label, "face", f"face {old} has no fingerprint"))
        elif place[1] is None:
            problems.append(Unresolved(label, "face", _refusal(feature.part, old, place[0])))
        else:
            new[old] = place[1]
    groups = tuple(tuple(new[old].index for old in group if old in new) for group in feature.groups)
    numbers = sorted(face.step_id for face in new.values() if face.step_id is not None)
    return replace(
        feature,
        faces=tuple(sorted(face.index for face in new.values())),
        step_faces=tuple(numbers),
        groups=tuple(group for group in groups if group),
        kinds=tuple(dict.fromkeys(face.kind for face in new.values())),
    )
