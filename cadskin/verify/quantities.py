"""Read which quantity a case asks for: words and ISO symbols of reference elements and parameters."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal, TypeAlias

__all__ = ["Wanted", "normalised", "read_quantity"]

What: TypeAlias = Literal["t", "p", "v", "q", "radius", "diameter", "angle", "half angle", "two point"]

_REFERENCES = (
    ("MC", r"mcc|mcs|mccy|mcci|mcsp|circumscribed|\bgn\b|size_gn"),
    ("MI", r"mic(?!ro)|mici|mis\b|inscribed|\bgx\b|size_gx"),
    ("LS", r"\bls|_ls|ls(pl|li|ci|cy|sp|co)|gauss|least.squares|\bgg\b|size_gg"),
    ("MZ", r"mz|minimum.zone|minimax|chebyshev"),
)
_PARAMETER = re.compile(
    r"\b(?:flt|str|ron|cyl|sph|con|tor)([tpvq])(?![a-z])|\b(?:flt|str|ron|cyl|sph|con|tor)([tpvq])_"
)


@dataclass(frozen=True)
class Wanted:
    """What is asked for; None where the text does not say.

    Parameters
    ----------
    what : str or None
    reference : str or None
        "MZ", "LS", "MC" or "MI".
    text : str
    """

    what: What | None
    reference: Literal["MZ", "LS", "MC", "MI"] | None
    text: str


def normalised(text: str) -> str:
    """Return lower-case letters and digits only, for comparing names.

    Examples
    --------
    >>> normalised("Circular run-out (radial)")
    'circularrunoutradial'
    """
    return re.sub(r"[^a-z0-9]", "", text.lower())


def read_quantity(text: str | None) -> Wanted:
    """Read a quantity such as ``FLTt (MZPL)``, ``LSCI diameter`` or ``size_GN``.

    Examples
    --------
    >>> read_quantity("LSCI diameter (NIST certified)")
    Wanted(what='diameter', reference='LS', text='LSCI diameter (NIST certified)')
    >>> read_quantity("CYLt (MZCY)").what
    't'
    """
    lower = (text or "").lower()
    reference = next((name for name, words in _REFERENCES if re.search(words, lower)), None)
    return Wanted(_what(lower), reference, text or "")  # type: ignore[arg-type]


def _what(lower: str) -> What | None:
    if re.search(r"two.point|\blp\b", lower):
        return "two point"
    parameter = _PARAMETER.search(lower)
    if parameter:
        return parameter.group(1) or parameter.group(2)  # type: ignore[return-value]
    if "half" in lower and "angle" in lower:
        return "half angle"
    if re.search(r"(apex|cone|full)[a-z ]* angle", lower) and "free angle" not in lower:
        return "angle"
    # Of "the diameter of the smallest enclosing cylinder" the diameter is the straightness itself.
    if re.search(r"^d_|^size_g|diameter", lower) and not re.search(r"strt|zone|enclosing", lower):
        return "diameter"
    if re.search(r"^r_|radius", lower):
        return "radius"
    if re.search(r"rms|root mean square", lower):
        return "q"
    if re.search(r"conicity|sphericity|cylindricity|roundness|flatness|straightness|value", lower):
        return "t"
    return None
