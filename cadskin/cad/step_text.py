"""What the text of a STEP file (ISO 10303-21) tells: schema, units, PMI, entity numbers."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from cadskin._typing import Ints
from cadskin.errors import ReadError

__all__ = ["StepText", "read_step_text"]

_STRINGS = re.compile(r"'(?:[^']|'')*'|/\*.*?\*/", re.S)
_DATA = re.compile(r"\bDATA\s*(?:\([^;]*\)\s*)?;(.*?)\bENDSEC\s*;", re.S)
_INSTANCE = re.compile(r"#(\d+)\s*=")
_SCHEMA = re.compile(r"FILE_SCHEMA\s*\(\s*\(\s*'((?:[^']|'')*)'", re.S)
_TOLERANCE = re.compile(
    r"\b(?:(?:ANGULARITY|CIRCULAR_RUNOUT|CONCENTRICITY|COAXIALITY|CYLINDRICITY|FLATNESS|GEOMETRIC|LINE_PROFILE"
    r"|PARALLELISM|PERPENDICULARITY|POSITION|ROUNDNESS|STRAIGHTNESS|SURFACE_PROFILE|SYMMETRY|TOTAL_RUNOUT)"
    r"_TOLERANCE)\s*\("
)
_DIMENSION = re.compile(r"\b(?:DIMENSIONAL_SIZE|DIMENSIONAL_LOCATION|ANGULAR_SIZE|ANGULAR_LOCATION)\w*\s*\(")
_DATUM = re.compile(r"=\s*(?:\([^;]*\b)?DATUM\s*\(")
_TESSELLATED = re.compile(r"\b(?:COMPLEX_TRIANGULATED_FACE|TRIANGULATED_FACE|COORDINATES_LIST)\s*\(")
_SI_LENGTH = re.compile(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.\s*\)")
_OTHER_LENGTH = re.compile(r"CONVERSION_BASED_UNIT\s*\(\s*'([^']*)'")
_LENGTH_UNIT = re.compile(r"#(\d+)\s*=\s*([^;]*\bLENGTH_UNIT\b[^;]*);")
_CONTEXT = re.compile(r"GLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^)]*)\)")
_PREFIXES = {"$": "m", ".MILLI.": "mm", ".CENTI.": "cm", ".DECI.": "dm", ".MICRO.": "µm", ".KILO.": "km"}


@dataclass(frozen=True, eq=False)
class StepText:
    """The text of a STEP file, cut into the statements of its DATA section.

    Parameters
    ----------
    header : str
        Everything before the DATA section.
    data : str
        The DATA section(s), with the strings and comments blanked.
    original : str
        The whole file.
    """

    header: str
    data: str
    original: str

    @property
    def schema(self) -> str:
        """Name of the schema, such as ``AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF``."""
        found = _SCHEMA.search(self.header)
        return found.group(1).split("{")[0].strip() if found else ""

    @cached_property
    def entity_ids(self) -> Ints:
        """Entity numbers in file order (n,)."""
        return np.array(_INSTANCE.findall(self.data), dtype=np.int64)

    @cached_property
    def length_units(self) -> tuple[str, ...]:
        """Length units of the geometry (not of the PMI): mm, cm, m, inch, ft or the file's own word."""
        units: dict[str, str] = {}
        for number, statement in _LENGTH_UNIT.findall(self.original):
            other, metric = _OTHER_LENGTH.search(statement), _SI_LENGTH.search(statement)
            if other:
                units[number] = unit_word(other.group(1))
            elif metric:
                units[number] = _PREFIXES.get(metric.group(1), metric.group(1))
        used = [
            units[number]
            for context in _CONTEXT.findall(self.data)
            for number in re.findall(r"#(\d+)", context)
            if number in units
        ]
        return tuple(dict.fromkeys(used))

    @cached_property
    def _statements(self) -> list[str]:
        return self.data.split(";")

    def _count(self, pattern: re.Pattern[str]) -> int:
        return sum(pattern.search(statement) is not None for statement in self._statements)

    @property
    def n_tolerances(self) -> int:
        """Number of geometric tolerances (semantic PMI)."""
        return self._count(_TOLERANCE)

    @property
    def n_datums(self) -> int:
        """Number of datums (semantic PMI)."""
        return self._count(_DATUM)

    @property
    def n_dimensions(self) -> int:
        """Number of dimensional sizes and locations (semantic PMI)."""
        return self._count(_DIMENSION)

    @property
    def n_tessellated(self) -> int:
        """Number of tessellated items: triangles beside or instead of exact surfaces."""
        return self._count(_TESSELLATED)


def read_step_text(path: Path) -> StepText:
    """Return the text of a STEP file.

    Raises
    ------
    ReadError
        No STEP file, or one that breaks off before its end.
    """
    text = path.read_bytes().decode("latin-1")
    if "ISO-10303-21" not in text[:2000]:
        raise ReadError(f"{path.name} is no STEP file: it does not begin with ISO-10303-21")
    blanked = _STRINGS.sub("''", text)
    sections = _DATA.findall(blanked)
    if not sections:
        what = "breaks off before the end of its DATA section" if "DATA" in blanked else "has no DATA section"
        raise ReadError(f"{path.name} is a truncated STEP file: it {what}; export or copy it again")
    begin = re.search(r"\bDATA\s*(?:\([^;]*\)\s*)?;", text)
    return StepText(header=text[: begin.start() if begin else 0], data="".join(sections), original=text)


def unit_word(name: str) -> str:
    """Return the short word for a length unit's name in a file (``'INCH'`` -> ``inch``)."""
    short = {
        "millimetre": "mm",
        "millimeter": "mm",
        "mm": "mm",
        "centimetre": "cm",
        "centimeter": "cm",
        "cm": "cm",
        "metre": "m",
        "meter": "m",
        "m": "m",
        "inch": "inch",
        "in": "inch",
        "inches": "inch",
        "foot": "ft",
        "feet": "ft",
        "ft": "ft",
    }
    word = name.strip().strip("'").lower()
    return short.get(word, word)
