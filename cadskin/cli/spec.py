"""``cadskin spec``: the tolerances of a part, from its PMI or a spec file, as TOML, table or JSON."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cadskin.cli._console import note, print_json, print_table, status
from cadskin.cli._options import Json, Part, TimeLimit, positive
from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from cadskin.spec import Specification

_FILE = typer.Argument(
    metavar="FILE", help="STEP file with PMI (AP242), or a spec file (.toml).", show_default=False
)


def command(
    path: Annotated[Path, _FILE],
    table: Annotated[bool, typer.Option("--table", help="Feature control frames, faces, units.")] = False,
    json: Json = False,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="Write the spec file there.", show_default=False),
    ] = None,
    on: Annotated[
        Path | None,
        typer.Option(
            "--on",
            metavar="PART",
            help="Put a spec file onto this export of the part: faces are found again by what they are.",
            show_default=False,
        ),
    ] = None,
    picture: Annotated[
        Path | None,
        typer.Option(
            "--picture", metavar="PNG", help="Draw the faces of each tolerance.", show_default=False
        ),
    ] = None,
    part: Part = None,
    time_limit: TimeLimit = 300.0,
) -> int:
    """Show the tolerances of a part as a spec file to edit.

    What could not be tied to faces is listed with its reason; nothing is left out silently. With --on, exit
    code 1 says that some faces were not found again.
    """
    if table and json:
        raise SpecificationError("--table and --json exclude each other: give one of them")
    spec = _read(path, part, time_limit)
    refused = 0
    if on is not None:
        spec, refused = _reattached(spec, on, part, time_limit)
    if picture is not None:
        _draw(picture, spec, path if on is None else on, part, time_limit)
    if output is not None:
        from cadskin.spec import write_spec

        note(f"wrote {write_spec(output, spec)}")
    if json:
        print_json(spec.to_dict())
    elif table:
        _print_tables(spec)
    elif output is None and picture is None:
        sys.stdout.write(spec.to_toml())
    if not table and not json:
        for text in spec.notes:
            note(f"{path.name}: {text}")
        for item in spec.unresolved:
            note(f"{path.name} {item.entity} ({item.kind}) is unresolved: {item.reason}")
    return 1 if refused else 0


def _read(path: Path, part: str | None, time_limit: float) -> Specification:
    if path.suffix.lower() == ".toml":
        from cadskin.spec import read_spec

        return read_spec(path)
    from cadskin.cad import read_pmi

    with status(f"reading {path.name}"):
        return read_pmi(path, part, time_limit=_limit(time_limit))


def _reattached(
    spec: Specification, path: Path, part: str | None, time_limit: float
) -> tuple[Specification, int]:
    """Return the specification on another export, and how many faces were not found again."""
    from cadskin.cli._reading import describe
    from cadskin.spec import reattach

    found = describe(path, time_limit=time_limit)
    result = reattach(spec, {one.name: one.faces for one in found.parts if part in (None, one.name)})
    for name, old, new in result.moved:
        place = f" of {name}" if name else ""
        note(f"face {old}{place} has moved or changed its outline; it is face {new} now")
    for reason in result.refused:
        note(f"{path.name}: {reason}")
    note(f"{len(result.spec.fingerprints)} faces found again, {result.renumbered} with another number")
    return result.spec, len(result.refused)


def _draw(picture: Path, spec: Specification, path: Path, part: str | None, time_limit: float) -> None:
    from cadskin.cad import contained_nominals
    from cadskin.cli._spec_picture import draw_tolerances

    if path.suffix.lower() == ".toml":
        raise SpecificationError("--picture needs the part: give it with --on PART.step")
    options = {"allow_open": True} if part is None else {"allow_open": True, "part": part}
    with status(f"meshing {path.name}"):
        models = contained_nominals(path, options, time_limit=_limit(time_limit))
    bound = spec if any(t.feature.faces for t in spec) or len(models) > 1 else spec.bind(models[0])
    note(f"wrote {draw_tolerances(picture, bound, models)}")


def _limit(seconds: float) -> float | None:
    return None if seconds == 0 else positive(seconds, "--time-limit", unit="seconds")


def _print_tables(spec: Specification) -> None:
    from cadskin.spec.table import rows

    for title, heads, body in rows(spec):
        if body:
            print_table(f"{title} ({len(body)})", heads, body)
