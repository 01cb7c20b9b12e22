"""Statements of ISO 10303-21, written."""

from __future__ import annotations

from cadskin.cad.pmi.tokens import Derived, Enumeration, Reference, Typed, Value

__all__ = ["Statements", "encode", "encode_string"]


def encode_string(text: str) -> str:
    r"""Return a text as a Part 21 string with its quotes.

    Printable ASCII stands for itself, everything else in ``\X2\`` or ``\X4\`` (ISO 10303-21, 6.4.3).

    Examples
    --------
    >>> print(encode_string("⌀ 5 it's"))
    '\X2\2300\X0\ 5 it''s'
    """
    parts = []
    for char in text:
        code = ord(char)
        if char == "'":
            parts.append("''")
        elif char == "\\":
            parts.append("\\\\")
        elif 32 <= code < 127:
            parts.append(char)
        elif code < 0x10000:
            parts.append(f"\\X2\\{code:04X}\\X0\\")
        else:
            parts.append(f"\\X4\\{code:08X}\\X0\\")
    return "'" + "".join(parts) + "'"


def _real(value: float) -> str:
    mantissa, _, exponent = repr(value).partition("e")
    if "." not in mantissa:
        mantissa += "."
    return mantissa + (f"E{exponent}" if exponent else "")


def encode(value: Value) -> str:
    """Return a value as text of Part 21.

    Examples
    --------
    >>> encode((Reference(12), None, 1e-7, Enumeration("T"), Typed("LENGTH_MEASURE", (0.5,))))
    '(#12,$,1.E-07,.T.,LENGTH_MEASURE(0.5))'
    """
    if value is None:
        return "$"
    if isinstance(value, Reference):
        return f"#{int(value)}"
    if isinstance(value, Enumeration):
        return f".{value}."
    if isinstance(value, Derived):
        return "*"
    if isinstance(value, Typed):
        return value.name + encode(value.values)
    if isinstance(value, tuple):
        return "(" + ",".join(encode(item) for item in value) + ")"
    if isinstance(value, str):
        return encode_string(value)
    if isinstance(value, float):
        return _real(value)
    if isinstance(value, bytes):
        return value.decode("ascii")
    return str(int(value))


class Statements:
    """Instances to be added to a file, numbered from ``first``."""

    def __init__(self, first: int) -> None:
        self._next = first
        self._lines: list[str] = []

    def add(self, keyword: str, *values: Value) -> Reference:
        """Add a simple instance and return its number."""
        return self._numbered(keyword + encode(values))

    def add_complex(self, *records: tuple[str, tuple[Value, ...]]) -> Reference:
        """Add a complex instance; its records are put into alphabetical order, as the standard wants it."""
        ordered = sorted(records)
        return self._numbered("(" + "".join(name + encode(values) for name, values in ordered) + ")")

    def _numbered(self, text: str) -> Reference:
        number = Reference(self._next)
        self._next += 1
        self._lines.append(f"#{int(number)}={text};\n")
        return number

    def text(self) -> str:
        """Return all statements."""
        return "".join(self._lines)
