"""The frame of the command line: codes, one-line errors, where output goes."""

from __future__ import annotations

import subprocess
import sys
import warnings

import pytest
import typer

import cadskin
from cadskin.cli import main as cli
from cadskin.errors import CadskinWarning, ReadError


def run(*words: str, **options) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cadskin.cli.main", *words]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=False, **options)


@pytest.fixture
def command_that(monkeypatch):
    """Put one command into an otherwise empty application."""

    def put(function):
        def build(names):
            app = typer.Typer()
            app.callback()(lambda: None)
            app.command("do")(function)
            return app

        monkeypatch.setattr(cli, "build", build)

    return put


def test_version_is_the_package_version():
    done = run("--version")
    assert (done.returncode, done.stdout) == (0, f"cadskin {cadskin.__version__}\n")


def test_help_lists_every_command():
    done = run("--help")
    assert done.returncode == 0
    assert all(name in done.stdout for name in cli.COMMANDS)


def test_no_word_at_all_shows_the_help():
    done = run()
    assert done.returncode == 2
    assert done.stdout == run("--help").stdout
    assert done.stderr == ""


def test_help_of_the_program_cuts_no_command_short():
    cut = [
        line for line in run("--help").stdout.partition("Commands:")[2].splitlines() if line.endswith("...")
    ]
    assert cut == [], "shorten the first line of the docstring of these commands"


@pytest.mark.parametrize("name", sorted(cli.COMMANDS))
def test_every_command_has_help(name):
    done = run(name, "--help")
    assert done.returncode == 0
    assert "Usage: cadskin " + name in done.stdout


@pytest.mark.parametrize("words", [["no-such-command"], ["doctor", "--no-such-option"], ["doctor", "extra"]])
def test_wrong_words_are_one_line_and_code_2(words):
    done = run(*words)
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("cadskin: ")
    assert done.stderr.count("\n") == 1


def raises(error):
    def do() -> None:
        raise error

    return do


@pytest.mark.parametrize(
    ("error", "code", "text"),
    [
        (ReadError("a.step: it is no STEP file\nat all"), 3, "cadskin: a.step: it is no STEP file at all\n"),
        (KeyboardInterrupt(), 130, "cadskin: stopped; nothing was left half written\n"),
        (
            FileNotFoundError(2, "No such file or directory", "x"),
            3,
            "cadskin: x: No such file or directory\n",
        ),
        (ZeroDivisionError("division by zero"), 70, "--debug"),
        (ModuleNotFoundError("No module named 'gmsh'", name="gmsh"), 3, "pip install 'cadskin[gmsh]'"),
        (OSError("libGLU.so.1: cannot open shared object file: none"), 3, "apt-get install libglu1-mesa"),
        (MemoryError(), 3, "out of memory"),
    ],
)
def test_errors_become_one_line_and_a_code(command_that, capfd, error, code, text):
    command_that(raises(error))
    assert cli.main(["do"]) == code
    told = capfd.readouterr()
    assert text in told.err
    assert told.err.count("\n") <= 2  # typer ends the line of ^C before ours
    assert "Traceback" not in told.err


def test_debug_lets_the_exception_through(command_that):
    command_that(raises(ZeroDivisionError("division by zero")))
    with pytest.raises(ZeroDivisionError):
        cli.main(["do", "--debug"])


def test_our_warnings_are_one_line_and_others_are_kept_back(command_that, capfd):
    def do() -> None:
        warnings.warn("the shape was healed", CadskinWarning, stacklevel=1)
        warnings.warn("something of another library", RuntimeWarning, stacklevel=1)

    command_that(do)
    assert cli.main(["do"]) == 0
    assert capfd.readouterr().err == "cadskin: warning: the shape was healed\n"


def test_full_disk_behind_standard_output_is_one_line():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "cadskin.cli.main", "doctor", "--no-imports", "--json"],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=60,
            check=False,
        )
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1] == "cadskin: No space left on device"
