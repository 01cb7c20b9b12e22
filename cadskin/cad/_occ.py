"""Gateway to the geometry kernel: the only file that knows what differs between OCP versions.

OCP 7.9 is what cadquery 2.8 brings; OCP 8.0 renamed the downcasts and moved the collections. Everything here
is written against names that one ``if`` can switch; callers pass and get raw ``TopoDS`` objects.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from typing import Any

from OCP.BRep import BRep_Builder
from OCP.BRepCheck import BRepCheck_Analyzer
from OCP.Message import Message
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Compound

__all__ = [
    "OCP_MAJOR",
    "compound_of",
    "edges_of",
    "faces_of",
    "index_map",
    "is_valid",
    "label_sequence",
    "quiet",
    "shells_of",
    "solids_of",
    "to_edge",
    "to_face",
    "to_solid",
    "to_vertex",
    "words_of",
    "xyz",
]

# Only the package is probed: a name that is missing in one version then fails loudly.
OCP_MAJOR = 8 if find_spec("OCP.collections") else 7

if OCP_MAJOR >= 8:
    from OCP.collections import IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher as _IndexedMap
else:
    from OCP.TopTools import TopTools_IndexedMapOfShape as _IndexedMap


def _cast(name: str) -> Any:
    return getattr(TopoDS, name if hasattr(TopoDS, name) else name + "_s")


to_face = _cast("Face")
to_edge = _cast("Edge")
to_vertex = _cast("Vertex")
to_solid = _cast("Solid")
to_shell = _cast("Shell")
to_wire = _cast("Wire")


def index_map(shape: Any, kind: TopAbs_ShapeEnum) -> Any:
    """Return the indexed map (1-based ``FindKey``, ``FindIndex``) of the sub-shapes of one kind.

    Its order is the order of cadquery's ``.Faces()``, ``.Edges()`` and ``.Vertices()``.
    """
    found = _IndexedMap()
    TopExp.MapShapes_s(shape, kind, found)
    return found


def _all(shape: Any, kind: TopAbs_ShapeEnum, cast: Any) -> list[Any]:
    found = index_map(shape, kind)
    return [cast(found.FindKey(i)) for i in range(1, found.Extent() + 1)]


def faces_of(shape: Any) -> list[Any]:
    """Return the faces of a shape, each once, in map order."""
    return _all(shape, TopAbs_ShapeEnum.TopAbs_FACE, to_face)


def edges_of(shape: Any) -> list[Any]:
    """Return the edges of a shape, each once, in map order."""
    return _all(shape, TopAbs_ShapeEnum.TopAbs_EDGE, to_edge)


def solids_of(shape: Any) -> list[Any]:
    """Return the solids of a shape, each once, in map order."""
    return _all(shape, TopAbs_ShapeEnum.TopAbs_SOLID, to_solid)


def xyz(point: Any) -> tuple[float, float, float]:
    """Return the coordinates of a ``gp_Pnt``, ``gp_Vec`` or ``gp_Dir``."""
    return point.X(), point.Y(), point.Z()


def shells_of(shape: Any) -> list[Any]:
    """Return the shells of a shape, each once, in map order."""
    return _all(shape, TopAbs_ShapeEnum.TopAbs_SHELL, to_shell)


def label_sequence() -> Any:
    """Return an empty sequence of document labels (1-based ``Value``)."""
    if OCP_MAJOR >= 8:
        from OCP.collections import Sequence_TDF_Label as LabelSequence
    else:
        from OCP.TDF import TDF_LabelSequence as LabelSequence
    return LabelSequence()


def is_valid(shape: Any) -> bool:
    """Return what OCCT's own check says of a shape."""
    return bool(BRepCheck_Analyzer(shape).IsValid())


def compound_of(shapes: Iterable[Any]) -> Any:
    """Return a compound of raw shapes."""
    builder, compound = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(compound)
    for shape in shapes:
        builder.Add(compound, shape)
    return compound


def words_of(problem: BaseException) -> str:
    """Return what a kernel exception says, on one line."""
    return " ".join(str(problem).split())[:200] or type(problem).__name__


@contextmanager
def quiet() -> Iterator[None]:
    """Keep the kernel's messages off the terminal while the block runs."""
    messenger = Message.DefaultMessenger_s()
    kept = list(messenger.Printers())
    for printer in kept:
        messenger.RemovePrinter(printer)
    try:
        yield
    finally:
        for printer in kept:
            messenger.AddPrinter(printer)
