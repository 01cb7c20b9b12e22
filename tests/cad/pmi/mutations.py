"""Mutations of STEP text: broken bytes, wrong references, missing pieces, hostile insertions."""

import re

_REFERENCE = re.compile(rb"#\d+")
_KEYWORD = re.compile(rb"[A-Z_]{5,}")
_NUMBER = re.compile(rb"[-+]?\d+\.\d*(?:E[-+]?\d+)?")
_BAD = [
    b"", b"'", b"''", b"(", b")", b";", b"$", b"*", b"#", b"#0", b"/*", b"*/", b"(" * 200, b")" * 50, b"\x00",
    b"\xff\xfe", b"1.E999", b"-1.E999", b"NAN", b"1.E-320", b"-0.", b"#99999999999999999999", b".T.",
    b"'\\X2\\D800\\X0\\'", b"'\\X2\\00'", b"\\S\\", b"'" + b"A" * 5000 + b"'", b"COMMON_DATUM_LIST((#1,#2))",
    b"LENGTH_MEASURE(1.)", b"!USER(1)", b"ENDSEC;", b"DATA;", b"#1=#1;", b"()", b"((((", b"=", b"=;",
]  # fmt: skip


def _pick(rng, found):
    return found[int(rng.integers(len(found)))]


def _span(rng, text, longest):
    start = int(rng.integers(len(text)))
    return start, min(len(text), start + int(rng.integers(1, longest)))


def swap_references(rng, text):
    """Let some references point elsewhere: to other kinds, to themselves, to nothing."""
    found = list(_REFERENCE.finditer(text))
    if not found:
        return text
    match, other = _pick(rng, found), _pick(rng, found)
    return text[: match.start()] + other[0] + text[match.end() :]


def swap_keywords(rng, text):
    found = list(_KEYWORD.finditer(text))
    if not found:
        return text
    match, other = _pick(rng, found), _pick(rng, found)
    return text[: match.start()] + other[0] + text[match.end() :]


def change_numbers(rng, text):
    found = list(_NUMBER.finditer(text))
    if not found:
        return text
    match = _pick(rng, found)
    value = [b"0.", b"-1.", b"1.E308", b"-1.E308", b"1.E999", b"1.E-320", b"17"][int(rng.integers(7))]
    return text[: match.start()] + value + text[match.end() :]


def cut_out(rng, text):
    start, stop = _span(rng, text, 400)
    return text[:start] + text[stop:]


def cut_off(rng, text):
    return text[: int(rng.integers(len(text)))]


def repeat(rng, text):
    start, stop = _span(rng, text, 400)
    return text[:stop] + text[start:stop] + text[stop:]


def move(rng, text):
    start, stop = _span(rng, text, 400)
    place = int(rng.integers(len(text)))
    return text[:place] + text[start:stop] + text[place:]


def insert_bad(rng, text):
    place = int(rng.integers(len(text)))
    return text[:place] + _BAD[int(rng.integers(len(_BAD)))] + text[place:]


def flip_bytes(rng, text):
    changed = bytearray(text)
    for _ in range(int(rng.integers(1, 6))):
        changed[int(rng.integers(len(changed)))] = int(rng.integers(256))
    return bytes(changed)


MUTATIONS = [
    swap_references, swap_references, swap_references, swap_keywords, swap_keywords, change_numbers,
    cut_out, cut_off, repeat, move, insert_bad, insert_bad, flip_bytes,
]  # fmt: skip


def mutated(rng, text, focus):
    """Return the text with one to four mutations; most of them within ``focus`` (the PMI)."""
    for _ in range(int(rng.integers(1, 5))):
        mutate = MUTATIONS[int(rng.integers(len(MUTATIONS)))]
        if len(text) < 200:
            return text
        start, stop = focus if rng.random() < 0.8 else (0, len(text))
        start, stop = min(start, len(text) - 1), min(stop, len(text))
        piece = text[start:stop]
        if len(piece) > 200:
            text = text[:start] + mutate(rng, piece) + text[stop:]
    return text


def shortened(text):
    """Return the text without most of its geometry and presentation, and where the PMI lies in it.

    References that lose their target dangle, which is one more thing to survive.
    """
    begin, end = text.index(b"DATA;") + 5, text.rindex(b"ENDSEC;")
    statements = text[begin:end].split(b";")
    heavy = re.compile(
        rb"=\s*(CARTESIAN_POINT|DIRECTION|VERTEX_POINT|POLYLINE|TESSELLATED|COORDINATES_LIST|COMPLEX_TRI)"
    )
    pmi = re.compile(rb"TOLERANCE|DATUM|ASPECT|DIMENSION|MEASURE|ITEM_SPECIFIC|IDENTIFIED|LIMITS|ZONE|_UNIT")
    light = [piece for piece in statements if not heavy.search(piece[:60])]
    chosen = [piece for piece in light if pmi.search(piece)]
    rest = [piece for piece in light if not pmi.search(piece)]
    body = b";".join(chosen)
    return text[:begin] + body + b";" + b";".join(rest) + text[end:], (begin, begin + len(body))
