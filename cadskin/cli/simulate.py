"""``cadskin simulate``: as-made parts that meet their tolerances, into a run folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cadskin.cli._console import note, print_json, print_table, progress_bar, status
from cadskin.cli._models import deviation_model, fresh_seed, process
from cadskin.cli._options import (
    AllowOpen,
    Backend,
    CadFile,
    EdgeLength,
    EdgeLengthOn,
    Force,
    Json,
    Part,
    Points,
    Seed,
    SpecOfFile,
    TimeLimit,
    positive,
)
from cadskin.cli._reading import general_profile, has_tolerances, nominal_and_spec, say_what_is_compiled
from cadskin.errors import ExportError, SpecificationError

if TYPE_CHECKING:
    from cadskin.export.runs import Run


def command(
    path: CadFile,
    output: Annotated[
        Path, typer.Option("-o", "--output", metavar="RUN", help="Folder; an unfinished run there goes on.")
    ],
    count: Annotated[int, typer.Option("-n", "--count", metavar="N", min=1, help="Number of parts.")] = 1,
    seed: Seed = None,
    spec: SpecOfFile = None,
    conform: Annotated[
        str,
        typer.Option(
            metavar="HOW",
            help="conditioned (the law given that all tolerances are met), scale, reject, none, or ID=MM for "
            "the value that a tolerance takes; several with commas.",
        ),
    ] = "conditioned",
    zone: Annotated[
        str,
        typer.Option(metavar="ZONE", help="Of flatness: minimum (ISO 1101), or pca (Zhang et al. 2013)."),
    ] = "minimum",
    cpk: Annotated[
        float | None,
        typer.Option(
            metavar="C", help="Process capability: sets the standard deviations.", show_default=False
        ),
    ] = None,
    model: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Deviation: field, noise, field:kernel=matern32, ... [default: a field whose standard "
            "deviations follow from the tolerances].",
            show_default=False,
        ),
    ] = None,
    sigma: Annotated[
        float | None, typer.Option(metavar="MM", help="Standard deviation of --model.", show_default=False)
    ] = None,
    length: Annotated[
        float | None,
        typer.Option(metavar="MM", help="Correlation length [default: a fifth of the part]."),
    ] = None,
    max_tries: Annotated[
        int, typer.Option(metavar="N", min=1, help="Fields per feature before the sampler is changed.")
    ] = 200,
    workers: Annotated[
        int, typer.Option(metavar="N", min=1, help="Processes that draw parts; the bits are the same.")
    ] = 1,
    edge_length: EdgeLength = None,
    points: Points = None,
    edge_length_on: EdgeLengthOn = None,
    part: Part = None,
    backend: Backend = "cadskin",
    allow_open: AllowOpen = False,
    force: Force = False,
    time_limit: TimeLimit = 300.0,
    json: Json = False,
) -> None:
    """Simulate parts inside all their tolerances at once.

    A STEP file with PMI needs no further option.

    Part i depends on the seed and on i alone. The folder holds the specification, the nominal model, the
    deviations and a table of all values; `cadskin verify RUN` evaluates it again, `cadskin export RUN` writes
    meshes.
    """
    from cadskin.conform import bound_part
    from cadskin.export.runs import simulate_run

    _refuse(output, positive(cpk, "--cpk", unit="(Cpk)"), model, sigma)
    length = positive(length, "--length")
    policies = _in_zone(_policies(conform), zone)
    if model is not None:
        deviation_model(model, sigma=sigma or 1.0, length=length or 1.0)  # said before the work
    nominal, tolerances = nominal_and_spec(
        path,
        spec,
        edge_length=edge_length,
        points=points,
        edge_length_on=edge_length_on,
        part=part,
        backend=backend,
        allow_open=allow_open,
        force=force,
        time_limit=time_limit,
    )
    if spec is None and not has_tolerances(tolerances):
        tolerances, width = general_profile(nominal)
        note(
            f"{path.name} has no tolerances and no --spec is given: every face gets a profile of {width:g} mm"
        )
    say_what_is_compiled("fields", "checks")
    bound = bound_part(tolerances, nominal)
    with status("matching the process to the tolerances"):
        law = process(nominal, bound, model, sigma=sigma, length=length, cpk=cpk)
    options = {
        "file": path.name,
        "spec": None if spec is None else spec.name,
        "model": model or "by the tolerances",
        "cpk": cpk,
        "conform": conform,
        "zone": zone,
    }
    with progress_bar(f"simulating {path.name}") as progress:
        run = simulate_run(
            output,
            nominal,
            law,
            bound,
            size=count,
            rng=fresh_seed() if seed is None else seed,
            conform=policies,
            max_tries=max_tries,
            workers=workers,
            options=options,
            progress=progress,
        )
    if json:
        print_json(_record(run))
    else:
        _show(run)


def _refuse(output: Path, cpk: float | None, model: str | None, sigma: float | None) -> None:
    if output.exists() and not output.is_dir():
        raise ExportError(f"{output} is a file; a run is a folder, name another one")
    if not output.resolve().parent.is_dir():
        raise ExportError(f"{output}: there is no folder {output.resolve().parent}; make it first")
    if cpk is not None and model is not None:
        raise SpecificationError("--cpk sets the standard deviations of the default field; leave out --model")
    if model is not None and positive(sigma, "--sigma") is None and "sigma=" not in model:
        raise SpecificationError(f"--model {model} needs --sigma, or leave out --model")
    if sigma is not None and model is None:
        raise SpecificationError("--sigma is for a --model; without one it follows from the tolerances")


def _policies(text: str) -> Any:
    """Return the policies of ``conditioned`` or of ``#27=0.02,#31=none,*=conditioned``."""
    from cadskin.conform import Conformity, target

    if "=" not in text:
        if text == "target":
            raise SpecificationError("--conform target needs values: --conform 'flatness-1=0.02'")
        return Conformity(text)  # type: ignore[arg-type]
    found: dict[str, Conformity] = {}
    for word in text.split(","):
        name, _, value = (piece.strip() for piece in word.partition("="))
        try:
            found[name] = target(float(value))
        except ValueError as error:
            if isinstance(error, SpecificationError):
                raise
            found[name] = Conformity(value)  # type: ignore[arg-type]
    return found


