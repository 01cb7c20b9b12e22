"""A spec file reads back as exactly the specification that was written."""

import tomllib

import pytest
from hypothesis import given, settings
from spec.strategies import file_specifications

from cadskin.errors import ExportError
from cadskin.spec import Specification, flatness, parse_spec, position, read_spec, to_toml, write_spec
from cadskin.spec.toml_lines import locate


@settings(max_examples=80, deadline=None)
@given(file_specifications())
def test_every_specification_round_trips(spec):
    text = to_toml(spec)
    again = parse_spec(text)
    assert again == spec
    assert to_toml(again) == text


@settings(max_examples=40, deadline=None)
@given(file_specifications())
def test_every_key_has_the_line_it_stands_on(spec):
    text = to_toml(spec)
    lines, located = text.split("\n"), locate(text)
    values = tomllib.loads(text)
    for key, value in values.items():
        assert (key,) in located
        if isinstance(value, list):
            for i, item in enumerate(value):
                first = next(iter(item))
                assert lines[located[key, i] - 1].lstrip().startswith("{")
                assert located[key, i, first] == located[key, i]


def test_a_written_file_reads_back(tmp_path):
    spec = Specification(
        flatness(">Z", 0.02), position(3, 0.1, datums="A|B", diameter=True), datums={"A": "<Z", "B": [1, 2]}
    )
    path = write_spec(tmp_path / "part.spec.toml", spec)
    again = read_spec(path)
    assert again == spec
    assert [t.source for t in again] == ["part.spec.toml:4", "part.spec.toml:5"]


def test_a_missing_folder_is_an_export_error(tmp_path):
    with pytest.raises(ExportError, match="choose another folder"):
        write_spec(tmp_path / "no" / "part.spec.toml", Specification())
