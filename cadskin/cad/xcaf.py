"""STEP and IGES through OCCT's document framework: solids with place, name, colours and entity numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from OCP.IFSelect import IFSelect_ReturnStatus
from OCP.IGESCAFControl import IGESCAFControl_Reader
from OCP.Quantity import Quantity_Color, Quantity_ColorRGBA
from OCP.Standard import Standard_Failure
from OCP.STEPCAFControl import STEPCAFControl_Reader
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDF import TDF_Label
from OCP.TDocStd import TDocStd_Document
from OCP.TopLoc import TopLoc_Location
from OCP.XCAFApp import XCAFApp_Application
from OCP.XCAFDoc import XCAFDoc_ColorType, XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

from cadskin.cad._occ import compound_of, faces_of, label_sequence, solids_of, words_of
from cadskin.cad.part import CadPart
from cadskin.cad.solids import Repaired, left_out, loose_faces, repaired, sewn
from cadskin.cad.step_text import StepText, unit_word
from cadskin.errors import GeometryError, ReadError
from cadskin.shape.nominal import Source

__all__ = ["read_iges", "read_step"]

_GENERIC_NAMES = {"", "SOLID", "SHELL", "COMPOUND", "COMPSOLID", "FACE", "NONE", "UNNAMED"}


@dataclass(frozen=True, eq=False)
class _Leaf:
    """One placed product of the document: its label, its shape in its own frame, and how it is reached."""

    label: Any
    shape: Any
    location: Any
    path: tuple[str, ...]
    colour: str | None

    def name(self, file: Path) -> str:
        """Return the nearest name that says something, or that of the file."""
        return next((name for name in reversed(self.path) if not _is_generic(name)), file.stem)


@dataclass(frozen=True, eq=False)
class _Document:
    """An XCAF document with its reader, kept together: labels die with their document."""

    document: Any
    reader: Any
    step_ids: dict[Any, int]

    @property
    def colours(self) -> Any:
        return XCAFDoc_DocumentTool.ColorTool_s(self.document.Main())


def read_step(path: Path, text: StepText, source: Source, *, allow_open: bool) -> tuple[CadPart, ...]:
    """Return the placed solids of a STEP file.

    Raises
    ------
    ReadError
        OCCT cannot make sense of the file, or it holds triangles only.
    GeometryError
        No solid.
    """
    reader = STEPCAFControl_Reader()
    reader.SetColorMode(True)
    reader.SetNameMode(True)
    document = _transfer(reader, path, "STEP")
    source = replace(source, units="+".join(text.length_units) or "mm")
    step_ids = _entity_numbers(reader, text)
    parts = _parts(_Document(document, reader, step_ids), path, source, allow_open=allow_open)
    if step_ids:
        return parts
    note = f"{path.name}: the kernel did not read all entities, so the faces carry no STEP entity numbers"
    return tuple(replace(part, notes=(*part.notes, note)) for part in parts)


def read_iges(path: Path, source: Source, *, allow_open: bool) -> tuple[CadPart, ...]:
    """Return the solids of an IGES file, sewn from its faces where it holds surfaces; see `read_step`."""
    reader = IGESCAFControl_Reader()
    reader.SetColorMode(True)
    reader.SetNameMode(True)
    document = _transfer(reader, path, "IGES")
    unit = reader.IGESModel().GlobalSection().UnitName()
    source = replace(source, units=unit_word(unit.ToCString()) if unit is not None else "mm")
    return _parts(_Document(document, reader, {}), path, source, allow_open=allow_open)


def _transfer(reader: Any, path: Path, what: str) -> Any:
    """Return the document that a reader fills from a file."""
    application = XCAFApp_Application.GetApplication_s()
    document = TDocStd_Document(TCollection_ExtendedString("MDTV-XCAF"))
    application.InitDocument(document)
    try:
        status = reader.ReadFile(str(path))
        done = status == IFSelect_ReturnStatus.IFSelect_RetDone and reader.Transfer(document)
    except Standard_Failure as problem:
        raise ReadError(
            f"{path.name} cannot be read as {what}: the kernel says {words_of(problem)}"
        ) from problem
    if not done:
        raise ReadError(
            f"{path.name} cannot be read as {what} ({status.name.removeprefix('IFSelect_')}): "
            "it is damaged or holds no shape; export it again"
        )
    return document


def _entity_numbers(reader: Any, text: StepText) -> dict[Any, int]:
    """Return the number of each STEP entity: the i-th entity of the model is the i-th of the file."""
    model = reader.ChangeReader().WS().Model()
    numbers = text.entity_ids
    if model.NbEntities() != len(numbers):
        return {}
    return {model.Value(i + 1): int(number) for i, number in enumerate(numbers)}


# --- the tree of the document -----------------------------------------------------------------------------


def _leaves(held: _Document) -> Iterator[_Leaf]:
    free = label_sequence()
    XCAFDoc_DocumentTool.ShapeTool_s(held.document.Main()).GetFreeShapes(free)
    for i in range(1, free.Length() + 1):
        yield from _walk(held, free.Value(i), TopLoc_Location(), (), None)


def _walk(
    held: _Document, label: Any, location: Any, path: tuple[str, ...], colour: str | None
) -> Iterator[_Leaf]:
    """Yield the simple shapes below a label, with the product of the locations on the way."""
    if XCAFDoc_ShapeTool.IsReference_s(label):
        target = TDF_Label()
        XCAFDoc_ShapeTool.GetReferredShape_s(label, target)
        place = location.Multiplied(XCAFDoc_ShapeTool.GetLocation_s(label))
        instance = _name(label)
        here = path if _is_generic(instance) else (*path, instance)
        yield from _walk(held, target, place, here, _label_colour(held, label) or colour)
        return
    name = _name(label)
    if XCAFDoc_ShapeTool.IsAssembly_s(label):
        components = label_sequence()
        XCAFDoc_ShapeTool.GetComponents_s(label, components)
        for i in range(1, components.Length() + 1):
            yield from _walk(held, components.Value(i), location, path or (name,), colour)
        return
    shape = XCAFDoc_ShapeTool.GetShape_s(label)
    if shape is not None and not shape.IsNull():
        yield _Leaf(label, shape, location, (*path, name), _label_colour(held, label) or colour)


def _telling(path: tuple[str, ...]) -> tuple[str, ...]:
    """Return a path without the kernel's own words for unnamed things."""
    return tuple(name for name in path if not _is_generic(name))


