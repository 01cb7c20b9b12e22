"""Mesh every STEP file of the corpus and keep the table in docs/corpus.md.

    CADSKIN_CORPUS=folder python benchmarks/corpus_table.py [--divide 100] [name ...]

Each file is read and meshed as the command line does it: in a child process, at edge length = diagonal / 100
of each solid. Quality is 4 sqrt(3) A / sum l² (1 is equilateral). Seconds are those of the child's processor.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cadskin.cad import contained_describe, contained_nominals
from cadskin.errors import CadskinError
from cadskin.shape import NominalModel
from cadskin.shape.check import triangle_quality

ROOT = Path(__file__).resolve().parent.parent
COLUMNS = (
    "file",
    "solids",
    "faces",
    "triangles",
    "watertight",
    "median quality",
    "worst",
    "CPU s",
    "remarks",
)


@dataclass(frozen=True)
class Row:
    """One line of the table, as text."""

    cells: tuple[str, ...]
    good: bool


def corpus() -> Path:
    folder = Path(os.environ.get("CADSKIN_CORPUS", ROOT.parent / "shared" / "corpus")) / "step"
    if not folder.is_dir():
        raise SystemExit(f"no STEP files in {folder}; name the corpus by CADSKIN_CORPUS")
    return folder


def cpu_of_children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def mesh_part(path: Path, name: str, diagonal: float, divide: float) -> NominalModel:
    options = {"part": name, "edge_length": diagonal / divide}
    (model,) = contained_nominals(path, options, time_limit=600.0)
    return model


def measure(path: Path, divide: float) -> Row:
    """Return the row of one file; a part that fails is named in the remarks."""
    start = cpu_of_children()
    try:
        parts = contained_describe(path).parts
    except CadskinError as error:
        return Row((path.name, *["-"] * 6, f"{cpu_of_children() - start:.1f}", str(error)), False)
    models, remarks = [], []
    for part in parts:
        try:
            models.append(mesh_part(path, part.name, part.diagonal, divide))
        except CadskinError as error:
            remarks.append(f"{part.name}: {error}")
    remarks += [
        f"{model.source.part}: faces {model.failed_faces} stand-in" for model in models if model.failed_faces
    ]
    quality = np.concatenate(
        [triangle_quality(m.surface.points, m.surface.triangles) for m in models] or [np.zeros(1)]
    )
    closed = sum(model.closed for model in models)
    cells = (
        path.name,
        str(len(parts)),
        str(sum(len(part.faces) for part in parts)),
        str(sum(model.surface.n_triangles for model in models)),
        f"{closed} of {len(parts)}",
        f"{np.median(quality):.4f}",
        f"{quality.min():.3f}",
        f"{cpu_of_children() - start:.1f}",
        "; ".join(remarks),
    )
    return Row(cells, closed == len(parts) and not remarks)


def markdown(rows: list[Row], divide: float) -> str:
    lines = [
        "# The corpus",
        "",
        "Written by `make corpus`; do not edit. Every solid of every STEP file of the corpus, read and",
        f"meshed as `cadskin mesh` does it, at edge length = diagonal / {divide:g}. Quality is 4√3 A / Σl²,",
        "1 is equilateral. CPU seconds include one process per solid and reading the file in each.",
        "",
        "| " + " | ".join(COLUMNS) + " |",
        "|---" * len(COLUMNS) + "|",
        *("| " + " | ".join(row.cells) + " |" for row in rows),
        "",
        f"{sum(row.good for row in rows)} of {len(rows)} files without a remark.",
        "",
    ]
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="only files whose name contains one of these; not kept")
    parser.add_argument("--divide", type=float, default=100.0, help="edge length = diagonal / this")
    options = parser.parse_args()
    wanted = [
        path
        for path in sorted(corpus().glob("*.st*p"))
        if not options.names or any(name in path.name for name in options.names)
    ]
    rows = []
    begin = time.monotonic()
    for path in wanted:
        rows.append(measure(path, options.divide))
        print("  ".join(rows[-1].cells), flush=True)
    print(f"{sum(row.good for row in rows)} of {len(rows)} files good, {time.monotonic() - begin:.0f} s")
    if not options.names:
        (ROOT / "docs" / "corpus.md").write_text(markdown(rows, options.divide), encoding="utf-8")
    return 0 if all(row.good for row in rows) else 1


if __name__ == "__main__":
    raise SystemExit(main())
