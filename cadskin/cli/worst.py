"""``cadskin worst``: the conforming part that makes a measure largest."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cadskin.cli._console import note, print_json
from cadskin.cli._options import CadFile, EdgeLength, Json, Part, Points, SpecOfFile, TimeLimit
from cadskin.cli._reading import nominal_and_spec
from cadskin.cli._targets import check_target


def command(
    path: CadFile,
    measure: Annotated[
        str,
        typer.Option(
            metavar="EXPR",
            help="volume, mean(FACES), gap(FACES, FACES), tilt(FACES) or distance(x y z, x y z); "
            "a minus turns it round.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="OUT", help="Mesh file of the part.", show_default=False),
    ] = None,
    spec: SpecOfFile = None,
    edge_length: EdgeLength = None,
    points: Points = None,
    part: Part = None,
    time_limit: TimeLimit = 300.0,
    json: Json = False,
) -> None:
    """Find the part at the edge of its tolerances.

    Datum features keep their nominal shape.
    """
    from cadskin.conform.measures import measure as weights_of
    from cadskin.conform.worst import worst_part

    kind = None if output is None else check_target(output, format=None, source=path)
    nominal, tolerances = nominal_and_spec(
        path, spec, edge_length=edge_length, points=points, part=part, time_limit=time_limit
    )
    found = worst_part(nominal, tolerances, weights_of(measure, nominal))
    if output is not None and kind is not None:
        found.skin.save(output, format=kind)
    for name, reason in found.left_out:
        note(f"{name} was not used as a zone: {reason}")
    if json:
        print_json(
            {
                "measure": measure,
                "value": found.value,
                "left_out": [{"tolerance": name, "reason": reason} for name, reason in found.left_out],
                "file": None if output is None else str(output),
            }
        )
    else:
        typer.echo(f"{measure} = {found.value:.9g} at most")
