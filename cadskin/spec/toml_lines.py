"""Line numbers of the keys of a TOML text, which `tomllib` does not tell."""

from __future__ import annotations

import re
from bisect import bisect_right
from typing import TypeAlias

__all__ = ["Path", "line_of", "locate"]

Path: TypeAlias = tuple[str | int, ...]

_BLANK = re.compile(r"(?:[ \t\r\n]++|#[^\n]*+)*+")
_KEY = re.compile(r'"(?:[^"\\\n]|\\.)*+"|\'[^\'\n]*+\'|[A-Za-z0-9_\-]++')
_STRING = re.compile(
    r'"""(?:[^"\\]|\\.|"(?!""))*+"{3,5}|\'\'\'(?:[^\']|\'(?!\'\'))*+\'{3,5}|"(?:[^"\\\n]|\\.)*+"|\'[^\'\n]*+\'',
    re.DOTALL,
)
_ATOM = re.compile(r"[^,\]}#\n]*+")
_ESCAPE = re.compile(r"\\(?:u([0-9A-Fa-f]{4})|U([0-9A-Fa-f]{8})|(.))")
_PLAIN = {"b": "\b", "t": "\t", "n": "\n", "f": "\f", "r": "\r", "e": "\x1b"}


def locate(text: str) -> dict[Path, int]:
    r"""Return the line (from 1) of every table, key and array element of a valid TOML text.

    Examples
    --------
    >>> locate("a = 1\n[b]\nc = [\n  {d = 2},\n]\n")["b", "c", 0, "d"]
    4
    """
    return _Scanner(text).scan()


def line_of(lines: dict[Path, int], path: Path) -> int | None:
    """Return the line of a path, or of the nearest table above it that has one."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


class _Scanner:
    """A walk over the text; `tomllib` has accepted it before, so that little can be wrong here."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.position = 0
        self.lines: dict[Path, int] = {}
        self.last_of_array: dict[Path, int] = {}
        self.starts = [0, *(match.end() for match in re.finditer("\n", text))]

    def scan(self) -> dict[Path, int]:
        table: Path = ()
        while self._blank() < len(self.text):
            if self.text.startswith("[[", self.position):
                self.position += 2
                table = self._header(array=True)
            elif self.text[self.position] == "[":
                self.position += 1
                table = self._header(array=False)
            else:
                self._pair(table)
        return self.lines

    def _blank(self) -> int:
        match = _BLANK.match(self.text, self.position)
        if match is not None:
            self.position = match.end()
        return self.position

    def _mark(self, path: Path, position: int) -> None:
        self.lines.setdefault(path, bisect_right(self.starts, position))

    def _keys(self) -> list[str]:
        keys: list[str] = []
        while True:
            self._blank()
            match = _KEY.match(self.text, self.position)
            if match is None:
                self.position += 1
                return keys
            self.position = match.end()
            keys.append(_unquoted(match[0]))
            self._blank()
            if not self.text.startswith(".", self.position):
                return keys
            self.position += 1

    def _header(self, *, array: bool) -> Path:
        begin = self.position
        keys = self._keys()
        path: Path = ()
        for i, key in enumerate(keys):
            path = (*path, key)
            self._mark(path, begin)
            if array and i == len(keys) - 1:
                self.last_of_array[path] = self.last_of_array.get(path, -1) + 1
            if path in self.last_of_array:
                path = (*path, self.last_of_array[path])
                self._mark(path, begin)
        self._blank()
        self.position += 2 if array else 1
        return path

    def _pair(self, table: Path) -> None:
        begin = self.position
        path = table
        for key in self._keys():
            path = (*path, key)
            self._mark(path, begin)
        self._blank()
        self.position += 1  # the sign of equality
        self._value(path)

    def _value(self, path: Path) -> None:
        self._blank()
        opening = self.text[self.position : self.position + 1]
        if opening == "[":
            self._array(path)
        elif opening == "{":
            self._inline_table(path)
        else:
            match = _STRING.match(self.text, self.position) or _ATOM.match(self.text, self.position)
            self.position = match.end() if match is not None else self.position + 1

    def _array(self, path: Path) -> None:
        self.position += 1
        index = 0
        while self._blank() < len(self.text) and self.text[self.position] != "]":
            self._mark((*path, index), self.position)
            self._value((*path, index))
            index += 1
            if self._blank() < len(self.text) and self.text[self.position] == ",":
                self.position += 1
        self.position += 1

    def _inline_table(self, path: Path) -> None:
        self.position += 1
        while self._blank() < len(self.text) and self.text[self.position] != "}":
            self._pair(path)
            if self._blank() < len(self.text) and self.text[self.position] == ",":
                self.position += 1
        self.position += 1


def _unquoted(key: str) -> str:
    if key.startswith("'"):
        return key[1:-1]
    if not key.startswith('"'):
        return key

    def plain(match: re.Match[str]) -> str:
        code = match[1] or match[2]
        return chr(int(code, 16)) if code else _PLAIN.get(match[3], match[3])

    return _ESCAPE.sub(plain, key[1:-1])
