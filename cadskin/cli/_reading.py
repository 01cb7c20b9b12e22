"""CAD files for the commands: read in a child process, with progress, into nominal models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cadskin._kernel_cache import kernels_to_compile
from cadskin.cli._console import note, progress_bar, status
from cadskin.cli._options import positive, table_of_lengths
from cadskin.errors import GeometryError

if TYPE_CHECKING:
    from cadskin.cad.description import FileDescription
    from cadskin.shape import NominalModel

__all__ = ["describe", "discretise", "say_what_is_compiled"]

NO_LIMIT = 2**31 - 1  # triangles


def describe(path: Path, *, time_limit: float) -> FileDescription:
    """Return what is in a CAD file."""
    from cadskin.cad import contained_describe

    with status(f"reading {path.name}"):
        return contained_describe(path, time_limit=_limit(time_limit))


def discretise(
    path: Path,
    *,
    edge_length: float | None,
    points: int | None,
    edge_length_on: list[str] | None,
    part: str | None,
    backend: str,
    allow_open: bool,
    force: bool,
    time_limit: float,
) -> tuple[NominalModel, ...]:
    """Return the nominal models of a CAD file; the options are those of the command line.

    Raises
    ------
    GeometryError
        Options that contradict each other or have no meaning.
    """
    from cadskin.cad import contained_nominals
    from cadskin.cad.filekind import cad_file

    if edge_length is not None and points is not None:
        raise GeometryError("--edge-length and --points exclude each other: give one of them")
    if points is not None and points < 4:
        raise GeometryError(f"--points must be at least 4, got {points}")
    options: dict[str, Any] = {
        "edge_length": positive(edge_length, "--edge-length"),
        "n_points": points,
        "face_edge_lengths": table_of_lengths(edge_length_on),
        "backend": backend,
        "allow_open": allow_open,
    }
    if part is not None:
        options["part"] = part
    if force:
        options["max_triangles"] = NO_LIMIT
    cad_file(path)
    say_what_is_compiled("meshing")
    with progress_bar(f"meshing {path.name}") as progress:
        return contained_nominals(path, options, time_limit=_limit(time_limit), progress=progress)


def say_what_is_compiled(*kernels: str) -> None:
    """Say that a first command takes longer, where it does."""
    missing = kernels_to_compile(*kernels)
    if missing:
        note(f"compiling kernels (once, up to 30 s): {', '.join(missing)}")


def _limit(seconds: float) -> float | None:
    return None if seconds == 0 else positive(seconds, "--time-limit", unit="seconds")
