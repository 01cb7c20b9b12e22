"""Write a part as text BREP, which keeps the order of its faces."""

from __future__ import annotations

import io
from pathlib import Path

from OCP.BRepTools import BRepTools
from OCP.TopTools import TopTools_FormatVersion

from cadskin.cad.part import CadPart
from cadskin.errors import ExportError

__all__ = ["write_brep"]


def write_brep(path: str | Path, part: CadPart) -> Path:
    """Write the exact shape of a part, without triangles, as text BREP.

    Parameters
    ----------
    path : str or Path
    part : CadPart

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        The file cannot be written.

    Examples
    --------
    >>> import cadquery as cq, tempfile, pathlib
    >>> from cadskin.cad.objects import as_parts
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = write_brep(pathlib.Path(folder, "block.brep"), as_parts(cq.Workplane().box(1, 2, 3))[0])
    ...     as_parts(file)[0].is_solid
    True
    """
    target, stream = Path(path), io.BytesIO()
    # The first version of the format: every kernel since 2010 reads it.
    version = TopTools_FormatVersion.TopTools_FormatVersion_VERSION_1
    BRepTools.Write_s(part.shape, stream, False, False, version)
    try:
        target.write_bytes(stream.getvalue())
    except OSError as error:
        raise ExportError(f"cannot write {target}: {error.strerror or error}") from error
    return target
