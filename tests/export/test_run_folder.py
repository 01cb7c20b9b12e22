"""Run folders: what is read is what was made, whatever stopped the writing, however many parts at a time."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys

import numpy as np
import pytest
from support.parts import box, plate_with_hole, sphere

import cadskin as cs
from cadskin.conform import simulate_conforming
from cadskin.deviation import FromFunction, GaussianField, Paraboloid
from cadskin.errors import ConformityError, ExportError, ReadError
from cadskin.export.runs import load_nominal, open_run, save_nominal, simulate_run
from cadskin.export.runs import write as writing
from cadskin.skin.provenance import nominal_sha256
from cadskin.spec import Specification, flatness, parallelism
from cadskin.verify import verify

MODEL = GaussianField(0.01, 50.0)
BOTTOM, TOP = 0, 1


@pytest.fixture(scope="module")
def part():
    return box((60.0, 40.0, 20.0), h=12.0)


@pytest.fixture(scope="module")
def spec():
    return Specification(flatness(BOTTOM, 0.01), parallelism(TOP, 0.02, datums="A"), datums={"A": BOTTOM})


@pytest.fixture
def small_chunks(monkeypatch):
    monkeypatch.setattr(writing, "_CHUNK_PARTS", 3)


def bytes_of(folder):
    return {file.name: file.read_bytes() for file in sorted(folder.iterdir()) if file.suffix != ".npz"}


@pytest.mark.parametrize("make", [box, plate_with_hole, sphere])
def test_nominal_model_comes_back(tmp_path, make):
    nominal = make()
    again = load_nominal(save_nominal(tmp_path / "part.npz", nominal))
    assert nominal_sha256(again) == nominal_sha256(nominal)
    assert [f.name for f in again.features] == [f.name for f in nominal.features]
    assert [type(f.ideal) for f in again.faces] == [type(f.ideal) for f in nominal.faces]
    assert again.source == nominal.source
    np.testing.assert_array_equal(again.samples.curvatures, nominal.samples.curvatures)


def test_run_is_read_as_it_was_made(tmp_path, part, spec, small_chunks):
    run = simulate_run(tmp_path / "run", part, MODEL, spec, size=7, rng=5, options={"file": "box"})
    lot = simulate_conforming(part, MODEL, spec, size=7, rng=5)
    opened = cs.open_run(tmp_path / "run")
    assert len(opened) == len(run) == 7
    assert opened.complete
    for i in (0, 2, 3, 6, -1):
        np.testing.assert_array_equal(opened[i].deviation, lot[i].deviation)
    assert [skin.provenance.index for skin in opened[2:4]] == [2, 3]
    np.testing.assert_array_equal(opened.ensemble().deviations, lot.deviations)
    found = verify(lot, spec)
    np.testing.assert_allclose(opened.values, found.values, rtol=1e-12)
    assert opened.tolerances == found.tolerances
    assert str(opened.spec[opened.tolerances[0]]) == "⏥ 0.01"
    table = (tmp_path / "run" / "evaluations.csv").read_text().splitlines()
    assert len(table) == 1 + 7 * 2
    assert all(line.endswith(",ok") for line in table[1:])
    with pytest.raises(IndexError):
        opened[7]


def test_stopped_run_goes_on_with_the_same_bits(tmp_path, part, spec, small_chunks):
    whole, stopped = tmp_path / "whole", tmp_path / "stopped"
    simulate_run(whole, part, MODEL, spec, size=7, rng=5)

    def stop(done, total):
        return done < 5

    with pytest.raises(cs.CadskinError, match="stopped"):
        simulate_run(stopped, part, MODEL, spec, size=7, rng=5, progress=stop)
    assert len(open_run(stopped)) == 3
    assert not open_run(stopped).complete
    assert not list(stopped.glob("*.tmp"))
    before = (stopped / "deviations-00000.npy").stat().st_mtime_ns
    simulate_run(stopped, part, MODEL, spec, size=7, rng=5)
    assert (stopped / "deviations-00000.npy").stat().st_mtime_ns == before
    assert bytes_of(stopped) == bytes_of(whole)


def test_run_grows(tmp_path, part, spec, small_chunks):
    simulate_run(tmp_path / "grown", part, MODEL, spec, size=4, rng=5)
    simulate_run(tmp_path / "grown", part, MODEL, spec, size=7, rng=5)
    simulate_run(tmp_path / "whole", part, MODEL, spec, size=7, rng=5)
    assert bytes_of(tmp_path / "grown") == bytes_of(tmp_path / "whole")
    with pytest.raises(ExportError, match="holds 7 parts already"):
        simulate_run(tmp_path / "grown", part, MODEL, spec, size=3, rng=5)


def test_damage_is_noticed_and_mended(tmp_path, part, spec, small_chunks):
    folder = tmp_path / "run"
    simulate_run(folder, part, MODEL, spec, size=7, rng=5)
    sound = bytes_of(folder)
    file = folder / "deviations-00001.npy"
    file.write_bytes(file.read_bytes()[:-8] + b"\0" * 8)
    opened = open_run(folder)
    assert opened[0].deviation.shape == (part.n_samples,)  # other chunks are not touched
    with pytest.raises(ReadError, match=r"deviations-00001.npy is damaged"):
        _ = opened[4].deviation
    simulate_run(folder, part, MODEL, spec, size=7, rng=5)
    assert bytes_of(folder) == sound
    file.unlink()
    with pytest.raises(ReadError, match="is missing"):
        _ = open_run(folder)[4]
    (folder / "spec.toml").write_text("")
    with pytest.raises(ReadError, match="not the specification"):
        _ = open_run(folder).spec
    save_nominal(folder / "nominal.npz", box())
    with pytest.raises(ReadError, match="not the nominal model"):
        _ = open_run(folder).nominal


def test_another_run_is_not_overwritten(tmp_path, part, spec):
    folder = tmp_path / "run"
    simulate_run(folder, part, MODEL, spec, size=2, rng=5)
    kept = bytes_of(folder)
    for other in ({"rng": 6}, {"model": GaussianField(0.011, 50.0)}, {"conform": "none"}, {"max_tries": 7}):
        options = {"model": MODEL, "rng": 5} | other
        with pytest.raises(ExportError, match=r"holds another run.*differ"):
            simulate_run(folder, part, options.pop("model"), spec, size=2, **options)
    assert bytes_of(folder) == kept


def test_places_that_are_no_run(tmp_path, part, spec):
    with pytest.raises(ReadError, match="is no folder"):
        open_run(tmp_path / "nothing")
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ReadError, match="is no run folder"):
        open_run(tmp_path)
    with pytest.raises(ExportError, match="not empty and holds no run"):
        simulate_run(tmp_path, part, MODEL, spec, size=1, rng=1)
    with pytest.raises(ExportError, match="is a file"):
        simulate_run(tmp_path / "notes.txt", part, MODEL, spec, size=1, rng=1)
    with pytest.raises(ExportError, match="at least one part"):
        simulate_run(tmp_path / "run", part, MODEL, spec, size=0, rng=1)
    assert (tmp_path / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"format": "cadskin run 99"}', "{not json"])
def test_strange_run_json(tmp_path, text):
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(ReadError, match=r"run.json"):
        open_run(tmp_path)


def test_damaged_nominal_model(tmp_path, part):
    good = save_nominal(tmp_path / "good.npz", part).read_bytes()
    for name, data in (("cut", good[: len(good) // 2]), ("empty", b""), ("text", b"hello")):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(ReadError, match=r"not a nominal model|cannot be read|damaged"):
            load_nominal(tmp_path / name)
    np.savez(tmp_path / "other.npz", about=json.dumps({"format": "other"}))
    with pytest.raises(ReadError, match="has format 'other'"):
        load_nominal(tmp_path / "other.npz")


def test_run_can_be_moved(tmp_path, part, spec):
    simulate_run(tmp_path / "run", part, MODEL, spec, size=2, rng=5)
    shutil.move(tmp_path / "run", tmp_path / "elsewhere")
    assert len(open_run(tmp_path / "elsewhere").ensemble()) == 2


def test_workers_give_the_same_bits_and_resume_them(tmp_path, part, spec, small_chunks):
    whole, shared, grown = (tmp_path / name for name in ("whole", "shared", "grown"))
    simulate_run(whole, part, MODEL, spec, size=7, rng=5)
    simulate_run(shared, part, MODEL, spec, size=7, rng=5, workers=2)
    assert bytes_of(shared) == bytes_of(whole)
    simulate_run(grown, part, MODEL, spec, size=4, rng=5)
    simulate_run(grown, part, MODEL, spec, size=7, rng=5, workers=2)
    assert bytes_of(grown) == bytes_of(whole)


def test_errors_and_wishes_to_stop_come_through_workers(tmp_path, part, spec):
    tight = Specification(flatness(BOTTOM, 0.002))
    with pytest.raises(ConformityError, match=r"flatness-1 .* binds"):
        simulate_run(tmp_path / "a", part, Paraboloid(0.1), tight, size=2, rng=5, workers=2)
    with pytest.raises(cs.CadskinError, match="stopped"):
        simulate_run(
            tmp_path / "b", part, MODEL, spec, size=2, rng=5, workers=2, progress=lambda done, _: done < 1
        )
    with pytest.raises(ExportError, match="use one worker"):
        simulate_run(tmp_path / "c", part, FromFunction(lambda p, n: p[:, 0]), spec, size=2, rng=5, workers=2)
    with pytest.raises(ExportError, match="at least one worker"):
        simulate_run(tmp_path / "d", part, MODEL, spec, size=2, rng=5, workers=0)


KILLED = """
import sys
sys.path[:0] = {path!r}
from support.parts import box
from cadskin.deviation import FromFunction, GaussianField, Paraboloid
from cadskin.export.runs import simulate_run, write
from cadskin.spec import Specification, flatness, parallelism
write._CHUNK_PARTS = 3
part = box((60.0, 40.0, 20.0), h=12.0)
spec = Specification(flatness(0, 0.01), parallelism(1, 0.02, datums="A"), datums={{"A": 0}})
def told(done, total):
    print(done, flush=True)
