"""``cadskin export``: meshes of the parts of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cadskin.cli._console import print_json, print_table
from cadskin.cli._options import Format, Json
from cadskin.cli._targets import check_target
from cadskin.errors import SelectionError


def command(
    run: Annotated[
        Path, typer.Argument(metavar="RUN", help="Folder that simulate wrote.", show_default=False)
    ],
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="OUT", help="Mesh file: .stl .ply .obj .3mf .glb .vtu .npz"),
    ],
    only: Annotated[
        list[int] | None,
        typer.Option(
            "--only",
            metavar="I",
            help="Number of the part, from 0; may be repeated [default: all].",
            show_default=False,
        ),
    ] = None,
    format: Format = None,
    json: Json = False,
) -> None:
    """Write parts of a run as meshes; several get their numbers in the file names."""
    from cadskin.export import open_run

    opened = open_run(run)
    kind = check_target(output, format=format, source=run)
    numbers = only if only else list(range(len(opened)))
    wrong = [number for number in numbers if not 0 <= number < len(opened)]
    if wrong:
        raise SelectionError(f"{run} has parts 0 to {len(opened) - 1}, not {wrong[0]}")
    records = []
    for number in numbers:
        file = output
        if len(numbers) > 1:
            file = output.with_name(f"{output.stem}_{number:05d}{output.suffix}")
        skin = opened[number]
        skin.save(file, format=kind)
        records.append({"part": number, "watertight": skin.closed, "file": str(file)})
    if json:
        print_json(records)
        return
    rows = [(r["part"], "yes" if r["watertight"] else "no", r["file"]) for r in records]
    print_table(f"{len(rows)} of {len(opened)} parts", ("part", "watertight", "file"), rows, right=("part",))
