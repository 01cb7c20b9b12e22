"""``cadskin measure``: from a scan to deviations of the CAD part, and to its tolerances."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast, get_args

import typer

from cadskin.cli._console import note, print_json, print_table, progress_bar
from cadskin.cli._options import EdgeLength, Json, Part, SpecOfPart, TimeLimit, as_selector
from cadskin.errors import SpecificationError, StatisticsError

if TYPE_CHECKING:
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification
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
    align: Annotated[
        str,
        typer.Option(
            help="none, datum_frame, least_squares, minimum_zone or robust. A best fit takes off what a "
            "position or orientation tolerance is about.",
            show_default=False,
        ),
    ],
    on: Annotated[
        list[str] | None,
        typer.Option(
            "--on",
            metavar="FACES",
            help="Align on these faces only; repeat for the datums of datum_frame, the primary first "
            "[default: the whole part, or the first datum system of the tolerances].",
            show_default=False,
        ),
    ] = None,
    search: Annotated[
        bool, typer.Option("--search", help="Look through all rotations: the scan lies anywhere.")
    ] = False,
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
    from cadskin.stats import Alignment, measure, register

    for value, choices, option in ((align, Alignment, "--align"), (unit, Unit, "--unit")):
        if value not in get_args(choices):
            raise SpecificationError(f"{option} must be one of {', '.join(get_args(choices))}, got {value!r}")
    cloud = read_points(scan, unit=cast("Any", unit))
    nominal, tolerances = nominal_and_spec(
        of, spec, part=part, edge_length=edge_length, time_limit=time_limit
    )
    with progress_bar(f"aligning {scan.name}") as progress:
        found = register(
            cloud.points,
            nominal,
            alignment=cast("Any", align),
            features=_features(on, align, tolerances, nominal),
            start="search" if search else None,
            probe_radius=probe_radius,
            progress=progress,
        )
    made = measure(cloud.points, nominal, motion=found, probe_radius=probe_radius)
    table = _verified(made, tolerances) if has_tolerances(tolerances) else None
    if output is not None:
        made.save(output)
    if picture is not None:
        made.picture(picture, title=f"{scan.name} against {of.name}")
    if json:
        print_json(_plain(made, found, table))
    else:
        _print(scan, of, made, found, table)
    return 0 if table is None or table.conforming else 1


def _features(on: list[str] | None, align: str, tolerances: Specification, nominal: NominalModel) -> Any:
    """Return what the alignment is made on: as given, or the first datum system of most references."""
    from cadskin.spec.binding import bound_to

    if on:
        chosen = [as_selector(faces) for faces in on]
        return chosen if align == "datum_frame" else chosen[0] if len(chosen) == 1 else chosen
    if align != "datum_frame":
        return None
    bound = bound_to(tolerances, nominal)
    systems = [tolerance.datums.references for tolerance in bound if tolerance.datums.references]
    if systems:
        chosen_system = max(systems, key=len)
        faces = [
            [face for letter in reference.letters for face in bound.datum(letter).feature.faces]
            for reference in chosen_system
        ]
        if all(faces):
            return faces
    raise SpecificationError(
        "--align datum_frame needs datums: no tolerance of the part names any; give --on FACES for each"
    )


def _verified(made: MeasuredPart, tolerances: Specification) -> Verification:
    from cadskin.verify import Verification, verify

    with progress_bar("verifying") as progress:
        found = verify(made.measured_surface, tolerances, nominal=made.nominal, sizes=True, progress=progress)
    if not isinstance(found, Verification):
        raise StatisticsError("one part gave several tables; please report this")
    return found


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
    import numpy as np

    turn, shift = np.degrees(found.motion.angle), found.motion.translation
    spread = 1000 * np.sqrt(np.diag(found.covariance)[:3])
    note(
        f"{len(made.faces)} points, {int(made.outliers.sum())} set aside, {100 * made.coverage:.0f} % of the "
        f"part measured; alignment {found.alignment}: turned by {turn:.3f}°, moved by "
        f"({shift[0]:.4f}, {shift[1]:.4f}, {shift[2]:.4f}) mm, known to "
        f"({spread[0]:.2f}, {spread[1]:.2f}, {spread[2]:.2f}) µm from the scatter of the points alone"
    )
    columns = ("feature", "kind", "measured", "mean µm", "rms µm", "min µm", "max µm")
    print_table(f"{scan.name} against {of.name}", columns, _rows(made), right=columns[2:])
    if table is not None:
        head = ("tolerance", "characteristic", "value", "limit", "verdict", "certified")
        print_table("tolerances", head, table.rows(), right=("value", "limit"))
        note("conforming" if table.conforming else "not conforming")


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
