"""CAD files for the commands: read in a child process, with progress, into nominal models."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from cadskin._kernel_cache import kernels_to_compile
from cadskin.cli._console import note, progress_bar, status
from cadskin.cli._options import positive, table_of_lengths
from cadskin.errors import GeometryError, SpecificationError

if TYPE_CHECKING:
    from cadskin.cad.description import FileDescription
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification

__all__ = [
    "describe",
    "discretise",
    "general_profile",
    "has_tolerances",
    "nominal_and_spec",
    "say_what_is_compiled",
    "tolerances_of",
]

NO_LIMIT = 2**31 - 1  # triangles


def describe(path: Path, *, time_limit: float) -> FileDescription:
    """Return what is in a CAD file."""
    from cadskin.cad import contained_describe

    with status(f"reading {path.name}"):
        return contained_describe(path, time_limit=_limit(time_limit))


def discretise(
    path: Path,
    *,
    edge_length: float | None = None,
    points: int | None = None,
    edge_length_on: list[str] | None = None,
    part: str | None = None,
    backend: str = "cadskin",
    allow_open: bool = False,
    force: bool = False,
    time_limit: float = 300.0,
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


def nominal_and_spec(
    path: Path, spec: Path | None, *, time_limit: float, **options: Any
) -> tuple[NominalModel, Specification]:
    """Return the nominal model of the one part of a CAD file, and its tolerances.

    Parameters
    ----------
    path : Path
    spec : Path or None
        Spec file; the PMI of the CAD file without one.
    time_limit : float
    **options
        As for `discretise`.

    Raises
    ------
    SpecificationError
        The file has several parts and none is chosen.
    """
    from cadskin.spec import read_spec

    given = None if spec is None else read_spec(spec)  # a mistake in it is said before the work
    nominals = discretise(path, time_limit=time_limit, **options)
    if len(nominals) != 1:
        names = ", ".join(nominal.source.part or "?" for nominal in nominals)
        raise SpecificationError(f"{path.name} has {len(nominals)} parts ({names}); choose one with --part")
    nominal = nominals[0]
    return nominal, tolerances_of(path, nominal, time_limit=time_limit) if given is None else given


def tolerances_of(path: Path, nominal: NominalModel, *, time_limit: float) -> Specification:
    """Return the tolerances that a CAD file itself has for a part; an empty specification where none."""
    from cadskin.cad import read_pmi
    from cadskin.spec import Specification

    if path.suffix.lower() not in (".stp", ".step"):
        return Specification()
    with status(f"reading the tolerances of {path.name}"):
        return read_pmi(path, nominal, time_limit=_limit(time_limit))


def has_tolerances(spec: Specification) -> bool:
    """Tell whether a specification asks for anything, be it only for something that was not understood."""
    asked = len(spec) > 0 or spec.default is not None or any(item.kind != "file" for item in spec.unresolved)
    return asked or any(item.lower is not None or item.upper is not None for item in spec.dimensions)


def general_profile(nominal: NominalModel) -> tuple[Specification, float]:
    """Return the specification of a part that has none: a profile on every face; and its width [mm]."""
    from cadskin.spec import Specification, tolerance
    from cadskin.spec.general import general_tolerance

    low, high = nominal.surface.points.min(axis=0), nominal.surface.points.max(axis=0)
    width = general_tolerance(float((high - low).max()))
    return Specification(default=tolerance("surface_profile", None, width, scope="general")), width


def say_what_is_compiled(*kernels: str) -> None:
    """Say that a first command takes longer, where it does."""
    missing = kernels_to_compile(*kernels)
    if missing:
        note(f"compiling kernels (once, up to 30 s): {', '.join(missing)}")


def _limit(seconds: float) -> float | None:
    return None if seconds == 0 else positive(seconds, "--time-limit", unit="seconds")
