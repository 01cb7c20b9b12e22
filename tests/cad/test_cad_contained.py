"""The child process: same answers, same errors, and it never takes the parent down."""

import os
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from pathlib import Path

import cadquery as cq
import numpy as np
import pytest

from cadskin.cad import contained, contained_describe, contained_nominals, nominal
from cadskin.errors import Cancelled, GeometryError, KernelError, ReadError


@pytest.fixture(scope="module")
def two_parts(tmp_path_factory):
    path = tmp_path_factory.mktemp("contained") / "two.step"
    pair = cq.Assembly(name="pair")
    pair.add(cq.Workplane().box(4, 4, 4), name="cube")
    pair.add(cq.Workplane().circle(2).extrude(5), name="rod", loc=cq.Location((10, 0, 0)))
    pair.export(str(path))
    return path


@pytest.fixture
def own_temporary_folder(tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


POPEN = subprocess.Popen


def fake_child(monkeypatch, code):
    """Let the child run other code, as a kernel that misbehaves would."""

    def start(command, **options):
        return POPEN([sys.executable, "-c", code, command[-1]], **options)

    monkeypatch.setattr(contained.subprocess, "Popen", start)


def test_the_child_makes_the_same_model(two_parts, own_temporary_folder):
    seen = []
    models = contained_nominals(
        two_parts, {"edge_length": 1.0}, progress=lambda done, total: seen.append((done, total))
    )
    assert [pair for pair in dict.fromkeys(seen) if pair[1] == 2] == [(0, 2), (1, 2), (2, 2)]
    for model in models:
        direct = nominal(two_parts, part=model.source.part, edge_length=1.0)
        np.testing.assert_array_equal(model.surface.triangles, direct.surface.triangles)
        np.testing.assert_allclose(model.surface.points, direct.surface.points, atol=1e-12)
        np.testing.assert_allclose(model.samples.normals, direct.samples.normals, atol=1e-12)
        assert model.source == direct.source
        assert [f.name for f in model.features] == [f.name for f in direct.features]
        assert all(feature._samples is model.samples for feature in model.features)
        for array in (model.faces[0].centre, model.features[0].triangle_ids, model.surface.points):
            assert not array.flags.writeable
    assert list(own_temporary_folder.iterdir()) == []


def test_one_part_only(two_parts):
    (model,) = contained_nominals(two_parts, {"edge_length": 1.0, "part": 1})
    assert "rod" in model.source.part


def test_describe(two_parts):
    described = contained_describe(two_parts)
    assert (described.name, described.kind, described.units) == ("two.step", "step", "mm")
    assert "AUTOMOTIVE_DESIGN" in described.schema or "AP" in described.schema
    assert not described.has_pmi
    cube, rod = described.parts
    assert cube.solid
    assert cube.valid
    assert cube.volume == pytest.approx(64)
    assert cube.area == pytest.approx(96)
    assert cube.diagonal == pytest.approx(4 * 3**0.5, rel=1e-6)
    assert [face.kind for face in rod.faces] == ["cylinder", "plane", "plane"]
    assert rod.groups == ((0,), (1,), (2,))
    assert not rod.faces[0].centre.flags.writeable


def test_errors_of_the_child_arrive_as_they_are(two_parts, tmp_path):
    with pytest.raises(GeometryError, match=r"two\.step has no part 'bolt'"):
        contained_nominals(two_parts, {"part": "bolt", "edge_length": 1.0})
    bad = tmp_path / "bad.step"
    bad.write_bytes(two_parts.read_bytes()[:3000])
    with pytest.raises(ReadError, match=r"bad\.step is a truncated STEP file"):
        contained_nominals(bad)
    with pytest.raises(ReadError, match="no such file") as caught:
        contained_describe(tmp_path / "none.step")
    assert caught.value.exit_code == 3


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_crash_becomes_an_error(two_parts, monkeypatch, own_temporary_folder):
    fake_child(monkeypatch, "import os, signal; os.kill(os.getpid(), signal.SIGSEGV)")
    with pytest.raises(
        KernelError, match=r"two\.step: the geometry kernel crashed on it \(SIGSEGV\)"
    ) as caught:
        contained_describe(two_parts)
    assert caught.value.exit_code == 3
    fake_child(monkeypatch, "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    with pytest.raises(KernelError, match="ran out of memory"):
        contained_describe(two_parts)
    assert list(own_temporary_folder.iterdir()) == []


def test_a_child_that_fails_says_why(two_parts, monkeypatch):
    fake_child(monkeypatch, "raise SystemExit('no kernel here')")
    with pytest.raises(KernelError, match="ended with code 1: no kernel here"):
        contained_describe(two_parts)


def test_a_hang_is_ended(two_parts, monkeypatch, own_temporary_folder):
    pid_file = Path(str(two_parts) + ".pid")
    write = f"pathlib.Path({str(pid_file)!r}).write_text(str(os.getpid()))"
    code = f"import os, time, pathlib; {write}; time.sleep(60)"
    fake_child(monkeypatch, code)
    start = time.monotonic()
    with pytest.raises(KernelError, match=r"did not finish within 2 s"):
        contained_describe(two_parts, time_limit=2)
    assert time.monotonic() - start < 30
    assert list(own_temporary_folder.iterdir()) == []
    pid = int(pid_file.read_text())
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_a_hang_can_be_cancelled(two_parts, monkeypatch):
    fake_child(monkeypatch, "import time; time.sleep(60)")
    start = time.monotonic()
    with pytest.raises(Cancelled):
        contained_describe(two_parts, progress=lambda done, total: time.monotonic() < start + 0.5)
    assert time.monotonic() - start < 20


def test_cancelling_ends_the_child(two_parts, own_temporary_folder):
    with pytest.raises(Cancelled):
        contained_nominals(two_parts, {"edge_length": 1.0}, progress=lambda done, total: False)
    assert list(own_temporary_folder.iterdir()) == []


@pytest.mark.skipif(sys.platform != "linux", reason="needs a memory limit that the system enforces")
def test_a_blow_up_of_memory_becomes_an_error(two_parts):
    with pytest.raises(KernelError, match=r"two\.step: the geometry kernel (ran out of memory|crashed)"):
        contained_nominals(
            two_parts,
            {"edge_length": 0.004, "max_triangles": 10**8},
            memory_limit=400 * 2**20,
            time_limit=60,
        )


def test_warnings_of_the_child_are_passed_on(two_parts, monkeypatch):
    code = (
        "import pickle, sys; from pathlib import Path;"
        "Path(sys.argv[1], 'result.pickle').write_bytes(pickle.dumps(('value', (), ['look at face 3'])))"
    )
    fake_child(monkeypatch, code)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert contained_nominals(two_parts) == ()
    assert [str(w.message) for w in caught] == ["look at face 3"]


def test_the_parent_stays_free_of_the_kernel(two_parts):
    code = (
        f"import sys; from cadskin.cad import contained_describe; contained_describe({str(two_parts)!r});"
        "print([m for m in ('OCP', 'cadquery', 'numba') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("[]\n", "")


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_the_child_leaves_when_its_parent_dies():
    """A killed parent leaves no working child behind: its standard input closes."""
    child = "import time; from cadskin.cad import _child; _child._end_with_the_parent(); time.sleep(60)"
    code = (
        "import subprocess, sys, time\n"
        f"child = subprocess.Popen([sys.executable, '-c', {child!r}],"
        " stdin=subprocess.PIPE, start_new_session=True)\n"
        "print(child.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    child_pid = int(parent.stdout.readline())
    os.kill(child_pid, 0)
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    deadline = time.monotonic() + 20
    while time.monotonic() < deadline and Path(f"/proc/{child_pid}").exists():
        time.sleep(0.05)
    with pytest.raises(ProcessLookupError):
        os.kill(child_pid, 0)
