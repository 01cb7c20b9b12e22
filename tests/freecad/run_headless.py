"""Run the workbench's tests in a real FreeCAD without a window; exit code 0 when all ran and passed.

    python tests/freecad/run_headless.py [--python PYTHON] [--addon DIR] [--only-tests]

The stages: the tests of the workbench by ``freecadcmd -t``; a document with a skin model opened by a FreeCAD
without the workbench; a FreeCAD that is killed during a job, whose worker must end; and a workbench with a
broken module, which must be found out. The checkout is linked as the addon, as the Addon Manager clones it.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
LIMIT = 900  # seconds for all tests; the kernels may have to be compiled
MODULE = "freecad.CadSkin.tests"


def environment_of(home, python, addon):
    """Return the environment of a FreeCAD with a profile of its own, the addon linked into it."""
    (home / "Mod").mkdir(parents=True)
    if addon is not None:
        (home / "Mod" / "cadskin").symlink_to(addon, target_is_directory=True)
    left = {
        name: value
        for name, value in os.environ.items()
        if name not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")
    }
    return {
        **left,
        "FREECAD_USER_HOME": str(home),
        "FREECAD_USER_DATA": str(home),
        "FREECAD_USER_TEMP": str(home),
        "CADSKIN_WORKER_PYTHON": python,
    }


def freecad(environment, *arguments, timeout=LIMIT):
    """Run freecadcmd and return (exit code, what it printed)."""
    command = ["freecadcmd", *arguments]
    try:
        done = subprocess.run(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=timeout,
            check=False,
        )
    except subprocess.TimeoutExpired as error:
        return 124, ((error.stdout or b"") + (error.stderr or b"")).decode("utf-8", "replace")
    return done.returncode, (done.stdout + done.stderr).decode("utf-8", "replace")


def run_tests(environment):
    """Run the tests; return (exit code, how many ran, the text)."""
    code, text = freecad(environment, "-t", MODULE)
    found = re.search(r"^Ran (\d+) tests? in", text, re.MULTILINE)
    count = int(found.group(1)) if found else 0
    if code == 0 and (not count or not re.search(r"^OK\b", text, re.MULTILINE)):
        code = 1  # FreeCAD's exit code is not trusted alone
    return code, count, text


def script(folder, name, text):
    """Write a script for freecadcmd that ends with an exit code of its own; return its path."""
    path = folder / name
    body = "\n".join(f"    {line}" for line in text.strip().splitlines())
    path.write_text(
        "import os, sys, traceback\ntry:\n" + body + "\nexcept BaseException:\n    traceback.print_exc()\n"
        "    sys.stdout.flush(); sys.stderr.flush(); os._exit(1)\nsys.stdout.flush(); os._exit(0)\n",
        encoding="utf-8",
    )
    return str(path)


MAKE = """
import FreeCAD
from freecad.CadSkin import api
document = FreeCAD.newDocument("Kept")
box = document.addObject("Part::Box", "Box")
document.recompute()
api.add_tolerance(box, "Face6", "flatness", 0.05)
skin = api.compute(api.create_skin(box, edge_length=2.5), timeout=300)
document.saveAs({path!r})
"""

OPEN_WITHOUT = """
import FreeCAD
try:
    import freecad.CadSkin
except ImportError:
    pass
else:
    raise AssertionError("the workbench is there")
document = FreeCAD.openDocument({path!r})
skin = document.getObject("Skin")
assert skin.Mesh.CountPoints > 100 and skin.Mesh.isSolid(), skin.Mesh
tolerance = document.getObject("Tolerance")
assert abs(tolerance.Value.Value - 0.05) < 1e-12 and tolerance.Faces[1] == ["Face6"]
"""

BE_KILLED = """
import FreeCAD, time
from freecad.CadSkin import api, engine, jobs
document = FreeCAD.newDocument("Killed")
box = document.addObject("Part::Box", "Box")
document.recompute()
skin = api.create_skin(box, edge_length=2.5, instances=100000)
api.compute(skin, wait=False)
job = jobs.job_of(skin)
while job.text != "drawing parts":
    engine.engine().pump(0.05)
