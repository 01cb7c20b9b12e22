"""Verification of a whole run: every part is welded and evaluated again."""

from __future__ import annotations

from typing import TYPE_CHECKING, cast

import numpy as np

from cadskin.cli._console import note, print_json, print_table, progress_bar
from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from pathlib import Path

    from cadskin.verify import Standard, Verification

__all__ = ["verify_run"]


def verify_run(
    folder: Path,
    spec: Path | None,
    *,
    standard: Standard,
    sections: int,
    csv: Path | None,
    qif: Path | None,
    json: bool,
) -> int:
    """Evaluate every part of a run; return 0 where all conform, else 1.

    Tolerances that cannot be evaluated are listed with the reason. They count as not conforming unless the
    run itself lists them as unsupported.
    """
    from cadskin.export import open_run, write_text
    from cadskin.spec import read_spec
    from cadskin.spec.binding import bound_to
    from cadskin.verify import verify
    from cadskin.verify.general import with_general
    from cadskin.verify.qif import write_qif

    run = open_run(folder)
    tolerances = run.spec if spec is None else read_spec(spec)
    if tolerances is None:
        raise SpecificationError(f"{folder} was made without tolerances; give a spec file with --spec")
    known = {item["tolerance"] for item in run.about["unsupported"]} if spec is None else set()
    bound = with_general(bound_to(tolerances, run.nominal), run.nominal)
    kept: dict[str, int] = {tolerance.id: 0 for tolerance in bound}
    tables: list[Verification] = []
    values: dict[str, list[float]] = {tolerance.id: [] for tolerance in bound}
    reasons: dict[str, str] = {}
    with progress_bar(f"verifying {folder.name}") as progress:
        for number, skin in enumerate(run):
            found = cast("Verification", verify(skin, bound, standard=standard, sections=sections))
            for name, evaluation in found.evaluations:
                values[name].append(evaluation.value)
                kept[name] += evaluation.ok is True  # a material requirement has a verdict of its own
            tables.append(found)
            reasons.update(found.unresolved)
            progress(number + 1, len(run))
    limits = {tolerance.id: tolerance.value for tolerance in bound}
    rows, conforming = [], len(run) > 0
    for name, listed in values.items():
        limit = limits[name]
        within = kept[name]
        if name not in known and name not in reasons:
            conforming &= within == len(run)
        largest = f"{np.max(listed):.9g}" if listed else ""
        rows.append((name, bound[name].type, largest, "" if limit is None else f"{limit:.6g}",
                     f"{within} of {len(run)}" if listed else "not evaluated"))  # fmt: skip
    conforming &= set(reasons) <= known
    text = "\n".join(
        ",".join(row) for row in [("tolerance", "characteristic", "largest", "limit", "within"), *rows]
    )
    if qif is not None:
        write_qif(qif, tables, bound, run.nominal)
    if csv is not None:
        write_text(csv, text + "\n")
    if json:
        print_json(
            {
                "conforming": conforming,
                "parts": len(run),
                "values": values,
                "limits": limits,
                "unresolved": [{"tolerance": name, "reason": reason} for name, reason in reasons.items()],
            }
        )
    else:
        columns = ("tolerance", "characteristic", "largest", "limit", "within")
        print_table(f"{len(run)} parts of {folder.name}", columns, rows, right=("largest", "limit", "within"))
        for name, reason in reasons.items():
            note(f"{name} was not evaluated: {reason}")
        note("conforming" if conforming else "not conforming")
    return 0 if conforming else 1
