"""Tables of a spec file, checked: wrong types and unknown keys are refused with their line."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from math import isfinite
from typing import Any

from cadskin.errors import SpecificationError
from cadskin.spec.characteristics import nearest
from cadskin.spec.toml_lines import Path, line_of

__all__ = ["SpecTable", "Where"]


@dataclass(frozen=True)
class Where:
    """A spec file: its name and the lines of its keys."""

    file: str
    lines: dict[Path, int]

    def at(self, path: Path) -> str:
        """Return ``part.spec.toml:12``."""
        line = line_of(self.lines, path)
        return self.file if line is None else f"{self.file}:{line}"


@dataclass
class SpecTable:
    """One table of a spec file; every key is taken once, and what is left at the end is refused.

    Parameters
    ----------
    values : Mapping
    path : tuple
        Keys that lead to it.
    where : Where
    """

    values: Mapping[str, Any]
    path: Path
    where: Where
    _taken: set[str] = field(default_factory=set)

    @property
    def source(self) -> str:
        """File and line of the table."""
        return self.where.at(self.path)

    def error(self, message: str, key: str | int | None = None) -> SpecificationError:
        """Return an error that names file and line."""
        path = self.path if key is None else (*self.path, key)
        return SpecificationError(f"{self.where.at(path)}: {message}")

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def raw(self, key: str, default: Any = None) -> Any:
        """Take a value of any type."""
        self._taken.add(key)
        return self.values.get(key, default)

    def text(self, key: str, default: str | None = None) -> str | None:
        """Take a text."""
        found: str | None = self._typed(key, str, "a text in quotes", default)
        return found

    def flag(self, key: str, default: bool | None = False) -> bool | None:
        """Take true or false."""
        found: bool | None = self._typed(key, bool, "true or false", default)
        return found

    def _typed(self, key: str, kind: type, what: str, default: Any) -> Any:
        value = self.raw(key)
        if value is None:
            return default
        if not isinstance(value, kind):
            raise self.error(f"{key} must be {what}, not {value!r}", key)
        return value

    def number(self, key: str, default: float | None = None) -> float | None:
        """Take a finite number."""
        value = self.raw(key)
        return default if value is None else self.as_number(value, key)

    def as_number(self, value: Any, key: str) -> float:
        """Return a value as a finite number."""
        if isinstance(value, bool) or not isinstance(value, int | float) or not isfinite(value):
            raise self.error(f"{key} must be a number, not {value!r}", key)
        return float(value)

    def numbers(self, key: str, count: int) -> tuple[float, ...] | None:
        """Take a list of ``count`` numbers."""
        value = self.raw(key)
        if value is None:
            return None
        if not isinstance(value, list) or len(value) != count:
            raise self.error(f"{key} must be a list of {count} numbers, not {value!r}", key)
        return tuple(self.as_number(item, key) for item in value)

    def texts(self, key: str) -> tuple[str, ...]:
        """Take one text or a list of texts."""
        value = self.raw(key, [])
        listed = [value] if isinstance(value, str) else value
        if not isinstance(listed, list) or not all(isinstance(item, str) for item in listed):
            raise self.error(f"{key} must be a text or a list of texts, not {value!r}", key)
        return tuple(listed)

    def indices(self, key: str) -> tuple[int, ...]:
        """Take one whole number or a list of them, none negative."""
        value = self.raw(key, [])
        listed = value if isinstance(value, list) else [value]
        if not all(isinstance(item, int) and not isinstance(item, bool) and item >= 0 for item in listed):
            raise self.error(f"{key} must be a list of whole numbers, not {value!r}", key)
        return tuple(listed)

    def table(self, key: str) -> SpecTable | None:
        """Take a table."""
        value = self.raw(key)
        if value is None:
            return None
        if not isinstance(value, dict):
            raise self.error(f"{key} must be a table {{...}}, not {value!r}", key)
        return SpecTable(value, (*self.path, key), self.where)

    def tables(self, key: str) -> Iterator[SpecTable]:
        """Take an array of tables."""
        value = self.raw(key, [])
        if not isinstance(value, list):
            raise self.error(f"{key} must be an array of tables, not {value!r}", key)
        for index, item in enumerate(value):
            if not isinstance(item, dict):
                raise self.error(f"{key} holds {item!r}, which is no table {{...}}", key)
            yield SpecTable(item, (*self.path, key, index), self.where)

    def skip(self, keys: Iterable[str]) -> None:
        """Take keys without looking at them."""
        self._taken.update(keys)

    def finish(self, known: object) -> None:
        """Refuse the keys that nothing has taken; ``known`` are the words to suggest from."""
        for key in self.values:
            if key not in self._taken:
                raise self.error(f"unknown key {key!r}{nearest(key, known)}", key)
