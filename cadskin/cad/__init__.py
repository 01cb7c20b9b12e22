"""The only room with a geometry kernel: CAD files and objects in, nominal models out.

Names load on first use; `contained_nominals` and `contained_describe` need no kernel in this process.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

_HOMES = {
    "CadPart": "cadskin.cad.part",
    "FileDescription": "cadskin.cad.description",
    "PartDescription": "cadskin.cad.description",
    "contained_describe": "cadskin.cad.contained",
    "contained_nominals": "cadskin.cad.contained",
    "describe_faces": "cadskin.cad.faces",
    "face_indices": "cadskin.cad.selectors",
    "nominal": "cadskin.cad.discretise",
    "nominals": "cadskin.cad.discretise",
    "partition": "cadskin.cad.partitioning",
    "read_parts": "cadskin.cad.documents",
    "read_pmi": "cadskin.cad.pmi.pmi",
    "to_ocp": "cadskin.cad.triangulation",
    "write_brep": "cadskin.cad.brep",
    "write_step": "cadskin.cad.pmi.write",
}

__all__ = [
    "CadPart",
    "FileDescription",
    "PartDescription",
    "contained_describe",
    "contained_nominals",
    "describe_faces",
    "face_indices",
    "nominal",
    "nominals",
    "partition",
    "read_parts",
    "read_pmi",
    "to_ocp",
    "write_brep",
    "write_step",
]

if TYPE_CHECKING:
    from cadskin.cad.brep import write_brep
    from cadskin.cad.contained import contained_describe, contained_nominals
    from cadskin.cad.description import FileDescription, PartDescription
    from cadskin.cad.discretise import nominal, nominals
    from cadskin.cad.documents import read_parts
    from cadskin.cad.faces import describe_faces
    from cadskin.cad.part import CadPart
    from cadskin.cad.partitioning import partition
    from cadskin.cad.pmi.pmi import read_pmi
    from cadskin.cad.pmi.write import write_step
    from cadskin.cad.selectors import face_indices
    from cadskin.cad.triangulation import to_ocp


def __getattr__(name: str) -> Any:
    try:
        home = _HOMES[name]
    except KeyError:
        raise AttributeError(f"module 'cadskin.cad' has no attribute {name!r}") from None
    value = getattr(import_module(home), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])
