"""The text of a STEP file (ISO 10303-21): found in one pass, parsed only where it is asked for."""

from __future__ import annotations

import re
from bisect import bisect_right
from collections.abc import Iterator
from pathlib import Path

from cadskin.cad.pmi.tokens import MAX_DEPTH, MAX_STRING, Malformed, Record, Value, parse_records
from cadskin.errors import ReadError

__all__ = ["Part21File", "read_part21"]

MAX_BYTES = 512 << 20
# A span is kept as one number, start and length: a 100 MB file has millions of them.
_LENGTH_BITS = 26
MAX_STATEMENT = 1 << _LENGTH_BITS

_COMMENT = rb"/\*(?:[^*]++|\*(?!/))*+\*/"
_SPACE = rb"(?:\s++|" + _COMMENT + rb")*+"
# One statement up to its semicolon; strings and comments may hold semicolons.
_BODY = rb"(?:[^;'/]++|'[^']*+'|" + _COMMENT + rb"|/(?!\*))*+"
_INSTANCE = re.compile(
    _SPACE + rb"#(\d++)" + _SPACE + rb"=" + _SPACE + rb"(!?[A-Za-z_][A-Za-z0-9_]*+|)(" + _BODY + rb");"
)
_STATEMENT = re.compile(_SPACE + rb"(" + _BODY + rb");")
_WORD = re.compile(_SPACE + rb"([A-Za-z_][A-Za-z0-9_\-]*+)")
_RECORD_NAME = re.compile(rb"([A-Za-z_][A-Za-z0-9_]*+)\s*+\(")
_BLANK = re.compile(rb"\s*+")
_KEYWORD = re.compile(rb"!?[A-Za-z_][A-Za-z0-9_]*+")
_STRING = re.compile(rb"'[^']*+'")
_SCHEMA_VERSION = re.compile(r"\{\s*1\s+0\s+10303\s+442\s+(\d+)")


