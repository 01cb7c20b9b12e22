"""Write a shape to a file; the suffix names the format."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import BinaryIO, TypeAlias

from cadskin.errors import ExportError
from cadskin.export.atomic import atomic_file
from cadskin.export.content import Content, Shape, content_of
from cadskin.export.gltf import write_glb, write_gltf
from cadskin.export.npz import write_npz
from cadskin.export.obj import write_obj
from cadskin.export.ply import write_ply
from cadskin.export.stl import write_ascii_stl, write_binary_stl
from cadskin.export.threemf import write_3mf
from cadskin.export.vtu import write_vtu

__all__ = ["FORMATS", "write"]

_Writer: TypeAlias = Callable[[BinaryIO, Content], None]

_WRITERS: dict[str, _Writer] = {
    "stl": write_binary_stl,
    "ply": write_ply,
    "obj": write_obj,
    "3mf": write_3mf,
    "glb": write_glb,
    "gltf": write_gltf,
    "vtu": write_vtu,
    "npz": write_npz,
}
FORMATS = tuple(_WRITERS)


def write(
    path: str | os.PathLike[str],
    shape: Shape,
    *,
    format: str | None = None,
    ascii: bool = False,
    double: bool = False,
) -> Path:
    """Write a shape to a file that is complete or not there.

    ======== ============================================================== ==============================
    format   holds                                                          precision of coordinates
    ======== ============================================================== ==============================
    ``stl``  triangles                                                      32 bit
    ``ply``  deviation per vertex, face and feature per triangle            32 bit, or 64 with ``double``
    ``obj``  one group per B-rep face                                       12 digits
    ``3mf``  one object in millimetres, for printing                        9 digits
    ``glb``  colours, deviation per feature sample; metres by a node scale  32 bit
    ``gltf`` the same as JSON
    ``vtu``  deviation, normals, face and feature ids                       64 bit
    ``npz``  all arrays of nominal and skin, provenance                     64 bit, exact
    ======== ============================================================== ==============================

    A 32-bit coordinate is rounded to 6e-8 of its size: 6 nm at 100 mm, 0.5 µm at 10 m. A `CadskinWarning`
    says so where that matters.

    Parameters
    ----------
    path : str or path
        A device or a pipe is written to directly.
    shape : NominalModel, SkinModel or DiscreteShape
    format : str, optional
        One of the formats above; by default the suffix of ``path``.
    ascii : bool
        STL only: write text.
    double : bool
        PLY only: write 64-bit numbers.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        Unknown format, missing folder, no permission, full disk. Nothing is left behind.
    GeometryError
        Nothing to write.

    Examples
    --------
    >>> import tempfile, cadskin.shape
    >>> tet = cadskin.shape.DiscreteShape([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
    ...                                   [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], [0, 1, 2, 3])
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write(folder + "/tet.stl", tet).stat().st_size
    284
    """
    path = Path(path)
    name = _format_of(path, format)
    writer = _with_options(name, ascii=ascii, double=double)
    content = content_of(shape)
    with atomic_file(path) as stream:
        writer(stream, content)
    return path


def _format_of(path: Path, format: str | None) -> str:
    name = (path.suffix if format is None else format).lower().lstrip(".")
    if name not in _WRITERS:
        what = f"the suffix {path.suffix!r}" if format is None else f"the format {format!r}"
        if format is None and not path.suffix:
            what = "a name without a suffix"
        raise ExportError(f"cannot write {path}: {what} is no known format; known are {', '.join(FORMATS)}")
    return name


def _with_options(name: str, *, ascii: bool, double: bool) -> _Writer:
    if ascii and name != "stl":
        raise ExportError(f"ascii=True is for STL only, not for {name}")
    if double and name != "ply":
        raise ExportError(f"double=True is for PLY only; {name} has one precision (see cadskin.export.write)")
    if ascii:
        return write_ascii_stl
    return partial(write_ply, double=True) if double else _WRITERS[name]
