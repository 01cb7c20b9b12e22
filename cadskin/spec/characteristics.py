"""The geometrical characteristics of ISO 1101 and ASME Y14.5, by their AP242 names."""

from __future__ import annotations

from dataclasses import dataclass
from difflib import get_close_matches
from typing import Literal, TypeAlias, get_args

from cadskin.errors import SpecificationError

__all__ = ["CHARACTERISTICS", "Characteristic", "CharacteristicName", "characteristic", "nearest"]

CharacteristicName: TypeAlias = Literal[
    "angularity",
    "circular_runout",
    "coaxiality",
    "concentricity",
    "cylindricity",
    "flatness",
    "line_profile",
    "parallelism",
    "perpendicularity",
    "position",
    "roundness",
    "straightness",
    "surface_profile",
    "symmetry",
    "total_runout",
]
Group: TypeAlias = Literal["form", "orientation", "location", "profile", "runout"]


@dataclass(frozen=True)
class Characteristic:
    """What is known about one characteristic.

    Parameters
    ----------
    name : str
        Name of the AP242 entity, without ``_tolerance``.
    group : str
        ``form``, ``orientation``, ``location``, ``profile`` or ``runout``.
    symbol : str
        The drawing symbol (ISO 1101, clause 8; ASME Y14.5, figure 6-1).
    iso, asme : str
        Its name in the two standards.
    datums : {"never", "optional", "always"}
        Whether a datum system belongs to it.
    aliases : tuple of str
        Further accepted names.
    """

    name: CharacteristicName
    group: Group
    symbol: str
    iso: str
    asme: str
    datums: Literal["never", "optional", "always"]
    aliases: tuple[str, ...] = ()


_ROWS = (
    Characteristic("straightness", "form", "⏤", "straightness", "straightness", "never"),
    Characteristic("flatness", "form", "⏥", "flatness", "flatness", "never", ("planarity",)),
    Characteristic("roundness", "form", "○", "roundness", "circularity", "never", ("circularity",)),
    Characteristic("cylindricity", "form", "⌭", "cylindricity", "cylindricity", "never"),
    Characteristic(
        "line_profile",
        "profile",
        "⌒",
        "profile any line",
        "profile of a line",
        "optional",
        ("profile_any_line", "profile_of_a_line", "profile_of_line", "line_profile_any_line"),
    ),
    Characteristic(
        "surface_profile",
        "profile",
        "⌓",
        "profile any surface",
        "profile of a surface",
        "optional",
        ("profile_any_surface", "profile_of_a_surface", "profile_of_surface", "profile"),
    ),
    Characteristic("parallelism", "orientation", "∥", "parallelism", "parallelism", "always"),
    Characteristic("perpendicularity", "orientation", "⟂", "perpendicularity", "perpendicularity", "always"),
    Characteristic("angularity", "orientation", "∠", "angularity", "angularity", "always"),
    Characteristic("position", "location", "⌖", "position", "position", "optional", ("true_position",)),
    Characteristic("coaxiality", "location", "◎", "coaxiality", "coaxiality", "always"),
    Characteristic("concentricity", "location", "◎", "concentricity", "concentricity", "always"),
    Characteristic("symmetry", "location", "⌯", "symmetry", "symmetry", "always"),
    Characteristic(
        "circular_runout", "runout", "↗", "circular run-out", "circular runout", "always", ("runout",)
    ),
    Characteristic("total_runout", "runout", "⌰", "total run-out", "total runout", "always"),
)

CHARACTERISTICS: dict[str, Characteristic] = {row.name: row for row in _ROWS}
_ALIASES = {alias: row.name for row in _ROWS for alias in (row.name, *row.aliases)}
_SYMBOLS = {row.symbol: row.name for row in reversed(_ROWS)}
assert set(CHARACTERISTICS) == set(get_args(CharacteristicName))


def nearest(word: str, known: object) -> str:
    """Return ``" (did you mean 'x'?)"`` for the known word that is nearest to ``word``, or nothing."""
    found = get_close_matches(word, [str(item) for item in known], n=1, cutoff=0.6)  # type: ignore[attr-defined]
    return f" (did you mean {found[0]!r}?)" if found else ""


def characteristic(name: str) -> Characteristic:
    """Return the characteristic of any of its names, in any spelling (``Profile of a surface``, ``⌓``).

    Raises
    ------
    SpecificationError
        No characteristic has that name.

    Examples
    --------
    >>> characteristic("circularity").name
    'roundness'
    """
    key = name.strip()
    if key in _SYMBOLS:
        return CHARACTERISTICS[_SYMBOLS[key]]
    word = key.lower().replace("-", "" if "run-out" in key.lower() else "_").replace(" ", "_")
    if word.endswith("_tolerance"):
        word = word.removesuffix("_tolerance")
    if word not in _ALIASES:
        raise SpecificationError(
            f"no characteristic is called {name!r}{nearest(word, _ALIASES)}; "
            f"there are {', '.join(sorted(CHARACTERISTICS))}"
        )
    return CHARACTERISTICS[_ALIASES[word]]
