"""Verification of a whole run: every part is welded and evaluated again."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin.cli._console import note, print_json, print_table, progress_bar
from cadskin.cli._verdicts import exit_code, say_verdict
from cadskin.errors import SpecificationError

if TYPE_CHECKING:
    from pathlib import Path

    from cadskin.spec import Specification
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
    from cadskin.verify import prepare
    from cadskin.verify.qif import write_qif

    run = open_run(folder)
    tolerances = run.spec if spec is None else read_spec(spec)
    if tolerances is None:
        raise SpecificationError(f"{folder} was made without tolerances; give a spec file with --spec")
    known = {item["tolerance"] for item in run.about["unsupported"]} if spec is None else set()
    prepared = prepare(run.nominal, tolerances, standard=standard, sections=sections)
    bound = prepared.spec
    limits = {tolerance.id: tolerance.value for tolerance in bound} | _size_limits(bound)
    types = {tolerance.id: tolerance.type for tolerance in bound}
    kept = dict.fromkeys(limits, 0)
    tables: list[Verification] = []
    values: dict[str, list[float]] = {name: [] for name in limits}
    reasons: dict[str, str] = {}
    with progress_bar(f"verifying {folder.name}") as progress:
        for number, skin in enumerate(run):
            found = prepared.evaluate(skin, sizes=True)
            for name, evaluation in found.evaluations:
                values[name].append(evaluation.value)
                kept[name] += evaluation.ok is True  # a material requirement has a verdict of its own
            tables.append(found)
            reasons.update(found.unresolved)
            progress(number + 1, len(run))
    rows, conforming = [], len(run) > 0
    for name, listed in values.items():
        within = kept[name]
        if name not in known and name not in reasons:
            conforming &= within == len(run)
        largest = f"{np.max(listed):.9g}" if listed else ""
        verdict = f"{within} of {len(run)}" if listed else "not evaluated"
        rows.append((name, types.get(name, "size"), largest, _text(limits[name]), verdict))
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
        say_verdict(conforming)
    return exit_code(conforming)


def _size_limits(spec: Specification) -> dict[str, tuple[float | None, float | None]]:
    """Return lower and upper limit of every size that has one."""
    from cadskin.verify.part_size import has_size_limits

    return {item.id: (item.lower, item.upper) for item in spec.dimensions if has_size_limits(item)}


def _text(limit: float | tuple[float | None, float | None] | None) -> str:
    if isinstance(limit, tuple):
        return " to ".join("" if value is None else f"{value:.6g}" for value in limit)
    return "" if limit is None else f"{limit:.6g}"
