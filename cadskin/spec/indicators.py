"""Indicators beside a frame (ISO 1101): intersection, orientation and collection plane, direction feature."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import degrees, isfinite, radians
from typing import Literal, TypeAlias, get_args

import numpy as np

from cadskin._typing import Vectors
from cadskin.errors import SpecificationError
from cadskin.spec.datums import DatumSystem, as_datum_system

__all__ = ["Indicator", "IndicatorKind", "IndicatorRelation", "as_indicator", "section_normal"]

IndicatorKind: TypeAlias = Literal[
    "intersection_plane", "orientation_plane", "direction_feature", "collection_plane"
]
IndicatorRelation: TypeAlias = Literal["parallel", "perpendicular", "inclined", "symmetrical", "run_out"]

INDICATOR_KINDS: tuple[IndicatorKind, ...] = get_args(IndicatorKind)
_SIGNS = {"parallel": "∥", "perpendicular": "⟂", "inclined": "∠", "symmetrical": "⌯", "run_out": "↗"}
_WORDS = {sign: word for word, sign in _SIGNS.items()} | {"//": "parallel", "⊥": "perpendicular"}
_ONLY = {"symmetrical": "intersection_plane", "run_out": "direction_feature"}
_FRAMES = {
    "intersection_plane": "◁{}",
    "orientation_plane": "◁{}▷",
    "direction_feature": "←{}",
    "collection_plane": "○{}",
}
_SHORTEST = 1e-9


@dataclass(frozen=True)
class Indicator:
    """One indicator of a tolerance.

    Parameters
    ----------
    kind : {"intersection_plane", "orientation_plane", "direction_feature", "collection_plane"}
        The plane whose sections are toleranced; the plane that orients the zone of a derived feature; the
        direction of the width of the zone; the plane that collects an "all around".
    relation : {"parallel", "perpendicular", "inclined", "symmetrical", "run_out"}
        To the datum or to `direction`; symmetrical only for an intersection plane, run_out only for a
        direction feature.
    datums : DatumSystem
        The datum that it refers to; empty where `direction` says it instead.
    angle : float or None
        Of an inclined one [rad].
    direction : (3,) tuple of float or None
        Normal of the plane (or the direction), in the frame of the part, where a file gives geometry and no
        datum.

    Raises
    ------
    SpecificationError
        A word or number has no meaning, or it has neither datum nor direction.

    References
    ----------
    ISO 1101:2017, plane and direction feature indicators.

    Examples
    --------
    >>> str(as_indicator("intersection_plane", "parallel A"))
    '◁∥ A'
    """

    kind: IndicatorKind
    relation: IndicatorRelation = "parallel"
    datums: DatumSystem = field(default_factory=DatumSystem)
    angle: float | None = None
    direction: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        """Check words and numbers."""
        for key, known in (("kind", INDICATOR_KINDS), ("relation", get_args(IndicatorRelation))):
            if getattr(self, key) not in known:
                raise SpecificationError(f"{key} {getattr(self, key)!r} is none of {', '.join(known)}")
        label = self.kind.replace("_", " ")
        if _ONLY.get(self.relation, self.kind) != self.kind:
            raise SpecificationError(f"{label}: {self.relation} is only for {_ONLY[self.relation]}")
        if (self.angle is None) == (self.relation == "inclined"):
            raise SpecificationError(f"{label}: give an angle for an inclined one, and only there")
        if self.angle is not None and not isfinite(self.angle):
            raise SpecificationError(f"{label}: its angle must be finite, got {self.angle}")
        if bool(self.datums) == (self.direction is not None):
            raise SpecificationError(f"{label}: give a datum (like 'parallel A') or a direction")
        if self.direction is not None and not 0 < sum(x * x for x in self.direction) < float("inf"):
            raise SpecificationError(f"{label}: its direction must be finite and not zero")

    def text(self) -> str | None:
        """Return the short form of a spec file, ``parallel A``; None where a table is needed."""
        return f"{self.relation} {self.datums.text()}" if self.datums and self.angle is None else None

    def __str__(self) -> str:
        """Return it as beside the frame, ``◁∥ A``."""
        angle = "" if self.angle is None else f"{degrees(self.angle):.7g}°"
        if self.direction is not None:
            to = "(" + " ".join(f"{x:.4g}" for x in self.direction) + ")"
        else:
            to = " | ".join(reference.symbols() for reference in self.datums.references)
        return _FRAMES[self.kind].format(f"{_SIGNS[self.relation]}{angle} {to}")


def as_indicator(kind: IndicatorKind, text: str) -> Indicator:
    """Return the indicator of a short form: ``"parallel A"``, ``"∥ A"``, ``"inclined 30 A"`` (degrees).

    Raises
    ------
    SpecificationError
        It is no such text.
    """
    words = text.split()
    angle = None
    if len(words) == 3:
        try:
            angle = radians(float(words.pop(1).rstrip("°")))
        except ValueError:
            words = []
    if len(words) != 2:
        raise SpecificationError(
            f"{kind} must be like 'parallel A', 'perpendicular B' or 'inclined 30 A', not {text!r}"
        )
    word = _WORDS.get(words[0], words[0])
    return Indicator(kind, word, as_datum_system(words[1]), angle)  # type: ignore[arg-type]


def section_normal(
    indicator: Indicator,
    surface_normal: Vectors,
    datum_direction: Vectors | None = None,
    *,
    is_axis: bool = False,
) -> Vectors:
    """Return the normal of the sections of a surface that an intersection plane asks for.

    Parameters
    ----------
    indicator : Indicator
    surface_normal : (3,) array
        Of the toleranced surface; the sections hold it.
    datum_direction : (3,) array, optional
        Normal of the datum plane, or direction of the datum axis; not needed where the indicator has a
        direction.
    is_axis : bool
        The datum is an axis.

    Returns
    -------
    (3,) array
        Unit vector.

    Raises
    ------
    SpecificationError
        The relation leaves the sections open: an inclined plane, or a surface parallel to it.

    Examples
    --------
    >>> import numpy as np
    >>> plane = as_indicator("intersection_plane", "perpendicular A")
    >>> section_normal(plane, np.array([0.0, 0, 1]), np.array([0.0, 1, 0])).tolist()
    [-1.0, 0.0, 0.0]
    """
    given = datum_direction if indicator.direction is None else indicator.direction
    if indicator.kind != "intersection_plane" or indicator.relation not in ("parallel", "perpendicular"):
        raise SpecificationError(f"{indicator} does not say in which planes a surface is cut")
    if given is None:
        raise SpecificationError(f"{indicator}: the direction of datum {indicator.datums.text()} is needed")
    direction = np.asarray(given, dtype=np.float64)
    along = is_axis == (indicator.relation == "perpendicular")
    normal = direction if along else np.cross(surface_normal, direction)
    length = float(np.linalg.norm(normal))
    across = float(np.linalg.norm(np.cross(surface_normal, normal)))
    if length < _SHORTEST or across < _SHORTEST * length:
        raise SpecificationError(f"{indicator} is parallel to the surface itself, so it cuts no line from it")
    return np.asarray(normal / length)
