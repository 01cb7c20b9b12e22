"""Install cadquery and build123d into one fresh environment, break it, let the doctor repair it, use both.

Run by ``make coexist`` (it downloads packages, so it is not among the tests). The two libraries bring two
wheels that write the same package ``OCP``; this is the proof that the doctor sees and repairs the collision.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

USE_BOTH = """
import cadquery, build123d
a = cadquery.Workplane().box(2, 3, 4).val().Volume()
b = build123d.Box(2, 3, 4).volume
assert abs(a - 24) < 1e-9 and abs(b - 24) < 1e-9, (a, b)
wrapped = cadquery.Shape.cast(build123d.Box(2, 3, 4).solid().wrapped)
assert abs(wrapped.Volume() - 24) < 1e-9
"""


def run(*command: str, code: int = 0) -> str:
    """Run a command, insist on its exit code, return what it wrote."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT)
    if done.returncode != code:
        raise SystemExit(
            f"{' '.join(command)}\nended with {done.returncode}, not {code}\n{done.stderr[-2000:]}"
        )
    return done.stdout


def main() -> int:
    """Return the number of times that the doctor repaired the environment."""
    with tempfile.TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        binaries = Path(folder) / ("Scripts" if os.name == "nt" else "bin")
        python, cadskin = str(binaries / "python"), str(binaries / "cadskin")
        print("installing cadskin[build123d] into a fresh environment")
        run(python, "-m", "pip", "install", "--quiet", f"{ROOT}[build123d]")
        run(cadskin, "doctor", "--repair")
        run(python, "-c", USE_BOTH)
        print("both import; now the other wheel is unpacked over the first one")
        listed = json.loads(run(python, "-m", "pip", "list", "--format", "json"))
        version = next(item["version"] for item in listed if item["name"] == "cadquery-ocp-novtk")
        wheel = f"cadquery-ocp-novtk=={version}"
        run(python, "-m", "pip", "install", "--quiet", "--force-reinstall", "--no-deps", wheel)
        found = json.loads(run(cadskin, "doctor", "--no-imports", "--json", code=1))["findings"]
        broken = [finding["subject"] for finding in found if finding["state"] == "broken"]
        if broken != ["geometry kernel"]:
            raise SystemExit(f"the doctor found {broken}, not the collision")
        run(python, "-c", "import cadquery", code=1)
        print("cadquery is broken and the doctor says so; repairing")
        run(cadskin, "doctor", "--repair")
        run(python, "-c", USE_BOTH)
        print("repaired: cadquery and build123d import and share their shapes")
    return 1


if __name__ == "__main__":
    sys.exit(0 if main() == 1 else 1)
