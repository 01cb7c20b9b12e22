"""The specification of a part: its tolerances, datums and dimensions, and what could not be read."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from cadskin.errors import SelectionError
from cadskin.spec.checks import enforce
from cadskin.spec.datums import Datum
from cadskin.spec.dimension import Dimension
from cadskin.spec.selection import as_selection
from cadskin.spec.tolerance import Tolerance

if TYPE_CHECKING:
    from pathlib import Path

    from cadskin.shape.fingerprint import FaceFingerprint
    from cadskin.shape.nominal import NominalModel

__all__ = ["FaceRecord", "Specification", "Unresolved"]


@dataclass(frozen=True)
class Unresolved:
    """Something that the file holds and that could not be tied to faces, or not be understood.

    Parameters
    ----------
    entity : str
        ``#27``, or a key of a spec file.
    kind : str
        ``tolerance``, ``datum``, ``dimension``, ``datum target`` or ``file``.
    reason : str
    """

    entity: str
    kind: str
    reason: str


@dataclass(frozen=True)
class FaceRecord:
    """What a face was when the specification was written, to find it again; see `cadskin.spec.reattach`.

    Parameters
    ----------
    part : str or None
    face : int
        Its index then.
    fingerprint : FaceFingerprint
    """

    part: str | None
    face: int
    fingerprint: FaceFingerprint


@dataclass(frozen=True, init=False)
class Specification:
    """All tolerances of one part.

    Parameters
    ----------
    *tolerances : Tolerance
        Tolerances without an id of their own get ``flatness-1``, ``flatness-2``, ...
    datums : mapping of str to feature, or iterable of Datum
    dimensions : iterable of Dimension
    default : Tolerance, optional
        The general tolerance, for faces that have none.
    unresolved : iterable of Unresolved
    notes : iterable of str
        Warnings of the reader; not compared.
    fingerprints : iterable of FaceRecord
        Of the faces it uses.
    checked : bool
        Refuse contradictions, and warn of what is probably not meant.

    Raises
    ------
    SpecificationError
        The specification contradicts itself; the message names the tolerances.

    Examples
    --------
    >>> from cadskin.spec import Specification, flatness, position
    >>> spec = Specification(flatness(">Z", 0.02), position("%CYLINDER", 0.1, datums="A"), datums={"A": "<Z"})
    >>> [str(tolerance) for tolerance in spec]
    ['⏥ 0.02', '⌖ 0.1 | A']
    """

    tolerances: tuple[Tolerance, ...]
    datums: tuple[Datum, ...] = ()
    dimensions: tuple[Dimension, ...] = ()
    default: Tolerance | None = None
    unresolved: tuple[Unresolved, ...] = ()
    notes: tuple[str, ...] = field(default=(), compare=False)
    fingerprints: tuple[FaceRecord, ...] = ()

    def __init__(
        self,
        *tolerances: Tolerance,
        datums: Mapping[str, Any] | Iterable[Datum] = (),
        dimensions: Iterable[Dimension] = (),
        default: Tolerance | None = None,
        unresolved: Iterable[Unresolved] = (),
        notes: Iterable[str] = (),
        fingerprints: Iterable[FaceRecord] = (),
        checked: bool = True,
    ) -> None:
        listed = tuple(datums) if not isinstance(datums, Mapping) else _datums(datums)
        values: dict[str, Any] = {
            "tolerances": _with_ids(tolerances),
            "datums": listed,
            "dimensions": _with_dimension_ids(tuple(dimensions)),
            "default": default,
            "unresolved": tuple(unresolved),
            "notes": tuple(notes),
            "fingerprints": tuple(fingerprints),
        }
        for key, value in values.items():
            object.__setattr__(self, key, value)
        if checked:
            enforce(self)

    def __iter__(self) -> Iterator[Tolerance]:
        return iter(self.tolerances)

    def __len__(self) -> int:
        return len(self.tolerances)

    def __getitem__(self, name: str) -> Tolerance:
        """Return the tolerance with this id."""
        for tolerance in self.tolerances:
            if tolerance.id == name:
                return tolerance
        known = ", ".join(tolerance.id for tolerance in self.tolerances) or "none"
        raise SelectionError(f"no tolerance has the id {name!r}; there are {known}")

    def datum(self, letter: str) -> Datum:
        """Return the datum of a letter.

        Raises
        ------
        SelectionError
            No datum has that letter.
        """
        for datum in self.datums:
            if datum.letter == letter:
                return datum
        known = ", ".join(datum.letter for datum in self.datums) or "none"
        raise SelectionError(f"no datum has the letter {letter!r}; there are {known}")

    @property
    def general(self) -> Tolerance | None:
        """The tolerance of faces that have none of their own: the default, else the first general one."""
        if self.default is not None:
            return self.default
        return next((item for item in self.tolerances if item.scope in ("general", "all_over")), None)

    def on_face(self, face: int) -> tuple[Tolerance, ...]:
        """Return the tolerances on one B-rep face."""
        return tuple(tolerance for tolerance in self.tolerances if face in tolerance.feature.faces)

    def bind(self, nominal: NominalModel) -> Specification:
        """Return the specification on the faces of a part; see `cadskin.spec.binding.bind`."""
        from cadskin.spec.binding import bind

        return bind(self, nominal)

    def changed(self, *tolerances: Tolerance, **values: Any) -> Specification:
        """Return a copy with other tolerances and values, without checking it again."""
        kept = {
            key: getattr(self, key)
            for key in ("datums", "dimensions", "default", "unresolved", "notes", "fingerprints")
        }
        return Specification(*(tolerances or self.tolerances), **{**kept, **values}, checked=False)

    def with_fingerprints(self, records: Iterable[FaceRecord]) -> Specification:
        """Return a copy with these fingerprints."""
        return self.changed(fingerprints=tuple(records))

    def with_unresolved(self, items: Iterable[Unresolved]) -> Specification:
        """Return a copy with this list of what is unresolved."""
        return self.changed(unresolved=tuple(items))

    def table(self) -> str:
        """Return a table of the frames, faces, units, sources and the unresolved list."""
        from cadskin.spec.table import table

        return table(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain data for JSON; see `cadskin.spec.plain`."""
        from cadskin.spec.plain import to_dict

        return to_dict(self)

    def to_toml(self) -> str:
        """Return the text of a spec file; see `cadskin.spec.toml_write`."""
        from cadskin.spec.toml_write import to_toml

        return to_toml(self)

    def save(self, path: str | Path) -> Path:
        """Write a spec file."""
        from cadskin.spec.toml_write import write_spec

        return write_spec(path, self)


def _datums(given: Mapping[str, Any]) -> tuple[Datum, ...]:
    return tuple(
        replace(feature, letter=letter)
        if isinstance(feature, Datum)
        else Datum(letter, as_selection(feature))
        for letter, feature in given.items()
    )


def _with_ids(tolerances: tuple[Tolerance, ...]) -> tuple[Tolerance, ...]:
    used = {tolerance.id for tolerance in tolerances}
    named = []
    counts: dict[str, int] = {}
    for tolerance in tolerances:
        if tolerance.id:
            named.append(tolerance)
            continue
        while True:
            counts[tolerance.type] = counts.get(tolerance.type, 0) + 1
            name = f"{tolerance.type}-{counts[tolerance.type]}"
            if name not in used:
                break
        named.append(replace(tolerance, id=name))
    return tuple(named)


def _with_dimension_ids(dimensions: tuple[Dimension, ...]) -> tuple[Dimension, ...]:
    used = {dimension.id for dimension in dimensions}
    fresh = (name for name in (f"dimension-{i}" for i in range(1, 10**9)) if name not in used)
    return tuple(dim if dim.id else replace(dim, id=next(fresh)) for dim in dimensions)
