"""Selectors: say which faces you mean, by index, STEP entity, name, direction, kind or size.

The direction strings are cadquery's (``">Z"``, ``"|X and >Y"``, ``"%CYLINDER"``, ``">>Z[1]"``), with the same
meaning and the same precedence, evaluated on the face records, so that they need no geometry kernel.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from cadskin.errors import SelectionError
from cadskin.shape.nominal import Face, Feature

if TYPE_CHECKING:
    from cadskin._typing import Vectors
    from cadskin.shape.nominal import NominalModel

__all__ = ["FeatureRef", "select", "select_faces", "select_one"]

FeatureRef: TypeAlias = "int | str | Feature | Face | Iterable[int | str | Feature | Face]"

_TOLERANCE = 1e-4  # cadquery's own, in mm for positions and in rad for directions

_AXES = {
    "X": (1.0, 0.0, 0.0),
    "Y": (0.0, 1.0, 0.0),
    "Z": (0.0, 0.0, 1.0),
    "XY": (1.0, 1.0, 0.0),
    "YZ": (0.0, 1.0, 1.0),
    "XZ": (1.0, 0.0, 1.0),
}
_VIEWS = {"front": ">Z", "back": "<Z", "left": "<X", "right": ">X", "top": ">Y", "bottom": "<Y"}
_KINDS = {
    "plane": "plane",
    "cylinder": "cylinder",
    "cone": "cone",
    "sphere": "sphere",
    "torus": "torus",
    "bspline": "bspline",
    "bezier": "bspline",
    "revolution": "revolution",
    "extrusion": "extrusion",
    "offset": "offset",
    "other": "other",
}
_NUMBER = r"[+-]?\d+(?:\.\d*)?"
_DIRECTION = rf"(?:XY|XZ|YZ|X|Y|Z|\(\s*{_NUMBER}\s*,\s*{_NUMBER}\s*,\s*{_NUMBER}\s*\))"
_ATOM = re.compile(
    rf"\s*(?:(?P<type>%\s*[A-Za-z]+)"
    rf"|(?P<op>>>|<<|>|<|\||#|\+|-)\s*(?P<dir>{_DIRECTION})\s*(?:\[\s*(?P<index>-?\d+)\s*\])?"
    rf"|(?P<only>{_DIRECTION})"
    rf"|(?P<view>front|back|left|right|top|bottom)\b"
    rf"|(?P<word>and|or|exc(?:ept)?|not)\b"
    rf"|(?P<paren>[()]))"
)


def select(model: NominalModel, ref: FeatureRef | None = None, /, **filters: Any) -> tuple[Feature, ...]:
    """Return the features that own at least one selected face, in their order.

    Parameters
    ----------
    model : NominalModel
    ref : int, str, Feature, Face or an iterable of these
        An int is a face index; ``"#123"`` a STEP entity number; another string is the exact name of a
        face or feature, or else a cadquery face selector. None selects all faces.
    **filters
        ``kind="cylinder"``, ``name="bore"``, ``colour="#ff0000"``, ``internal=True``, ``area=`` and
        ``radius=`` as a value (1e-6 relative) or as a range ``(low, high)`` in mm² and mm.

    Returns
    -------
    tuple of Feature
        Never empty.

    Raises
    ------
    SelectionError
        Nothing matches, or the selector is not understood.
    """
    chosen = set(select_faces(model.faces, ref, features=model.features, **filters))
    return tuple(f for f in model.features if chosen.intersection(f.face_indices))


def select_one(model: NominalModel, ref: FeatureRef | None = None, /, **filters: Any) -> Feature:
    """Return the single feature selected; see `select`.

    Raises
    ------
    SelectionError
        Nothing matches, or more than one feature does.
    """
    found = select(model, ref, **filters)
    if len(found) > 1:
        names = ", ".join(f"{f.name} ({f.kind}, {f.area:.4g} mm²)" for f in found[:6])
        more = "" if len(found) <= 6 else f" and {len(found) - 6} more"
        raise SelectionError(
            f"{_say(ref, filters)} selects {len(found)} features, one was asked for: {names}{more}; "
            "narrow it down or use select()"
        )
    return found[0]


def select_faces(
    faces: Sequence[Face],
    ref: FeatureRef | None = None,
    /,
    *,
    features: Sequence[Feature] = (),
    **filters: Any,
) -> tuple[int, ...]:
    """Return the indices of the selected faces; see `select` for the meaning of the arguments.

    Raises
    ------
    SelectionError
        Nothing matches, or the selector is not understood.
    """
    chosen = _by_ref(faces, ref, features) if ref is not None else list(range(len(faces)))
    for key, want in filters.items():
        try:
            keep = _FILTERS[key]
        except KeyError:
            raise SelectionError(f"unknown filter {key!r}; known are {', '.join(_FILTERS)}") from None
        if want is not None:
            chosen = [i for i in chosen if keep(faces[i], want, features)]
    if not chosen:
        raise SelectionError(
            f"{_say(ref, filters)} matches none of the {len(faces)} faces{_hint(faces, ref)}"
        )
    return tuple(chosen)


def _say(ref: Any, filters: dict[str, Any]) -> str:
    parts = ([] if ref is None else [repr(ref)]) + [f"{k}={v!r}" for k, v in filters.items()]
    return "the selector " + ", ".join(parts)


def _hint(faces: Sequence[Face], ref: Any) -> str:
    names = sorted({face.name for face in faces if face.name})
    if isinstance(ref, str) and names:
        close = difflib.get_close_matches(ref, names, n=3) or names[:5]
        return "; names in this part: " + ", ".join(close)
    return "; `cadskin faces` lists them"


def _by_ref(faces: Sequence[Face], ref: Any, features: Sequence[Feature]) -> list[int]:
    if isinstance(ref, Feature):
        return [i for i in ref.face_indices if _known(i, faces)]
    if isinstance(ref, Face):
        return [ref.index] if _known(ref.index, faces) else []
    if isinstance(ref, (int, np.integer)) and not isinstance(ref, bool):
        return [int(ref)] if _known(int(ref), faces) else []
    if isinstance(ref, str):
        return _by_string(faces, ref, features)
    if isinstance(ref, Iterable):
        return sorted({i for one in ref for i in select_faces(faces, one, features=features)})
    raise SelectionError(f"a selector is a face index, a string, a Feature or a list of these, not {ref!r}")


def _known(index: int, faces: Sequence[Face]) -> bool:
    if not 0 <= index < len(faces):
        raise SelectionError(f"there is no face {index}; the part has faces 0 to {len(faces) - 1}")
    return True


def _by_string(faces: Sequence[Face], text: str, features: Sequence[Feature]) -> list[int]:
    if re.fullmatch(r"\s*#\s*\d+\s*", text):
        wanted = int(text.strip()[1:])
        return [face.index for face in faces if face.step_id == wanted]
    named = [face.index for face in faces if face.name == text]
    named += [i for feature in features if feature.name == text for i in feature.face_indices]
    if named:
        return sorted(set(named))
    tokens = _tokens(text)
    if tokens is None:
        if any(c in text for c in "<>|#%") or text.strip() == "":
            raise SelectionError(
                f"the selector {text!r} is not understood; examples: '>Z', '|X and >Y', '%CYLINDER'"
            )
        return []
    return sorted(_Parser(tokens, faces, text).parse())


# --- cadquery's string syntax -----------------------------------------------------------------------------


def _tokens(text: str) -> list[re.Match[str]] | None:
    found, position = [], 0
    text = text.rstrip()
    while position < len(text):
        match = _ATOM.match(text, position)
        if match is None or match.end() == position:
            return None
        found.append(match)
        position = match.end()
    return found or None


class _Parser:
    """Recursive descent with cadquery's precedence: ``and``, then ``or``, ``exc``, and ``not`` loosest."""

    def __init__(self, tokens: list[re.Match[str]], faces: Sequence[Face], text: str) -> None:
        self.tokens = tokens
        self.faces = faces
        self.text = text
        self.position = 0

    def parse(self) -> set[int]:
        chosen = self._not()
        if self.position != len(self.tokens):
            raise self._error()
        return chosen

    def _error(self) -> SelectionError:
        return SelectionError(f"the selector {self.text!r} is not understood after token {self.position}")

    def _word(self, *words: str) -> bool:
        if self.position < len(self.tokens) and self.tokens[self.position]["word"] in words:
            self.position += 1
            return True
        return False

    def _not(self) -> set[int]:
        if self._word("not"):
            return set(range(len(self.faces))) - self._not()
        return self._exc()

    def _exc(self) -> set[int]:
        chosen = self._or()
        while self._word("exc", "except"):
            chosen = chosen - self._or()
        return chosen

    def _or(self) -> set[int]:
        chosen = self._and()
        while self._word("or"):
            chosen = chosen | self._and()
        return chosen

    def _and(self) -> set[int]:
        chosen = self._atom()
        while self._word("and"):
            chosen = chosen & self._atom()
        return chosen

    def _atom(self) -> set[int]:
        if self.position >= len(self.tokens):
            raise self._error()
        token = self.tokens[self.position]
        self.position += 1
        if token["paren"] == "(":
            chosen = self._not()
            if self.position >= len(self.tokens) or self.tokens[self.position]["paren"] != ")":
                raise self._error()
            self.position += 1
            return chosen
        if token["paren"] or token["word"]:
            raise self._error()
        return set(_simple(self.faces, token))


