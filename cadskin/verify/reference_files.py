"""Reference point sets as files that metrology software, and ``cadskin evaluate``, can read."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin._progress import report
from cadskin._random import child, seed_sequence
from cadskin.errors import SpecificationError
from cadskin.verify.reference import ReferenceSet, reference_set
from cadskin.verify.reference_datums import (
    DATUM_CHARACTERISTICS,
    DatumReferenceSet,
    datum_reference_set,
)

if TYPE_CHECKING:
    from cadskin._typing import Points, Progress, RNGLike

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
        Of `reference_set`, or of `datum_reference_set` for orientation, location and run-out.

    Returns
    -------
    tuple of Path
        The JSON files.
    """
    target = Path(folder)
    target.mkdir(parents=True, exist_ok=True)
    seed, written = seed_sequence(rng), []
    for index in range(count):
        made, labelled = _made(characteristic, value, child(seed, index), options)
        name = f"{characteristic.replace(' ', '_')}_{index:04d}"
        with (target / f"{name}.csv").open("w", newline="", encoding="utf-8") as stream:
            rows = csv.writer(stream, lineterminator="\n")
            rows.writerow(["feature", "x", "y", "z"])
            for label, points in labelled.items():
                rows.writerows([label, *map(repr, point)] for point in points.tolist())
        path = target / f"{name}.json"
        path.write_text(json.dumps(made.question(name), indent=1) + "\n", encoding="utf-8")
        written.append(path)
        report(progress, index + 1, count)
    return tuple(written)


def _made(
    characteristic: str, value: float, rng: RNGLike, options: dict[str, Any]
) -> tuple[ReferenceSet | DatumReferenceSet, dict[str, Points]]:
    """Return a reference set and its points by label."""
    if characteristic in DATUM_CHARACTERISTICS:
        unused = {"arc": 2 * np.pi, "waviness": 0}
        refused = [key for key, plain in unused.items() if options.get(key, plain) != plain]
        if refused:
            raise SpecificationError(f"{', '.join(refused)}: not an option of {characteristic}")
        kept = {key: option for key, option in options.items() if key not in unused}
        found = datum_reference_set(characteristic, value, rng=rng, **kept)
        return found, {**found.features, "outlier": found.outliers}
    made = reference_set(characteristic, value, rng=rng, **options)
    return made, {"S": made.points, "outlier": made.outliers}
