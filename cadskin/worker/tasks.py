"""The tasks: what the worker can do for the client."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from cadskin._progress import report
from cadskin.errors import CadskinWarning, GeometryError, SpecificationError
from cadskin.worker import PROTOCOL
from cadskin.worker.channel import Stage
from cadskin.worker.parts import PartMemory
from cadskin.worker.request import Request, RequestError
from cadskin.worker.results import corner_deviation, instance_report, versions, write_json, write_skin
from cadskin.worker.tables import specification_from_tables, tables_of_specification

if TYPE_CHECKING:
    from cadskin.conform import Conformity
    from cadskin.shape import NominalModel
    from cadskin.skin import SkinEnsemble
    from cadskin.spec import Specification

__all__ = ["TASKS", "Context", "run_task"]


@dataclass
class Context:
    """What a task has besides its request.

    Parameters
    ----------
    stage : Stage
    parts : PartMemory
    """

    stage: Stage
    parts: PartMemory = field(default_factory=PartMemory)


def run_task(request: Request, context: Context) -> dict[str, Any]:
    """Do what a request asks for, write ``result.json`` and return what the message of success says.

    Raises
    ------
    RequestError
        There is no such task.
    CadskinError
        As from the task.
    """
    if request.task not in TASKS:
        raise RequestError(f"no task is called {request.task!r}; there are {', '.join(TASKS)}")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", CadskinWarning)
        result = TASKS[request.task](request, context)
    told = [str(item.message) for item in caught if issubclass(item.category, CadskinWarning)]
    result = {
        "protocol": PROTOCOL,
        "task": request.task,
        "job": request.job,
        **result,
        "warnings": [*result.get("warnings", []), *dict.fromkeys(told)],
        "versions": versions(),
    }
    write_json(request.folder / "result.json", result)
    return {"result": "result.json", "warnings": result["warnings"]}


# -- simulate --------------------


def _simulate(request: Request, context: Context) -> dict[str, Any]:
    from cadskin.conform import bound_part, process_of, simulate_conforming

    size = request.count("size", 1, least=1)
    seed = request.count("seed", 0)
    spec, said = _specification(request)
    policies = _policies(request.options.get("conform", "conditioned"))
    nominal = context.parts.nominal(request, context.stage(0.0, 0.4, "meshing the part"))
    bound = _bound(spec, nominal)
    fitting = context.stage(0.4, 0.5, "matching the process to the tolerances")
    report(fitting, 0, 1)
    checked = bound_part(bound, nominal)
    model = process_of(nominal, checked, length=request.positive("correlation_length"))
    report(fitting, 1, 1)
    lot = simulate_conforming(
        nominal,
        model,
        checked,
        size=size,
        rng=seed,
        conform=policies,
        progress=context.stage(0.5, 0.8, "drawing parts"),
    )
    corners = write_skin(request.folder, lot)
    instances = _verified(lot, bound, corners, context)
    return {
        "part": _part_record(nominal),
        "edge_length": nominal.source.edge_length,
        "seed": seed,
        "size": size,
        "model": str(model),
        "instances": instances,
        "unresolved": _unresolved(lot, bound),
        "conform": lot.provenance.options.get("conform", {}),
        "samplers": lot.provenance.options.get("samplers", []),
        "acceptance": lot.provenance.options.get("acceptance"),
        "warnings": [*said, *nominal.notes],
    }


def _specification(request: Request) -> tuple[Specification, list[str]]:
    """Return the specification of a request, and what has to be said about it."""
    from cadskin.spec import parse_spec

    text = request.text("spec_toml")
    if text is not None:
        return parse_spec(text, name="spec"), []
    general = request.options.get("general")
    tables = request.tables("tolerances")
    if general is not None and not isinstance(general, dict):
        raise RequestError(f"general must be a table, got {general!r}")
    return specification_from_tables(
        tables, request.tables("datums"), general, request.tables("dimensions")
    ), []


def _bound(spec: Specification, nominal: NominalModel) -> Specification:
    """Return the specification on the faces of the part; a general tolerance by size where it is empty."""
    from cadskin.spec import Specification, tolerance
    from cadskin.spec.general import general_tolerance

    if not len(spec) and spec.default is None:
        width = general_tolerance(float(np.ptp(nominal.surface.points, axis=0).max()))
        warnings.warn(
            f"there are no tolerances: every face gets a profile of {width:g} mm",
            CadskinWarning,
            stacklevel=2,
        )
        spec = Specification(
            default=tolerance("surface_profile", None, width, scope="general", id="general"),
            datums=spec.datums,
            dimensions=spec.dimensions,
        )
    return spec.bind(nominal)


def _policies(given: Any) -> dict[str, Conformity] | Conformity:
    """Return the policies: a name, or a table of tolerance id to a name or to the value [mm] it takes."""
    from cadskin.conform import Conformity, target

    if isinstance(given, str):
        return Conformity(given)  # type: ignore[arg-type]
    if not isinstance(given, dict):
        raise RequestError(f"conform must be a name or a table, got {given!r}")
    return {
        name: Conformity(how) if isinstance(how, str) else target(float(how))  # type: ignore[arg-type]
        for name, how in given.items()
    }


def _part_record(nominal: NominalModel) -> dict[str, Any]:
    surface, source = nominal.surface, nominal.source
    return {
        "name": source.part,
        "sha256": source.sha256,
        "faces": len(nominal.faces),
        "failed_faces": [face + 1 for face in nominal.failed_faces],
        "points": surface.n_points,
        "triangles": surface.n_triangles,
        "size": np.ptp(surface.points, axis=0).tolist(),
    }


def _verified(
    lot: SkinEnsemble, spec: Specification, corners: np.ndarray, context: Context
) -> list[dict[str, Any]]:
    from cadskin.verify import Verification, verify

    progress = context.stage(0.85, 0.99, "checking against the tolerances")
    ids = (*(item.id for item in spec.tolerances), *(item.id for item in spec.dimensions))
    reports = []
    for index, skin in enumerate(lot):
        report(progress, index, len(lot))
        found = verify(skin, spec, sizes=True)
        assert isinstance(found, Verification)
        reports.append(_with_size_limits(instance_report(lot.nominal, corners[index], found, ids), spec))
    return reports


def _with_size_limits(record: dict[str, Any], spec: Specification) -> dict[str, Any]:
    """Return a report that says both limits of a size: its row has room for the nearer one only."""
    limits = {item.id: (item.lower, item.upper) for item in spec.dimensions}
    for row in record["tolerances"]:
        if row["id"] in limits and row["value"] is not None:
            low, high = ("none" if value is None else f"{value:g} mm" for value in limits[row["id"]])
            row["reason"] = "; ".join(filter(None, [f"limits of size {low} to {high}", row["reason"]]))
    return record


def _unresolved(lot: SkinEnsemble, spec: Specification) -> list[dict[str, str]]:
    listed = [{"tolerance": item.entity, "reason": item.reason} for item in spec.unresolved]
    return [*listed, *lot.provenance.options.get("unsupported", [])]


# -- verify and export what was simulated before --------------------


def _stored(request: Request, context: Context) -> SkinEnsemble:
    """Return the parts in ``skin.npz`` of the job folder.

    Raises
    ------
    GeometryError
        They were made of another part, or with another mesher.
    """
    from cadskin.skin import SkinEnsemble

    nominal = context.parts.nominal(request, context.stage(0.0, 0.4, "meshing the part"))
    path = request.folder / "skin.npz"
    try:
        with np.load(path, allow_pickle=False) as file:
            points, triangles, deviation = file["points"], file["triangles"], file["deviation"]
    except (OSError, KeyError, ValueError) as error:
        raise RequestError(f"cannot read {path.name}: {error}") from error
    surface = nominal.surface
    same = points.shape == surface.points.shape and np.array_equal(triangles, surface.triangles)
    if not same or not np.allclose(points, surface.points, rtol=0, atol=1e-9 * np.abs(points).max()):
        raise GeometryError(
            "the part, its mesh size or the versions have changed since the skin model was computed; "
            "compute it again"
        )
    return SkinEnsemble(nominal, deviation)


def _verify(request: Request, context: Context) -> dict[str, Any]:
    spec, said = _specification(request)
    lot = _stored(request, context)
    if not len(spec) and spec.default is None:
        raise SpecificationError("there is no tolerance to check against; add one, or a general tolerance")
    bound = spec.bind(lot.nominal)
    corners = np.array([corner_deviation(skin) for skin in lot])
    return {
        "part": _part_record(lot.nominal),
        "size": len(lot),
        "instances": _verified(lot, bound, corners, context),
        "unresolved": _unresolved(lot, bound),
        "warnings": said,
    }


def _export(request: Request, context: Context) -> dict[str, Any]:
    from cadskin.export import write

    wanted = request.text("path")
    if not wanted:
        raise RequestError("export needs a path")
    lot = _stored(request, context)
    number = request.count("instance", 0)
    if number >= len(lot):
        raise RequestError(f"there is no instance {number}; there are {len(lot)}")
    progress = context.stage(0.5, 1.0, "writing")
    report(progress, 0, 1)
    written = write(Path(wanted), lot[number], format=request.text("format"))
    return {"path": str(written), "bytes": written.stat().st_size}


# -- import --------------------


def _import_step(request: Request, context: Context) -> dict[str, Any]:
    from cadskin.cad import read_parts, read_pmi, write_brep

    given = request.text("path")
    if not given:
        raise RequestError("import_step needs a path")
    path = Path(given)
    reading = context.stage(0.0, 0.5, f"reading {path.name}")
    parts = read_parts(path, allow_open=True, progress=reading)
    progress = context.stage(0.5, 0.95, f"reading the tolerances of {path.name}")
    records = []
    for index, part in enumerate(parts):
        report(progress, index, len(parts))
        brep = f"part-{index + 1}.brep"
        write_brep(request.folder / brep, part)
        tables = tables_of_specification(read_pmi(path, part)) if part.source.kind == "step" else {}
        records.append({"name": part.name, "brep": brep, "solid": part.is_solid, **tables})
    return {"file": path.name, "units": parts[0].source.units, "parts": records}


# -- versions --------------------


def _versions(*_: object) -> dict[str, Any]:
    """Load what a job needs, so that a broken installation is found here."""
    import sys

    from cadskin.cad import nominal

    return {"executable": sys.executable, "kernel": nominal.__module__}


Task: TypeAlias = Callable[[Request, Context], dict[str, Any]]

TASKS: dict[str, Task] = {
    "simulate": _simulate,
    "verify": _verify,
    "export": _export,
    "import_step": _import_step,
    "versions": _versions,
}
