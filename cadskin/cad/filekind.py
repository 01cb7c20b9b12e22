"""The format of a CAD file, from its content and its name (no kernel needed)."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, TypeAlias

from cadskin.errors import ReadError

__all__ = ["EXTENSIONS", "CadFileKind", "cad_file"]

CadFileKind: TypeAlias = Literal["step", "iges", "brep"]

EXTENSIONS: dict[str, CadFileKind] = {
    ".step": "step",
    ".stp": "step",
    ".p21": "step",
    ".iges": "iges",
    ".igs": "iges",
    ".brep": "brep",
    ".brp": "brep",
}
_MESHES = {".stl", ".ply", ".obj", ".3mf", ".off", ".glb", ".gltf", ".vtu", ".vtk", ".amf"}


def cad_file(path: Path) -> CadFileKind:
    """Return the format of a CAD file; its content decides, its name is for the message.

    Raises
    ------
    ReadError
        Missing, a folder, not readable, empty, or no format that is known here.

    Examples
    --------
    >>> cad_file(Path("no such file.step"))
    Traceback (most recent call last):
    cadskin.errors.ReadError: no such file.step: there is no such file
    """
    if path.is_dir():
        raise ReadError(f"{path} is a folder, a STEP, IGES or BREP file was expected")
    try:
        with path.open("rb") as stream:
            head = stream.read(4096)
    except FileNotFoundError:
        raise ReadError(f"{path}: there is no such file") from None
    except OSError as problem:
        raise ReadError(f"{path} cannot be opened: {problem.strerror or problem}") from problem
    if not head:
        raise ReadError(f"{path.name} is empty (0 bytes)")
    found = _by_content(head)
    if found is not None:
        return found
    expected = EXTENSIONS.get(path.suffix.lower())
    if expected is not None:
        raise ReadError(f"{path.name} is no {expected.upper()} file: its content is something else")
    if path.suffix.lower() in _MESHES:
        raise ReadError(f"{path.name} is a mesh; give the CAD model as STEP, IGES or BREP")
    raise ReadError(f"{path.name} has a format that is not known here; known are {', '.join(EXTENSIONS)}")


def _by_content(head: bytes) -> CadFileKind | None:
    if b"ISO-10303-21" in head[:2000]:
        return "step"
    if b"CASCADE Topology" in head[:300] or b"DBRep_DrawableShape" in head[:300]:
        return "brep"
    lines = head.splitlines()
    if lines and len(lines[0]) >= 73 and lines[0][72:73] == b"S" and lines[0][73:80].strip().isdigit():
        return "iges"
    return None
