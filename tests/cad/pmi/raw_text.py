"""An independent, slow and simple look at the text of a STEP file, by regular expressions only."""

import re
from collections import Counter
from functools import cache

LEAVES = (
    "ANGULARITY",
    "CIRCULAR_RUNOUT",
    "COAXIALITY",
    "CONCENTRICITY",
    "CYLINDRICITY",
    "FLATNESS",
    "LINE_PROFILE",
    "PARALLELISM",
    "PERPENDICULARITY",
    "POSITION",
    "ROUNDNESS",
    "STRAIGHTNESS",
    "SURFACE_PROFILE",
    "SYMMETRY",
    "TOTAL_RUNOUT",
)
_LEAF = re.compile(r"\b(" + "|".join(LEAVES) + r")_TOLERANCE\s*\(")


@cache
def statements(path):
    """Number and text of every instance, without comments and without odd signs in strings."""
    text = path.read_bytes().decode("latin-1")
    text = re.sub(r"/\*.*?\*/", "", text, flags=re.S)
    text = re.sub(r"'((?:[^']|'')*)'", lambda m: "'" + re.sub(r"[^A-Za-z0-9 ._-]", "_", m[1]) + "'", text)
    found = {}
    for piece in text[text.index("DATA;") :].split(";"):
        match = re.match(r"\s*(?:DATA\s*)?#(\d+)\s*=\s*(.*)", piece, re.S)
        if match:
            found[int(match[1])] = " ".join(match[2].split())
    return found


def leaf_counts(path):
    """How often each characteristic occurs as an entity."""
    return Counter(m[1].lower() for text in statements(path).values() for m in [_LEAF.search(text)] if m)


def tolerance_ids(path):
    return {
        number: match[1].lower()
        for number, text in statements(path).items()
        for match in [_LEAF.search(text)]
        if match
    }


def magnitude(path_statements, number):
    """Raw value and factor to mm of a tolerance: the third attribute of geometric_tolerance."""
    text = path_statements[number]
    body = re.search(r"GEOMETRIC_TOLERANCE\s*\(([^()]*)\)", text) or re.match(r"[A-Z_]+\s*\(([^()]*)", text)
    measure = path_statements[int(re.findall(r"#(\d+)", body[1])[0])]
    value = float(re.search(r"MEASURE\s*\(\s*([-+0-9.Ee]+)\s*\)", measure)[1])
    unit = path_statements[int(re.findall(r"#(\d+)", measure)[0])]
    return value, 25.4 if "INCH" in unit.upper() or " IN'" in unit.upper() or "'IN'" in unit.upper() else 1.0


def datum_letters(path_statements, number):
    """Letters in order of precedence, common datums with a hyphen."""
    text = path_statements[number]
    inner = re.search(r"WITH_DATUM_REFERENCE\s*\(\s*\(([^()]*)\)", text)
    if inner is None:
        simple = re.match(r"[A-Z_]+\s*\([^()]*,\s*\(([^()]*)\)", text)
        if simple is None:
            return []
        inner = simple
    letters = []
    for system in re.findall(r"#(\d+)", inner[1]):
        constituents = re.findall(r"\(([^()]*)\)\s*\)?\s*$", path_statements[int(system)])[-1]
        for compartment in re.findall(r"#(\d+)", constituents):
            letters.append("-".join(_letters_of(path_statements, int(compartment))))
    return letters


def _letters_of(path_statements, compartment):
    text = path_statements[compartment]
    common = re.search(r"COMMON_DATUM_LIST\s*\(\s*\(([^()]*)\)", text)
    if common:
        elements = re.findall(r"#(\d+)", common[1])
        return [letter for element in elements for letter in _letters_of(path_statements, int(element))]
    datum = re.findall(r"#(\d+)", text)[-1]  # the one before is the product definition shape
    return [re.search(r"'([^']*)'\s*\)\s*$", path_statements[int(datum)])[1]]