simulate_run({folder!r}, part, GaussianField(0.01, 50.0), spec, size=300, rng=5, progress=told)
"""


@pytest.mark.skipif(os.name != "posix", reason="SIGKILL is of POSIX")
def test_killed_run_is_valid_and_goes_on_with_the_same_bits(tmp_path, part, spec, small_chunks):
    folder = tmp_path / "killed"
    code = KILLED.format(path=sys.path, folder=str(folder))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        for line in process.stdout:
            if int(line) >= 8:
                process.send_signal(signal.SIGKILL)
                break
    killed = open_run(folder)
    assert 6 <= len(killed) < 300
    assert not killed.complete
    lot = simulate_conforming(part, MODEL, spec, size=len(killed), rng=5)
    np.testing.assert_array_equal(killed.ensemble().deviations, lot.deviations)
    size = len(killed) + 4
    about = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps(about | {"size": size}))
    simulate_run(folder, part, MODEL, spec, size=size, rng=5)
    simulate_run(tmp_path / "whole", part, MODEL, spec, size=size, rng=5)
    np.testing.assert_array_equal(
        open_run(folder).ensemble().deviations, open_run(tmp_path / "whole").ensemble().deviations
    )


def test_full_disk_leaves_a_valid_folder(tmp_path, part, spec, small_chunks, monkeypatch):
    saved, calls = np.save, []

    def full(stream, array, **options):
        calls.append(array.shape)
        if len(calls) > 3:  # in the middle of the second chunk
            stream.write(b"half")
            raise OSError(errno.ENOSPC, "No space left on device")
        saved(stream, array, **options)

    monkeypatch.setattr(np, "save", full)
    with pytest.raises(ExportError, match=r"values-00001.npy: the disk is full"):
        simulate_run(tmp_path / "run", part, MODEL, spec, size=7, rng=5)
    monkeypatch.undo()
    assert len(open_run(tmp_path / "run")) == 3
    assert not list((tmp_path / "run").glob(".cadskin-*"))
    monkeypatch.setattr(writing, "_CHUNK_PARTS", 3)
    simulate_run(tmp_path / "run", part, MODEL, spec, size=7, rng=5)
    simulate_run(tmp_path / "whole", part, MODEL, spec, size=7, rng=5)
    assert bytes_of(tmp_path / "run") == bytes_of(tmp_path / "whole")