def _simple(faces: Sequence[Face], token: re.Match[str]) -> list[int]:
    if token["view"]:
        inner = _ATOM.match(_VIEWS[token["view"]])
        assert inner is not None  # the table above holds valid selectors only
        return _simple(faces, inner)
    if token["type"]:
        name = token["type"][1:].strip().lower()
        if name not in _KINDS:
            raise SelectionError(
                f"unknown surface type %{name.upper()}; known are {', '.join(sorted(_KINDS))}"
            )
        return [face.index for face in faces if face.kind == _KINDS[name]]
    direction = _vector(token["dir"] or token["only"])
    operator = token["op"]
    if operator in (">", "<", ">>", "<<"):
        pool = list(range(len(faces)))
        nth = -1 if token["index"] is None else int(token["index"])
        if operator in (">", "<") and token["index"] is not None:
            pool = _planar(faces, lambda n: float(np.linalg.norm(np.cross(direction, n))) < _TOLERANCE)
        return _nth(faces, pool, direction, nth, upward=operator[0] == ">")
    if operator == "|":
        return _planar(faces, lambda n: float(np.linalg.norm(np.cross(direction, n))) < _TOLERANCE)
    if operator == "#":
        return _planar(faces, lambda n: abs(_angle(direction, n) - np.pi / 2) < _TOLERANCE)
    signed = -direction if operator == "-" else direction
    return _planar(faces, lambda n: _angle(signed, n) < _TOLERANCE)


