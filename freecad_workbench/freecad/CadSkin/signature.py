"""What a face looked like when it was picked, to notice when the link has come to another face.

FreeCAD before 1.0 keeps ``Face8`` when the model upstream changes and Face8 becomes another face; later
versions follow most changes and write ``?Face8`` where they lose one.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import FreeCAD

__all__ = [
    "FaceSignature",
    "describe_change",
    "face_number",
    "find_face",
    "local_shape",
    "pack",
    "same_face",
    "shape_signatures",
    "signature",
    "unpack",
]

_SAME = 1e-5  # of the part's size


@dataclass(frozen=True)
class FaceSignature:
    """Geometry of one face, in the frame of its part.

    Parameters
    ----------
    kind : str
        ``Plane``, ``Cylinder``, ``Cone``, ``Sphere``, ``Toroid``, ``BSplineSurface``, ...
    area : float
        [mm²].
    centre : tuple of float
        Centre of area [mm].
    axis : tuple of float
        Normal or axis; zero where there is none. Its sign is free.
    radius : float
        [mm]; zero where there is none.
    """

    kind: str
    area: float
    centre: tuple[float, float, float]
    axis: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 0.0


def signature(face: Any) -> FaceSignature:
    """Return the signature of a `Part.Face`."""
    surface = face.Surface
    axis = getattr(surface, "Axis", None)
    radius = getattr(surface, "Radius", None) or getattr(surface, "MinorRadius", None) or 0.0
    return FaceSignature(
        kind=type(surface).__name__,
        area=float(face.Area),
        centre=_numbers(face.CenterOfMass),
        axis=(0.0, 0.0, 0.0) if axis is None else _numbers(axis),
        radius=float(radius),
    )


def _numbers(vector: Any) -> tuple[float, float, float]:
    return (float(vector.x), float(vector.y), float(vector.z))


def local_shape(part: Any) -> Any:
    """Return the shape of an object without its placement: moving a part changes nothing of its form."""
    shape = part.Shape.copy()
    shape.Placement = FreeCAD.Placement()
    return shape


def shape_signatures(shape: Any) -> list[FaceSignature]:
    """Return the signatures of all faces of a shape, ``Face1`` first."""
    return [signature(face) for face in shape.Faces]


def same_face(first: FaceSignature, second: FaceSignature, size: float) -> bool:
    """Tell whether two signatures are of the same face of a part of this size [mm]."""
    near = _SAME * max(size, 1e-6)
    return (
        first.kind == second.kind
        and abs(first.area - second.area) <= near * size
        and max(abs(a - b) for a, b in zip(first.centre, second.centre)) <= near
        and abs(first.radius - second.radius) <= near
        and _parallel(first.axis, second.axis)
    )


def _parallel(first: Sequence[float], second: Sequence[float]) -> bool:
    straight = max(abs(a - b) for a, b in zip(first, second))
    reverse = max(abs(a + b) for a, b in zip(first, second))
    return min(straight, reverse) <= _SAME


def find_face(wanted: FaceSignature, faces: Sequence[FaceSignature], size: float) -> int | None:
    """Return the number (1 for ``Face1``) of the one face with a signature; None for none or several."""
    found = [k for k, face in enumerate(faces, start=1) if same_face(wanted, face, size)]
    return found[0] if len(found) == 1 else None


def describe_change(
    number: int, before: FaceSignature, faces: Sequence[FaceSignature], size: float
) -> str | None:
    """Say what has happened to a face since it was picked; None where nothing has.

    Parameters
    ----------
    number : int
        Of the link, 1 for ``Face1``.
    before : FaceSignature
    faces : sequence of FaceSignature
        Those of the part now.
    size : float
        Of the part [mm].
    """
    if number > len(faces):
        return f"Face{number} is gone"
    now = faces[number - 1]
    if same_face(before, now, size):
        return None
    other = find_face(before, faces, size)
    if other is not None:
        return f"Face{number} is another face now; the one that was picked is Face{other}"
    if before.kind != now.kind:
        return f"Face{number} was a {before.kind} and is a {now.kind} now"
    return f"Face{number} has another size or place than when it was picked"


def face_number(name: str) -> int | None:
    """Return 6 for ``Face6``; None for anything else, also for ``?Face6`` that FreeCAD has lost.

    >>> face_number("Face6"), face_number("?Face6"), face_number("Edge1")
    (6, None, None)
    """
    digits = name[4:]
    return int(digits) if name.startswith("Face") and digits.isdigit() and int(digits) > 0 else None


def pack(signatures: Iterable[FaceSignature]) -> list[str]:
    """Return signatures as texts for a property."""
    return [json.dumps(asdict(item)) for item in signatures]


def unpack(texts: Iterable[str]) -> list[FaceSignature]:
    """Return the signatures in the texts of a property."""
    found = []
    for text in texts:
        values = json.loads(text)
        for key in ("centre", "axis"):
            values[key] = tuple(values[key])
        found.append(FaceSignature(**values))
    return found
