"""Every bad input of a user: one clear line, exit code 2 or 3, no traceback, nothing left behind.

All through the real command line, in a process of its own.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

PARTS = Path(__file__).resolve().parents[2] / "examples" / "parts"
BRACKET = PARTS / "bracket.step"
CADSKIN = [sys.executable, "-m", "cadskin.cli.main"]
WRITING = ["convert", "mesh"]


def run(*words, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [*CADSKIN, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False, cwd=cwd)


def assert_refused(done: subprocess.CompletedProcess[str], code: int, *texts: str) -> None:
    assert done.returncode == code, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    lines = [line for line in done.stderr.splitlines() if "compiling" not in line]
    assert len(lines) == 1, done.stderr
    assert lines[0].startswith("cadskin: ")
    assert len(lines[0]) < 400
    for text in texts:
        assert text.lower() in lines[0].lower()


@pytest.fixture(scope="session")
def bad(tmp_path_factory) -> Path:
    """A folder of files that are not what they should be."""
    import cadquery as cq

    folder = tmp_path_factory.mktemp("bad")
    (folder / "empty.step").touch()
    (folder / "text.step").write_text("This is a shopping list.\n" * 40)
    text = BRACKET.read_text()
    (folder / "truncated.step").write_text(text[: len(text) // 2])
    (folder / "folder.step").mkdir()
    sheet = cq.Workplane().rect(20, 10).extrude(5).faces(">Z").val()
    sheet.exportStep(str(folder / "surface.step"))
    write_tessellated(folder / "tessellated.step")
    return folder


def write_tessellated(path: Path) -> None:
    """Write a box as triangles only, without any exact surface (AP242)."""
    import cadquery as cq
    from OCP.BRep import BRep_Builder, BRep_Tool
    from OCP.Interface import Interface_Static
    from OCP.STEPControl import STEPControl_Controller, STEPControl_StepModelType, STEPControl_Writer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS_Compound, TopoDS_Face

    box = cq.Workplane().box(1, 2, 3).val()
    box.mesh(0.1)
    builder, triangles_only = BRep_Builder(), TopoDS_Compound()
    builder.MakeCompound(triangles_only)
    for face in box.Faces():
        bare = TopoDS_Face()
        builder.MakeFace(bare, BRep_Tool.Triangulation_s(face.wrapped, TopLoc_Location()))
        builder.Add(triangles_only, bare)
    STEPControl_Controller.Init_s()
    Interface_Static.SetCVal_s("write.step.schema", "AP242DIS")
    Interface_Static.SetIVal_s("write.step.tessellated", 1)
    writer = STEPControl_Writer()
    writer.Transfer(triangles_only, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))
    Interface_Static.SetIVal_s("write.step.tessellated", 2)


@pytest.mark.parametrize(
    ("name", "code", "text"),
    [
        ("missing.step", 3, "no such file"),
        ("empty.step", 3, "empty"),
        ("text.step", 3, "no STEP file"),
        ("truncated.step", 3, "truncated"),
        ("folder.step", 3, "folder"),
        ("tessellated.step", 3, "tessellated"),
    ],
)
@pytest.mark.parametrize("command", ["convert", "info"])
def test_input_that_is_no_part(bad, tmp_path, command, name, code, text):
    words = ["-o", tmp_path / "out.stl"] if command == "convert" else []
    assert_refused(run(command, bad / name, *words, cwd=tmp_path), code, name.split(".")[0], text)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", WRITING)
def test_surface_is_no_solid(bad, tmp_path, command):
    assert_refused(run(command, bad / "surface.step", "-o", "out.stl", cwd=tmp_path), 2, "surface", "solid")
    assert list(tmp_path.iterdir()) == []


def test_surface_works_as_an_open_shell_when_asked(bad, tmp_path):
    done = run("mesh", bad / "surface.step", "-o", "sheet.ply", "--allow-open", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "no" in next(line for line in done.stdout.splitlines() if "sheet.ply" in line).split()
    assert (tmp_path / "sheet.ply").stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (["--edge-length", "0"], "--edge-length"),
        (["--edge-length", "-1"], "--edge-length"),
        (["--edge-length", "nan"], "--edge-length"),
        (["--edge-length", "inf"], "--edge-length"),
        (["--edge-length", "abc"], "--edge-length"),
        (["--edge-length", "500"], "larger"),
        (["--edge-length", "0.005"], "--force"),
        (["--points", "2"], "--points"),
        (["--points", "500", "--edge-length", "1"], "exclude"),
        (["--edge-length-on", ">Q=1"], ">Q"),
        (["--edge-length-on", "no such face=1"], "no such face"),
        (["--edge-length-on", ">Z"], "FACES=MM"),
        (["--part", "wheel"], "wheel"),
        (["--backend", "magic"], "magic"),
        (["--time-limit", "-3"], "--time-limit"),
    ],
)
def test_option_without_meaning(tmp_path, words, text):
    assert_refused(run("convert", BRACKET, "-o", "out.stl", *words, cwd=tmp_path), 2, text)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ["--tolerance", "0"],
        ["--tolerance", "-0.1"],
        ["--tolerance", "nan"],
        ["--seed", "-1"],
        ["--sigma", "0"],
        ["--length", "nan"],
        ["--model", "magic"],
        ["--exaggeration", "0"],
    ],
)
def test_deviation_without_meaning(tmp_path, words):
    assert_refused(run("convert", BRACKET, "-o", "out.stl", *words, cwd=tmp_path), 2, words[0].lstrip("-"))
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("command", WRITING)
@pytest.mark.parametrize(
    ("output", "text"),
    [
        ("no/such/folder/out.stl", "no folder"),
        ("/proc/out.stl", "/proc"),
        ("out.docx", "stl"),
        ("out", "stl"),
    ],
)
def test_output_that_cannot_be(tmp_path, command, output, text):
    assert_refused(run(command, BRACKET, "-o", output, cwd=tmp_path), 3, text)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here")
@pytest.mark.parametrize("command", WRITING)
def test_full_disk(tmp_path, command):
    words = ["-o", "/dev/full", "--format", "stl", "--edge-length", "2"]
    assert_refused(run(command, BRACKET, *words, cwd=tmp_path), 3, "/dev/full")
    assert list(tmp_path.iterdir()) == []


def test_output_over_the_input_is_refused(tmp_path):
    copy = tmp_path / "part.step"
    copy.write_bytes(BRACKET.read_bytes())
    assert_refused(run("mesh", copy, "-o", copy, "--format", "stl", cwd=tmp_path), 3, "input")
    assert copy.read_bytes() == BRACKET.read_bytes()


@pytest.mark.skipif(os.name != "posix", reason="signals of a terminal")
@pytest.mark.parametrize(("sent", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_ctrl_c_in_mid_run(tmp_path, sent, code):
    """A terminal sends SIGINT to the whole group; the mesher's child must end with it."""
    words = ["mesh", str(BRACKET), "-o", "out.stl", "--edge-length", "0.05", "--force"]
    process = subprocess.Popen(
        [*CADSKIN, *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        start_new_session=True,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a run behind `&` ignores it
        env={**os.environ, "TMPDIR": str(tmp_path)},
    )
    deadline = time.monotonic() + 60
    while not (children := children_of(process.pid)) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert children, "the child process did not start"
    time.sleep(1.0)
    assert process.poll() is None, "it finished before it could be stopped"
    os.killpg(process.pid, sent)
    out, err = process.communicate(timeout=120)
    assert process.returncode == code, err
    assert out == ""
    assert "Traceback" not in err
    assert err.strip().splitlines()[-1].startswith("cadskin: ")
    assert list(tmp_path.iterdir()) == []
    assert not any(is_alive(child) for child in children)


def children_of(pid: int) -> list[int]:
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]
    except OSError:
        return []


def is_alive(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[0]
    except OSError:
        return False
    return state != "Z"
