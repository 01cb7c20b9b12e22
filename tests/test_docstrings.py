"""The examples in the docstrings run (each module's in a namespace of its own)."""

from __future__ import annotations

import doctest
import importlib
import pkgutil

import numpy as np
import pytest

import cadskin

SKIPPED_ROOMS = {"cadskin.cli"}  # `main` replaces the process's warnings; tests/cli runs it instead


def modules() -> list[str]:
    found = pkgutil.walk_packages(cadskin.__path__, "cadskin.")
    return ["cadskin", *sorted(info.name for info in found if not info.name.startswith(tuple(SKIPPED_ROOMS)))]


@pytest.mark.parametrize("name", modules())
def test_docstring_examples(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)  # an example may write a file
    module = importlib.import_module(name)
    with np.printoptions(legacy=False):
        result = doctest.testmod(module, optionflags=doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS)
    assert result.failed == 0
