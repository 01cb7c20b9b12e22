"""Verification of measured parts in a QIF file: every part is judged again from what was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

from cadskin.cli._console import note, print_json, print_table
from cadskin.cli._verdicts import exit_code

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["verify_qif"]


def verify_qif(path: Path, *, json: bool) -> int:
    """Print found and declared verdict of each part; return 0 where all pass, else 1."""
    from cadskin.cad.measured import read_qif

    results = read_qif(path)
    rows = []
    for part, found, values in zip(results.parts, results.verdicts(), results.values(), strict=True):
        outside = [
            one.name or one.id
            for one, value in zip(results.characteristics, values, strict=True)
            if value == value and not one.passes(value)
        ]
        rows.append({"part": part.id, "declared": part.declared, "found": found, "outside": outside})
    if json:
        print_json({"parts": rows, "not_read": list(results.not_read)})
    else:
        table = [(str(r["part"]), str(r["declared"]), str(r["found"]), ", ".join(r["outside"])) for r in rows]
        title = f"{results.source}: {len(results.characteristics)} characteristics"
        print_table(title, ("part", "declared", "found", "outside"), table)
        for missing in results.not_read:
            note(f"not read: {missing}")
        odd = sum(r["found"] != r["declared"] for r in rows)
        if odd:
            note(f"{odd} of {len(rows)} parts are judged otherwise than the file declares")
    return exit_code(all(r["found"] == "PASS" for r in rows))
