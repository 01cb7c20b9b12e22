"""Run the study, draw its figures and write its page: ``python -m case_study`` in ``examples``."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import cadskin as cs

from .figures import draw_all
from .page import write_page
from .study import run

DOCS = Path(__file__).resolve().parents[2] / "docs"


def main(arguments: Sequence[str]) -> int:
    docs = Path(arguments[0]) if arguments else DOCS
    try:
        study = run()
    except cs.CadskinError as error:
        print(error, file=sys.stderr)
        return 1
    for path in draw_all(docs / "images", study.material):
        print("wrote", path)
    print("wrote", write_page(docs / "case_study.md", study))
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
