"""Resolved aspects as selections: STEP face numbers tied to the faces of the parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Protocol

from cadskin.cad.pmi.aspects import Resolved
from cadskin.cad.pmi.topology import Topology
from cadskin.spec.selection import Derived, FeatureSelection

__all__ = ["FaceMap", "PartFaces", "selection"]


class PartFaces(Protocol):
    """What is needed of a part: its name and the STEP number of each face (`cadskin.cad.part.CadPart`)."""

    @property
    def name(self) -> str:
        """Name of the part in the file."""

    @property
    def face_step_ids(self) -> Sequence[int | None]:
        """STEP number of every face, in the order of the face indices."""


@dataclass(frozen=True)
class FaceMap:
    """Which part and which face index a STEP face number is.

    Parameters
    ----------
    places : dict
        STEP number to the places (part, index); an assembly can hold one part several times.
    names : tuple of str
        Names of the parts.
    """

    places: dict[int, tuple[tuple[int, int], ...]]
    names: tuple[str, ...]

    @classmethod
    def of(cls, parts: Iterable[PartFaces]) -> FaceMap:
        """Return the map of some parts."""
        listed = list(parts)
        places: dict[int, list[tuple[int, int]]] = {}
        for part_index, part in enumerate(listed):
            for face_index, number in enumerate(part.face_step_ids):
                if number is not None:
                    places.setdefault(number, []).append((part_index, face_index))
        return cls({key: tuple(value) for key, value in places.items()}, tuple(part.name for part in listed))

    def indices(self, faces: Sequence[int]) -> tuple[int | None, dict[int, int]]:
        """Return the part that holds most of the faces, the first of equals, and their indices in it."""
        found: dict[int, dict[int, int]] = {}
        for number in faces:
            for part, index in self.places.get(number, ()):
                found.setdefault(part, {})[number] = index
        if not found:
            return None, {}
        best = max(found, key=lambda part: (len(found[part]), -part))
        return best, found[best]


def selection(
    resolved: Resolved, face_map: FaceMap | None, topology: Topology, *, derived: Derived = "none"
) -> tuple[FeatureSelection, tuple[str, ...]]:
    """Return the selection of a resolved aspect, and notes: how it was found, what is beside the part."""
    numbers = tuple(sorted(resolved.faces))
    kinds = tuple(dict.fromkeys(topology.kind(face) for face in numbers))
    notes = [f"faces found through {', '.join(resolved.via)}"] if resolved.via else []
    if resolved.missing and numbers:
        notes.append(f"no face found for {', '.join(resolved.missing[:5])}")
    indices: dict[int, int] = {}
    part = None
    if face_map is not None and numbers:
        place, indices = face_map.indices(numbers)
        part = face_map.names[place] if place is not None and len(face_map.names) > 1 else None
        beside = [face for face in numbers if face not in indices]
        if beside:
            shown = ", ".join(f"#{face}" for face in beside[:5]) + (", ..." if len(beside) > 5 else "")
            notes.append(
                f"{len(beside)} of {len(numbers)} faces are not on the part (supplemental geometry): {shown}"
            )
    groups = resolved.groups if len(resolved.groups) > 1 else ()
    if indices:
        members = tuple(tuple(sorted(indices[face] for face in group if face in indices)) for group in groups)
        groups = tuple(member for member in members if member)
    else:
        groups = tuple(tuple(sorted(group)) for group in groups)
    faces = tuple(sorted(set(indices.values())))
    return FeatureSelection(
        faces=faces, step_faces=numbers, groups=groups, derived=derived, part=part, kinds=kinds
    ), tuple(notes)