def _vector(text: str) -> Vectors:
    if text in _AXES:
        return np.array(_AXES[text])
    vector = np.array([float(x) for x in text.strip("() ").split(",")])
    if not np.linalg.norm(vector) > 0:
        raise SelectionError(f"the direction {text} has no length")
    return vector


def _angle(a: Vectors, b: Vectors) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), np.dot(a, b)))


def _planar(faces: Sequence[Face], test: Callable[[Vectors], bool]) -> list[int]:
    return [face.index for face in faces if face.kind == "plane" and test(face.normal)]


def _nth(faces: Sequence[Face], pool: list[int], direction: Vectors, nth: int, *, upward: bool) -> list[int]:
    """Faces of the nth cluster of centres along a direction (clusters of 1e-4 mm, as in cadquery)."""
    if not pool:
        return []
    keys = sorted((float(np.dot(faces[i].centre, direction)), i) for i in pool)
    clusters: list[list[int]] = [[]]
    start = keys[0][0]
    for key, index in keys:
        if abs(key - start) > _TOLERANCE:
            clusters.append([])
            start = key
        clusters[-1].append(index)
    if not upward:
        clusters.reverse()
    if not -len(clusters) <= nth < len(clusters):
        raise SelectionError(
            f"index [{nth}] is out of range: there are {len(clusters)} levels along that direction"
        )
    return clusters[nth]


# --- filters ----------------------------------------------------------------------------------------------


def _in_range(value: float | None, want: Any) -> bool:
    if value is None:
        return False
    if np.isscalar(want):
        return bool(np.isclose(value, float(want), rtol=1e-6, atol=1e-9))  # type: ignore[arg-type]
    low, high = want
    return (low is None or value >= low) and (high is None or value <= high)


def _has_name(face: Face, want: str, features: Sequence[Feature]) -> bool:
    return face.name == want or any(f.name == want and face.index in f.face_indices for f in features)


_FILTERS: dict[str, Callable[[Face, Any, Sequence[Feature]], bool]] = {
    "kind": lambda face, want, _: face.kind == str(want).lower(),
    "name": _has_name,
    "colour": lambda face, want, _: face.colour is not None and face.colour.lower() == str(want).lower(),
    "internal": lambda face, want, _: face.internal == bool(want),
    "area": lambda face, want, _: _in_range(face.area, want),
    "radius": lambda face, want, _: _in_range(face.radius, want),
}
