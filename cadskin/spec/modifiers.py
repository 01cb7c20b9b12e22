"""Modifiers of tolerances and datum references: AP242 names, drawing symbols, accepted short forms."""

from __future__ import annotations

from cadskin.errors import SpecificationError
from cadskin.spec.characteristics import nearest

__all__ = [
    "DATUM_MODIFIERS",
    "MATERIAL_MODIFIERS",
    "TOLERANCE_MODIFIERS",
    "datum_modifier",
    "modifier_symbol",
    "tolerance_modifier",
]

# AP242 geometric_tolerance_modifier -> (symbol on the drawing, short forms a person may write).
TOLERANCE_MODIFIERS: dict[str, tuple[str, tuple[str, ...]]] = {
    "ANY_CROSS_SECTION": ("ACS", ("ACS",)),
    "ASSOCIATED_LEAST_SQUARE_FEATURE": ("Ⓖ", ("G",)),
    "ASSOCIATED_MAXIMUM_INSCRIBED_FEATURE": ("Ⓧ", ("X",)),
    "ASSOCIATED_MINIMUM_INSCRIBED_FEATURE": ("Ⓝ", ("N",)),
    "ASSOCIATED_MINMAX_FEATURE": ("Ⓒ", ("C",)),
    "ASSOCIATED_TANGENT_FEATURE": ("Ⓣ", ()),
    "CIRCLE_A": ("Ⓐ", ("A",)),
    "COMMON_ZONE": ("CZ", ("CZ", "COMBINED_ZONE")),
    "DYNAMIC_PROFILE": ("△", ()),
    "EACH_ELEMENT": ("EACH ELEMENT", ()),
    "EACH_RADIAL_ELEMENT": ("EACH RADIAL ELEMENT", ()),
    "FREE_STATE": ("Ⓕ", ("F",)),
    "LEAST_MATERIAL_REQUIREMENT": ("Ⓛ", ("L", "LMR", "LMC", "LEAST_MATERIAL_CONDITION", "LMB")),
    "LINE_ELEMENT": ("LE", ("LE",)),
    "MAJOR_DIAMETER": ("MD", ("MD",)),
    "MAXIMUM_MATERIAL_REQUIREMENT": ("Ⓜ", ("M", "MMR", "MMC", "MAXIMUM_MATERIAL_CONDITION", "MMB")),
    "MINOR_DIAMETER": ("LD", ("LD",)),
    "NOT_CONVEX": ("NC", ("NC",)),
    "PEAK_HEIGHT": ("Ⓟpeak", ()),
    "PITCH_DIAMETER": ("PD", ("PD",)),
    "RECIPROCITY_REQUIREMENT": ("Ⓡ", ("R", "RPR")),
    "REFERENCE_HEIGHT_DEVIATION": ("T", ()),
    "SEPARATE_REQUIREMENT": ("SEP REQT", ("SEP_REQT",)),
    "SEPARATE_ZONE": ("SZ", ("SZ",)),
    "STANDARD_DEVIATION": ("Q", ("Q",)),
    "STATISTICAL_TOLERANCE": ("ⓈⓉ", ("ST", "STATISTICAL")),
    "TANGENT_PLANE": ("Ⓣ", ("T",)),
    "TOTAL_RANGE_DEVIATION": ("T", ()),
    "UNITED_FEATURE": ("UF", ("UF",)),
    "VALLEY_DEPTH": ("V", ("V",)),
}

