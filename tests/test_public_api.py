"""The public names: each one loads, is documented, and is declared for type checkers."""

from __future__ import annotations

import ast
import inspect
import subprocess
import sys
from pathlib import Path

import pytest

import cadskin

NAMES = sorted(cadskin._HOMES)


@pytest.mark.parametrize("name", NAMES)
def test_name_loads_and_has_a_docstring(name):
    value = getattr(cadskin, name)
    assert inspect.getdoc(value), f"cadskin.{name} has no docstring"


@pytest.mark.parametrize("name", NAMES)
def test_name_is_exported_by_its_home(name):
    home = __import__(cadskin._HOMES[name], fromlist=["__all__"])
    assert name in home.__all__


def test_dir_and_all_agree_with_the_table():
    assert set(NAMES) | {"__version__"} == set(cadskin.__all__)
    assert set(NAMES) <= set(dir(cadskin))


def test_type_checkers_see_the_same_names():
    tree = ast.parse(Path(cadskin.__file__).read_text())
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.name for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert seen == set(NAMES)


def test_unknown_name_is_an_attribute_error():
    with pytest.raises(AttributeError, match="no attribute 'nothing_like_it'"):
        cadskin.nothing_like_it  # noqa: B018


def test_package_is_typed_and_its_version_is_the_distribution_version():
    from importlib.metadata import version

    assert (Path(cadskin.__file__).parent / "py.typed").is_file()
    assert version("cadskin") == cadskin.__version__


def test_verify_is_a_verb_before_and_after_its_room_is_imported():
    code = (
        "import cadskin\n"
        "first = cadskin.verify\n"
        "import cadskin.verify\n"
        "assert callable(first) and callable(cadskin.verify)\n"
        "assert cadskin.verify.flatness is not cadskin.flatness\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
