"""Which faces a tolerance, a datum or a dimension is about."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias, get_args

from cadskin.errors import SpecificationError
from cadskin.shape.nominal import Face, Feature

__all__ = ["Derived", "FeatureSelection", "FeatureSelector", "as_selection"]

Derived: TypeAlias = Literal["none", "axis", "median_plane", "centre_point", "line_element"]
FeatureSelector: TypeAlias = "FeatureSelection | Feature | Face | int | str | Iterable[Any] | None"


@dataclass(frozen=True)
class FeatureSelection:
    """The geometrical feature that a tolerance, datum or dimension refers to.

    Parameters
    ----------
    faces : tuple of int
        B-rep face indices; several faces can be one feature (two half-cylinders are one hole).
    step_faces : tuple of int
        STEP entity numbers of the faces, where they come from a file.
    selectors : tuple of int or str
        What a person wrote (``">Z"``, ``"#1234"``); bound to faces by `bind`.
    groups : tuple of tuple of int
        For a pattern: the faces of each of its members (a part of `faces`, or of `step_faces` where there are
        no indices). Empty for a single feature.
    derived : {"none", "axis", "median_plane", "centre_point", "line_element"}
        The tolerance bounds this derived feature instead of the surface itself.
    part : str or None
        Name of the part in a file of several.
    kinds : tuple of str
        Kinds of the ideal surfaces where they are known; not compared.
    """

    faces: tuple[int, ...] = ()
    step_faces: tuple[int, ...] = ()
    selectors: tuple[int | str, ...] = ()
    groups: tuple[tuple[int, ...], ...] = ()
    derived: Derived = "none"
    part: str | None = None
    kinds: tuple[str, ...] = field(default=(), compare=False)

    def __post_init__(self) -> None:
        """Check the derived feature and that groups are of the faces."""
        if self.derived not in get_args(Derived):
            raise SpecificationError(
                f"derived feature {self.derived!r} is none of {', '.join(get_args(Derived))}"
            )
        own = set(self.faces) or set(self.step_faces)
        if own and any(face not in own for group in self.groups for face in group):
            raise SpecificationError(f"groups {self.groups} name faces that are not in {sorted(own)}")

    def __bool__(self) -> bool:
        return bool(self.faces or self.step_faces or self.selectors)

    @property
    def members(self) -> tuple[tuple[int, ...], ...]:
        """Faces of each member: the groups of a pattern, else all faces as one."""
        return self.groups or ((self.faces,) if self.faces else ())

    def with_faces(
        self, faces: Iterable[int], *, step_faces: Iterable[int] = (), kinds: Iterable[str] = ()
    ) -> FeatureSelection:
        """Return a copy on these faces, without groups."""
        return replace(self, faces=tuple(faces), step_faces=tuple(step_faces), kinds=tuple(kinds), groups=())

    def text(self) -> str:
        """Return a short text: ``faces 3+4``, ``>Z``, ``#120, #121``."""
        if self.faces:
            return ("face " if len(self.faces) == 1 else "faces ") + "+".join(map(str, self.faces))
        if self.selectors:
            return ", ".join(map(str, self.selectors))
        return ", ".join(f"#{number}" for number in self.step_faces)


def _one(item: Any) -> FeatureSelection:
    if isinstance(item, FeatureSelection):
        return item
    if isinstance(item, Feature):
        numbers = tuple(face.step_id for face in item.faces if face.step_id is not None)
        return FeatureSelection(
            faces=item.face_indices, step_faces=numbers, kinds=tuple(face.kind for face in item.faces)
        )
    if isinstance(item, Face):
        numbers = () if item.step_id is None else (item.step_id,)
        return FeatureSelection(faces=(item.index,), step_faces=numbers, kinds=(item.kind,))
    if isinstance(item, bool) or not isinstance(item, int | str):
        raise SpecificationError(
            f"a feature is a Feature, a Face, a face index or a selector like '>Z', not {item!r}"
        )
    return FeatureSelection(selectors=(item,))


def as_selection(selector: FeatureSelector, *, derived: Derived | None = None) -> FeatureSelection:
    """Return the selection of anything that names features.

    Parameters
    ----------
    selector : FeatureSelection, Feature, Face, int, str, or an iterable of those
        Several features make a pattern: each is a member of its own. None is the empty selection.
    derived : str, optional
        See `FeatureSelection`.

    Raises
    ------
    SpecificationError
        It is none of these.

    Examples
    --------
    >>> as_selection([">Z", "<Z"]).selectors
    ('>Z', '<Z')
    """
    if selector is None:
        found = FeatureSelection()
    elif isinstance(selector, Iterable) and not isinstance(selector, str | Mapping):
        parts = [_one(item) for item in selector]
        groups = tuple(part.faces for part in parts) if len(parts) > 1 and all(p.faces for p in parts) else ()
        found = FeatureSelection(
            faces=tuple(dict.fromkeys(face for part in parts for face in part.faces)),
            step_faces=tuple(dict.fromkeys(number for part in parts for number in part.step_faces)),
            selectors=tuple(word for part in parts for word in part.selectors),
            groups=groups,
            kinds=tuple(kind for part in parts for kind in part.kinds),
        )
    else:
        found = _one(selector)
    return found if derived is None else replace(found, derived=derived)
