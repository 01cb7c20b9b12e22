"""Names and texts of a run folder.

========================  ==============================================================================
``run.json``              versions, seed, options, SHA-256 of the inputs, the list of chunks
``spec.toml``             the specification, bound to the faces (only where there is one)
``nominal.npz``           the nominal model, see `cadskin.export.runs.save_nominal`
``deviations-00000.npy``  deviations (k, n_c) float64 [mm] of the first k parts; SHA-256 in ``run.json``
``values-00000.npy``      values (k, m) float64 [mm] of the tolerances on their welded meshes
``evaluations.csv``       one row per part and tolerance: value, limit, verdict
========================  ==============================================================================
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from cadskin.errors import ReadError

__all__ = ["ABOUT", "FORMAT", "NOMINAL", "SPEC", "TABLE", "chunk_names", "read_about", "sha256_of_file"]

FORMAT = "cadskin run 1"
ABOUT, SPEC, NOMINAL, TABLE = "run.json", "spec.toml", "nominal.npz", "evaluations.csv"


def chunk_names(number: int) -> tuple[str, str]:
    """Return the names of the deviations and of the values of a chunk.

    Examples
    --------
    >>> chunk_names(3)
    ('deviations-00003.npy', 'values-00003.npy')
    """
    return f"deviations-{number:05d}.npy", f"values-{number:05d}.npy"


def sha256_of_file(path: Path) -> str:
    """Return the SHA-256 of a file."""
    with open(path, "rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def read_about(folder: Path) -> dict[str, Any]:
    """Return the content of ``run.json``.

    Raises
    ------
    ReadError
        No run folder, a damaged one, or one of another version.
    """
    file = folder / ABOUT
    if not folder.is_dir():
        raise ReadError(f"{folder} is no folder; a run is the folder that `cadskin simulate -o` wrote")
    try:
        about = json.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise ReadError(f"{folder} is no run folder: it has no {ABOUT}") from None
    except (OSError, ValueError) as error:
        raise ReadError(f"{file} cannot be read: {error}") from error
    if not isinstance(about, dict) or about.get("format") != FORMAT:
        found = about.get("format") if isinstance(about, dict) else about
        raise ReadError(f"{file} has format {found!r}, this version reads {FORMAT!r}")
    return about
