"""Solids out of shapes: healing where OCCT's check asks for it, loose faces sewn, everything reported."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepBuilderAPI import BRepBuilderAPI_Sewing
from OCP.BRepLib import BRepLib
from OCP.ShapeFix import ShapeFix_Shape, ShapeFix_Solid
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS_Shell

from cadskin.cad._occ import (
    compound_of,
    faces_of,
    index_map,
    is_valid,
    shells_of,
    solids_of,
    to_face,
    to_shell,
    to_solid,
)
from cadskin.cad.faces import volume
from cadskin.cad.part import CadPart
from cadskin.errors import GeometryError, ReadError
from cadskin.shape.nominal import Source

__all__ = ["Repaired", "has_surfaces", "left_out", "loose_faces", "parts_of_shape", "repaired", "sewn"]


@dataclass(frozen=True, eq=False)
class Repaired:
    """A shape after healing, and which old face each of its faces came from (-1 for a new one)."""

    shape: Any
    origin: tuple[int, ...]
    notes: tuple[str, ...]


def parts_of_shape(
    shape: Any, *, name: str, source: Source, where: str, allow_open: bool = False
) -> tuple[CadPart, ...]:
    """Return the solids of a shape that carries no names; sewn and open shells where there is no solid.

    Raises
    ------
    GeometryError
        No solid and no face, or an open shell that was not asked for.
    ReadError
        Triangles only, no exact surfaces.
    """
    solids = solids_of(shape)
    if solids:
        extra = left_out(len(loose_faces(shape)), where=where)
        return tuple(
            CadPart(name, done.shape, source, notes=(*extra, *done.notes))
            for done in (repaired(solid, where=where) for solid in solids)
        )
    found = sewn(faces_of(shape), where=where, allow_open=allow_open)
    return tuple(CadPart(name, done.shape, source, notes=done.notes) for done in found)


def loose_faces(shape: Any) -> list[Any]:
    """Return the faces that belong to no solid."""
    explorer = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE, TopAbs_ShapeEnum.TopAbs_SOLID)
    found = []
    while explorer.More():
        found.append(to_face(explorer.Current()))
        explorer.Next()
    return found


def left_out(n_faces: int, *, where: str) -> tuple[str, ...]:
    """Return the note on faces that belong to no solid; none where there is no such face."""
    if not n_faces:
        return ()
    return (f"{where}: {n_faces} {'face' if n_faces == 1 else 'faces'} outside of the solids left out",)


def has_surfaces(shape: Any) -> bool:
    """Return False when at least one face has no exact surface (a tessellated model)."""
    return all(BRep_Tool.Surface_s(face) is not None for face in faces_of(shape))


def repaired(solid: Any, *, where: str) -> Repaired:
    """Return a solid as it is when OCCT's check passes, else what `ShapeFix` makes of it.

    Raises
    ------
    ReadError
        Its faces are triangles without exact surfaces.
    """
    n_faces = len(faces_of(solid))
    if not has_surfaces(solid):
        raise ReadError(
            f"{where} holds a tessellated model (triangles only, no exact surfaces); export it as a B-rep "
            "(AP203, AP214 or AP242 with exact geometry)"
        )
    same = tuple(range(n_faces))
    notes: tuple[str, ...] = ()
    if not is_valid(solid):
        fixer = ShapeFix_Shape(solid)
        fixer.Perform()
        candidates = solids_of(fixer.Shape())
        if len(candidates) == 1 and is_valid(candidates[0]):
            healed = candidates[0]
            origin = _origin(solid, healed, fixer.Context().Apply)
            notes = (f"{where}: healed by ShapeFix ({n_faces} faces before, {len(origin)} after)",)
            return Repaired(_outward(healed), origin, notes)
        notes = (
            f"{where}: OCCT's check calls the solid invalid and ShapeFix could not mend it; used as it is",
        )
    turned = _outward(solid)
    if turned is not solid:
        notes = (*notes, f"{where}: the solid was inside out and was turned")
    return Repaired(turned, same, notes)


def sewn(faces: Sequence[Any], *, where: str, allow_open: bool) -> list[Repaired]:
    """Return solids (closed) and shells (open, if allowed) sewn from loose faces.

    Raises
    ------
    GeometryError
        No face at all, or open shells that were not asked for.
    ReadError
        The faces are triangles without exact surfaces.
    """
    if not faces:
        raise GeometryError(f"{where} holds no solid and no surface, nothing that can be meshed")
    if not all(has_surfaces(face) for face in faces):
        raise ReadError(
            f"{where} holds a tessellated model (triangles only, no exact surfaces); export it as a B-rep "
            "(AP203, AP214 or AP242 with exact geometry)"
        )
    tolerance = max(1e-6, *(min(BRep_Tool.Tolerance_s(face), 1e-2) for face in faces))
    sewing = BRepBuilderAPI_Sewing(tolerance)
    for face in faces:
        sewing.Add(face)
    sewing.Perform()
    found = [_closed(shell) for shell in _shells_and_faces(sewing.SewedShape())]
    is_open = [not _is_solid(shape) for shape in found]
    if any(is_open) and not allow_open:
        raise GeometryError(
            f"{where} holds no solid, only {len(faces)} faces that do not close a volume; "
            "ask for an open shell (allow_open=True, --allow-open) or export a solid"
        )
    results = []
    for shape, shell_is_open in zip(found, is_open, strict=True):
        what = "an open shell" if shell_is_open else "a solid"
        origin = _origin(compound_of(faces), shape, sewing.ModifiedSubShape)
        results.append(Repaired(shape, origin, (f"{where}: {len(origin)} faces sewn into {what}",)))
    return results


def _shells_and_faces(shape: Any) -> list[Any]:
    """Return the shells of a sewn shape; a face that stayed alone becomes a shell of its own."""
    shells = shells_of(shape)
    held = index_map(compound_of(shells), TopAbs_ShapeEnum.TopAbs_FACE)
    alone = [face for face in faces_of(shape) if not held.Contains(face)]
    return shells + [_shell_of(face) for face in alone]


def _shell_of(face: Any) -> Any:
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    builder.Add(shell, face)
    return shell


def _closed(shell: Any) -> Any:
    """Return a solid where the shell closes a volume, else the shell."""
    if not BRep_Tool.IsClosed_s(shell):
        return to_shell(shell)
    solid = ShapeFix_Solid().SolidFromShell(to_shell(shell))
    return _outward(to_solid(solid))


def _is_solid(shape: Any) -> bool:
    return bool(shape.ShapeType() == TopAbs_ShapeEnum.TopAbs_SOLID)


def _outward(solid: Any) -> Any:
    """Return the solid with its material inside; the very same object where it is so already."""
    if volume(solid) >= 0:
        return solid
    turned = to_solid(solid.Reversed())
    if volume(turned) < 0:
        BRepLib.OrientClosedSolid_s(turned)
    return turned


def _origin(before: Any, after: Any, follow: Callable[[Any], Any]) -> tuple[int, ...]:
    """Return for each face of ``after`` the index of the face of ``before`` that ``follow`` leads to it."""
    new = index_map(after, TopAbs_ShapeEnum.TopAbs_FACE)
    origin = [-1] * new.Extent()
    for i, face in enumerate(faces_of(before)):
        followed = follow(face)
        if followed is None or followed.IsNull():
            continue
        for image in faces_of(followed):
            k = new.FindIndex(to_face(image))
            if k:
                origin[k - 1] = i
    return tuple(origin)
