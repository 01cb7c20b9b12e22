"""Limits of size of ISO 286 (sizes up to 500 mm)."""

from __future__ import annotations

import re
from bisect import bisect_left

from cadskin.errors import SpecificationError
from cadskin.spec.fit_tables import FINE_SIZES, GRADES, HOLE_J, SHAFT_DEVIATIONS, SHAFT_J, SIZES

__all__ = ["fit_deviations", "standard_tolerance"]

_CODE = re.compile(r"\s*(JS|Js|js|CD|EF|FG|ZA|ZB|ZC|cd|ef|fg|za|zb|zc|[A-Za-z])\s*(0?1|\d{1,2})\s*$")
_NO_LETTERS = ("i", "l", "o", "q", "w")


def _row(size: float, sizes: tuple[int, ...]) -> int:
    if not 0 < size <= sizes[-1]:
        raise SpecificationError(
            f"ISO 286 fits are known for sizes up to {sizes[-1]} mm, not for {size:g} mm"
        )
    return bisect_left(sizes, size)


def standard_tolerance(size: float, grade: str) -> float:
    """Return the standard tolerance of an IT grade [mm].

    Parameters
    ----------
    size : float
        Nominal size [mm], up to 500.
    grade : str
        ``"01"``, ``"0"``, ``"1"`` to ``"18"``.

    Raises
    ------
    SpecificationError
        Unknown grade, or a size out of range.

    References
    ----------
    ISO 286-1:2010, table 1.

    Examples
    --------
    >>> standard_tolerance(20.0, "7")
    0.021
    """
    if grade not in GRADES:
        raise SpecificationError(f"there is no standard tolerance grade IT{grade}; there are IT01 to IT18")
    return GRADES[grade][_row(size, SIZES)] / 1000


def _value(row: tuple[float | None, ...], size: float) -> float | None:
    index = _row(size, FINE_SIZES if len(row) == len(FINE_SIZES) else SIZES)
    return row[index] if index < len(row) else None


def _shaft_deviation(letter: str, size: float, grade: int) -> float | None:
    """Fundamental deviation of a shaft [µm]; None where the standard has none."""
    if letter == "k":
        return _value(SHAFT_DEVIATIONS["k"], size) if 4 <= grade <= 7 else 0.0
    rows = SHAFT_J.get(grade, ()) if letter == "j" else SHAFT_DEVIATIONS.get(letter, ())
    return _value(rows, size)


def _hole_deviation(letter: str, size: float, grade: int) -> float | None:
    """Fundamental deviation of a hole [µm], for K to ZC with the increment delta; None where there is none.

    Delta = IT(n) - IT(n-1) is tabulated for the grades 3 to 8 above 3 mm (ISO 286-1:2010, tables 3 and 7).
    """
    if letter == "j":
        return _value(HOLE_J.get(grade, ()), size)
    shaft = _value(SHAFT_DEVIATIONS.get(letter, ()), size)
    if shaft is None or letter <= "h":
        return None if shaft is None else -shaft
    row = _row(size, SIZES)
    if row == 0:
        return -shaft
    if grade < 3 or (letter == "k" and grade > 8):
        return None
    if letter == "n" and grade > 8:
        return 0.0
    if letter == "m" and grade == 6 and 250 < size <= 315:
        return -9.0
    fine = grade <= (8 if letter in "kmn" else 7)
    return -shaft + (GRADES[str(grade)][row] - GRADES[str(grade - 1)][row] if fine else 0.0)


def _refuse_small(code: str, letter: str, size: float, grade: int) -> None:
    """Refuse what ISO 286-1 excludes up to 1 mm: a, b, coarse N holes and the grades IT14 to IT18."""
    if size > 1:
        return
    if letter in "ab" or grade >= 14 or (code.lstrip()[0] == "N" and grade > 8):
        raise SpecificationError(
            f"ISO 286 excludes tolerance class {code!r} at {size:g} mm (up to 1 mm); give limits instead"
        )


def fit_deviations(size: float, code: str) -> tuple[float, float]:
    """Return the lower and upper limit deviation of an ISO 286 tolerance class [mm].

    Parameters
    ----------
    size : float
        Nominal size [mm], up to 500.
    code : str
        ``"H7"`` (upper case: hole), ``"g6"`` (lower case: shaft), ``"js9"``, ``"zc8"``.

    Returns
    -------
    tuple of float
        Signed lower and upper deviation [mm].

    Raises
    ------
    SpecificationError
        The code is not understood, or ISO 286 has no such class at that size: cd, ef and fg above 10 mm, t up
        to 24 mm, v up to 14 mm, y up to 18 mm, j beside j5 to j8 (J6 to J8), holes K above IT8, and
        holes K to ZC finer than IT3 (both above 3 mm).

    References
    ----------
    ISO 286-1:2010, tables 1 to 7.

    Examples
    --------
    >>> fit_deviations(20.0, "P7")
    (-0.035, -0.014)
    """
    match = _CODE.match(code)
    if match is None or match[1].lower() in _NO_LETTERS:
        raise SpecificationError(f"{code!r} is no tolerance class of ISO 286, write for example 'H7' or 'g6'")
    letter, word = match[1].lower(), match[2]
    grade = 0 if word == "01" else int(word)
    width = round(standard_tolerance(size, word) * 1000, 3)
    _refuse_small(code, letter, size, grade)
    if letter == "js":
        return -width / 2000, width / 2000
    hole = match[1].isupper()
    deviation = (_hole_deviation if hole else _shaft_deviation)(letter, size, grade)
    if deviation is None:
        raise SpecificationError(
            f"ISO 286 has no tolerance class {code!r} at {size:g} mm; give limits instead"
        )
    from_below = hole == (letter <= "h")
    low = deviation if from_below else deviation - width
    return round(low, 3) / 1000 + 0.0, round(low + width, 3) / 1000 + 0.0
