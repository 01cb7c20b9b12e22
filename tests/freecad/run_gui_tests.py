"""Run the GUI tests in a real FreeCAD on a virtual screen; exit code 0 only when all of them ran and passed.

    python tests/freecad/run_gui_tests.py --out artifacts/freecad [--pattern gui_display.py] [--workbench DIR]

It makes a quiet FreeCAD profile in a temporary folder, links the workbench into its ``Mod`` folder, starts
FreeCAD under Xvfb with `gui_session.py`, and reads the result file that the session writes. FreeCAD's own
exit code is not trusted alone: there must be a result file, with at least one test, and no failure.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).resolve().parent
WORKBENCH = HERE.parents[1] / "freecad_workbench"
NEEDED = ("freecad", "freecadcmd", "xvfb-run", "xdotool", "import")
SCREEN = "-screen 0 1400x900x24 +extension GLX"


def make_profile(home, workbench):
    """Make a profile without dialogs, splash, start page and recovery, with the workbench in it."""
    (home / "Mod").mkdir(parents=True)
    (home / "Mod" / "CadSkin").symlink_to(workbench, target_is_directory=True)
    environment = {
        **os.environ,
        "FREECAD_USER_HOME": str(home),
        "FREECAD_USER_DATA": str(home),
        "FREECAD_USER_TEMP": str(home),
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "QTWEBENGINE_DISABLE_SANDBOX": "1",
    }
    # This Python's own folders are nothing to FreeCAD's Python.
    for name in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV"):
        environment.pop(name, None)
    subprocess.run(
        ["freecadcmd", str(HERE / "quiet_profile.py")],
        env=environment,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        timeout=60,
        check=True,
    )
    return environment


def run_session(environment, out, pattern, seconds):
    """Run FreeCAD with the tests; return its exit code, 124 when it did not end in time."""
    environment = {
        **environment,
        "CADSKIN_GUI_OUT": str(out),
        "CADSKIN_GUI_PATTERN": pattern,
        "CADSKIN_GUI_SECONDS": str(seconds),
        "CADSKIN_WORKER_PYTHON": environment.get("CADSKIN_WORKER_PYTHON", sys.executable),
    }
    command = [
        "timeout",
        "-k",
        "5",
        str(seconds + 20),
        "xvfb-run",
        "-a",
        "-s",
        SCREEN,
        "freecad",
        str(HERE / "gui_session.py"),
    ]
    with (out / "freecad.log").open("wb") as log:
        return subprocess.run(
            command,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
            check=False,
        ).returncode


def verdict(out, returncode):
    """Return (exit code, sentence) from the result file and FreeCAD's exit code."""
    result_file = out / "result.json"
    if not result_file.exists():
        return 1, f"no result file: FreeCAD ended with {returncode}; see freecad.log and stacks.txt in {out}"
    result = json.loads(result_file.read_text(encoding="utf-8"))
    sentence = (
        f"{result['ran']} GUI tests, {len(result['failures'])} failed, {result['skipped']} skipped, "
        f"{result['seconds']:.1f} s, FreeCAD {result['freecad']}"
    )
    if result["failures"]:
        names = "\n".join(f"  {failure['test']}\n{failure['text']}" for failure in result["failures"])
        return 1, f"{sentence}\n{names}"
    if not result["ran"]:
        return 1, f"{sentence}: nothing ran"
    return (0, sentence) if returncode == 0 else (1, f"{sentence}, but FreeCAD ended with {returncode}")


def control_problem(environment, workbench, folder, seconds):
    """Return what is wrong with this runner: a workbench with a broken module must turn it red."""
    broken = folder / "broken"
    shutil.copytree(workbench, broken, ignore=shutil.ignore_patterns("__pycache__"))
    (broken / "freecad" / "CadSkin" / "colormap.py").write_text("broken on purpose (\n", encoding="utf-8")
    link = Path(environment["FREECAD_USER_HOME"]) / "Mod" / "CadSkin"
    link.unlink()
    link.symlink_to(broken, target_is_directory=True)
    out = folder / "control"
    out.mkdir()
    code, sentence = verdict(out, run_session(environment, out, "gui_display.py", seconds))
    return None if code else f"the negative control was green: {sentence}"


def keep_pictures(out, folder):
    """Copy the pictures of the tutorial, made smaller, into a folder of the documentation."""
    for picture in sorted(out.glob("tutorial_*.png")):
        target = folder / picture.name.replace("tutorial", "freecad")
        command = ["convert", str(picture), "-resize", "1000x", "-strip", str(target)]
        subprocess.run(command, check=True, timeout=60)


def main():
    """Read the arguments, run, and say what came out."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder for pictures, log and result file")
    parser.add_argument("--pattern", default="gui_*.py", help="which files of tests/freecad/gui")
    parser.add_argument("--workbench", type=Path, default=WORKBENCH, help="another copy of the workbench")
    parser.add_argument("--seconds", type=int, default=400, help="limit of the whole session")
    parser.add_argument("--pictures", type=Path, help="put the tutorial's pictures into this folder, smaller")
    parser.add_argument("--no-control", action="store_true", help="leave out the negative control")
    arguments = parser.parse_args()
    missing = [program for program in NEEDED if shutil.which(program) is None]
    if missing:
        print(f"GUI tests need {', '.join(missing)}: apt-get install freecad xvfb xauth xdotool imagemagick")
        return 2
    out = arguments.out.resolve()
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    with tempfile.TemporaryDirectory(prefix="cadskin-freecad-") as home:
        environment = make_profile(Path(home) / "profile", arguments.workbench.resolve())
        returncode = run_session(environment, out, arguments.pattern, arguments.seconds)
        code, sentence = verdict(out, returncode)
        print(sentence)
        if code == 0 and arguments.pictures:
            keep_pictures(out, arguments.pictures)
        if code == 0 and not arguments.no_control:
            problem = control_problem(
                environment, arguments.workbench.resolve(), Path(home), arguments.seconds
            )
            print(problem or "negative control: a broken module is found out")
            code = 1 if problem else 0
    return code


if __name__ == "__main__":
    sys.exit(main())
