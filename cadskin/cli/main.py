"""Entry point of ``cadskin``: finds the command, runs it, turns whatever goes wrong into one line and a code.

Exit codes: 0 done, 1 an answer of "no" (not conforming, a broken installation), 2 a wrong request, 3 an input
that cannot be read or an output that cannot be written, 70 a defect of cadskin, 130 stopped by Ctrl-C.
"""

from __future__ import annotations

import os
import signal
import sys
import warnings
from collections.abc import Iterable, Sequence
from importlib import import_module
from types import FrameType
from typing import Annotated, Any, TextIO

import typer

import cadskin
from cadskin.cli._console import failure, note
from cadskin.errors import CadskinError, CadskinWarning

__all__ = ["COMMANDS", "main"]

# Command -> module that holds its function ``command``; loaded only when it is asked for.
COMMANDS = {
    "convert": "cadskin.cli.convert",
    "info": "cadskin.cli.info",
    "faces": "cadskin.cli.faces",
    "mesh": "cadskin.cli.mesh",
    "spec": "cadskin.cli.spec",
    "doctor": "cadskin.cli.doctor",
    "evaluate": "cadskin.cli.evaluate",
    "reference": "cadskin.cli.reference",
    "measure": "cadskin.cli.measure",
    "verify": "cadskin.cli.verify",
    "simulate": "cadskin.cli.simulate",
    "export": "cadskin.cli.export",
    "worst": "cadskin.cli.worst",
}

EXIT_USAGE = 2
EXIT_DEFECT = 70
EXIT_INTERRUPTED = 130
EXIT_BROKEN_PIPE = 141
EXIT_TERMINATED = 143


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Words after the program's name; those of the process by default.

    Examples
    --------
    >>> main(["--version"])  # doctest: +ELLIPSIS
    cadskin ...
    0
    """
    words = list(sys.argv[1:] if arguments is None else arguments)
    words, debug = _without_debug(words)
    with warnings.catch_warnings():
        _install_warnings(debug=debug)
        if debug:
            return _run(words)
        return _run_safely(words)


def build(names: Iterable[str]) -> typer.Typer:
    """Return the application with the named commands; their modules are imported here."""
    app = typer.Typer(
        name="cadskin",
        help=cadskin.__doc__.splitlines()[0] if cadskin.__doc__ else None,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # help texts hold units in brackets, such as [mm]
        context_settings={"help_option_names": ["-h", "--help"]},
        epilog="Add --debug to any command to see where an error comes from.",
    )
    app.callback()(_options)
    for name in names:
        app.command(name)(import_module(COMMANDS[name]).command)
    return app


def _show_version(asked: bool) -> None:
    if asked:
        typer.echo(f"cadskin {cadskin.__version__}")
        raise typer.Exit


def _options(
    version: Annotated[
        bool,
        typer.Option("--version", is_eager=True, callback=_show_version, help="Show the version and exit."),
    ] = False,
) -> None:
    """As-manufactured parts from CAD: watertight meshes of a part as it could come off the machine."""


def _without_debug(words: list[str]) -> tuple[list[str], bool]:
    end = words.index("--") if "--" in words else len(words)
    kept = [word for word in words[:end] if word != "--debug"]
    return kept + words[end:], len(kept) < end


def _run(words: list[str]) -> int:
    """Run without catching anything that is not about the request."""
    if not words:
        _run(["--help"])
        return EXIT_USAGE
    asked = next((word for word in words if not word.startswith("-")), None)
    app = build([asked] if asked in COMMANDS else COMMANDS)
    result = app(words, prog_name="cadskin", standalone_mode=False)
    if result == EXIT_INTERRUPTED:  # what newer typers make of Ctrl-C
        raise KeyboardInterrupt
    sys.stdout.flush()
    return result if isinstance(result, int) else 0


def _run_safely(words: list[str]) -> int:
    previous = _on_terminate()
    try:
        return _run(words)
    except (KeyboardInterrupt, typer.Abort):
        return failure("stopped; nothing was left half written", EXIT_INTERRUPTED)
    except _Terminated:
        return failure("terminated; nothing was left half written", EXIT_TERMINATED)
    except BrokenPipeError:
        _discard_output()
        return EXIT_BROKEN_PIPE
    except Exception as error:
        return _report(error)
    finally:
        if previous is not None:
            signal.signal(signal.SIGTERM, previous)


def _report(error: Exception) -> int:
    """Say in one line what went wrong; return the exit code."""
    if isinstance(error, CadskinError):
        from cadskin.doctor import explain_missing_library

        return failure(explain_missing_library(str(error)) or str(error), error.exit_code)
    usage = getattr(error, "format_message", None)
    if usage is not None:  # typer's errors about the words of the command line
        message, code = _one_line(usage()), int(getattr(error, "exit_code", 2))
        return failure(f"{message} (see cadskin --help)", code) if message else code
    if isinstance(error, ImportError | OSError) and _is_about_loading(error):
        from cadskin.doctor import explain_import_error

        return failure(explain_import_error(error), 3)
    if isinstance(error, MemoryError):
        return failure("out of memory; ask for a larger --edge-length or for one --part at a time", 3)
    if isinstance(error, OSError) and error.strerror:
        _discard_output()
        name = f"{error.filename}: " if error.filename else ""
        return failure(f"{name}{error.strerror}", 3)
    what = f"{type(error).__name__}: {_one_line(str(error))}"
    return failure(f"internal error, {what}; run again with --debug and report it", EXIT_DEFECT)


def _is_about_loading(error: ImportError | OSError) -> bool:
    return isinstance(error, ImportError) or "cannot open shared object file" in str(error)


def _one_line(text: str) -> str:
    return " ".join(text.split())


class _Terminated(BaseException):
    """SIGTERM arrived: unwind, so that temporary files are removed."""


def _on_terminate() -> Any:
    def stop(_signal: int, _frame: FrameType | None) -> None:
        raise _Terminated

    try:
        return signal.signal(signal.SIGTERM, stop)
    except ValueError:  # not in the main thread: the host program owns the signals
        return None


def _discard_output() -> None:
    """Keep the interpreter from failing again when it flushes an output that is gone or full."""
    with open(os.devnull, "w") as sink:
        os.dup2(sink.fileno(), sys.stdout.fileno())


def _install_warnings(*, debug: bool) -> None:
    """Show our own warnings as one line each; keep those of other libraries for ``--debug``."""

    def show(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,  # noqa: ARG001
        line: str | None = None,  # noqa: ARG001
    ) -> None:
        if issubclass(category, CadskinWarning):
            note(f"warning: {message}")
        elif debug:
            note(f"{filename}:{lineno}: {category.__name__}: {message}")

    warnings.showwarning = show
    warnings.simplefilter("default" if debug else "ignore")
    warnings.simplefilter("always", CadskinWarning)


if __name__ == "__main__":
    sys.exit(main())