class Part21File:
    """An indexed STEP file.

    Made by `read_part21`. One pass finds where every instance starts; an instance is parsed when it is
    asked for the first time.

    Parameters
    ----------
    data : bytes
    name : str
        For messages.

    Raises
    ------
    ReadError
        The text is no STEP file, is cut off, or is beyond the limits.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self.name = name
        self._data = data
        self._spans: dict[int, int] = {}
        self._by_name: dict[str, list[int]] = {}
        self._complex: dict[str, list[int]] = {}
        self._long: list[int] = []
        self._types: dict[int, tuple[str, ...]] = {}
        self._parsed: dict[int, tuple[Record, ...]] = {}
        self.header: tuple[Record, ...] = ()
        self.broken: dict[int, str] = {}
        self._index()
        self._refuse_hostile()

    def __len__(self) -> int:
        return len(self._spans)

    def __contains__(self, number: object) -> bool:
        return number in self._spans

    def __iter__(self) -> Iterator[int]:
        """Instance numbers in the order of the file."""
        return iter(self._spans)

    def records(self, number: int) -> tuple[Record, ...]:
        """Return the records of an instance.

        Empty where the file has no such instance, and where its text is malformed: that goes to `broken`.

        Raises
        ------
        ReadError
            It is beyond the limits of nesting and length.
        """
        number = int(number)
        found = self._parsed.get(number)
        if found is None:
            if number not in self._spans:
                return ()
            start, stop = self._span(number)
            try:
                found = parse_records(self._data, start, stop, label=f"{self.name}, #{number}")
            except Malformed as error:
                self.broken[number] = str(error)
                found = ()
            self._parsed[number] = found
        return found

    def types(self, number: int) -> tuple[str, ...]:
        """Return the names of its records; a simple instance is not parsed for that."""
        found = self._types.get(number)
        if found is None:
            if number not in self._spans:
                return ()
            match = _KEYWORD.match(self._data, self._span(number)[0])
            if match is not None:
                found = (match[0].decode("ascii").upper(),)
            else:
                found = tuple(record.name for record in self.records(number))
            self._types[number] = found
        return found

    def is_a(self, number: int, *names: str) -> bool:
        """Tell whether an instance has a record of one of these names."""
        types = self.types(number)
        return types[0] in names if len(types) == 1 else not set(types).isdisjoint(names)

    def values(self, number: int, name: str | None = None) -> tuple[Value, ...]:
        """Return the values of one record of an instance (of the first without ``name``); else nothing."""
        for record in self.records(number):
            if name is None or record.name == name:
                return record.values
        return ()

    def of_type(self, *names: str) -> list[int]:
        """Return the instances that have a record of one of these names, in the order of the file."""
        simple = {number for name in names for number in self._by_name.get(name, ())}
        maybe = {number for name in names for number in self._complex.get(name, ())}
        found = [*simple, *(number for number in maybe if self.is_a(number, *names))]
        return sorted(found, key=self._spans.__getitem__)

    def type_names(self) -> frozenset[str]:
        """Return the names of all records that the file may hold."""
        return frozenset(self._by_name) | frozenset(self._complex)

    def text(self, number: int) -> bytes:
        """Return the text of an instance, from its keyword to the semicolon."""
        start, stop = self._span(number)
        return self._data[start:stop]

    def _span(self, number: int) -> tuple[int, int]:
        packed = self._spans[number]
        start = packed >> _LENGTH_BITS
        return start, start + (packed & (MAX_STATEMENT - 1))

    @property
    def schema(self) -> str:
        """Name in FILE_SCHEMA, as written; empty if there is none."""
        for record in self.header:
            if record.name == "FILE_SCHEMA" and record.values and isinstance(record.values[0], tuple):
                return ", ".join(str(item) for item in record.values[0])
        return ""

    @property
    def edition(self) -> int | None:
        """Edition of AP242 (1, 2 or 3) by the schema's version number; None for other schemas."""
        match = _SCHEMA_VERSION.search(self.schema)
        if match is None:
            return 1 if "AP242" in self.schema.upper() else None
        return {1: 1, 2: 2, 3: 2, 4: 3}.get(int(match[1]), 3)

    def line(self, position: int) -> int:
        """Return the line number of the first text at or behind a byte position."""
        text = _BLANK.match(self._data, position)
        return self._data.count(b"\n", 0, position if text is None else text.end()) + 1

    def _refuse_hostile(self) -> None:
        """Parse what nests too deep or is too long, so that it is refused even where nobody asks for it."""
        nested = self._data.find(b"(" * (MAX_DEPTH + 1))
        starts = (
            sorted((packed >> _LENGTH_BITS, number) for number, packed in self._spans.items())
            if nested >= 0
            else []
        )
        if starts:
            self.records(starts[max(bisect_right(starts, (nested, 0)) - 1, 0)][1])
        for number in self._long:
            self.records(number)

    # -- the one pass --------------------

    def _index(self) -> None:
        position = self._keyword(0, b"ISO-10303-21", "it does not start with ISO-10303-21;")
        position = self._header(self._keyword(position, b"HEADER", "it has no HEADER section"))
        sections = 0
        while True:
            match = _WORD.match(self._data, position)
            word = match[1].upper() if match else b""
            if word == b"DATA":
                position = self._section(self._statement(position)[1])
                sections += 1
            elif word in (b"ANCHOR", b"REFERENCE", b"SIGNATURE"):
                position = self._skip_section(position)
            else:
                break
        if not sections:
            raise ReadError(f"{self.name} has no DATA section: it is cut off, or is no STEP part")

    def _statement(self, position: int) -> tuple[bytes, int]:
        match = _STATEMENT.match(self._data, position)
        if match is None:
            raise ReadError(
                f"{self.name}, line {self.line(position)}: the file ends inside a statement; is it cut off?"
            )
        return match[1], match.end()

    def _keyword(self, position: int, word: bytes, message: str) -> int:
        start = 3 if position == 0 and self._data.startswith(b"\xef\xbb\xbf") else position
        match = _WORD.match(self._data, start)
        if match is None or match[1].upper() != word:
            raise ReadError(f"{self.name} is no STEP file: {message}")
        return self._statement(start)[1]

    def _header(self, position: int) -> int:
        records: list[Record] = []
        while True:
            body, after = self._statement(position)
            word = _WORD.match(body)
            if word is None or word[1].upper() == b"ENDSEC":
                break
            label = f"{self.name}, {word[1].decode('ascii', 'replace')}"
            records += parse_records(body, 0, len(body), label=label)
            position = after
        self.header = tuple(records)
        return after

    def _skip_section(self, position: int) -> int:
        while True:
            body, position = self._statement(position)
            if body.strip().upper() == b"ENDSEC":
                return position

    def _section(self, position: int) -> int:
        data, spans, by_keyword = self._data, self._spans, {}  # type: ignore[var-annotated]
        match_instance, complex_ids, before = _INSTANCE.match, [], len(self._spans)
        count = 0
        while (match := match_instance(data, position)) is not None:
            number, keyword, position = int(match[1]), match[2], match.end()
            start = match.start(2)
            if position - start > MAX_STATEMENT:
                raise ReadError(
                    f"{self.name}, #{number}: {position - start} bytes long; the limit is {MAX_STATEMENT}"
                )
            spans[number] = start << _LENGTH_BITS | position - 1 - start
            count += 1
            if position - start > MAX_STRING:
                self._long.append(number)
            if not keyword:
                complex_ids.append(number)
            elif keyword in by_keyword:
                by_keyword[keyword].append(number)
            else:
                by_keyword[keyword] = [number]
        if len(spans) != before + count:
            raise ReadError(f"{self.name}: an instance number is used twice, so references are not clear")
        for keyword, numbers in by_keyword.items():
            self._by_name.setdefault(keyword.decode("ascii").upper(), []).extend(numbers)
        self._index_complex(complex_ids)
        return self._end_of_section(position)

    def _end_of_section(self, position: int) -> int:
        body, after = self._statement(position)
        if body.strip().upper() != b"ENDSEC":
            shown = body.strip()[:40].decode("ascii", "replace")
            raise ReadError(f"{self.name}, line {self.line(position)}: not an instance: {shown!r}")
        return after

    def _index_complex(self, numbers: list[int]) -> None:
        by_name = self._complex
        for number in numbers:
            text = self.text(number)
            if b"'" in text:
                text = _STRING.sub(b"", text)
            for name in set(_RECORD_NAME.findall(text)):
                by_name.setdefault(name.decode("ascii").upper(), []).append(number)


def read_part21(path: str | Path, *, max_bytes: int = MAX_BYTES) -> Part21File:
    """Index the text of a STEP file.

    Parameters
    ----------
    path : str or Path
    max_bytes : int
        Larger files are refused before they are read.

    Returns
    -------
    Part21File

    Raises
    ------
    ReadError
        Missing, empty, too large, cut off, or no STEP text.

    References
    ----------
    ISO 10303-21:2016.
    """
    file = Path(path)
    try:
        size = file.stat().st_size
        if size > max_bytes:
            limit = f"{max_bytes / 2**20:.0f} MiB (max_bytes=)"
            raise ReadError(f"{file.name} has {size / 2**20:.0f} MiB; the limit is {limit}")
        data = file.read_bytes()
    except OSError as error:
        raise ReadError(f"cannot read {file}: {error.strerror or error}") from error
    if not data or data.isspace():
        raise ReadError(f"{file.name} is empty")
    return Part21File(data, file.name)