def _in_zone(policies: Any, zone: str) -> Any:
    """Return the policies with another zone of flatness."""
    from dataclasses import replace

    from cadskin.conform import Conformity

    if isinstance(policies, Conformity):
        return replace(policies, zone=zone)  # type: ignore[arg-type]  # it checks the name
    return {name: replace(policy, zone=zone) for name, policy in ({"*": Conformity()} | policies).items()}


def _record(run: Run) -> dict[str, Any]:
    values, about = run.values, run.about
    return {
        "run": str(run.folder),
        "parts": len(run),
        "seed": about["provenance"]["seed"],
        "model": about["provenance"]["model"],
        "samplers": sorted({name for chunk in about["chunks"] for name in chunk["samplers"]}),
        "acceptance": min(chunk["acceptance"] for chunk in about["chunks"]),
        "tolerances": [
            {
                **item,
                "largest": float(values[:, k].max()),
                "within": int((values[:, k] <= item["limit"]).sum()),
            }
            for k, item in enumerate(about["tolerances"])
        ],
        "unsupported": about["unsupported"],
    }


def _show(run: Run) -> None:
    record = _record(run)
    rows = [
        (
            item["tolerance"],
            item["characteristic"],
            f"{item['limit']:.6g}",
            f"{item['largest']:.6g}",
            f"{item['within']} of {record['parts']}",
        )
        for item in record["tolerances"]
    ]
    columns = ("tolerance", "characteristic", "limit mm", "largest mm", "within")
    title = f"{record['parts']} parts in {record['run']}, seed {record['seed'][0]}"
    print_table(title, columns, rows, right=("limit mm", "largest mm", "within"))
    typer.echo(f"model: {record['model']}")
    typer.echo(f"samplers: {', '.join(record['samplers']) or 'none'}; acceptance {record['acceptance']:.3g}")
    for item in record["unsupported"]:
        note(f"{item['tolerance']} plays no part: {item['reason']}")
