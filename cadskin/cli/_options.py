"""Arguments and options that several commands share, and their checks."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from cadskin.errors import CadskinError, GeometryError

__all__ = [
    "AllowOpen",
    "Backend",
    "CadFile",
    "EdgeLength",
    "EdgeLengthOn",
    "Force",
    "Format",
    "Json",
    "Part",
    "Points",
    "Seed",
    "SpecOfFile",
    "SpecOfPart",
    "TimeLimit",
    "positive",
    "table_of_lengths",
]

CadFile = Annotated[Path, typer.Argument(metavar="FILE", help="STEP, IGES or BREP file.", show_default=False)]
EdgeLength = Annotated[
    float | None,
    typer.Option(
        "--edge-length", metavar="MM", help="Target edge length of the triangles [default: diagonal / 100]."
    ),
]
Points = Annotated[
    int | None,
    typer.Option("--points", metavar="N", help="Wanted number of points instead of --edge-length."),
]
EdgeLengthOn = Annotated[
    list[str] | None,
    typer.Option(
        "--edge-length-on",
        metavar="FACES=MM",
        help='Another edge length on some faces: ">Z=0.5", "3=0.2", "%CYLINDER=0.3"; may be repeated.',
        show_default=False,
    ),
]
Part = Annotated[
    str | None, typer.Option("--part", metavar="NAME", help="Only this part of the file.", show_default=False)
]
Backend = Annotated[
    str, typer.Option("--backend", metavar="NAME", help="Mesher: cadskin, gmsh or pymeshlab.")
]
AllowOpen = Annotated[
    bool, typer.Option("--allow-open", help="Take surfaces that close no volume as an open shell.")
]
Force = Annotated[bool, typer.Option("--force", help="Go on beyond 5 million triangles.")]
TimeLimit = Annotated[
    float,
    typer.Option("--time-limit", metavar="S", help="Seconds for reading and meshing; 0 for no limit."),
]
Format = Annotated[
    str | None,
    typer.Option("--format", metavar="NAME", help="File format, where the suffix does not name it."),
]
SpecOfFile = Annotated[
    Path | None,
    typer.Option(
        "--spec", metavar="SPEC", help="Spec file (.toml) [default: the PMI of FILE].", show_default=False
    ),
]
SpecOfPart = Annotated[
    Path | None,
    typer.Option(
        "--spec", metavar="SPEC", help="Spec file (.toml) [default: the PMI of PART].", show_default=False
    ),
]
Seed = Annotated[
    int | None,
    typer.Option("--seed", metavar="K", min=0, help="Makes the result repeatable [default: random]."),
]
Json = Annotated[bool, typer.Option("--json", help="Machine-readable output.")]


def positive(value: float | None, option: str, *, unit: str = "mm") -> float | None:
    """Return ``value`` if it is None or a finite number above zero.

    Raises
    ------
    GeometryError
        Zero, negative, infinite or NaN.

    Examples
    --------
    >>> positive(0.5, "--edge-length")
    0.5
    """
    if value is None or (math.isfinite(value) and value > 0.0):
        return value
    raise GeometryError(f"{option} must be a number of {unit} above 0, got {value:g}")


def table_of_lengths(entries: Iterable[str] | None) -> dict[str | int, float]:
    """Return {selector: edge length [mm]} from ``FACES=MM`` entries; a bare number selects by index.

    Raises
    ------
    CadskinError
        An entry without ``=`` or without a number behind it.

    Examples
    --------
    >>> table_of_lengths([">Z=0.5", "3=0.2"])
    {'>Z': 0.5, 3: 0.2}
    """
    table: dict[str | int, float] = {}
    for entry in entries or ():
        faces, separator, length = entry.rpartition("=")
        try:
            number = float(length)
        except ValueError:
            separator = ""
        if not separator or not faces.strip():
            raise CadskinError(f"--edge-length-on takes FACES=MM, such as '>Z=0.5', got {entry!r}")
        positive(number, f"--edge-length-on {faces}")
        table[as_selector(faces)] = number
    return table


def as_selector(text: str) -> str | int:
    """Return a face selector from a word of the command line; a bare number is an index.

    Examples
    --------
    >>> as_selector("12"), as_selector(">Z")
    (12, '>Z')
    """
    text = text.strip()
    return int(text) if text.isdigit() else text