# AP242 simple_datum_reference_modifier and datum_reference_modifier_with_value.
DATUM_MODIFIERS: dict[str, tuple[str, tuple[str, ...]]] = {
    "ANY_CROSS_SECTION": ("ACS", ("ACS",)),
    "ANY_LONGITUDINAL_SECTION": ("ALS", ("ALS",)),
    "BASIC": ("BSC", ("BSC",)),
    "CIRCULAR_OR_CYLINDRICAL": ("⌀", ("CIRCULAR", "CYLINDRICAL")),
    "CONTACTING_FEATURE": ("CF", ("CF",)),
    "DEGREE_OF_FREEDOM_CONSTRAINT_U": ("u", ()),
    "DEGREE_OF_FREEDOM_CONSTRAINT_V": ("v", ()),
    "DEGREE_OF_FREEDOM_CONSTRAINT_W": ("w", ()),
    "DEGREE_OF_FREEDOM_CONSTRAINT_X": ("x", ()),
    "DEGREE_OF_FREEDOM_CONSTRAINT_Y": ("y", ()),
    "DEGREE_OF_FREEDOM_CONSTRAINT_Z": ("z", ()),
    "DISTANCE_VARIABLE": ("DV", ("DV",)),
    "DISTANCE": ("BSC", ()),
    "FREE_STATE": ("Ⓕ", ("F",)),
    "LEAST_MATERIAL_REQUIREMENT": ("Ⓛ", ("L", "LMR", "LMC", "LMB", "LEAST_MATERIAL_CONDITION")),
    "LINE": ("SL", ("SL",)),
    "MAJOR_DIAMETER": ("MD", ("MD",)),
    "MAXIMUM_MATERIAL_REQUIREMENT": ("Ⓜ", ("M", "MMR", "MMC", "MMB", "MAXIMUM_MATERIAL_CONDITION")),
    "MINOR_DIAMETER": ("LD", ("LD",)),
    "ORIENTATION": ("><", ("ORIENTATION_ONLY",)),
    "PITCH_DIAMETER": ("PD", ("PD",)),
    "PLANE": ("PL", ("PL",)),
    "POINT": ("PT", ("PT",)),
    "PROJECTED": ("Ⓟ", ("P",)),
    "SPHERICAL": ("S", ()),
    "TRANSLATION": ("▷", ("TRANSLATION_MODIFIER",)),
    "UNITED_FEATURE": ("UF", ("UF",)),
}

MATERIAL_MODIFIERS = {
    "MAXIMUM_MATERIAL_REQUIREMENT": "MMR",
    "MAXIMUM_MATERIAL_CONDITION": "MMR",
    "LEAST_MATERIAL_REQUIREMENT": "LMR",
    "LEAST_MATERIAL_CONDITION": "LMR",
}


def _by_any_name(table: dict[str, tuple[str, tuple[str, ...]]]) -> dict[str, str]:
    known = {short: name for name, (_, shorts) in table.items() for short in shorts}
    return {**{symbol: name for name, (symbol, _) in table.items() if len(symbol) == 1}, **known} | {
        name: name for name in table
    }


_TOLERANCE_NAMES = _by_any_name(TOLERANCE_MODIFIERS)
_DATUM_NAMES = _by_any_name(DATUM_MODIFIERS)


def _look_up(text: str, names: dict[str, str], what: str) -> str:
    word = text.strip()
    if word.startswith("AP242:"):  # a name of a file that no list here has
        return word.removeprefix("AP242:")
    key = word if word in names else word.upper().replace(" ", "_").replace("-", "_")
    if key not in names:
        raise SpecificationError(f"no modifier of a {what} is called {text!r}{nearest(key, names)}")
    return names[key]


def tolerance_modifier(text: str) -> str:
    """Return the AP242 name of a tolerance modifier.

    Raises
    ------
    SpecificationError
        It is none.

    Examples
    --------
    >>> tolerance_modifier("free state"), tolerance_modifier("CZ")
    ('FREE_STATE', 'COMMON_ZONE')
    """
    return _look_up(text, _TOLERANCE_NAMES, "tolerance")


def datum_modifier(text: str) -> str:
    """Return the AP242 name of a modifier of a datum reference; see `tolerance_modifier`."""
    return _look_up(text, _DATUM_NAMES, "datum reference")


def modifier_symbol(name: str) -> str:
    """Return the drawing symbol of an AP242 modifier, or the name itself where it is not known."""
    entry = TOLERANCE_MODIFIERS.get(name) or DATUM_MODIFIERS.get(name)
    return entry[0] if entry else name
