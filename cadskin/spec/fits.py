"""Limits of size of ISO 286 (sizes up to 500 mm)."""

from __future__ import annotations

import re
from bisect import bisect_left

from cadskin.errors import SpecificationError

__all__ = ["fit_deviations", "standard_tolerance"]

# ISO 286-1:2010, table 1: nominal sizes up to and including [mm]; tolerances [µm].
_SIZES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
_GRADES: dict[str, tuple[float, ...]] = {
    "01": (0.3, 0.4, 0.4, 0.5, 0.6, 0.6, 0.8, 1, 1.2, 2, 2.5, 3, 4),
    "0": (0.5, 0.6, 0.6, 0.8, 1, 1, 1.2, 1.5, 2, 3, 4, 5, 6),
    "1": (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8),
    "2": (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10),
    "3": (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15),
    "4": (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    "5": (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    "6": (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    "7": (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    "8": (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    "9": (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    "10": (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    "11": (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
    "12": (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630),
    "13": (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970),
    "14": (250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550),
    "15": (400, 480, 580, 700, 840, 1000, 1200, 1400, 1600, 1850, 2100, 2300, 2500),
    "16": (600, 750, 900, 1100, 1300, 1600, 1900, 2200, 2500, 2900, 3200, 3600, 4000),
    "17": (1000, 1200, 1500, 1800, 2100, 2500, 3000, 3500, 4000, 4600, 5200, 5700, 6300),
    "18": (1400, 1800, 2200, 2700, 3300, 3900, 4600, 5400, 6300, 7200, 8100, 8900, 9700),
}

# ISO 286-1:2010, tables 4 and 5: fundamental deviations of shafts [µm], sizes up to and including [mm].
# a to h: upper deviation (negative); k to x: lower deviation.
_FINE: tuple[int, ...] = (3, 6, 10, 14, 18, 24, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180)
_FINE += (200, 225, 250, 280, 315, 355, 400, 450, 500)
_FINE_DEVIATIONS: dict[str, str] = {
    "a": "-270 -270 -280 -290 -290 -300 -300 -310 -320 -340 -360 -380 -410 -460 -520 -580 -660 -740 -820"
    " -920 -1050 -1200 -1350 -1500 -1650",
    "b": "-140 -140 -150 -150 -150 -160 -160 -170 -180 -190 -200 -220 -240 -260 -280 -310 -340 -380 -420"
    " -480 -540 -600 -680 -760 -840",
    "c": "-60 -70 -80 -95 -95 -110 -110 -120 -130 -140 -150 -170 -180 -200 -210 -230 -240 -260 -280"
    " -300 -330 -360 -400 -440 -480",
    "r": "10 15 19 23 23 28 28 34 34 41 43 51 54 63 65 68 77 80 84 94 98 108 114 126 132",
    "s": "14 19 23 28 28 35 35 43 43 53 59 71 79 92 100 108 122 130 140 158 170 190 208 232 252",
    "t": "- - - - - - 41 48 54 66 75 91 104 122 134 146 166 180 196 218 240 268 294 330 360",
    "u": "18 23 28 33 33 41 48 60 70 87 102 124 144 170 190 210 236 258 284 315 350 390 435 490 540",
    "x": "20 28 34 40 45 54 64 80 97 122 146 178 210 248 280 310 350 385 425 475 525 590 660 740 820",
}
_DEVIATIONS: dict[str, tuple[float, ...]] = {
    "d": (-20, -30, -40, -50, -65, -80, -100, -120, -145, -170, -190, -210, -230),
    "e": (-14, -20, -25, -32, -40, -50, -60, -72, -85, -100, -110, -125, -135),
    "f": (-6, -10, -13, -16, -20, -25, -30, -36, -43, -50, -56, -62, -68),
    "g": (-2, -4, -5, -6, -7, -9, -10, -12, -14, -15, -17, -18, -20),
    "h": (0,) * 13,
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
_CODE = re.compile(r"\s*(JS|Js|js|[A-Za-z])\s*(0?1|\d{1,2})\s*$")


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
    if grade not in _GRADES:
        raise SpecificationError(f"there is no standard tolerance grade IT{grade}; there are IT01 to IT18")
    return _GRADES[grade][_row(size, _SIZES)] / 1000


def _shaft_deviation(letter: str, size: float) -> float | None:
    if letter in _DEVIATIONS:
        return float(_DEVIATIONS[letter][_row(size, _SIZES)])
    if letter in _FINE_DEVIATIONS:
        word = _FINE_DEVIATIONS[letter].split()[_row(size, _FINE)]
        return None if word == "-" else float(word)
    return None


def _hole_deviation(letter: str, size: float, grade: int, shaft: float) -> float:
    """Upper deviation of a hole K to X [µm]: ISO 286-1, 4.3.3.2 with the increment delta."""
    row = _row(size, _SIZES)
    delta = 0.0
    fine = grade <= (8 if letter in "kmn" else 7)
    if fine and row > 0 and grade >= 3:
        delta = _GRADES[str(grade)][row] - _GRADES[str(grade - 1)][row]
    if letter == "k" and grade > 8:
        return 0.0
    if letter == "n" and grade > 8 and row > 0:
        return 0.0
    if letter == "m" and grade == 6 and 250 < size <= 315:
        return -9.0
    return -shaft + delta


def fit_deviations(size: float, code: str) -> tuple[float, float]:
    """Return the lower and upper limit deviation of an ISO 286 tolerance class [mm].

    Parameters
    ----------
    size : float
        Nominal size [mm], up to 500.
    code : str
        ``"H7"`` (upper case: hole), ``"g6"`` (lower case: shaft), ``"js9"``.

    Returns
    -------
    tuple of float
        Signed lower and upper deviation [mm].

    Raises
    ------
    SpecificationError
        The code is not understood, or the tables do not have it.

    References
    ----------
    ISO 286-1:2010, tables 1 to 5. Classes cd, ef, fg, j, v, y, z, za, zb, zc are not in these tables.

    Examples
    --------
    >>> fit_deviations(20.0, "P7")
    (-0.035, -0.014)
    """
    match = _CODE.match(code)
    if match is None:
        raise SpecificationError(f"{code!r} is no tolerance class of ISO 286, write for example 'H7' or 'g6'")
    letter, grade = match[1], match[2]
    width = round(standard_tolerance(size, grade) * 1000, 3)
    if letter.lower() == "js":
        return -width / 2000, width / 2000
    small = letter.lower()
    shaft = _shaft_deviation(small, size)
    if shaft is None:
        raise SpecificationError(
            f"tolerance class {code!r} at {size:g} mm is not in the tables; give limits instead"
        )
    if small <= "h":
        pair = (-shaft, -shaft + width) if letter.isupper() else (shaft - width, shaft)
    elif letter.isupper():
        high = _hole_deviation(small, size, int(grade), shaft)
        pair = (high - width, high)
    else:
        low = shaft if small != "k" or 4 <= int(grade) <= 7 else 0.0
        pair = (low, low + width)
    return round(pair[0], 3) / 1000 + 0.0, round(pair[1], 3) / 1000 + 0.0
