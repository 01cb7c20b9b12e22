"""The page on specifications: its spec files read, its Python runs."""

import re
from pathlib import Path

import pytest

from cadskin.spec import parse_spec
from cadskin.spec.toml_read import _TOLERANCE_KEYS

PAGE = (Path(__file__).parents[2] / "docs" / "specification.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.S)


@pytest.mark.parametrize("text", blocks("toml"))
def test_spec_files_of_the_page_read(text):
    assert len(parse_spec(text)) > 0


def test_the_first_file_means_what_it_says():
    spec = parse_spec(blocks("toml")[0])
    assert [str(t) for t in spec][2] == "⌖ ⌀0.1 Ⓜ | A | B | C"
    assert spec.tolerances[3].parent == "holes"
    assert spec.dimensions[0].upper == 12.018


def test_python_of_the_page_runs(capsys):
    (code,) = blocks("python")
    exec(code, {})
    assert "⌖ ⌀0.1 | A | B" in capsys.readouterr().out


def test_the_keys_of_the_page_exist():
    table = PAGE.partition("| key | meaning |")[2].partition("A mistake")[0]
    keys = {
        key for row in table.splitlines() for key in re.findall(r"`(\w+)`", row.split("|")[1] if row else "")
    }
    assert keys <= set(_TOLERANCE_KEYS)
