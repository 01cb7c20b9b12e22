"""CAD files: which format, checked before the kernel sees them, read into parts."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from OCP.BinTools import BinTools
from OCP.BRep import BRep_Builder
from OCP.BRepTools import BRepTools
from OCP.Standard import Standard_Failure
from OCP.TopoDS import TopoDS_Shape

from cadskin._progress import report
from cadskin._typing import Progress
from cadskin.cad._occ import quiet, words_of
from cadskin.cad.filekind import cad_file
from cadskin.cad.part import CadPart, with_unique_names
from cadskin.cad.solids import parts_of_shape
from cadskin.cad.step_text import read_step_text
from cadskin.cad.xcaf import read_iges, read_step
from cadskin.errors import ReadError
from cadskin.shape.nominal import Source

__all__ = ["read_parts"]

_BREP_END = re.compile(rb"[-+ie]\d+\s+\d+\s*$")  # orientation, number and location of the whole shape


def read_parts(
    path: str | Path, *, allow_open: bool = False, progress: Progress | None = None
) -> tuple[CadPart, ...]:
    """Return the parts of a STEP, IGES or BREP file: every placed solid, in mm.

    Parameters
    ----------
    path : str or Path
        ``.step``, ``.stp``, ``.p21``, ``.iges``, ``.igs``, ``.brep``, ``.brp`` (text or binary).
    allow_open : bool
        Where the file holds surfaces that close no volume, return them as open shells.
    progress : callable, optional

    Returns
    -------
    tuple of CadPart
        One per instance of a solid; names are those of the products, made unique.

    Raises
    ------
    ReadError
        Missing, empty, truncated or damaged file; unknown format; triangles only.
    GeometryError
        No solid in the file.

    Examples
    --------
    >>> import cadquery as cq, tempfile, pathlib
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = pathlib.Path(folder, "block.step")
    ...     _ = cq.Workplane().box(1, 2, 3).val().exportStep(str(file))
    ...     [(part.is_solid, part.source.units) for part in read_parts(file)]
    [(True, 'mm')]
    """
    path = Path(path)
    kind = cad_file(path)
    report(progress, 0, 1)
    source = Source(kind=kind, path=path.name, sha256=hashlib.sha256(path.read_bytes()).hexdigest())
    with quiet():
        if kind == "step":
            parts = read_step(path, read_step_text(path), source, allow_open=allow_open)
        elif kind == "iges":
            parts = read_iges(path, source, allow_open=allow_open)
        else:
            parts = _read_brep(path, source, allow_open=allow_open)
    report(progress, 1, 1)
    return with_unique_names(parts)


def _read_brep(path: Path, source: Source, *, allow_open: bool) -> tuple[CadPart, ...]:
    content = path.read_bytes()
    binary = content[:200].lstrip().startswith(b"Open CASCADE Topology")
    if not binary and not (b"TShapes" in content and _BREP_END.search(content[-200:])):
        raise ReadError(f"{path.name} cannot be read as BREP: it is truncated; export it again")
    shape = TopoDS_Shape()
    try:
        if binary:
            BinTools.Read_s(shape, str(path))
        else:
            BRepTools.Read_s(shape, str(path), BRep_Builder())
    except Standard_Failure as problem:
        raise ReadError(
            f"{path.name} cannot be read as BREP: the kernel says {words_of(problem)}"
        ) from problem
    if shape.IsNull():
        raise ReadError(f"{path.name} cannot be read as BREP: it is damaged; export it again")
    return parts_of_shape(shape, name=path.stem, source=source, where=path.name, allow_open=allow_open)
