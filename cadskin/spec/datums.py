"""Datums and datum systems (ISO 5459)."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from math import isfinite
from typing import Literal, TypeAlias, get_args

from cadskin.errors import SpecificationError
from cadskin.spec.modifiers import DATUM_MODIFIERS, datum_modifier, modifier_symbol
from cadskin.spec.selection import FeatureSelection

__all__ = [
    "Datum",
    "DatumModifier",
    "DatumReference",
    "DatumSystem",
    "DatumTarget",
    "TargetKind",
    "as_datum_system",
]

TargetKind: TypeAlias = Literal["point", "line", "rectangle", "circle", "circular_curve", "area"]


_LETTERS = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


def check_letter(letter: str) -> None:
    """Refuse what cannot be the letter of a datum.

    Raises
    ------
    SpecificationError
        It holds other signs than letters and digits.
    """
    if _LETTERS.match(letter) is None:
        raise SpecificationError(f"{letter!r} is no datum letter: write letters and digits, like A or A2")


@dataclass(frozen=True)
class DatumModifier:
    """A modifier of a datum reference: AP242 name, and a value [mm] where it has one (projected length)."""

    name: str
    value: float | None = None

    def __post_init__(self) -> None:
        """Check that the value is finite."""
        if self.value is not None and not isfinite(self.value):
            raise SpecificationError(
                f"datum modifier {self.name}: its value must be finite, got {self.value}"
            )

    def text(self) -> str:
        """Return the name as `DatumSystem.parse` reads it, ``PROJECTED=20.0`` for one with a value."""
        name = self.name if self.name in DATUM_MODIFIERS else f"AP242:{self.name}"
        return name if self.value is None else f"{name}={self.value!r}"


@dataclass(frozen=True)
class DatumReference:
    """One compartment of a datum system: a letter, or several for a common datum A-B.

    Parameters
    ----------
    letters : tuple of str
    modifiers : tuple of DatumModifier
        Modifiers of the compartment.
    element_modifiers : tuple of tuple of DatumModifier
        Modifiers of each letter of a common datum; empty where no letter has one.
    """

    letters: tuple[str, ...]
    modifiers: tuple[DatumModifier, ...] = ()
    element_modifiers: tuple[tuple[DatumModifier, ...], ...] = ()

    def __post_init__(self) -> None:
        """Check the letters."""
        if not self.letters:
            raise SpecificationError("a datum reference needs at least one letter")
        for letter in self.letters:
            check_letter(letter)
        if self.element_modifiers and len(self.element_modifiers) != len(self.letters):
            raise SpecificationError(
                f"datum {'-'.join(self.letters)}: one list of modifiers per letter, please"
            )
        if not any(self.element_modifiers):
            object.__setattr__(self, "element_modifiers", ())

    @property
    def label(self) -> str:
        """``A``, or ``A-B`` for a common datum."""
        return "-".join(self.letters)

    def text(self) -> str:
        """Return the compartment as `DatumSystem.parse` reads it: ``A``, ``B(M)``, ``A-B(M)``."""
        if not self.element_modifiers:
            return self.label + _bracket(self.modifiers)
        parts = [
            letter + _bracket(mods) for letter, mods in zip(self.letters, self.element_modifiers, strict=True)
        ]
        return "[" + "-".join(parts) + "]" + _bracket(self.modifiers)

    def symbols(self) -> str:
        """Return the compartment with drawing symbols: ``BⓂ``."""

        def drawn(mods: tuple[DatumModifier, ...]) -> str:
            return "".join(
                modifier_symbol(mod.name) + (f"{mod.value:g}" if mod.value is not None else "")
                for mod in mods
            )

        elements = self.element_modifiers or ((),) * len(self.letters)
        joined = "-".join(letter + drawn(mods) for letter, mods in zip(self.letters, elements, strict=True))
        return joined + drawn(self.modifiers)


def _bracket(modifiers: Iterable[DatumModifier]) -> str:
    words = [mod.text() for mod in modifiers]
    return "(" + ",".join(words) + ")" if words else ""


_LETTER = re.compile(r"\s*([A-Za-z_][A-Za-z0-9_]*)\s*((?:\([^()]*\)\s*)*)")


def _parse_modifiers(text: str, source: str) -> tuple[DatumModifier, ...]:
    found = []
    for word in re.split(r"[(),\s]+", text):
        if not word:
            continue
        name, _, value = word.partition("=")
        try:
            found.append(DatumModifier(datum_modifier(name), float(value) if value else None))
        except ValueError as error:
            raise SpecificationError(f"datum system {source!r}: {error}") from None
    return tuple(found)


def _parse_reference(text: str, source: str) -> DatumReference:
    body = text.strip()
    outer: tuple[DatumModifier, ...] = ()
    if body.startswith("["):
        inside, closed, tail = body[1:].partition("]")
        if not closed:
            raise SpecificationError(f"datum system {source!r}: '[' is never closed")
        body, outer = inside, _parse_modifiers(tail, source)
    letters: list[str] = []
    modifiers: list[tuple[DatumModifier, ...]] = []
    position = 0
    while True:
        match = _LETTER.match(body, position)
        if match is None:
            raise SpecificationError(
                f"datum system {source!r} is not understood at {body[position:]!r}; "
                "write letters with '|' between them, 'A|B-C|D(M)'"
            )
        letters.append(match[1])
        modifiers.append(_parse_modifiers(match[2], source))
        position = match.end()
        if position == len(body):
            break
        if body[position] != "-":
            raise SpecificationError(f"datum system {source!r} is not understood at {body[position:]!r}")
        position += 1
    if not text.strip().startswith("["):
        # "A-B(M)": without brackets the modifiers of the last letter are those of the compartment.
        outer, modifiers[-1] = modifiers[-1], ()
    return DatumReference(tuple(letters), outer, tuple(modifiers))


@dataclass(frozen=True)
class DatumSystem:
    """An ordered datum system: primary, secondary, tertiary."""

    references: tuple[DatumReference, ...] = ()

    @classmethod
    def parse(cls, text: str) -> DatumSystem:
        """Return the datum system of a text.

        Parameters
        ----------
        text : str
            Compartments with ``|`` between them; common datums with ``-``; modifiers in brackets, as AP242
            name or short form; ``[A(M)-B](F)`` gives single letters of a common datum their own.

        Raises
        ------
        SpecificationError
            The text is not understood.

        Examples
        --------
        >>> DatumSystem.parse("A|B-C|D(M)").labels
        ('A', 'B-C', 'D')
        """
        if not text.strip():
            return cls()
        return cls(tuple(_parse_reference(part, text) for part in text.split("|")))

    def __bool__(self) -> bool:
        return bool(self.references)

    def __len__(self) -> int:
        return len(self.references)

    @property
    def labels(self) -> tuple[str, ...]:
        """``("A", "B-C")``, in order of precedence."""
        return tuple(reference.label for reference in self.references)

    @property
    def letters(self) -> tuple[str, ...]:
        """All letters, in order, each once."""
        return tuple(dict.fromkeys(letter for reference in self.references for letter in reference.letters))

    def text(self) -> str:
        """Return the text that `parse` reads."""
        return "|".join(reference.text() for reference in self.references)


def as_datum_system(datums: DatumSystem | str | Iterable[str] | None) -> DatumSystem:
    """Return the datum system of a text ``"A|B"``, of a list ``["A", "B-C"]``, or of one."""
    if datums is None:
        return DatumSystem()
    if isinstance(datums, DatumSystem):
        return datums
    return DatumSystem.parse(datums if isinstance(datums, str) else "|".join(datums))


@dataclass(frozen=True)
class DatumTarget:
    """A datum target: where the part touches its fixture.

    Parameters
    ----------
    label : str
        ``A1``.
    kind : str
        ``point``, ``line``, ``rectangle``, ``circle``, ``circular_curve`` or ``area``.
    origin : (3,) tuple of float or None
        [mm], in the frame of the part itself, wherever an assembly puts it.
    axis, direction : (3,) tuple of float or None
        Third and first axis of its frame.
    length, width, diameter : float or None
        [mm].
    feature : FeatureSelection
        Faces on which it lies.
    movable : bool
    """

    label: str
    kind: TargetKind = "point"
    origin: tuple[float, float, float] | None = None
    axis: tuple[float, float, float] | None = None
    direction: tuple[float, float, float] | None = None
    length: float | None = None
    width: float | None = None
    diameter: float | None = None
    feature: FeatureSelection = field(default_factory=FeatureSelection)
    movable: bool = False

    def __post_init__(self) -> None:
        """Check the kind."""
        if self.kind not in get_args(TargetKind):
            raise SpecificationError(
                f"datum target {self.label}: kind {self.kind!r} is none of {', '.join(get_args(TargetKind))}"
            )
        numbers = [self.length, self.width, self.diameter]
        numbers += [x for vector in (self.origin, self.axis, self.direction) if vector for x in vector]
        if not all(isfinite(number) for number in numbers if number is not None):
            raise SpecificationError(f"datum target {self.label}: its numbers must be finite")


@dataclass(frozen=True)
class Datum:
    """A datum: its letter and the feature, or the targets, that establish it.

    Parameters
    ----------
    letter : str
    feature : FeatureSelection
    targets : tuple of DatumTarget
    source : str or None
        ``part.stp #41`` or ``part.spec.toml:7``; not compared.
    """

    letter: str
    feature: FeatureSelection = field(default_factory=FeatureSelection)
    targets: tuple[DatumTarget, ...] = ()
    source: str | None = field(default=None, compare=False)

    def __post_init__(self) -> None:
        """Check the letter."""
        check_letter(self.letter)
