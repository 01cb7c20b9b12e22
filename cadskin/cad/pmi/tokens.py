"""Values of ISO 10303-21 parameter lists: tokens, nesting, string escapes."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TypeAlias

from cadskin.errors import ReadError

__all__ = [
    "DERIVED",
    "Derived",
    "Enumeration",
    "Malformed",
    "Record",
    "Reference",
    "Typed",
    "Value",
    "decode_string",
    "parse_records",
]

MAX_DEPTH = 64
MAX_STRING = 1 << 20


class Malformed(ReadError):
    """One instance whose text is no parameter list; the rest of the file can still be read."""


class Reference(int):
    """``#12``."""

    __slots__ = ()

    def __repr__(self) -> str:
        return f"#{int(self)}"


class Enumeration(str):
    """``.MILLI.`` without its dots."""

    __slots__ = ()


class Derived:
    """``*``: an attribute that the schema derives."""

    __slots__ = ()

    def __repr__(self) -> str:
        return "*"


DERIVED = Derived()


@dataclass(frozen=True, slots=True)
class Typed:
    """``LENGTH_MEASURE(0.1)``: a value with its type."""

    name: str
    values: tuple[Value, ...]


Value: TypeAlias = (
    "Reference | Enumeration | Derived | Typed | tuple[Value, ...] | str | float | int | bytes | None"
)


@dataclass(frozen=True, slots=True)
class Record:
    """One record of an instance: a simple instance has one, a complex one several."""

    name: str
    values: tuple[Value, ...]


# Longest alternatives first; a real may begin with its point, which the standard forbids and writers do.
# Every repetition is possessive, so that matching cannot backtrack.
_TOKEN = re.compile(
    rb"""\s++|(?P<reference>\#\d++)|(?P<punctuation>[(),$*])|(?P<string>'(?:[^']++|'')*+')
    |(?P<real>[+-]?(?:\d++\.\d*+|\.\d++)(?:[eE][+-]?\d++)?+)|(?P<integer>[+-]?\d++(?:[eE][+-]?\d++)?+)
    |(?P<enumeration>\.[A-Za-z_][A-Za-z0-9_]*+\.)|(?P<name>!?[A-Za-z_][A-Za-z0-9_]*+)
    |(?P<binary>"[0-9A-Fa-f]*+")|(?P<comment>/\*(?:[^*]++|\*(?!/))*+\*/)|(?P<anchor><[^>]*+>)""",
    re.VERBOSE,
)
_ESCAPE = re.compile(
    r"\\X2\\((?:[0-9A-Fa-f]{4})*+)\\X0\\|\\X4\\((?:[0-9A-Fa-f]{8})*+)\\X0\\|\\X\\([0-9A-Fa-f]{2})"
    r"|\\S\\(.)|\\P([A-I])\\|\\N\\|\\T\\|\\\\",
    re.DOTALL,
)
_PAGES = {letter: f"iso8859-{i}" for i, letter in enumerate("ABCDEFGHI", start=1)}


def decode_string(raw: bytes) -> str:
    r"""Return the text of a Part 21 string without its outer quotes.

    Parameters
    ----------
    raw : bytes
        What stands between the quotes, with ``''`` for a quote and the escapes of ISO 10303-21, 6.4.3:
        ``\X2\...\X0\``, ``\X4\...\X0\``, ``\X\hh``, ``\S\c``, ``\Pa\``, ``\\``. An escape that is
        none is kept as it stands. Bytes above 127 are read as UTF-8 where they are that, else as ISO 8859-1.

    Examples
    --------
    >>> decode_string(rb"\X2\2300\X0\ 5 it''s")
    "⌀ 5 it's"
    """
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    text = text.replace("''", "'")
    if "\\" not in text:
        return text
    page = "iso8859-1"

    def plain(match: re.Match[str]) -> str:
        nonlocal page
        two, four, one, shifted, letter = match.groups()
        if two is not None:
            return bytes.fromhex(two).decode("utf-16-be", errors="replace")
        if four is not None:
            return bytes.fromhex(four).decode("utf-32-be", errors="replace")
        if one is not None:
            return bytes.fromhex(one).decode("latin-1")
        if shifted is not None:
            code = ord(shifted)
            return bytes([code + 128]).decode(page, errors="replace") if code < 128 else shifted
        if letter is not None:
            page = _PAGES[letter]
            return ""
        return {"\\N\\": "\n", "\\T\\": "\t"}.get(match[0], "\\")

    return _ESCAPE.sub(plain, text)


def _scalar(kind: str, token: bytes, label: str) -> Value:
    if kind == "reference":
        return Reference(token[1:])
    if kind == "string":
        if len(token) > MAX_STRING:
            raise ReadError(f"{label}: a string of {len(token)} characters; the limit is {MAX_STRING}")
        return decode_string(token[1:-1])
    if kind == "real":
        return float(token)
    if kind == "integer":
        if len(token) > 400:
            raise ReadError(f"{label}: a number of {len(token)} digits")
        return float(token) if b"e" in token.lower() else int(token)
    if kind == "enumeration":
        return Enumeration(token[1:-1].decode("ascii").upper())
    return bytes(token)


def parse_records(data: bytes, start: int, stop: int, *, label: str) -> tuple[Record, ...]:
    """Return the records of one instance.

    Parameters
    ----------
    data : bytes
    start, stop : int
        From the keyword of ``A(...)``, or the bracket of a complex ``(A(...)B(...))``, to the semicolon.
    label : str
        For messages: ``part.stp, #12``.

    Raises
    ------
    Malformed
        Text that is no parameter list.
    ReadError
        Brackets nested more than 64 deep, a string of more than 1 MiB.
    """
    stack: list[tuple[str | None, list[Value]]] = []
    pending: str | None = None
    position, match_token = start, _TOKEN.match
    done: tuple[str | None, list[Value]] | None = None
    while position < stop:
        match = match_token(data, position, stop)
        if match is None:
            raise Malformed(f"{label}: not understood at {data[position : position + 30]!r}")
        position, kind, token = match.end(), match.lastgroup, match[0]
        if kind is None or kind == "comment":
            continue
        if done is not None:
            raise Malformed(f"{label}: text after the closing bracket: {token[:30]!r}")
        if token == b"(":
            if len(stack) >= MAX_DEPTH:
                raise ReadError(f"{label}: brackets nested more than {MAX_DEPTH} deep")
            stack.append((pending, []))
            pending = None
        elif pending is not None or (not stack and kind != "name"):
            raise Malformed(f"{label}: '(' expected at {token[:30]!r}")
        elif token == b")":
            closed = stack.pop()
            if stack:
                own, values = closed
                stack[-1][1].append(tuple(values) if own is None else Typed(own, tuple(values)))
            else:
                done = closed
        elif kind == "name":
            pending = token.decode("ascii").upper()
        elif kind != "punctuation":
            stack[-1][1].append(_scalar(kind, token, label))
        elif token != b",":
            stack[-1][1].append(None if token == b"$" else DERIVED)
    if done is None:
        raise Malformed(f"{label}: a bracket is never closed")
    own, values = done
    if own is not None:
        return (Record(own, tuple(values)),)
    return tuple(Record(item.name, item.values) for item in values if isinstance(item, Typed))
