"""The forms and sizes of which reference point sets are made: surface, motions, sides in contact, names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from cadskin.shape.association import _kernels as kernels

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = [
    "CHARACTERISTICS",
    "CONE_ANGLE",
    "CRITERION",
    "LENGTH",
    "MAJOR",
    "RADIUS",
    "FormKind",
    "ideal_surface",
]

RADIUS, LENGTH, CONE_ANGLE, MAJOR = 10.0, 40.0, float(np.radians(15.0)), 25.0
CRITERION = {(1, -1): "minimum zone", (1,): "minimum circumscribed", (-1,): "maximum inscribed"}


@dataclass(frozen=True)
class FormKind:
    """Which surface, which motions, which sides are in contact, and how the answer is named."""

    name: str
    kernel: int
    free: tuple[int, ...]
    sides: tuple[int, ...]
    quantity: str
    characteristic: str
    feature_type: str

    @property
    def criterion(self) -> str:
        """The association that gives the value."""
        return "minimum zone" if self.name == "line" else CRITERION[self.sides]

    @property
    def is_zone(self) -> bool:
        """Whether the value is the width or diameter of a zone; else it is a size."""
        return self.criterion == "minimum zone"

    def shape(self, radius: float) -> Floats:
        """Return the two shape numbers of the surface."""
        second = {kernels.CONE: CONE_ANGLE, kernels.TORUS: MAJOR}.get(self.kernel, 0.0)
        return np.array([0.0 if self.kernel == kernels.PLANE else radius, second])


def _zone(name: str, kernel: int, free: tuple[int, ...], quantity: str, word: str, what: str) -> FormKind:
    return FormKind(name, kernel, free, (1, -1), quantity, word, what)


def _size(name: str, kernel: int, free: tuple[int, ...], side: int) -> FormKind:
    words = "minimum circumscribed" if side > 0 else "maximum inscribed"
    return FormKind(name, kernel, free, (side,), f"diameter of the {words} {name}", "size", name)


_CIRCLE, _AXIS, _CENTRE = (0, 1), (0, 1, 3, 4), (0, 1, 2)
_PLANE, _ROUND, _BALL = kernels.PLANE, kernels.CYLINDER, kernels.SPHERE
CHARACTERISTICS: dict[str, FormKind] = {
    "flatness": _zone("plane", _PLANE, (3, 4), "FLTt (MZPL)", "flatness", "plane"),
    "straightness": _zone(
        "profile line", _PLANE, (3,), "STRt (MZLI)", "straightness", "line in a section plane"
    ),
    "straightness of a median line": FormKind(
        "line",
        _ROUND,
        _AXIS,
        (1,),
        "STRt (diameter of the smallest enclosing cylinder)",
        "straightness",
        "median line (axis)",
    ),
    "roundness": _zone("circle", _ROUND, _CIRCLE, "RONt (MZCI)", "roundness", "circle (section)"),
    "cylindricity": _zone("cylinder", _ROUND, _AXIS, "CYLt (MZCY)", "cylindricity", "cylinder"),
    "sphericity": _zone("sphere", _BALL, _CENTRE, "sphericity (MZSP)", "sphericity", "sphere"),
    "conicity": _zone("cone", kernels.CONE, (*_AXIS, 7), "conicity (minimum zone cone)", "conicity", "cone"),
    "toricity": _zone(
        "torus", kernels.TORUS, (0, 1, 2, 3, 4, 7), "toricity (minimum zone torus)", "toricity", "torus"
    ),
    "circumscribed circle": _size("circle", _ROUND, _CIRCLE, 1),
    "inscribed circle": _size("circle", _ROUND, _CIRCLE, -1),
    "circumscribed cylinder": _size("cylinder", _ROUND, _AXIS, 1),
    "inscribed cylinder": _size("cylinder", _ROUND, _AXIS, -1),
    "circumscribed sphere": _size("sphere", _BALL, _CENTRE, 1),
    "inscribed sphere": _size("sphere", _BALL, _CENTRE, -1),
}


def ideal_surface(kind: FormKind, radius: float, arc: float, u: Floats, v: Floats) -> tuple[Points, Vectors]:
    """Return points of the nominal surface at parameters of the unit square, and its normals there."""
    zero, up = np.zeros(len(u)), np.array([0.0, 0.0, 1.0])
    if kind.name == "plane":
        flat = np.column_stack([100 * (u - 0.5), 60 * (v - 0.5), zero])
        return flat, np.broadcast_to(up, (len(u), 3))
    if kind.name == "profile line":
        return np.column_stack([zero, 100 * (u - 0.5), zero]), np.broadcast_to(up, (len(u), 3))
    angle = arc * u
    around = np.column_stack([np.cos(angle), np.sin(angle), zero])
    if kind.name == "circle":
        return radius * around, around
    if kind.name == "torus":
        turn = 2.0 * np.pi * v
        normals = np.cos(turn)[:, None] * around + np.sin(turn)[:, None] * up
        return MAJOR * around + radius * normals, normals
    height = LENGTH * (v - 0.5)
    if kind.name in ("cylinder", "line"):
        return radius * around + height[:, None] * up, around
    if kind.name == "cone":
        ring = radius + height * np.tan(CONE_ANGLE)
        normals = np.cos(CONE_ANGLE) * around - np.sin(CONE_ANGLE) * up
        return ring[:, None] * around + height[:, None] * up, normals
    sine = 2 * v - 1
    normals = np.sqrt(1 - sine**2)[:, None] * around + sine[:, None] * up
    return radius * normals, normals
