"""Examine the installation: what is there, what is broken, and the line that repairs it.

Only the standard library is used, and the geometry kernel is never imported into this process, so that the
examination works where the installation does not.

>>> findings = examine(imports=False)
>>> sorted({finding.state for finding in findings} - {"ok", "absent", "note", "broken"})
[]
"""

from __future__ import annotations

import ctypes
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Literal

from cadskin._kernel_cache import kernels_to_compile

__all__ = [
    "Finding",
    "broken",
    "examine",
    "explain_import_error",
    "explain_missing_library",
    "kernel_wheel",
    "repair",
    "report",
]

State = Literal["ok", "note", "absent", "broken"]

BASE = ("numpy", "scipy", "numba", "pythoncdt", "cadquery", "typer", "rich")
# Extra -> (distribution, module).
EXTRAS = {
    "build123d": ("build123d", "build123d"),
    "gmsh": ("gmsh", "gmsh"),
    "pymeshlab": ("pymeshlab", "pymeshlab"),
    "view": ("pyvista", "pyvista"),
}
KERNEL_WHEELS = ("cadquery-ocp", "cadquery-ocp-novtk")

# Shared library that a wheel expects from the system -> Debian package that has it.
DEBIAN_PACKAGES = {
    "libGL.so.1": "libgl1",
    "libX11.so.6": "libx11-6",
    "libexpat.so.1": "libexpat1",
    "libGLU.so.1": "libglu1-mesa",
    "libXrender.so.1": "libxrender1",
    "libXcursor.so.1": "libxcursor1",
    "libXfixes.so.3": "libxfixes3",
    "libXext.so.6": "libxext6",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libfontconfig.so.1": "libfontconfig1",
    "libOpenGL.so.0": "libopengl0",
    "libEGL.so.1": "libegl1",
    "libgomp.so.1": "libgomp1",
    "libz.so.1": "zlib1g",
    "libxcb.so.1": "libxcb1",
    "libglib-2.0.so.0": "libglib2.0-0",
    "libSM.so.6": "libsm6",
    "libICE.so.6": "libice6",
}
# Who needs which (from the NEEDED entries of the wheels' files).
LIBRARIES = {
    "cadquery": ("libGL.so.1", "libX11.so.6", "libexpat.so.1"),
    "gmsh": (
        "libGLU.so.1",
        "libGL.so.1",
        "libXrender.so.1",
        "libXcursor.so.1",
        "libXfixes.so.3",
        "libXext.so.6",
        "libXft.so.2",
        "libfontconfig.so.1",
        "libXinerama.so.1",
        "libX11.so.6",
        "libgomp.so.1",
    ),
    "pymeshlab": ("libGL.so.1", "libOpenGL.so.0"),
}


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at.

    Parameters
    ----------
    subject : str
        What was looked at.
    state : {"ok", "note", "absent", "broken"}
        ``absent`` is an optional part that is not installed; only ``broken`` needs a repair.
    detail : str
        Version, place, or what is wrong.
    repair : str or None
        The command that repairs it.
    """

    subject: str
    state: State
    detail: str
    repair: str | None = None


def examine(*, imports: bool = True) -> tuple[Finding, ...]:
    """Examine the installation.

    Parameters
    ----------
    imports : bool
        Import the heavy packages as well, each in a process of its own (some seconds).

    Returns
    -------
    tuple of Finding
    """
    return (
        _python(),
        *_base_packages(),
        kernel_wheel(),
        *_extras(),
        *_system_libraries(),
        *(_imports() if imports else ()),
        _kernel_cache(),
    )


def broken(findings: tuple[Finding, ...]) -> tuple[Finding, ...]:
    """Return the findings that need a repair."""
    return tuple(finding for finding in findings if finding.state == "broken")


def report(findings: tuple[Finding, ...]) -> str:
    """Return the findings as plain text for a bug report, the home folder written as ``~``."""
    lines = [
        f"{f.state:<7} {f.subject}: {f.detail}" + (f" | {f.repair}" if f.repair else "") for f in findings
    ]
    system = f"{platform.system()} {platform.release()} {platform.machine()}, {os.cpu_count()} processors"
    home = str(Path.home())
    return "\n".join([f"system  {system}", *lines]).replace(home, "~")


def repair(findings: tuple[Finding, ...]) -> tuple[str, ...]:
    """Run the repair lines of what is broken; return those that could not be run or failed.

    ``pip`` lines run with this Python; ``apt-get`` lines run only for root, others are returned.
    """
    lines = dict.fromkeys(finding.repair for finding in broken(findings) if finding.repair)
    return tuple(line for line in lines if not _run_repair(line))


def _run_repair(line: str) -> bool:
    tool, *words = shlex.split(line)
    if tool == "pip":
        return _succeeds([sys.executable, "-m", "pip", *words])
    is_root = hasattr(os, "geteuid") and os.geteuid() == 0
    if tool == "apt-get" and is_root and shutil.which(tool):
        _succeeds([tool, "update", "-qq"])
        return _succeeds([tool, *words, "-y", "-qq", "--no-install-recommends"])
    return False


def _succeeds(command: list[str]) -> bool:
    return subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode == 0


def explain_import_error(error: ImportError | OSError) -> str:
    """Return one line that says what to install when an import, or the loading of a library, failed.

    Examples
    --------
    >>> explain_import_error(ImportError("libGL.so.1: cannot open shared object file: No such file"))
    'the system library libGL.so.1 is missing: apt-get install libgl1'
    >>> explain_import_error(ModuleNotFoundError("No module named 'gmsh'", name="gmsh"))
    "the package gmsh is missing: pip install 'cadskin[gmsh]'"
    """
    cause = cause_of_import_error(error)
    return cause or f"an import failed ({error}); `cadskin doctor` says what is broken"


def cause_of_import_error(error: ImportError | OSError) -> str | None:
    """Return what `explain_import_error` does, or None where the cause is not one that is known here."""
    library = explain_missing_library(str(error))
    if library:
        return library
    for extra, (_, module) in EXTRAS.items():
        if getattr(error, "name", None) == module:
            return f"the package {module} is missing: pip install 'cadskin[{extra}]'"
    wheel = kernel_wheel()
    if wheel.state == "broken":
        return f"{wheel.detail}; repair: {wheel.repair}"
    return None


def explain_missing_library(text: str) -> str | None:
    """Return one line that names the Debian package, if ``text`` is the loader's complaint about a library.

    Examples
    --------
    >>> explain_missing_library("ImportError: libX11.so.6: cannot open shared object file: No such file")
    'the system library libX11.so.6 is missing: apt-get install libx11-6'
    >>> explain_missing_library("some other error") is None
    True
    """
    library = re.search(r"(lib[\w+.-]*\.so[.\d]*): cannot open shared object", text)
    if library is None:
        return None
    package = DEBIAN_PACKAGES.get(library[1])
    how = f"apt-get install {package}" if package else "install the system's package that holds it"
    return f"the system library {library[1]} is missing: {how}"


def kernel_wheel(path: Sequence[str] | None = None) -> Finding:
    """Find out which wheel's geometry kernel is on the disk, without importing it.

    Parameters
    ----------
    path : sequence of str, optional
        Folders to look into; `sys.path` by default.

    Notes
    -----
    ``cadquery-ocp`` and ``cadquery-ocp-novtk`` install the same package ``OCP``; the last one to be unpacked
    wins. Each wheel's RECORD holds the size of its binary: the one that equals the file's is the winner.
    cadquery needs the first; the first serves everybody.
    """
    installed = {name: dist for name in KERNEL_WHEELS if (dist := _distribution(name, path)) is not None}
    if not installed:
        return Finding("geometry kernel", "broken", "no OCP wheel is installed", _repair(None))
    versions = {name: dist.version for name, dist in installed.items()}
    label = ", ".join(f"{name} {version}" for name, version in versions.items())
    repair = _repair(versions.get("cadquery-ocp") or versions["cadquery-ocp-novtk"])
    if len(set(versions.values())) > 1:
        what = f"{label} are of different versions and overwrite each other"
        return Finding("geometry kernel", "broken", what, _repair(None) + " 'build123d<0.13'")
    winners = [name for name, dist in installed.items() if _is_on_disk(dist)]
    if "cadquery-ocp" in winners:
        return Finding("geometry kernel", "ok", f"{label}; cadquery-ocp is on the disk")
    if not winners:
        return Finding(
            "geometry kernel", "broken", f"{label}: the files of OCP are missing or foreign", repair
        )
    what = "cadquery-ocp-novtk is on the disk, which cadquery cannot use"
    return Finding("geometry kernel", "broken", f"{label}; {what}", repair)


def _repair(version: str | None) -> str:
    """Return the line that puts the wheel back that serves both cadquery and build123d."""
    if version is None:
        return "pip install --force-reinstall 'cadquery-ocp>=7.9,<8' 'cadquery>=2.8'"
    return f"pip install --force-reinstall --no-deps cadquery-ocp=={version}"


def _distribution(name: str, path: Sequence[str] | None = None) -> metadata.Distribution | None:
    found = metadata.distributions(name=name, path=list(sys.path if path is None else path))
    return next(iter(found), None)


def _is_on_disk(dist: metadata.Distribution) -> bool:
    """Tell whether the binary of this wheel is the one that lies on the disk."""
    for file in dist.files or []:
        if re.fullmatch(r"OCP/OCP\.[^/]*(so|pyd)", file.as_posix()):
            place = Path(str(dist.locate_file(file)))
            return place.is_file() and place.stat().st_size == file.size
    return False


def _python() -> Finding:
    version = platform.python_version()
    return Finding("Python", "ok", f"{version} ({platform.python_implementation()})")


def _base_packages() -> Iterator[Finding]:
    own = _distribution("cadskin")
    if own is None:
        yield Finding("cadskin", "broken", "runs from a folder without being installed", "pip install .")
    else:
        yield Finding("cadskin", "ok", own.version)
    for name in BASE:
        dist = _distribution(name)
        if dist is None:
            yield Finding(name, "broken", "not installed", f"pip install {name}")
        else:
            yield Finding(name, "ok", dist.version)


def _extras() -> Iterator[Finding]:
    for extra, (name, _) in EXTRAS.items():
        dist = _distribution(name)
        if dist is None:
            yield Finding(f"extra {extra}", "absent", f"pip install 'cadskin[{extra}]'")
        else:
            yield Finding(f"extra {extra}", "ok", f"{name} {dist.version}")


def _system_libraries() -> Iterator[Finding]:
    """Look for the shared libraries that the installed wheels expect from a Linux system."""
    if sys.platform != "linux":
        return
    for name, libraries in LIBRARIES.items():
        if _distribution(name) is None:
            continue
        missing = [library for library in libraries if not _loads(library)]
        if missing:
            packages = " ".join(sorted({DEBIAN_PACKAGES[library] for library in missing}))
            what = f"{', '.join(missing)} missing on this system"
            yield Finding(f"libraries of {name}", "broken", what, f"apt-get install {packages}")
        else:
            yield Finding(f"libraries of {name}", "ok", f"{len(libraries)} found")


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


def _imports() -> Iterator[Finding]:
    for module in ("cadquery", *(module for _, module in EXTRAS.values())):
        if find_spec(module) is not None:
            yield _import_in_child(module)


def _import_in_child(module: str, *, seconds: float = 120.0) -> Finding:
    command = [sys.executable, "-W", "ignore", "-c", f"import {module}"]
    subject = f"import {module}"
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        return Finding(subject, "broken", f"does not end within {seconds:.0f} s", f"pip install -U {module}")
    if done.returncode == 0:
        return Finding(subject, "ok", "works")
    if done.returncode < 0:
        return Finding(
            subject, "broken", f"crashes with signal {-done.returncode}", f"pip install -U {module}"
        )
    last = (done.stderr.strip().splitlines() or ["no message"])[-1]
    library = re.search(r"(lib[\w+.-]*\.so[.\d]*): cannot open", last)
    package = DEBIAN_PACKAGES.get(library[1]) if library else None
    return Finding(subject, "broken", last, f"apt-get install {package}" if package else _import_repair())


def _import_repair() -> str:
    return kernel_wheel().repair or "pip install --upgrade --force-reinstall cadskin"


def _kernel_cache() -> Finding:
    missing = kernels_to_compile()
    if not missing:
        return Finding("compiled kernels", "ok", "in numba's cache")
    what = f"not in the cache: {', '.join(missing)}; the first command compiles them once"
    return Finding("compiled kernels", "note", what)
