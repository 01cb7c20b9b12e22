"""``cadskin faces``: the faces of a CAD file, to pick them by."""

from __future__ import annotations

import csv as csv_module
import sys
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cadskin.cli._console import print_json, print_table
from cadskin.cli._options import CadFile, Json, Part, TimeLimit, as_selector
from cadskin.cli._reading import describe
from cadskin.errors import GeometryError

if TYPE_CHECKING:
    from cadskin.cad.description import FileDescription, PartDescription
    from cadskin.shape import Face

COLUMNS = (
    "face",
    "feature",
    "surface",
    "area mm²",
    "centre mm",
    "normal",
    "radius mm",
    "name",
    "colour",
    "#",
)


def command(
    path: CadFile,
    part: Part = None,
    select: Annotated[
        str | None,
        typer.Option("--select", metavar="FACES", help='Only these: ">Z", "%CYLINDER", "3", a name.'),
    ] = None,
    json: Json = False,
    csv: Annotated[bool, typer.Option("--csv", help="Comma-separated values.")] = False,
    time_limit: TimeLimit = 300.0,
) -> None:
    """List the faces: surface, area, centre, normal, radius, name.

    The number in the first column, the name, #entity and rules such as ">Z" or "%CYLINDER" pick faces.
    """
    found = describe(path, time_limit=time_limit)
    chosen = [(one, _selected(one, select)) for one in _parts(found, part)]
    records = [_record(one, face) for one, faces in chosen for face in faces]
    if json:
        print_json(records)
    elif csv:
        _print_csv(records)
    else:
        for one, faces in chosen:
            title = f"{one.name}: {len(faces)} of {len(one.faces)} faces, {len(one.groups)} features"
            rows = [_row(_record(one, face)) for face in faces]
            print_table(title, COLUMNS, rows, right=("face", "feature", "area mm²", "radius mm"))


def _parts(found: FileDescription, name: str | None) -> tuple[PartDescription, ...]:
    if name is None:
        return found.parts
    parts = tuple(part for part in found.parts if part.name == name)
    if not parts:
        names = ", ".join(part.name for part in found.parts)
        raise GeometryError(f"{found.name} has no part {name!r}; it has {names}")
    return parts


def _selected(part: PartDescription, select: str | None) -> tuple[Face, ...]:
    if select is None:
        return part.faces
    from cadskin.shape.selectors import select_faces

    return tuple(part.faces[index] for index in select_faces(part.faces, as_selector(select)))


def _record(part: PartDescription, face: Face) -> dict[str, Any]:
    return {
        "part": part.name,
        "face": face.index,
        "feature": next(number for number, group in enumerate(part.groups) if face.index in group),
        "surface": face.kind,
        "internal": face.internal,
        "area_mm2": face.area,
        "centre_mm": face.centre.tolist(),
        "normal": face.normal.tolist(),
        "radius_mm": face.radius,
        "name": face.name,
        "colour": face.colour,
        "step_id": face.step_id,
    }


def _row(record: dict[str, Any]) -> tuple[object, ...]:
    surface = record["surface"] + (" (inside)" if record["internal"] else "")
    radius = "" if record["radius_mm"] is None else f"{record['radius_mm']:.6g}"
    step_id = "" if record["step_id"] is None else f"#{record['step_id']}"
    return (
        record["face"],
        record["feature"],
        surface,
        f"{record['area_mm2']:.6g}",
        _triple(record["centre_mm"], "{:.2f}"),
        _triple(record["normal"], "{:+.3f}"),
        radius,
        record["name"] or "",
        record["colour"] or "",
        step_id,
    )


def _triple(values: list[float], form: str) -> str:
    return " ".join(form.format(value + 0.0 if abs(value) >= 5e-7 else 0.0) for value in values)


def _print_csv(records: list[dict[str, Any]]) -> None:
    columns = ["part", "face", "feature", "surface", "internal", "area_mm2"]
    columns += [f"{what}_{axis}" for what in ("centre", "normal") for axis in "xyz"]
    columns += ["radius_mm", "name", "colour", "step_id"]
    writer = csv_module.writer(sys.stdout, lineterminator="\n")
    writer.writerow(columns)
    for record in records:
        triples = {
            f"{what}_{axis}": value
            for what, key in (("centre", "centre_mm"), ("normal", "normal"))
            for axis, value in zip("xyz", record[key], strict=True)
        }
        flat = {**record, **triples}
        writer.writerow(["" if flat[column] is None else flat[column] for column in columns])
