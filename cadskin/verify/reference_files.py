"""Reference point sets as files that metrology software, and ``cadskin evaluate``, can read."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cadskin._progress import report
from cadskin._random import child, seed_sequence
from cadskin.verify.reference import reference_set

if TYPE_CHECKING:
    from cadskin._typing import Progress, RNGLike

__all__ = ["write_references"]


def write_references(
    folder: str | Path,
    characteristic: str,
    value: float,
    *,
    count: int = 1,
    rng: RNGLike = None,
    progress: Progress | None = None,
    **options: Any,
) -> tuple[Path, ...]:
    """Write ``count`` reference sets as cases (JSON and CSV) that ``cadskin evaluate`` reads.

    Parameters
    ----------
    folder : path
        Made where it is missing; existing files of the same name are replaced.
    characteristic : str
    value : float
    count : int
    rng : seed or generator
        Set i uses the child stream i.
    progress : callable, optional
    **options
        Of `reference_set`.

    Returns
    -------
    tuple of Path
        The JSON files.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    seed, written = seed_sequence(rng), []
    for index in range(count):
        made = reference_set(characteristic, value, rng=child(seed, index), **options)
        name = f"{characteristic.replace(' ', '_')}_{index:04d}"
        with (target / f"{name}.csv").open("w", newline="", encoding="utf-8") as stream:
            rows = csv.writer(stream, lineterminator="\n")
            rows.writerow(["feature", "x", "y", "z"])
            rows.writerows(["S", *map(repr, point)] for point in made.points.tolist())
            rows.writerows(["outlier", *map(repr, point)] for point in made.outliers.tolist())
        path = target / f"{name}.json"
        path.write_text(json.dumps(made.question(name), indent=1) + "\n", encoding="utf-8")
        written.append(path)
        report(progress, index + 1, count)
    return tuple(written)
