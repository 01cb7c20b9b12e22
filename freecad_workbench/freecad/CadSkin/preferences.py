"""Preferences, and the Python that the worker runs in: where it is, whether it works, how it is made."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import FreeCAD

from .protocol import PROTOCOL, JobError, clean_environment

__all__ = [
    "WorkerInfo",
    "candidates",
    "create_environment",
    "environment_folder",
    "find_worker",
    "get",
    "parameters",
    "put",
    "try_python",
]

_GROUP = "User parameter:BaseApp/Preferences/Mod/CadSkin"
_DEFAULTS: dict[str, Any] = {
    "WorkerPython": "",  # empty: look for one
    "EdgeLength": 0.0,  # mm; 0: a hundredth of the diagonal
    "Seed": 1,
    "KeepWorker": True,
    "Instances": 1,
}
_START = 120.0  # seconds that a Python may take to load the kernel
_INSTALL = 1800.0
# Checks for cadskin without running it, then tells its version and protocol.
_PROBE = (
    "import importlib.util as u, json, sys\n"
    "found = u.find_spec('cadskin')\n"
    "if found is None: print(json.dumps({'missing': True, 'python': sys.version.split()[0]})); sys.exit()\n"
    "import cadskin\n"
    "worker = u.find_spec('cadskin.worker')\n"
    "protocol = None\n"
    "if worker is not None:\n"
    "    from cadskin.worker import PROTOCOL as protocol\n"
    "print(json.dumps({'python': sys.version.split()[0], 'cadskin': getattr(cadskin, '__version__', '?'),"
    " 'protocol': protocol}))\n"
)


def parameters() -> Any:
    """Return FreeCAD's parameter group of this workbench."""
    return FreeCAD.ParamGet(_GROUP)


def get(name: str) -> Any:
    """Return a preference.

    Parameters
    ----------
    name : str
        ``WorkerPython``, ``EdgeLength`` [mm], ``Seed``, ``KeepWorker`` or ``Instances``.
    """
    default, group = _DEFAULTS[name], parameters()
    if isinstance(default, bool):
        return group.GetBool(name, default)
    if isinstance(default, int):
        return group.GetInt(name, default)
    if isinstance(default, float):
        return group.GetFloat(name, default)
    return group.GetString(name, default)


def put(name: str, value: Any) -> None:
    """Set a preference; see `get`."""
    default, group = _DEFAULTS[name], parameters()
    if isinstance(default, bool):
        group.SetBool(name, bool(value))
    elif isinstance(default, int):
        group.SetInt(name, int(value))
    elif isinstance(default, float):
        group.SetFloat(name, float(value))
    else:
        group.SetString(name, str(value))


@dataclass(frozen=True)
class WorkerInfo:
    """What a Python says of itself.

    Parameters
    ----------
    python : str
        Its path.
    ok : bool
        Whether the worker can run in it.
    text : str
        Versions, or what is wrong and what to do.
    versions : dict
    """

    python: str
    ok: bool
    text: str
    versions: dict[str, Any] = field(default_factory=dict)


def environment_folder() -> Path:
    """Return the folder of the environment that `create_environment` makes."""
    return Path(FreeCAD.getUserAppDataDir()) / "CadSkin" / "environment"


def python_in(folder: Path) -> Path:
    """Return the Python of a virtual environment."""
    return folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def candidates() -> list[str]:
    """Return the Pythons that may have cadskin, the most likely first.

    A path in the preferences is the only candidate: what the user has chosen is not silently replaced.
    """
    chosen = get("WorkerPython")
    if chosen:
        return [chosen]
    found = [os.environ.get("CADSKIN_WORKER_PYTHON"), str(python_in(environment_folder()))]
    command = shutil.which("cadskin")
    if command:
        found.append(str(python_in(Path(command).resolve().parent.parent)))
    found += [shutil.which(name) for name in ("python3", "python")]
    there = [path for path in found if path and (Path(path).exists() or shutil.which(path))]
    return list(dict.fromkeys(there))


_known: dict[str, str] = {}


def find_worker() -> str:
    """Return the Python that has cadskin.

    Raises
    ------
    JobError
        None has; the message lists what was tried and says what to do.
    """
    tried = []
    for path in candidates():
        if path in _known:
            return path
        info = _probed(path)
        if info.ok:
            _known[path] = info.text
            return path
        tried.append(info.text)
    raise JobError(
        "WorkerMissing",
        " ".join(tried or ["No Python was found."])
        + " Set a Python with cadskin in Edit > Preferences > CadSkin, or create an environment there.",
    )


def forget_known() -> None:
    """Look again at the next job: a preference or an environment has changed."""
    _known.clear()


