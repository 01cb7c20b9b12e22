"""``cadskin convert``: a CAD part in, an as-made part out, with a picture beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cadskin.cli._console import note, print_json, print_table, progress_bar, status
from cadskin.cli._models import deviation_model, fresh_seed, process, rounded, seed_of_part
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
    Seed,
    SpecOfFile,
    TimeLimit,
    positive,
)
from cadskin.cli._reading import discretise, has_tolerances, say_what_is_compiled, tolerances_of
from cadskin.cli._targets import check_target, is_device, names_for_parts
from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from cadskin.shape import NominalModel
    from cadskin.skin import SkinModel
    from cadskin.spec import Specification

SIGMAS_PER_TOLERANCE = 8.0  # the zone ends at four sigma: almost every field fits


@dataclass(frozen=True)
class Request:
    """What is asked of every part.

    Parameters
    ----------
    tolerance : float or None
        Width of the profile zone [mm]; None for the tolerances of the part, or the general one by size.
    seed : int
    model : str or None
    sigma, length : float or None
        Parameters of the model [mm]; None for defaults by tolerance and size.
    """

    tolerance: float | None
    seed: int
    model: str | None
    sigma: float | None
    length: float | None


@dataclass(frozen=True)
class Made:
    """An as-made part, and what it keeps to.

    Parameters
    ----------
    skin : SkinModel
    width : float or None
        Of the profile zone [mm]; None where the part has tolerances of its own.
    tolerances : int
        Tolerances and sizes that were met.
    """

    skin: SkinModel
    width: float | None
    tolerances: int = 0


def command(
    path: CadFile,
    output: Annotated[
        Path,
        typer.Option("-o", "--output", metavar="OUT", help="Mesh file: .stl .ply .obj .3mf .glb .vtu .npz"),
    ],
    tolerance: Annotated[
        float | None,
        typer.Option(
            metavar="T",
            help="Every face stays within +-T/2 of nominal [mm] [default: the tolerances of SPEC or FILE; "
            "where there are none ISO 2768-2 class K by size].",
        ),
    ] = None,
    spec: SpecOfFile = None,
    seed: Seed = None,
    edge_length: EdgeLength = None,
    points: Points = None,
    edge_length_on: EdgeLengthOn = None,
    part: Part = None,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Deviation: field, noise, field:kernel=matern32, ... [default: field].",
            show_default=False,
        ),
    ] = None,
    sigma: Annotated[
        float | None, typer.Option(metavar="MM", help="Standard deviation of the model [default: T / 8].")
    ] = None,
    length: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Correlation length of the field [default: a fifth of the part]."),
    ] = None,
    picture: Annotated[bool, typer.Option(help="Write the picture OUT.png beside the mesh.")] = True,
    exaggeration: Annotated[
        float | None, typer.Option(metavar="X", help="Deviations in the picture times X [default: by size].")
    ] = None,
    backend: Backend = "cadskin",
    allow_open: AllowOpen = False,
    force: Force = False,
    format: Format = None,
    time_limit: TimeLimit = 300.0,
    json: Json = False,
) -> None:
    """Turn a CAD part into an as-made part: mesh and picture.

    A part with tolerances (PMI of the STEP file, or --spec) meets them all, as with `cadskin simulate -n 1`;
    with --tolerance T, or without any, every point of every face lies within +-T/2 of the nominal surface. A
    file with several solids gives one mesh per solid, named OUT_part; --part picks one. The same --seed gives
    the same files.
    """
    from cadskin.spec import read_spec

    kind = check_target(output, format=format, source=path)
    positive(exaggeration, "--exaggeration", unit="times")
    request = Request(
        tolerance=positive(tolerance, "--tolerance"),
        seed=fresh_seed() if seed is None else seed,
        model=model,
        sigma=positive(sigma, "--sigma"),
        length=positive(length, "--length"),
    )
    if tolerance is not None and spec is not None:
        raise SpecificationError("--tolerance and --spec exclude each other: give one of them")
    deviation_model(model or "field", sigma=sigma or 1.0, length=length or 1.0)  # said before the work
    given = None if spec is None else read_spec(spec)
    nominals = discretise(
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
    names = [nominal.source.part or path.stem for nominal in nominals]
    say_what_is_compiled("fields", "checks", *(["pictures"] if picture else []))
    if given is not None and len(nominals) > 1:
        raise SpecificationError(f"{path.name} has {len(nominals)} parts; choose one for {spec} with --part")
    records = []
    for nominal, name, file in zip(nominals, names, names_for_parts(output, names), strict=True):
        own = request.seed if part is None and len(nominals) == 1 else seed_of_part(request.seed, name)
        wanted = given
        if wanted is None and tolerance is None:
            wanted = tolerances_of(path, nominal, time_limit=time_limit)
        if wanted is not None and (spec is not None or has_tolerances(wanted)):
            made = _conforming(nominal, name, request, wanted, own)
        else:
            made = _in_zone(nominal, name, request)
        skin = made.skin
        skin.save(file, format=kind)
        files = [file]
        if picture and not is_device(file):
            files.append(_draw(skin, file, exaggeration=exaggeration))
        records.append(_record(made, name, request.seed, files))
    if json:
        print_json(records)
    else:
        _show(records, request)


def _conforming(nominal: NominalModel, name: str, request: Request, spec: Specification, seed: Any) -> Made:
    """Return the as-made part inside the tolerances of a specification."""
    from cadskin.conform import bound_part, simulate_conforming

    bound = bound_part(spec, nominal)
    with status(f"matching the process of {name} to its tolerances"):
        law = process(nominal, bound, request.model, sigma=request.sigma, length=request.length)
    with progress_bar(f"simulating {name}") as progress:
        skin = simulate_conforming(nominal, law, bound, rng=seed, progress=progress)[0]
    options = skin.provenance.options
    for remark in nominal.notes:
        note(f"{name}: {remark}")
    for item in options["unsupported"]:
        note(f"{name}: {item['tolerance']} plays no part: {item['reason']}")
    left_out = {item["tolerance"] for item in options["unsupported"]}
    return Made(skin, None, len(options["conform"].keys() - left_out))


def _in_zone(nominal: NominalModel, name: str, request: Request) -> Made:
    """Return the as-made part inside one profile zone all over."""
    from cadskin.skin import simulate_in_profile_zone
    from cadskin.spec.general import general_tolerance

    longest = float((nominal.surface.points.max(axis=0) - nominal.surface.points.min(axis=0)).max())
    width = request.tolerance or general_tolerance(longest)
    model = deviation_model(
        request.model or "field",
        sigma=request.sigma or width / SIGMAS_PER_TOLERANCE,
        length=request.length or rounded(longest / 5.0),
    )
    with progress_bar(f"simulating {name}") as progress:
        skin = simulate_in_profile_zone(
            nominal, model, width, rng=seed_of_part(request.seed, name), progress=progress
        )
    for text in nominal.notes:
        note(f"{name}: {text}")
    return Made(skin, width)


def _draw(skin: SkinModel, mesh_file: Path, *, exaggeration: float | None) -> Path:
    """Draw the picture beside the mesh."""
    options = {} if exaggeration is None else {"exaggeration": exaggeration}
    return skin.picture(mesh_file.with_suffix(".png"), **options)


def _record(made: Made, name: str, seed: int, files: list[Path]) -> dict[str, Any]:
    skin = made.skin
    surface, deviation = skin.surface, skin.deviation
    return {
        "part": name,
        "points": surface.n_points,
        "triangles": surface.n_triangles,
        "watertight": skin.closed,
        "deviation_min_mm": float(deviation.min()),
        "deviation_max_mm": float(deviation.max()),
        "tolerance_mm": made.width,
        "tolerances_met": made.tolerances,
        "model": skin.provenance.model,
        "seed": seed,
        "failed_faces": skin.nominal.failed_faces,
        "files": [str(file) for file in files],
    }


def _show(records: list[dict[str, Any]], request: Request) -> None:
    rows = [
        (
            record["part"],
            record["points"],
            record["triangles"],
            "yes" if record["watertight"] else "no",
            f"{record['deviation_min_mm']:+.4f} to {record['deviation_max_mm']:+.4f}",
            f"{record['tolerances_met']} met"
            if record["tolerance_mm"] is None
            else f"{record['tolerance_mm']:g}",
            " ".join(record["files"]),
        )
        for record in records
    ]
    columns = ("part", "points", "triangles", "watertight", "deviation mm", "tolerance mm", "files")
    title = f"{len(records)} part{'s'[: len(records) != 1]}, seed {request.seed}"
    print_table(title, columns, rows, right=("points", "triangles", "tolerance mm"))
    for model in dict.fromkeys(record["model"] for record in records):
        typer.echo(f"model: {model}, given that the part is within its tolerances")
    if request.tolerance is None and any(record["tolerance_mm"] is not None for record in records):
        typer.echo("tolerance: flatness of ISO 2768-2 class K by the longest side (choose one: --tolerance)")
