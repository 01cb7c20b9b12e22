"""``cadskin info``: what is in a CAD file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import typer

from cadskin.cli._console import note, print_json, print_table
from cadskin.cli._options import CadFile, Json, TimeLimit
from cadskin.cli._reading import describe

if TYPE_CHECKING:
    from cadskin.cad.description import FileDescription, PartDescription


def command(path: CadFile, json: Json = False, time_limit: TimeLimit = 300.0) -> None:
    """Show solids, faces, areas, units and tolerances (PMI)."""
    found = describe(path, time_limit=time_limit)
    if json:
        print_json(_as_data(found))
        return
    typer.echo(f"{found.name}: {found.kind.upper()}, lengths in {found.units}, shown in mm")
    if found.schema:
        typer.echo(f"schema: {found.schema}")
    typer.echo(f"tolerances (PMI): {_pmi(found)}")
    print_table(
        f"{len(found.parts)} part" + ("" if len(found.parts) == 1 else "s"),
        ("part", "kind", "faces", "features", "area mm²", "volume mm³", "size mm", "valid"),
        [_row(part) for part in found.parts],
        right=("faces", "features", "area mm²", "volume mm³"),
    )
    for part in found.parts:
        for text in part.notes:
            note(f"{part.name}: {text}")


def _pmi(found: FileDescription) -> str:
    if not found.has_pmi:
        return "none that a program can read"
    return f"{found.n_tolerances} geometric, {found.n_dimensions} dimensional, {found.n_datums} datums"


def _row(part: PartDescription) -> tuple[object, ...]:
    size = " × ".join(f"{side:.6g}" for side in part.bounds[1] - part.bounds[0])
    volume = "-" if part.volume is None else f"{part.volume:.6g}"
    kind = "solid" if part.solid else "open shell"
    valid = "yes" if part.valid else "no"
    return part.name, kind, len(part.faces), len(part.groups), f"{part.area:.6g}", volume, size, valid


def _as_data(found: FileDescription) -> dict[str, Any]:
    return {
        "file": found.name,
        "kind": found.kind,
        "units": found.units,
        "sha256": found.sha256,
        "schema": found.schema,
        "tolerances": found.n_tolerances,
        "dimensions": found.n_dimensions,
        "datums": found.n_datums,
        "parts": [
            {
                "name": part.name,
                "path": part.path,
                "solid": part.solid,
                "valid": part.valid,
                "faces": len(part.faces),
                "features": len(part.groups),
                "area_mm2": part.area,
                "volume_mm3": part.volume,
                "bounds_mm": part.bounds,
                "notes": part.notes,
            }
            for part in found.parts
        ],
    }
