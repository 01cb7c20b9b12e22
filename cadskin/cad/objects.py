"""Any CAD object (cadquery, build123d, raw OCP, FreeCAD, a file) becomes parts, by what it looks like."""

from __future__ import annotations

import io
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.Quantity import Quantity_Color
from OCP.TopoDS import TopoDS_Shape

from cadskin._typing import Progress
from cadskin.cad._occ import compound_of, faces_of, quiet
from cadskin.cad.part import CadPart, with_unique_names
from cadskin.cad.solids import parts_of_shape
from cadskin.errors import GeometryError
from cadskin.shape.nominal import Source

__all__ = ["as_parts", "as_shape", "describe_object"]


def as_parts(obj: Any, *, allow_open: bool = False, progress: Progress | None = None) -> tuple[CadPart, ...]:
    """Return the solids of any CAD object or file as parts.

    Parameters
    ----------
    obj : object
        A file name, a `CadPart`, a cadquery Workplane, Shape or Assembly, a build123d builder or shape, a
        FreeCAD ``Part.Shape``, a raw ``TopoDS_Shape``, or a list of these.
    allow_open : bool
        Accept open shells where there is no solid.
    progress : callable, optional

    Raises
    ------
    GeometryError
        Nothing that has a shape, or no solid in it.
    ReadError
        A file that cannot be read.
    """
    if isinstance(obj, CadPart):
        return (obj,)
    if isinstance(obj, (str, Path)):
        from cadskin.cad.documents import read_parts

        return read_parts(obj, allow_open=allow_open, progress=progress)
    if isinstance(obj, (list, tuple)) and obj and all(isinstance(item, CadPart) for item in obj):
        return tuple(obj)
    source = Source(kind=_library(obj))
    with quiet():
        found: list[CadPart] = []
        for name, shape, colour in _named_shapes(obj):
            for part in parts_of_shape(
                shape, name=name, source=source, allow_open=allow_open, where=describe_object(obj)
            ):
                colours = (colour,) * len(faces_of(part.shape)) if colour else ()
                found.append(CadPart(part.name, part.shape, source, face_colours=colours, notes=part.notes))
    return with_unique_names(found)


def as_shape(obj: Any) -> Any:
    """Return the raw ``TopoDS_Shape`` inside a CAD object.

    Nothing of cadquery or build123d is imported: objects are known by their attributes.

    Raises
    ------
    GeometryError
        The object holds no shape.

    Examples
    --------
    >>> import cadquery as cq
    >>> as_shape(cq.Workplane().box(1, 2, 3)).ShapeType().name
    'TopAbs_SOLID'
    """
    if isinstance(obj, TopoDS_Shape):
        return _not_null(obj, obj)
    if isinstance(obj, str | Path):
        return compound_of(part.shape for part in as_parts(obj, allow_open=True))
    if callable(getattr(obj, "toCompound", None)):  # cadquery Assembly
        return as_shape(obj.toCompound())
    if callable(getattr(obj, "vals", None)):  # cadquery Workplane, Sketch
        return _together([value for value in obj.vals() if hasattr(value, "wrapped")], obj)
    for builder in ("part", "sketch", "line"):  # build123d builders
        inner = getattr(obj, builder, None)
        if inner is not None and not hasattr(obj, "wrapped"):
            return as_shape(inner)
    if hasattr(obj, "wrapped"):
        return _not_null(obj.wrapped, obj)
    if callable(getattr(obj, "exportBrepToString", None)):  # FreeCAD
        return _from_brep_text(obj.exportBrepToString(), obj)
    if isinstance(obj, Iterable):
        return _together(list(obj), obj)
    raise GeometryError(
        f"{describe_object(obj)} holds no CAD shape: give a file, a cadquery or build123d object "
        "or a TopoDS_Shape"
    )


def describe_object(obj: Any) -> str:
    """Return how messages name a CAD object: the file name, or the type."""
    if isinstance(obj, (str, Path)):
        return Path(obj).name
    return f"the {type(obj).__module__.split('.')[0]} {type(obj).__name__}"


def _library(obj: Any) -> str:
    root = type(obj[0] if isinstance(obj, (list, tuple)) and obj else obj).__module__.split(".")[0]
    return root if root in ("cadquery", "build123d") else "shape"


def _named_shapes(obj: Any) -> list[tuple[str, Any, str | None]]:
    """Return (name, shape, colour) of what the object holds; more than one for an assembly or a list."""
    if callable(getattr(obj, "toCompound", None)) and hasattr(obj, "__iter__"):  # cadquery Assembly
        return [
            (name.split("/")[-1], as_shape(shape).Moved(location.wrapped), _hex(colour))
            for shape, name, location, colour in obj
        ]
    if isinstance(obj, (list, tuple)) and obj:
        return [entry for item in obj for entry in _named_shapes(item)]
    name = getattr(obj, "label", "") or getattr(getattr(obj, "part", None), "label", "") or "part"
    return [(str(name), as_shape(obj), _hex(getattr(obj, "color", None)))]


def _hex(colour: Any) -> str | None:
    wrapped = getattr(colour, "wrapped", None)
    if wrapped is None:
        return None
    return str(Quantity_Color.ColorToHex_s(wrapped.GetRGB(), True).ToCString()).lower()


def _together(values: list[Any], obj: Any) -> Any:
    if not values:
        raise GeometryError(f"{describe_object(obj)} is empty: it holds no CAD shape")
    shapes = [as_shape(value) for value in values]
    return shapes[0] if len(shapes) == 1 else compound_of(shapes)


def _not_null(shape: Any, obj: Any) -> Any:
    if not isinstance(shape, TopoDS_Shape) or shape.IsNull():
        raise GeometryError(f"{describe_object(obj)} is empty: it holds no CAD shape")
    return shape


def _from_brep_text(text: str, obj: Any) -> Any:
    shape = TopoDS_Shape()
    BRepTools.Read_s(shape, io.BytesIO(text.encode()), BRep_Builder())
    return _not_null(shape, obj)
