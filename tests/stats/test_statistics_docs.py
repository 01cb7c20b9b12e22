"""The page on statistics runs as it stands, and says what comes out."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

PAGE = (Path(__file__).parents[2] / "docs" / "statistics.md").read_text(encoding="utf-8")


def test_the_code_of_the_page_runs():
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.S)
    assert len(blocks) == 4
    space: dict[str, object] = {}
    out = io.StringIO()
    with contextlib.redirect_stdout(out):
        for block in blocks:
            exec(block, space)
    told = out.getvalue()
    left, of = map(float, re.search(r"six points: ([\d.]+) µm left of ([\d.]+) µm", told).groups())
    assert left < 0.7 * of
    assert int(re.search(r"(\d+) % measured", told).group(1)) > 90
    assert space["inside"].mean() > 0.8
    assert space["thousand"].deviations.shape[0] == 1000
    print(told)
