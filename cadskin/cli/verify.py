"""``cadskin verify``: whether a made part is within its tolerances."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, cast

import typer

from cadskin.cli._console import note, print_json, print_table, progress_bar
from cadskin.cli._options import Json, Part, SpecOfPart, TimeLimit


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
    align: Annotated[
        str | None,
        typer.Option(
            "--align",
            metavar="HOW",
            help="Bring a scan to the part first: robust, least_squares, minimum_zone or search.",
            show_default=False,
        ),
    ] = None,
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
    from cadskin.cli._scans import aligned
    from cadskin.errors import SpecificationError
    from cadskin.verify import Standard, Verification, verify
    from cadskin.verify.qif import write_qif
    from cadskin.verify.scans import labelled_scan, read_scan

    if standard not in ("ISO 5459:2011", "ASME Y14.5.1-2019"):
        raise SpecificationError(
            f"unknown standard {standard!r}; choose 'ISO 5459:2011' or 'ASME Y14.5.1-2019'"
        )
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
        scan = aligned(scan, nominal, align)
    made = labelled_scan(scan, nominal)
    with progress_bar("verifying") as progress:
        found = verify(
            made,
            given,
            nominal=nominal,
            standard=cast("Standard", standard),
            sections=sections,
            sizes=True,
            sampling=sampling,
            progress=progress,
        )
    table = cast("Verification", found)
    if csv is not None:
        csv.write_text(table.to_csv(), encoding="utf-8")
    if qif is not None:
        write_qif(qif, [table], given, nominal)
    if json:
        print_json(table.to_dict())
    else:
        columns = ("tolerance", "characteristic", "value", "limit", "verdict", "certified")
        print_table(f"{mesh.name} against {of.name}", columns, table.rows(), right=("value", "limit"))
        if sampling:
            missing = [found.details.get("sampling_shortfall", 0.0) for _, found in table.evaluations]
            note(f"between the points the surface probably adds up to {max(missing, default=0.0):.3g} mm")
        note("conforming" if table.conforming else "not conforming")
    return 0 if table.conforming else 1
