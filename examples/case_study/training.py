"""Make the training set with CalculiX, one npz file per drawn part, and a manifest that says how.

``python -m case_study.training`` (in the folder ``examples``) runs what is not there yet: ten parts, and the
nominal process on finer and finer meshes. After it was killed it goes on with the next missing part; a part
that diverged is listed with the reason and its parameters, never dropped. ``--only coarse`` runs some.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import sys
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import cadskin as cs

from .fe_run import DivergedError, Drawn, ccx_version, draw
from .process import CHECK, CHECK_PROCESS, MESHES, TRAINING_MESH, DrawingProcess, FeMesh, latin_hypercube

DATA = Path(__file__).resolve().parent / "data"
COMMAND = "python -m case_study.training"
N_PARTS = 10


@dataclass(frozen=True)
class Run:
    """One CalculiX run: its name is that of its file."""

    name: str
    mesh: FeMesh
    process: DrawingProcess


def planned(mesh: str = TRAINING_MESH) -> list[Run]:
    """Return all runs: the test's, the training set on one mesh, the nominal process on each mesh."""
    processes = latin_hypercube(N_PARTS)
    parts = [Run(f"{mesh}_{i:02d}", MESHES[mesh], process) for i, process in enumerate(processes)]
    study = [Run(f"nominal_{name}", sizes, DrawingProcess()) for name, sizes in MESHES.items()]
    return [Run("check", CHECK, CHECK_PROCESS), *parts, *study]


def training_set(data: Path = DATA) -> tuple[dict[int, Run], dict[int, Drawn]]:
    """Return runs and parts by number, after a check of their hashes; what has no result is absent.

    Raises
    ------
    CadskinError
        A file is not the one of the manifest, or there are fewer than three parts to analyse.
    """
    runs = {k: run for k, run in enumerate(planned()[1 : 1 + N_PARTS]) if has(run.name, data)}
    if len(runs) < 3:
        raise cs.CadskinError(f"{len(runs)} parts were drawn on the {TRAINING_MESH} mesh; run `{COMMAND}`")
    return runs, {k: load(run.name, data) for k, run in runs.items()}


def has(name: str, data: Path = DATA) -> bool:
    """Say whether a run has a result."""
    return "sha256" in read_manifest(data)["runs"].get(name, {})


def load(name: str, data: Path = DATA) -> Drawn:
    """Return one run that ships."""
    entry = read_manifest(data)["runs"].get(name)
    if entry is None:
        raise cs.CadskinError(f"{name} has not been run; run `{COMMAND}`")
    if "diverged" in entry:
        raise cs.CadskinError(f"{name} has no result: {entry['diverged']}")
    path = data / f"{name}.npz"
    if not path.is_file() or _sha256(path) != entry["sha256"]:
        raise cs.CadskinError(f"{path} is missing or is not the file of the manifest; run `{COMMAND}`")
    return Drawn.load(path)


def make(
    runs: Sequence[Run], data: Path = DATA, *, again: bool = False
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Run what is missing; yield the name and the manifest entry of each new run as it ends."""
    data.mkdir(parents=True, exist_ok=True)
    for run in runs:
        if not again and _is_there(run, read_manifest(data), data):
            continue
        entry = _entry(run, data)
        manifest = read_manifest(data)
        manifest["runs"][run.name] = entry
        manifest["runs"] = dict(sorted(manifest["runs"].items()))
        manifest["solver"], manifest["made by"] = f"CalculiX {ccx_version()}", COMMAND
        _write(manifest, data)
        yield run.name, entry


def _entry(run: Run, data: Path) -> dict[str, Any]:
    """Draw the part; where it diverges try once more with half the increments, then say so."""
    entry: dict[str, Any] = {"mesh": asdict(run.mesh), "process": asdict(run.process)}
    path = data / f"{run.name}.npz"
    failure = ""
    for share in (1.0, 0.5):
        mesh = replace(run.mesh, largest_increment=share * run.mesh.largest_increment)
        with tempfile.TemporaryDirectory(prefix=f"ccx_{run.name}_") as folder:
            try:
                drawn = draw(run.process, mesh, Path(folder) / "run")
            except DivergedError as error:
                failure = str(error)
                continue
        drawn.save(path)
        return entry | {
            "largest_increment": mesh.largest_increment,
            "sha256": _sha256(path),
            "nodes": len(drawn.points),
            "cpu_seconds": round(drawn.cpu_seconds, 1),
        }
    path.unlink(missing_ok=True)
    return entry | {"diverged": failure}


def _is_there(run: Run, manifest: dict[str, Any], data: Path) -> bool:
    """Say whether the run was made with these very parameters and its file is whole."""
    entry = manifest["runs"].get(run.name, {})
    same = entry.get("mesh") == asdict(run.mesh) and entry.get("process") == asdict(run.process)
    path = data / f"{run.name}.npz"
    return same and ("diverged" in entry or (path.is_file() and _sha256(path) == entry.get("sha256")))


def read_manifest(data: Path = DATA) -> dict[str, Any]:
    """Return the manifest, empty where there is none."""
    path = data / "manifest.json"
    if not path.is_file():
        return {"solver": None, "made by": COMMAND, "runs": {}}
    return dict(json.loads(path.read_text(encoding="utf-8")))


def _write(manifest: dict[str, Any], data: Path) -> None:
    part = data / "manifest.json.part"
    part.write_text(json.dumps(manifest, indent=1) + "\n", encoding="utf-8")
    part.replace(data / "manifest.json")


def _sha256(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what is missing, print a line each, and return 1 where a run diverged."""
    parser = argparse.ArgumentParser(prog=COMMAND, description=__doc__)
    parser.add_argument("--only", default="", help="runs whose name holds this text")
    parser.add_argument("--mesh", choices=MESHES, default=TRAINING_MESH, help="of the ten parts")
    parser.add_argument("--data", type=Path, default=DATA, help="folder of the results")
    parser.add_argument("--again", action="store_true", help="also what is there already")
    chosen = parser.parse_args(arguments)
    runs = [run for run in planned(chosen.mesh) if chosen.only in run.name]
    try:
        for name, entry in make(runs, chosen.data, again=chosen.again):
            told = entry.get("diverged") or f"{entry['nodes']} nodes, {entry['cpu_seconds']} CPU s"
            print(f"{name}: {told}", flush=True)
    except cs.CadskinError as error:
        print(error, file=sys.stderr)
        return 2
    entries = read_manifest(chosen.data)["runs"]
    diverged = [run.name for run in runs if "diverged" in entries.get(run.name, {})]
    if diverged:
        print(f"diverged: {', '.join(diverged)}; see manifest.json", file=sys.stderr)
    return int(bool(diverged))


if __name__ == "__main__":
    raise SystemExit(main())
