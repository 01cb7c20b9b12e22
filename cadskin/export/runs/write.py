"""Simulate into a run folder, chunk by chunk; what is there and sound is kept."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

import cadskin
from cadskin._progress import report
from cadskin._random import seed_sequence
from cadskin.conform.record import conformity_record
from cadskin.conform.simulate import prepare_conforming
from cadskin.errors import ExportError, ReadError
from cadskin.export.atomic import atomic_file, write_text
from cadskin.export.runs.layout import (
    ABOUT,
    FORMAT,
    NOMINAL,
    SPEC,
    TABLE,
    chunk_names,
    read_about,
    sha256_of_file,
)
from cadskin.export.runs.nominal_archive import save_nominal
from cadskin.export.runs.read import Run
from cadskin.export.runs.workers import Job, workers_of
from cadskin.skin.provenance import nominal_sha256, provenance_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cadskin._typing import Floats, Progress, RNGLike
    from cadskin.conform import BoundPart, ConformingSampler
    from cadskin.conform.chain import Tally
    from cadskin.conform.policy import Policies
    from cadskin.conform.simulate import Made
    from cadskin.deviation import DeviationModel
    from cadskin.shape import NominalModel
    from cadskin.spec import Specification

__all__ = ["simulate_run"]

_CHUNK_BYTES = 4_000_000  # what a killed process may lose
_CHUNK_PARTS = 64

Draw: TypeAlias = "Callable[[Sequence[int], Callable[[int], None]], list[Made]]"


@dataclass(frozen=True, eq=False)
class _Plan:
    """What is written where."""

    folder: Path
    nominal: NominalModel
    sampler: ConformingSampler
    seed: np.random.SeedSequence
    size: int
    per_chunk: int
    check: bool

    def counts(self) -> list[tuple[int, int]]:
        """Return first part and number of parts of every chunk."""
        starts = range(0, self.size, self.per_chunk)
        return [(first, min(self.per_chunk, self.size - first)) for first in starts]


def simulate_run(  # noqa: PLR0913 (what simulate_conforming takes, and the folder)
    folder: str | Path,
    nominal: NominalModel,
    model: DeviationModel,
    spec: Specification | BoundPart,
    *,
    size: int,
    rng: RNGLike = None,
    conform: Policies = "conditioned",
    max_tries: int = 200,
    check: bool = True,
    workers: int = 1,
    options: Mapping[str, Any] | None = None,
    progress: Progress | None = None,
) -> Run:
    """Simulate parts that meet their tolerances into a run folder.

    Part i depends on the seed and on i alone. Every chunk is written in one step when it is complete; the
    same call on an unfinished folder goes on where that one stopped, a call with a larger ``size`` adds
    parts, and both give the bits of one uninterrupted run, whatever the number of workers.

    Parameters
    ----------
    folder : path
        Made where it is missing.
    nominal, model, spec, conform, max_tries, check
        As for `cadskin.conform.simulate_conforming`.
    size : int
        Number of parts.
    rng : int or SeedSequence
        None takes fresh entropy, and then nothing can be resumed.
    workers : int
        Processes that draw parts; with more than one, the model and the policies must be picklable.
    options : mapping, optional
        What else shall stand in ``run.json`` (plain data).
    progress : callable, optional
        Called with (parts done, parts).

    Raises
    ------
    ExportError
        The folder holds another run, or something else, or cannot be written; ``workers`` is not positive.
    ConformityError, SpecificationError, GeometryError
        As for `cadskin.conform.simulate_conforming`.
    """
    target = Path(folder)
    if size < 1:
        raise ExportError(f"a run needs at least one part, got {size}")
    if workers < 1:
        raise ExportError(f"a run needs at least one worker, got {workers}")
    sampler = prepare_conforming(nominal, model, spec, conform=conform, max_tries=max_tries)
    seed = seed_sequence(rng)
    per_chunk = max(1, min(_CHUNK_PARTS, _CHUNK_BYTES // (8 * max(nominal.n_samples, 1))))
    plan = _Plan(target, nominal, sampler, seed, size, per_chunk, check)
    about = _about(plan, dict(options or {}))
    chunks = _kept_chunks(plan, about)
    _make_folder(target)
    write_text(target / SPEC, sampler.spec.to_toml())
    about["spec_sha256"] = sha256_of_file(target / SPEC)
    save_nominal(target / NOMINAL, nominal)
    asked = {
        "nominal": nominal,
        "model": model,
        "spec": sampler.spec,
        "conform": conform,
        "max_tries": max_tries,
    }
    with _drawing(plan, Job(asked, seed, check), workers, len(chunks)) as draw:
        _draw_chunks(plan, about, chunks, draw, progress)
    run = Run(target, read_about(target))
    write_text(target / TABLE, _table(run))
    return run


@contextmanager
def _drawing(plan: _Plan, job: Job, workers: int, kept: int) -> Iterator[Draw]:
    """Yield the function that draws parts by number: here, or in as many processes as there is work for."""
    if workers > 1 and kept < len(plan.counts()):
        with workers_of(job, min(workers, plan.size)) as running:
            yield running.draw
        return

    def draw(numbers: Sequence[int], done: Callable[[int], None]) -> list[Made]:
        found = []
        for made in job.draw(plan.sampler, numbers):
            found.append(made)
            done(len(found))
        return found

    yield draw


def _make_folder(target: Path) -> None:
    if target.exists() and not target.is_dir():
        raise ExportError(f"{target} is a file; a run is a folder, name another one")
    if target.is_dir() and any(target.iterdir()) and not (target / ABOUT).is_file():
        raise ExportError(f"{target} is not empty and holds no run; name a new folder")
    try:
        target.mkdir(exist_ok=True)
    except OSError as error:
        raise ExportError(f"cannot make the folder {target}: {error.strerror}") from error


def _about(plan: _Plan, options: dict[str, Any]) -> dict[str, Any]:
    """Return the content of run.json without the chunks."""
    nominal, sampler = plan.nominal, plan.sampler
    provenance = provenance_of(
        nominal,
        str(sampler.model),
        plan.seed,
        check=plan.check,
        max_tries=sampler.setup.max_tries,
        conform={name: str(policy) for name, policy in sampler.policies.items()},
    ).to_dict()
    limits = {item.tolerance.id: item.limit for item in sampler.requirements}
    types = {item.tolerance.id: item.tolerance.type for item in sampler.requirements}
    return {
        "format": FORMAT,
        "version": cadskin.__version__,
        "numpy": np.__version__,
        "size": plan.size,
        "parts_per_chunk": plan.per_chunk,
        "nominal_sha256": nominal_sha256(nominal),
        "spec_sha256": None,
        "provenance": json.loads(json.dumps(provenance)),
        "options": options,
        "tolerances": [
            {"tolerance": name, "characteristic": types[name], "limit": limits[name]} for name in limits
        ],
        "unsupported": [{"tolerance": item.tolerance, "reason": item.reason} for item in sampler.unsupported],
        "chunks": [],
    }


_SAME = ("version", "nominal_sha256", "parts_per_chunk", "provenance", "tolerances")


def _kept_chunks(plan: _Plan, about: dict[str, Any]) -> dict[int, dict[str, Any]]:
    """Return the complete and sound chunks of an earlier call, by their number.

    Raises
    ------
    ExportError
        The folder holds another run.
    """
    if not (plan.folder / ABOUT).is_file():
        return {}
    try:
        before = read_about(plan.folder)
    except ReadError as error:
        raise ExportError(f"{error}; name a new folder") from error
    different = [key for key in _SAME if before.get(key) != about[key]]
    if different:
        raise ExportError(
            f"{plan.folder} holds another run ({', '.join(different)} differ); name a new folder, or repeat "
            "its options to go on with it"
        )
    if before["size"] > plan.size:
        raise ExportError(f"{plan.folder} holds {before['size']} parts already, more than {plan.size}")
    kept = {}
    for chunk in before["chunks"]:
        number = chunk["first"] // plan.per_chunk
        wanted = min(plan.per_chunk, plan.size - chunk["first"])
        if chunk["count"] == wanted and all(
            _is_sound(plan.folder, chunk, k) for k in ("deviations", "values")
        ):
            kept[number] = chunk
    return kept


def _is_sound(folder: Path, chunk: dict[str, Any], what: str) -> bool:
    file = folder / chunk[what]
    return bool(file.is_file() and sha256_of_file(file) == chunk[f"{what}_sha256"])


def _draw_chunks(
    plan: _Plan,
    about: dict[str, Any],
    kept: dict[int, dict[str, Any]],
    draw: Draw,
    progress: Progress | None,
) -> None:
    done = 0
    report(progress, 0, plan.size)
    for number, (first, count) in enumerate(plan.counts()):
        if number not in kept:
            kept[number] = _chunk(plan, number, first, count, draw, progress)
        done += count
        about["chunks"] = [kept[k] for k in sorted(kept)]
        _save_about(plan.folder, about, complete=done == plan.size)
        report(progress, done, plan.size)


def _save_about(folder: Path, about: dict[str, Any], *, complete: bool) -> None:
    text = json.dumps(about | {"complete": complete}, indent=1, sort_keys=True, ensure_ascii=False)
    write_text(folder / ABOUT, text + "\n")


def _chunk(
    plan: _Plan, number: int, first: int, count: int, draw: Draw, progress: Progress | None
) -> dict[str, Any]:
    """Draw the parts of a chunk, write it, and return its entry in run.json."""
    names = list(dict.fromkeys(item.tolerance.id for item in plan.sampler.requirements))
    deviations = np.zeros((count, plan.nominal.n_samples))
    values = np.zeros((count, len(names)))
    tallies: list[Tally] = []
    parts = draw(range(first, first + count), lambda done: report(progress, first + done, plan.size))
    for k, made in enumerate(parts):
        deviations[k] = made.deviation
        values[k] = [made.values[name] for name in names]
        tallies.append(made.tally)
    files = dict(zip(("deviations", "values"), chunk_names(number), strict=True))
    for key, array in (("deviations", deviations), ("values", values)):
        _save_array(plan.folder / files[key], array)
    sums = {f"{key}_sha256": sha256_of_file(plan.folder / name) for key, name in files.items()}
    record = conformity_record(plan.sampler, tallies)
    cost = {key: record[key] for key in ("samplers", "acceptance", "acceptance_by_tolerance")}
    return {"first": first, "count": count, **files, **sums, **cost}


def _save_array(path: Path, array: Floats) -> None:
    with atomic_file(path) as stream:
        np.save(stream, array, allow_pickle=False)


def _table(run: Run) -> str:
    """Return the evaluation table as CSV."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(["part", "tolerance", "characteristic", "value_mm", "limit_mm", "verdict"])
    for part, row in enumerate(run.values.tolist()):
        for item, value in zip(run.about["tolerances"], row, strict=True):
            verdict = "ok" if value <= item["limit"] else "not conforming"
            writer.writerow(
                [part, item["tolerance"], item["characteristic"], repr(value), repr(item["limit"]), verdict]
            )
    return stream.getvalue()
