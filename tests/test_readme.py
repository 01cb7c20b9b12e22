"""Every block of code in the README runs as it stands, in an empty folder with the example part in it."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cadskin.cli.main import main

ROOT = Path(__file__).resolve().parent.parent
TEXT = (ROOT / "README.md").read_text()


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TEXT, flags=re.MULTILINE | re.DOTALL)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    for name in ("bracket.step", "bracket.spec.toml"):
        shutil.copy(ROOT / "examples" / "parts" / name, tmp_path)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def commands() -> list[str]:
    return [line.split("  #")[0].strip() for block in blocks("sh") for line in block.splitlines()]


def test_there_is_something_to_run():
    assert len(blocks("python")) >= 2
    assert len(commands()) >= 5


def test_commands_run_one_after_the_other(folder, capsys):
    for command in commands():
        program, *words = shlex.split(command)
        assert program == "cadskin"
        assert main(words) == 0, (command, capsys.readouterr().err)
        if "-o" in words:
            assert (folder / words[words.index("-o") + 1]).stat().st_size > 1000 or "refs" in words
    assert {path.name for path in folder.iterdir()} >= {"bracket_skin.stl", "bracket_skin.png", "nominal.ply"}


@pytest.mark.parametrize("code", blocks("python"))
def test_script_runs(code, folder):
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=300, cwd=folder
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout


@pytest.mark.parametrize("target", re.findall(r"^    make ([a-z-]+)", TEXT, flags=re.MULTILINE))
def test_make_target_exists(target):
    assert re.search(rf"^{target}:", (ROOT / "Makefile").read_text(), flags=re.MULTILINE)


def test_links_to_files_point_to_files():
    targets = re.findall(r"\]\((?!https?:)([^)#]+)\)", TEXT)
    assert targets
    assert [target for target in targets if not (ROOT / target).exists()] == []
