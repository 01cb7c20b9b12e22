"""``cadskin measure``: from a scan to deviations of the CAD part, and to its tolerances."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast, get_args

import typer

from cadskin.cli._console import note, print_json, print_table
from cadskin.cli._options import EdgeLength, Json, Part, SpecOfPart, TimeLimit
from cadskin.cli._scans import Align, AlignOn, Search, aligned, check_alignment, say_alignment
from cadskin.cli._verdicts import exit_code, print_verification, verified
from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from cadskin.stats import MeasuredPart, Registration
    from cadskin.verify import Verification


def command(
    scan: Annotated[
        Path,
        typer.Argument(metavar="SCAN", help="Scan: PLY, STL, XYZ, CSV, ASC, PTS.", show_default=False),
    ],
    of: Annotated[
        Path, typer.Option("--of", metavar="PART", help="CAD file of the part.", show_default=False)
    ],
    align: Align,
    on: AlignOn = None,
    search: Search = False,
    unit: Annotated[str, typer.Option(help="Unit of the scan: mm, um, cm, m or inch.")] = "mm",
    probe_radius: Annotated[
        float, typer.Option(metavar="MM", help="The points are centres of a probe ball.")
    ] = 0.0,
    spec: SpecOfPart = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Write the measured triangles with face labels (.npz, .ply, .stl ...), for `verify`.",
            show_default=False,
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", metavar="PNG", help="Draw the deviation.", show_default=False),
    ] = None,
    edge_length: EdgeLength = None,
    part: Part = None,
    json: Json = False,
    time_limit: TimeLimit = 300.0,
) -> int:
    """Align a scan with its CAD part; deviations, verdicts.

    Scale is never changed. What the scan does not show stays "not measured", and a tolerance on it is listed
    as not evaluated. With tolerances the exit code is 1 when the part does not conform. Deviations are read
    by a robust plane around each sample, so that single points of noise do not count.
    """
    from cadskin.cad.measured.points import Unit, read_points
    from cadskin.cli._reading import has_tolerances, nominal_and_spec
    from cadskin.stats import measure

    check_alignment(align)
    if unit not in get_args(Unit):
        raise SpecificationError(f"--unit must be one of {', '.join(get_args(Unit))}, got {unit!r}")
    cloud = read_points(scan, unit=cast("Any", unit))
    nominal, tolerances = nominal_and_spec(
        of, spec, part=part, edge_length=edge_length, time_limit=time_limit
    )
    found = aligned(cloud.points, nominal, tolerances, align, on=on, search=search, probe_radius=probe_radius)
    made = measure(cloud.points, nominal, motion=found, probe_radius=probe_radius)
    table = None
    if has_tolerances(tolerances):
        table = verified(made.measured_surface, tolerances, nominal)
    if output is not None:
        made.save(output)
    if picture is not None:
        made.picture(picture, title=f"{scan.name} against {of.name}")
    if json:
        print_json(_plain(made, found, table))
    else:
        _print(scan, of, made, found, table)
    return exit_code(table is None or table.conforming)


def _rows(made: MeasuredPart) -> list[tuple[str, ...]]:
    import numpy as np

    out = []
    for feature in made.nominal.features:
        values = made.deviation[feature.rows]
        known = values[np.isfinite(values)]
        share = f"{100 * len(known) / max(len(values), 1):.0f} %"
        if len(known):
            numbers = (known.mean(), np.sqrt((known**2).mean()), known.min(), known.max())
            out.append((feature.name, feature.kind, share, *(f"{1000 * value:+.1f}" for value in numbers)))
        else:
            out.append((feature.name, feature.kind, share, "", "", "", ""))
    return out


def _print(scan: Path, of: Path, made: MeasuredPart, found: Registration, table: Verification | None) -> None:
    note(
        f"{len(made.faces)} points, {int(made.outliers.sum())} set aside, {100 * made.coverage:.0f} % of the "
        "part measured"
    )
    say_alignment(found)
    columns = ("feature", "kind", "measured", "mean µm", "rms µm", "min µm", "max µm")
    print_table(f"{scan.name} against {of.name}", columns, _rows(made), right=columns[2:])
    if table is not None:
        print_verification("tolerances", table)


def _plain(made: MeasuredPart, found: Registration, table: Verification | None) -> dict[str, Any]:
    keys = ("feature", "kind", "measured", "mean_um", "rms_um", "min_um", "max_um")
    return {
        "points": len(made.faces),
        "outliers": int(made.outliers.sum()),
        "coverage": made.coverage,
        "alignment": found.alignment,
        "rotation": found.motion.rotation.tolist(),
        "translation": found.motion.translation.tolist(),
        "covariance": found.covariance.tolist(),
        "notes": list(found.notes),
        "features": [dict(zip(keys, row, strict=True)) for row in _rows(made)],
        "verification": None if table is None else table.to_dict(),
    }