def _name(label: Any) -> str:
    if not label.IsAttribute(TDataStd_Name.GetID_s()):  # FindAttribute on a missing one crashes
        return ""
    attribute = TDataStd_Name()
    label.FindAttribute(TDataStd_Name.GetID_s(), attribute)
    return str(attribute.Get().ToExtString()).strip()


def _is_generic(name: str) -> bool:
    return name.upper() in _GENERIC_NAMES or name.startswith(("=>[", "Open CASCADE "))


# --- parts ------------------------------------------------------------------------------------------------


def _parts(held: _Document, path: Path, source: Source, *, allow_open: bool) -> tuple[CadPart, ...]:
    leaves = list(_leaves(held))
    with_solids = [(leaf, solids_of(leaf.shape)) for leaf in leaves]
    loose = [face for leaf in leaves for face in loose_faces(leaf.shape)]
    if not any(solids for _, solids in with_solids):
        return _sewn_parts(held, leaves, path, source, allow_open=allow_open)
    notes = left_out(len(loose), where=path.name)
    made: dict[tuple[Any, int], CadPart] = {}
    parts = []
    for leaf, solids in with_solids:
        for k, solid in enumerate(solids):
            key = (leaf.shape.TShape(), k)
            if key not in made:
                made[key] = _part(held, leaf, solid, repaired(solid, where=path.name), source)
            one = made[key]
            parts.append(
                replace(
                    one,
                    shape=one.shape.Moved(leaf.location),
                    name=leaf.name(path),
                    path=_telling(leaf.path),
                    notes=(*notes, *one.notes),
                    face_colours=tuple(c or leaf.colour for c in one.face_colours),
                )
            )
    return tuple(parts)


def _sewn_parts(
    held: _Document, leaves: Sequence[_Leaf], path: Path, source: Source, *, allow_open: bool
) -> tuple[CadPart, ...]:
    """Return solids and shells sewn from a file of surfaces."""
    placed = [face for leaf in leaves for face in faces_of(leaf.shape.Moved(leaf.location))]
    own = [face for leaf in leaves for face in faces_of(leaf.shape)]
    if not own:
        raise GeometryError(f"{path.name} holds no solid and no surface, nothing that can be meshed")
    first = next(leaf for leaf in leaves if faces_of(leaf.shape))
    whole = _Leaf(None, compound_of(own), TopLoc_Location(), (first.name(path),), None)
    return tuple(
        _part(held, whole, None, done, source, own_faces=own)
        for done in sewn(placed, where=path.name, allow_open=allow_open)
    )


def _part(
    held: _Document,
    leaf: _Leaf,
    solid: Any,
    done: Repaired,
    source: Source,
    *,
    own_faces: Sequence[Any] | None = None,
) -> CadPart:
    """Return a part in its own frame, with what the document says of its faces."""
    faces = faces_of(solid) if own_faces is None else list(own_faces)
    whole = None if solid is None else _shape_colour(held, solid)
    entities = [_entity(held, face) for face in faces]
    names = [_entity_name(entity) for entity in entities]
    numbers = [held.step_ids.get(entity) for entity in entities]
    colours = [_shape_colour(held, face) or whole for face in faces]
    return CadPart(
        name=leaf.path[-1],
        shape=done.shape,
        source=source,
        face_names=_follow(names, done.origin),
        face_colours=_follow(colours, done.origin),
        face_step_ids=_follow(numbers, done.origin),
        path=_telling(leaf.path),
        notes=done.notes,
    )


def _follow(values: Sequence[Any], origin: Sequence[int]) -> tuple[Any, ...]:
    return tuple(values[i] if i >= 0 else None for i in origin)


def _entity(held: _Document, face: Any) -> Any:
    """Return the STEP entity that a face was made from; None for other files."""
    if not held.step_ids:
        return None
    return held.reader.ChangeReader().WS().TransferReader().EntityFromShapeResult(face, -1)


def _entity_name(entity: Any) -> str | None:
    name = getattr(entity, "Name", None)
    handle = name() if callable(name) else None
    text = "" if handle is None else str(handle.ToCString()).strip()
    return None if _is_generic(text) else text


def _label_colour(held: _Document, label: Any) -> str | None:
    return _colour(lambda kind, colour: held.colours.GetColor_s(label, kind, colour))


def _shape_colour(held: _Document, shape: Any) -> str | None:
    tool = held.colours
    return _colour(lambda kind, colour: tool.GetColor(shape, kind, colour))


def _colour(get: Any) -> str | None:
    found = Quantity_ColorRGBA()
    for kind in (XCAFDoc_ColorType.XCAFDoc_ColorSurf, XCAFDoc_ColorType.XCAFDoc_ColorGen):
        if get(kind, found):
            return str(Quantity_Color.ColorToHex_s(found.GetRGB(), True).ToCString()).lower()
    return None
