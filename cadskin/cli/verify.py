"""``cadskin verify``: whether a made part is within its tolerances."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated, cast

import typer

from cadskin.cli._console import note, print_json
from cadskin.cli._options import Json, Part, SpecOfPart, TimeLimit
from cadskin.cli._scans import AlignOn, AlignOrNot, Search, aligned, check_alignment, say_alignment
from cadskin.cli._verdicts import exit_code, print_verification, verified


def command(
    mesh: Annotated[
        Path,
        typer.Argument(
            metavar="MESH",
            help="Made part or scan (.npz, .ply, .stl, .csv, .xyz), a run folder, or measured parts (.qif).",
            show_default=False,
        ),
    ],
    of: Annotated[
        Path | None,
        typer.Option("--of", metavar="PART", help="CAD file of the nominal part.", show_default=False),
    ] = None,
    spec: SpecOfPart = None,
    standard: Annotated[
        str, typer.Option(help="Datum associations: 'ISO 5459:2011' or 'ASME Y14.5.1-2019'.")
    ] = "ISO 5459:2011",
    sections: Annotated[int, typer.Option(help="Sections, lines or circles of a feature.")] = 15,
    csv: Annotated[
        Path | None,
        typer.Option("--csv", metavar="FILE", help="Also write the table there.", show_default=False),
    ] = None,
    qif: Annotated[
        Path | None,
        typer.Option("--qif", metavar="FILE", help="Also write QIF 3.0 results there.", show_default=False),
    ] = None,
    sampling: Annotated[
        bool,
        typer.Option(
            "--sampling",
            help="Also estimate what the surface between the points adds.",
        ),
    ] = False,
    align: AlignOrNot = None,
    on: AlignOn = None,
    search: Search = False,
    json: Json = False,
    part: Part = None,
    time_limit: TimeLimit = 300.0,
) -> int:
    """Evaluate every tolerance on a made part.

    The exit code is 1 when it does not conform.

    The values are those of the points of the mesh. A tolerance that could not be evaluated is listed with the
    reason, and the part then does not count as conforming.
    """
    from cadskin.cli._reading import has_tolerances, nominal_and_spec
    from cadskin.errors import SpecificationError
    from cadskin.verify import Standard
    from cadskin.verify.qif import write_qif
    from cadskin.verify.scans import labelled_scan, read_scan

    if standard not in ("ISO 5459:2011", "ASME Y14.5.1-2019"):
        raise SpecificationError(
            f"unknown standard {standard!r}; choose 'ISO 5459:2011' or 'ASME Y14.5.1-2019'"
        )
    check_alignment(align, on=on, search=search)
    if align is not None and (mesh.is_dir() or mesh.suffix.lower() == ".qif"):
        raise SpecificationError(f"--align is for a mesh or a scan; {mesh.name} holds nothing to be aligned")
    if mesh.is_dir():
        from cadskin.cli._verify_run import verify_run

        chosen = cast("Standard", standard)
        return verify_run(mesh, spec, standard=chosen, sections=sections, csv=csv, qif=qif, json=json)
    if mesh.suffix.lower() == ".qif":
        from cadskin.cli._verify_qif import verify_qif

        return verify_qif(mesh, json=json)
    if of is None:
        raise SpecificationError(f"{mesh.name} is a mesh: name the CAD file of its nominal part with --of")
    scan = read_scan(mesh)
    nominal, given = nominal_and_spec(of, spec, part=part, time_limit=time_limit)
    if not has_tolerances(given):
        raise SpecificationError(f"{spec or of} holds no tolerances; give a spec file with --spec")
    if align is not None:
        found = aligned(scan.points, nominal, given, align, on=on, search=search)
        say_alignment(found)
        scan = replace(scan, points=found.motion.apply(scan.points))
    made = labelled_scan(scan, nominal)
    table = verified(made, given, nominal, standard=standard, sections=sections, sampling=sampling)
    if csv is not None:
        csv.write_text(table.to_csv(), encoding="utf-8")
    if qif is not None:
        write_qif(qif, [table], given, nominal)
    if json:
        print_json(table.to_dict())
    else:
        if sampling:
            missing = [found.details.get("sampling_shortfall", 0.0) for _, found in table.evaluations]
            note(f"between the points the surface probably adds up to {max(missing, default=0.0):.3g} mm")
        print_verification(f"{mesh.name} against {of.name}", table)
    return exit_code(table.conforming)
