"""``cadskin export``: meshes of the parts of a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cadskin.cli._console import print_json, print_table
from cadskin.cli._options import Format, Json
from cadskin.cli._targets import check_target
from cadskin.errors import SelectionError, SpecificationError

if TYPE_CHECKING:
    from cadskin.export import Run
    from cadskin.skin import SkinModel


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
    certificate: Annotated[
        bool, typer.Option("--certificate", help="Write OUT.certificate.json beside each mesh.")
    ] = False,
    format: Format = None,
    json: Json = False,
) -> None:
    """Write parts of a run as meshes.

    Several get their numbers in the file names.
    """
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
        if certificate:
            _certify(opened, skin, file)
        records.append({"part": number, "watertight": skin.closed, "file": str(file)})
    if json:
        print_json(records)
        return
    rows = [(r["part"], "yes" if r["watertight"] else "no", r["file"]) for r in records]
    print_table(f"{len(rows)} of {len(opened)} parts", ("part", "watertight", "file"), rows, right=("part",))


def _certify(run: Run, skin: SkinModel, mesh: Path) -> None:
    """Write the certificate of a part beside its mesh."""
    import json

    from cadskin.conform.certificate import certificate_of
    from cadskin.export import write_text

    if run.spec is None:
        raise SpecificationError(f"{run.folder} was made without tolerances; there is nothing to certify")
    text = json.dumps(certificate_of(skin, run.spec), indent=1, ensure_ascii=False)
    write_text(mesh.with_suffix(".certificate.json"), text + "\n")
