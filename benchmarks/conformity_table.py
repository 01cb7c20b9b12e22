"""Simulate every AP242 file of the corpus inside its tolerances and keep the table in docs/conformity.md.

    CADSKIN_CORPUS=folder python benchmarks/conformity_table.py [-n 20] [name ...]

Each file gets what ``cadskin simulate FILE -n 20`` gives it: the tolerances of its PMI, the default process,
edge length = diagonal / 100. Every part is then read back, welded, checked to be watertight, and evaluated
again as ``cadskin verify RUN`` does it. Seconds are processor seconds of one part; making the process fit
the tolerances is extra.
"""

from __future__ import annotations

import argparse
import os
import re
import tempfile
import time
import warnings
from dataclasses import dataclass
from pathlib import Path

from cadskin.cad import contained_nominals, read_pmi
from cadskin.conform import process_of
from cadskin.conform.capable import correlation_length
from cadskin.errors import CadskinError, CadskinWarning
from cadskin.export.runs import Run, simulate_run
from cadskin.verify import prepare

ROOT = Path(__file__).resolve().parent.parent
SEED = 1
COLUMNS = (
    "file", "vertices", "tolerances and sizes", "supported", "watertight", "conforming", "values within",
    "acceptance", "CPU s set-up", "CPU s per part", "CPU s verify",
)  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One line of the table, and what stands below it."""

    cells: tuple[str, ...]
    remarks: tuple[str, ...]


def corpus() -> list[Path]:
    folder = Path(os.environ.get("CADSKIN_CORPUS", ROOT.parent / "shared" / "corpus")) / "step"
    files = sorted(folder.glob("*ap242*.stp"))
    if not files:
        raise SystemExit(f"no AP242 files in {folder}; name the corpus by CADSKIN_CORPUS")
    return files


def simulated(path: Path, folder: Path, count: int) -> tuple[Run, float, float]:
    """Return the run, and the seconds of the set-up and of one part."""
    (nominal,) = contained_nominals(path, {}, time_limit=600.0)
    spec = read_pmi(path, nominal)
    start = time.process_time()
    model = process_of(nominal, spec, length=float(f"{correlation_length(nominal):.3g}"))
    set_up = time.process_time() - start
    start = time.process_time()
    run = simulate_run(folder, nominal, model, spec, size=count, rng=SEED)
    return run, set_up, (time.process_time() - start) / count


def evaluated(run: Run) -> tuple[int, int, int, int, float]:
    """Return watertight parts, conforming parts, values, values within, and the seconds of one part."""
    ignored = {item["tolerance"] for item in run.about["unsupported"]}
    watertight = conforming = values = within = 0
    start = time.process_time()
    prepared = prepare(run.nominal, run.spec)
    for skin in run:
        found = prepared.evaluate(skin, sizes=True)
        kept = [evaluation.ok is True for name, evaluation in found.evaluations if name not in ignored]
        missed = [name for name, _ in found.unresolved if name not in ignored]
        watertight += skin.closed and skin.surface.volume > 0
        conforming += all(kept) and not missed
        values += len(kept) + len(missed)
        within += sum(kept)
    return watertight, conforming, values, within, (time.process_time() - start) / max(len(run), 1)


def row_of(path: Path, count: int) -> Row:
    try:
        with tempfile.TemporaryDirectory() as folder:
            run, set_up, per_part = simulated(path, Path(folder) / "run", count)
            watertight, conforming, values, within, to_verify = evaluated(run)
            unsupported, vertices = run.about["unsupported"], run.nominal.surface.n_points
            supported = len(run.tolerances)
            samples = sum(chunk["count"] * chunk["acceptance"] for chunk in run.about["chunks"])
    except CadskinError as error:
        return Row((path.name, *["-"] * (len(COLUMNS) - 1)), (f"{type(error).__name__}: {error}",))
    total = supported + len({item["tolerance"] for item in unsupported} - set(run.tolerances))
    cells = (
        path.name,
        str(vertices),
        str(total),
        str(supported),
        f"{watertight} of {count}",
        f"{conforming} of {count}",
        f"{within / max(values, 1):.1%}",
        f"{samples / count:.2f}",
        f"{set_up:.1f}",
        f"{per_part:.2f}",
        f"{to_verify:.2f}",
    )
    remarks = tuple(f"{item['tolerance']}: {item['reason']}" for item in unsupported)
    return Row(cells, remarks)


def document(rows: list[Row], count: int, total: int) -> str:
    lines = [
        "# Conformity",
        "",
        "Written by `benchmarks/conformity_table.py`; do not edit. Every AP242 file of the corpus,",
        f"simulated {count} times as `cadskin simulate FILE -n {count}` does it: no option but the file.",
        "Sizes with limits move their features and count as tolerances do.",
        "A part conforms when `cadskin verify` finds every supported tolerance kept on its welded mesh.",
        "What is not supported, or not tied to faces, is named below the table. *Acceptance*",
        "is the share of attempts at features and groups of features that were kept; the default process",
        "is made for the tolerances, so it is high. Seconds are processor seconds on one core of the machine",
        "that wrote the page, compilation of kernels left out. The rules are in [simulation](simulation.md).",
        "",
        f"{len(rows)} of {total} files are done.",
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|" + "---|" * len(COLUMNS),
        *("| " + " | ".join(row.cells) + " |" for row in rows),
        "",
    ]
    for row in rows:
        if row.remarks:
            lines += [f"**{row.cells[0]}**, not simulated:", ""]
            lines += [f"- {re.sub(r'[|]', '/', remark)}" for remark in row.remarks] + [""]
    return "\n".join(lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-n", "--count", type=int, default=20)
    parser.add_argument("--output", type=Path, default=ROOT / "docs" / "conformity.md")
    parser.add_argument("names", nargs="*", help="only files whose name contains one of these")
    request = parser.parse_args()
    warnings.simplefilter("ignore", CadskinWarning)
    rows = []
    files = corpus()
    if not request.names:
        row_of(files[0], 1)  # compiles what is not compiled yet
    for path in files:
        if request.names and not any(name in path.name for name in request.names):
            continue
        rows.append(row_of(path, request.count))
        print(" | ".join(rows[-1].cells), flush=True)
        for remark in rows[-1].remarks:
            print(f"    {remark}")
        request.output.write_text(document(rows, request.count, len(files)), encoding="utf-8")


if __name__ == "__main__":
    main()