def _probed(path: str) -> WorkerInfo:
    """Ask a Python whether it has cadskin of the right protocol; the kernel is not loaded."""
    try:
        done = subprocess.run(
            [path, "-c", _PROBE],
            capture_output=True,
            stdin=subprocess.DEVNULL,
            timeout=_START,
            env=clean_environment(),
            cwd=_neutral_folder(),
            check=False,
        )
    except (OSError, subprocess.SubprocessError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        return WorkerInfo(path, False, f"{path} cannot be started: {reason}.")
    lines = done.stdout.decode("utf-8", "replace").strip().splitlines()
    try:
        values = json.loads(lines[-1]) if lines else {}
    except ValueError:
        values = {}
    return _judged(path, values, done.stderr.decode("utf-8", "replace"))


def _judged(path: str, values: dict[str, Any], printed: str) -> WorkerInfo:
    if not values:
        last = (printed.strip().splitlines() or ["it gave no answer"])[-1]
        return WorkerInfo(path, False, f"{path} does not work as Python: {last}.")
    if values.get("missing"):
        return WorkerInfo(path, False, f"{path} (Python {values['python']}) has no cadskin.", values)
    if values.get("protocol") != PROTOCOL:
        text = (
            f"{path} has cadskin {values.get('cadskin')}, which speaks protocol {values.get('protocol')}; "
            f"this workbench needs {PROTOCOL}: update cadskin or the workbench."
        )
        return WorkerInfo(path, False, text, values)
    text = f"cadskin {values['cadskin']}, Python {values['python']}"
    return WorkerInfo(path, True, text, values)


def try_python(path: str | None = None) -> WorkerInfo:
    """Run a job of the worker in a Python, the kernel included, and return what it says.

    Parameters
    ----------
    path : str, optional
        By default the one that jobs would use.
    """
    try:
        python = path or find_worker()
    except JobError as error:
        return WorkerInfo("", False, str(error))
    info = _probed(python)
    return _with_kernel(info) if info.ok else info


def _with_kernel(info: WorkerInfo) -> WorkerInfo:
    from .engine import Engine

    engine = Engine(python=info.python, use_qt=False)
    try:
        job = engine.submit({"task": "versions"})
        job.wait(_START)
    except JobError as error:
        return WorkerInfo(info.python, False, str(error), info.versions)
    finally:
        engine.close()
    if job.state != "done":
        return WorkerInfo(info.python, False, job.text, info.versions)
    found = job.result.get("versions", {})
    text = ", ".join(f"{name} {number}" for name, number in found.items())
    return WorkerInfo(info.python, True, text, found)


def create_environment(
    *,
    consent: bool,
    python: str | None = None,
    requirement: str = "cadskin",
    folder: Path | None = None,
    run: Any = subprocess.run,
) -> WorkerInfo:
    """Make a virtual environment with cadskin; this downloads packages, some hundred megabytes.

    Parameters
    ----------
    consent : bool
        The user has agreed to the download; without it nothing is done.
    python : str, optional
        The Python to make it with; by default the first on the path that is new enough.
    requirement : str
        What to install: a name, a folder with the sources, a wheel.
    folder : Path, optional
    run : callable
        `subprocess.run`, or what stands in for it.

    Raises
    ------
    JobError
        No consent, no Python, or the installation failed; the message has its last lines.
    """
    if not consent:
        raise JobError("NoConsent", "nothing was installed: the download of packages needs your consent")
    base = python or base_python()
    target = environment_folder() if folder is None else folder
    steps = (
        [base, "-m", "venv", "--clear", str(target)],
        [str(python_in(target)), "-m", "pip", "install", "--disable-pip-version-check", requirement],
    )
    for step in steps:
        try:
            done = run(
                step,
                capture_output=True,
                stdin=subprocess.DEVNULL,
                timeout=_INSTALL,
                env=clean_environment(),
                check=False,
            )
        except (OSError, subprocess.SubprocessError) as error:
            raise JobError("InstallError", f"{step[0]}: {error}") from error
        if done.returncode != 0:
            said = (done.stderr or done.stdout).decode("utf-8", "replace").strip().splitlines()[-5:]
            raise JobError("InstallError", f"{' '.join(step[1:4])} failed: " + " ".join(said))
    forget_known()
    put("WorkerPython", str(python_in(target)))
    return _probed(str(python_in(target)))


def base_python() -> str:
    """Return a Python from 3.11 on that can make an environment.

    Raises
    ------
    JobError
        There is none on the path.
    """
    names = ["python3", "python", *(f"python3.{minor}" for minor in (13, 12, 11))]
    for path in filter(None, map(shutil.which, names)):
        done = subprocess.run(
            [path, "-c", "import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))"],
            capture_output=True,
            stdin=subprocess.DEVNULL,
            env=clean_environment(),
            check=False,
        )
        if done.returncode == 0:
            return path
    raise JobError(
        "WorkerMissing",
        "no Python from 3.11 on with venv is on the path; install one "
        f"(FreeCAD's own is {sys.version.split()[0]})",
    )


def _neutral_folder() -> str:
    """Return a folder to start Python in: never one with a package of the same name in it."""
    return str(Path(FreeCAD.getUserAppDataDir()))
