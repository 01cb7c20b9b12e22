"""Look into a CAD file without meshing it: the work behind ``cadskin info`` and ``cadskin faces``."""

from __future__ import annotations

from pathlib import Path

from cadskin._progress import report
from cadskin._typing import Progress
from cadskin.cad._occ import is_valid
from cadskin.cad.description import FileDescription, PartDescription
from cadskin.cad.discretise import part_faces
from cadskin.cad.documents import read_parts
from cadskin.cad.faces import bounding_box, surface_area, volume
from cadskin.cad.part import CadPart
from cadskin.cad.partitioning import partition
from cadskin.cad.step_text import read_step_text

__all__ = ["describe_file", "describe_part"]


def describe_file(path: str | Path, *, progress: Progress | None = None) -> FileDescription:
    """Return what is in a CAD file: parts, faces, features, sizes, and how much PMI there is.

    Parameters
    ----------
    path : str or Path
    progress : callable, optional

    Raises
    ------
    ReadError
        The file cannot be read.
    """
    path = Path(path)
    parts = read_parts(path, allow_open=True)
    described = []
    for done, part in enumerate(parts):
        report(progress, done, len(parts))
        described.append(describe_part(part))
    report(progress, len(parts), len(parts))
    source = parts[0].source
    text = read_step_text(path) if source.kind == "step" else None
    return FileDescription(
        name=path.name,
        kind=source.kind,
        units=source.units,
        sha256=source.sha256 or "",
        parts=tuple(described),
        schema=text.schema if text else "",
        n_tolerances=text.n_tolerances if text else 0,
        n_datums=text.n_datums if text else 0,
        n_dimensions=text.n_dimensions if text else 0,
        n_tessellated=text.n_tessellated if text else 0,
    )


def describe_part(part: CadPart) -> PartDescription:
    """Return the record of one part."""
    faces = part_faces(part)
    return PartDescription(
        name=part.name,
        path=part.path,
        solid=part.is_solid,
        valid=is_valid(part.shape),
        area=surface_area(part.shape),
        volume=volume(part.shape) if part.is_solid else None,
        bounds=bounding_box(part.shape),
        faces=faces,
        groups=partition(part.shape, faces),
        notes=part.notes,
    )
