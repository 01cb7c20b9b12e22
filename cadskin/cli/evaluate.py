"""``cadskin evaluate``: the value of a point-set case, as a tester of metrology software asks for it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cadskin.cli._console import print_json, print_table


def command(
    case: Annotated[Path, typer.Argument(help="JSON file of the case; its 'csv' entry names the points.")],
    json: Annotated[bool, typer.Option("--json", help="Machine-readable output.")] = False,
) -> None:
    """Evaluate a characteristic of labelled points.

    The reference answer in the file is not read.
    """
    from cadskin.verify import evaluate_case, read_case

    asked = read_case(case)
    found = evaluate_case(asked)
    quantity = asked.quantity or asked.characteristic
    if json:
        print_json(
            {
                **found.to_dict(),
                "id": asked.id,
                "characteristic": asked.characteristic,
                "quantity": quantity,
                "evaluated": found.quantity,
            }
        )
        return
    rows = [
        ("value", repr(found.value)),
        ("quantity", quantity),
        ("evaluated", found.quantity),
        ("certified", "yes" if found.certified else "no"),
        ("of the points", str(found.n_points)),
        *((name.replace("_", " "), _shown(value)) for name, value in found.details.items()),
        *(("operation", text) for text in found.operations),
    ]
    print_table(f"{asked.id}: {asked.characteristic}", ("what", "value"), rows)


def _shown(value: object) -> str:
    return "none" if value is None else repr(value) if isinstance(value, float) else str(value)
