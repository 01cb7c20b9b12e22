"""``cadskin mesh``: the nominal discrete shape, every triangle labelled with its face."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cadskin.cli._console import note, print_json, print_table
from cadskin.cli._options import (
    AllowOpen,
    Backend,
    CadFile,
    EdgeLength,
    EdgeLengthOn,
    Force,
    Format,
    Json,
    Part,
    Points,
    TimeLimit,
)
from cadskin.cli._reading import discretise
from cadskin.cli._targets import check_target, names_for_parts


def command(
    path: CadFile,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="OUT", help="Mesh file: .stl .ply .obj .3mf .glb .vtu .npz"),
    ],
    edge_length: EdgeLength = None,
    points: Points = None,
    edge_length_on: EdgeLengthOn = None,
    part: Part = None,
    backend: Backend = "cadskin",
    allow_open: AllowOpen = False,
    force: Force = False,
    format: Format = None,
    time_limit: TimeLimit = 300.0,
    json: Json = False,
) -> None:
    """Write the perfect part as a closed, labelled mesh.

    Every triangle knows its face (PLY, VTU, OBJ, NPZ). Several solids give one file each, named OUT_part.
    """
    kind = check_target(output, format=format, source=path)
    models = discretise(
        path,
        edge_length=edge_length,
        points=points,
        edge_length_on=edge_length_on,
        part=part,
        backend=backend,
        allow_open=allow_open,
        force=force,
        time_limit=time_limit,
    )
    names = [model.source.part or path.stem for model in models]
    files = names_for_parts(output, names)
    records = []
    for model, name, file in zip(models, names, files, strict=True):
        model.save(file, format=kind)
        for text in model.notes:
            note(f"{name}: {text}")
        records.append(
            {
                "part": name,
                "faces": len(model.faces),
                "points": model.surface.n_points,
                "triangles": model.surface.n_triangles,
                "watertight": model.closed,
                "failed_faces": model.failed_faces,
                "file": str(file),
            }
        )
    if json:
        print_json(records)
        return
    rows = [
        (r["part"], r["faces"], r["points"], r["triangles"], "yes" if r["watertight"] else "no", r["file"])
        for r in records
    ]
    columns = ("part", "faces", "points", "triangles", "watertight", "file")
    print_table("nominal mesh", columns, rows, right=("faces", "points", "triangles"))
