"""cadquery's face selector strings, evaluated by cadquery itself on a kernel shape."""

from __future__ import annotations

from typing import Any

from OCP.TopAbs import TopAbs_ShapeEnum

from cadskin.cad._occ import index_map
from cadskin.cad.objects import as_shape
from cadskin.errors import SelectionError

__all__ = ["face_indices"]


def face_indices(shape: Any, selector: str) -> tuple[int, ...]:
    """Return the indices of the faces that a cadquery selector string picks.

    Parameters
    ----------
    shape : object
        Any CAD object (see `cadskin.cad.objects.as_shape`).
    selector : str
        Such as ``">Z"``, ``"%CYLINDER"``, ``"|X and <Y"``, ``">>Z[1]"``.

    Returns
    -------
    tuple of int
        Zero-based, ascending; empty where nothing matches.

    Raises
    ------
    SelectionError
        The string is no selector, or asks for a level that does not exist.

    Examples
    --------
    >>> import cadquery as cq
    >>> face_indices(cq.Workplane().box(1, 2, 3), ">Z")
    (5,)
    """
    import cadquery
    import pyparsing

    library: Any = cadquery
    raw = as_shape(shape)
    try:
        chosen = library.StringSyntaxSelector(selector).filter(library.Shape.cast(raw).Faces())
    except (pyparsing.ParseException, IndexError, ValueError, KeyError) as problem:
        raise SelectionError(
            f"the selector {selector!r} is not understood by cadquery: {problem}"
        ) from problem
    found = index_map(raw, TopAbs_ShapeEnum.TopAbs_FACE)
    return tuple(sorted(found.FindIndex(face.wrapped) - 1 for face in chosen))
