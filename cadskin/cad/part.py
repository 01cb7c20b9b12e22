"""One solid (or open shell) out of a CAD file or object, with what the file says of it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from OCP.TopAbs import TopAbs_ShapeEnum

from cadskin.errors import GeometryError
from cadskin.shape.nominal import Source

__all__ = ["CadPart", "pick_part", "with_unique_names"]


@dataclass(frozen=True, eq=False)
class CadPart:
    """A solid or open shell, placed where its assembly puts it.

    Parameters
    ----------
    name : str
        Name of the product in the file, made unique (``nut``, ``nut-2``, ...).
    shape : TopoDS_Solid or TopoDS_Shell
        In mm, in the frame of the whole file.
    source : Source
        Kind and name of the file, its hash and its length unit.
    face_names, face_colours, face_step_ids : tuple
        What the file says of each face, in the order of cadquery's ``.Faces()``; None where it says nothing.
    path : tuple of str
        Names of the assembly instances that hold the part, the outermost first.
    notes : tuple of str
        What was repaired or left out on the way.
    """

    name: str
    shape: Any = field(repr=False)
    source: Source
    face_names: tuple[str | None, ...] = field(default=(), repr=False)
    face_colours: tuple[str | None, ...] = field(default=(), repr=False)
    face_step_ids: tuple[int | None, ...] = field(default=(), repr=False)
    path: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def is_solid(self) -> bool:
        """True for a solid, False for an open shell."""
        return bool(self.shape.ShapeType() == TopAbs_ShapeEnum.TopAbs_SOLID)

    @property
    def wrapped(self) -> Any:
        """The raw shape, under the name that cadquery and build123d use."""
        return self.shape


def with_unique_names(parts: Iterable[CadPart]) -> tuple[CadPart, ...]:
    """Return the parts with names made unique by ``-2``, ``-3``, ... and entered into their source."""
    given = list(parts)
    taken = {part.name for part in given}
    seen: set[str] = set()
    named = []
    for part in given:
        name, count = part.name, 1
        while name in seen:
            count += 1
            name = f"{part.name}-{count}"
            if name in taken and name not in seen:
                continue
        seen.add(name)
        named.append(replace(part, name=name, source=replace(part.source, part=name)))
    return tuple(named)


def pick_part(parts: Sequence[CadPart], name: str | int | None, *, where: str) -> CadPart:
    """Return the part called ``name`` (or number ``name``); the only one if no name is given.

    Raises
    ------
    GeometryError
        No such part, or several parts and no name; the message lists the names.
    """
    names = ", ".join(part.name for part in parts[:12])
    names += "" if len(parts) <= 12 else f" and {len(parts) - 12} more"
    if name is None:
        if len(parts) == 1:
            return parts[0]
        raise GeometryError(
            f"{where} holds {len(parts)} solids ({names}): choose one with part=, or use nominals() for all"
        )
    if isinstance(name, int):
        if 0 <= name < len(parts):
            return parts[name]
        raise GeometryError(f"{where} has no part {name}; it has parts 0 to {len(parts) - 1} ({names})")
    for part in parts:
        if part.name == name:
            return part
    raise GeometryError(f"{where} has no part {name!r}; it has {names}")