with open({path!r}, "w") as stream:
    stream.write(str(engine.engine().process_id))
time.sleep(600)
"""


def open_without_addon(folder, environment, bare):
    """Compute a skin model, open its document without the workbench; return what went wrong, or nothing."""
    path = str(folder / "kept.FCStd")
    for name, text, given in (("make.py", MAKE, environment), ("open.py", OPEN_WITHOUT, bare)):
        code, printed = freecad(given, script(folder, name, text.format(path=path)))
        if code != 0:
            return f"{name}: exit code {code}\n{printed}"
    return ""


def kill_freecad(folder, environment):
    """Kill FreeCAD during a job; return what went wrong: its worker must end and leave nothing behind."""
    mark = folder / "worker.pid"
    path = script(folder, "killed.py", BE_KILLED.format(path=str(mark)))
    jobs = folder / "jobs"
    jobs.mkdir()
    process = subprocess.Popen(
        ["freecadcmd", path],
        env={**environment, "TMPDIR": str(jobs)},
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    try:
        deadline = time.monotonic() + 300
        while not (mark.exists() and mark.read_text()):
            if time.monotonic() > deadline or process.poll() is not None:
                return f"FreeCAD did not come to the job (exit code {process.poll()})"
            time.sleep(0.1)
        worker = int(mark.read_text())
        if not alive(worker):
            return "the worker had ended before"
    finally:
        process.send_signal(signal.SIGKILL)
        process.wait()
    deadline = time.monotonic() + 15
    while alive(worker):
        if time.monotonic() > deadline:
            os.kill(worker, signal.SIGKILL)
            return f"the worker {worker} went on 15 s after FreeCAD was killed"
        time.sleep(0.1)
    left = [item.name for item in jobs.glob("cadskin-job-*")]
    return f"the worker left {', '.join(left)} behind" if left else ""


def alive(process_id):
    """Tell whether a process runs; one that has ended and that nobody has waited for does not."""
    try:
        state = Path(f"/proc/{process_id}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state not in "ZX"


def broken_workbench(folder, workbench, python):
    """Run the tests of a workbench with a broken module; return what went wrong: they must fail."""
    copy = folder / "broken" / "freecad_workbench"
    shutil.copytree(workbench, copy, ignore=shutil.ignore_patterns("__pycache__"))
    module = copy / "freecad" / "CadSkin" / "signature.py"
    module.write_text("raise RuntimeError('broken on purpose')\n", encoding="utf-8")
    code, _count, _text = run_tests(environment_of(folder / "broken-home", python, copy))
    return "" if code != 0 else "the tests of a broken workbench passed: they test nothing"


def main():
    """Run the stages and return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--python", default=os.environ.get("CADSKIN_WORKER_PYTHON", sys.executable))
    parser.add_argument("--addon", type=Path, default=ROOT)
    parser.add_argument("--only-tests", action="store_true")
    given = parser.parse_args()
    if shutil.which("freecadcmd") is None:
        print("there is no freecadcmd; install FreeCAD", file=sys.stderr)
        return 1
    python = str(Path(shutil.which(given.python) or given.python).absolute())
    with tempfile.TemporaryDirectory(prefix="cadskin-freecad-") as place:
        folder = Path(place)
        environment = environment_of(folder / "home", python, given.addon.resolve())
        code, count, text = run_tests(environment)
        print(f"freecadcmd -t {MODULE}: {count} tests, {'passed' if code == 0 else 'FAILED'}")
        if code != 0:
            print(text)
            return 1
        if given.only_tests:
            return 0
        bare = environment_of(folder / "bare", python, None)
        workbench = given.addon / "freecad_workbench"
        for name, problem in (
            ("a document without the workbench", open_without_addon(folder, environment, bare)),
            ("FreeCAD killed during a job", kill_freecad(folder, environment)),
            ("a broken module is found out", broken_workbench(folder, workbench, python)),
        ):
            print(f"{name}: {'FAILED' if problem else 'passed'}")
            if problem:
                print(problem)
                code = 1
    return code


if __name__ == "__main__":
    sys.exit(main())
