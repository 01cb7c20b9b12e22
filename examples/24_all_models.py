"""24 Gallery sheet: all models of the galleries 20 to 22 side by side.

A script run draws the sheet. `main` returns the number of model classes of the registry that are not on it
(the operators `a + b`, `2 * a` and `a.on(...)` are used for others and count as shown): none.
"""

from __future__ import annotations

import runpy
import sys
from dataclasses import fields
from pathlib import Path

import gallery

import cadskin as cs
from cadskin.deviation import model_names

SCRIPTS = ("20_systematic_forms", "21_random_fields", "22_processes_and_data")


def models(part: cs.NominalModel) -> dict[str, cs.DeviationModel]:
    found: dict[str, cs.DeviationModel] = {}
    for script in SCRIPTS:
        make = runpy.run_path(str(Path(__file__).with_name(f"{script}.py")))["models"]
        family = script.partition("_")[2].split("_")[0]
        last = ""
        for title, model in (make(part) if family == "processes" else make()).items():
            last = last if title.startswith("...") else title.split(",")[0].removesuffix(" Legendre")
            found[title.replace("...", last)] = model
    return found


def classes(model: object) -> set[str]:
    """Return the names of the classes that a model is made of."""
    if isinstance(model, tuple):
        return set().union(*map(classes, model))
    if not isinstance(model, cs.DeviationModel):
        return set()
    return {model.name}.union(*(classes(getattr(model, f.name)) for f in fields(model)))


def main() -> int:
    shown = set().union(*map(classes, models(gallery.part()).values()))
    return len(set(model_names()) - shown - {"on"})


if __name__ == "__main__":
    part = gallery.part()
    made = gallery.skins(part, models(part))
    gallery.draw(sys.argv[1] if len(sys.argv) > 1 else "all_models.png", made, columns=7, tile=(212, 162))
