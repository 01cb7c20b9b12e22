"""The page on deviations says what the code does, and names every model."""

from __future__ import annotations

import contextlib
import io
import re
from pathlib import Path

from cadskin.deviation import from_dict, model_class, model_names
from cadskin.spec.toml_read import parse_spec

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "deviations.md").read_text(encoding="utf-8")
MADE_BY_OPERATORS = {"SumModel", "ScaledModel", "RestrictedModel"}


def test_code_prints_what_the_page_shows():
    space: dict[str, object] = {}
    found = re.findall(r"```python\n(.*?)```\n\n    (.*?)\n", PAGE, flags=re.S)
    assert len(found) == 3
    for code, printed in found:
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            exec(code, space)
        assert out.getvalue().strip() == printed


def test_every_model_is_on_the_page():
    classes = {model_class(name).__name__ for name in model_names()}
    missing = {name for name in classes - MADE_BY_OPERATORS if f"`{name}`" not in PAGE}
    assert missing == set()


def test_pictures_exist():
    names = re.findall(r"\]\((images/.*?)\)", PAGE)
    assert len(names) == 4
    assert all((ROOT / "docs" / name).stat().st_size > 10_000 for name in names)


def test_the_specification_holds_the_model():
    (text,) = re.findall(r"```toml\n(.*?)```", PAGE, flags=re.S)
    (tolerance,) = tuple(parse_spec(text))
    model = from_dict(tolerance.model).resolved(tolerance=tolerance.value)
    assert str(model) == "GaussianField(sigma=0.00625 mm, length=12 mm, kernel='matern32')"
