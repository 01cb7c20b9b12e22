"""The engine against stand-ins that behave badly: crashes, other protocols, no cadskin, full disks."""

from __future__ import annotations

import os
import shutil
import tempfile
import time
import unittest
from pathlib import Path
from unittest import mock

from freecad.CadSkin import preferences
from freecad.CadSkin.engine import Engine
from freecad.CadSkin.protocol import JobError, LineBuffer, clean_environment, parse_message

from .support import python_for_scripts, stand_in

READY = "send(event='ready', protocol=1, versions={'cadskin': '9'})\n"
BEGUN = "    send(event='progress', job=job['job'], fraction=0, text='x')\n"
ANSWER = (
    "    if 'folder' in job:\n"
    "        open(job['folder'] + '/result.json', 'w').write('{\"answer\": 42}')\n"
    "        send(event='progress', job=job['job'], fraction=0.5, text='half')\n"
    "        send(event='done', job=job['job'])\n"
)


class EngineTest(unittest.TestCase):
    use_qt = False

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="cadskin-test-"))
        self.engines = []
        self.events = []

    def tearDown(self):
        for engine in self.engines:
            engine.close()
        shutil.rmtree(self.folder, ignore_errors=True)

    def engine(self, body):
        made = Engine(python=stand_in(self.folder, body), use_qt=self.use_qt)
        self.engines.append(made)
        return made

    def submit(self, engine, **options):
        return engine.submit(
            {"task": "simulate"},
            lambda _job, fraction, text: self.events.append(("progress", fraction, text)),
            lambda job, result: self.events.append(("done", result, job.folder.exists())),
            lambda _job, kind, text: self.events.append(("error", kind, text)),
            **options,
        )

    def test_a_job_and_its_messages(self):
        engine = self.engine("print('hello from a library')\n" + READY + "for job in jobs():\n" + ANSWER)
        job = self.submit(engine).wait(30)
        self.assertEqual(self.events, [("progress", 0.5, "half"), ("done", {"answer": 42}, True)])
        self.assertEqual((job.state, job.folder.exists()), ("done", False))
        self.assertEqual(engine.versions, {"cadskin": "9"})
        process = engine.process_id
        self.submit(engine).wait(30)
        self.assertEqual(engine.process_id, process)  # it stays

    def test_a_worker_that_aborts(self):
        body = READY + "for job in jobs():\n" + BEGUN + "    os.abort()\n"
        engine = self.engine(body)
        job = self.submit(engine).wait(30)
        self.assertEqual((job.state, job.error), ("failed", "WorkerCrashed"))
        self.assertFalse(job.folder.exists())
        # The next job gets a new process, and those that waited are not lost.
        first, second = self.submit(engine), self.submit(engine)
        first.wait(30)
        second.wait(30)
        self.assertEqual((first.error, second.error), ("WorkerCrashed", "WorkerCrashed"))

    def test_a_worker_that_ended_while_idle_is_started_again(self):
        engine = self.engine(READY + "for job in jobs():\n" + ANSWER + "        sys.exit(0)\n")
        self.submit(engine).wait(30)
        time.sleep(0.5)
        self.assertEqual(self.submit(engine).wait(30).state, "done")

    def test_a_worker_that_dies_at_once_does_not_restart_for_ever(self):
        engine = self.engine(READY + "for job in jobs():\n    os._exit(5)\n")
        job = self.submit(engine).wait(30)
        self.assertEqual((job.state, job.error, job.attempts), ("failed", "WorkerCrashed", 2))

    def test_another_protocol(self):
        engine = self.engine("send(event='ready', protocol=2)\nfor job in jobs():\n" + ANSWER)
        job = self.submit(engine).wait(30)
        self.assertEqual(job.error, "ProtocolMismatch")
        self.assertIn("protocol 2, the workbench 1", job.text)

    def test_no_cadskin_there(self):
        engine = self.engine("print(\"No module named 'cadskin'\", file=sys.stderr)\nsys.exit(1)\n")
        job = self.submit(engine).wait(30)
        self.assertEqual(job.error, "WorkerMissing")
        self.assertIn("No module named 'cadskin'", job.text)

    def test_a_python_that_is_gone(self):
        engine = Engine(python=str(self.folder / "gone"), use_qt=self.use_qt)
        self.engines.append(engine)
        job = self.submit(engine).wait(30)
        self.assertEqual((job.state, job.error), ("failed", "WorkerMissing"))
        self.assertIn("gone", job.text)

    def test_cancel_ends_a_worker_that_does_not_listen(self):
        body = READY + "for job in jobs():\n" + BEGUN + "    time.sleep(60)\n"
        engine = self.engine(body)
        job = self.submit(engine)
        waiting = self.submit(engine)
        while job.state == "waiting":
            engine.pump(0.05)
        waiting.cancel()
        self.assertEqual(waiting.state, "cancelled")
        asked = time.monotonic()
        job.cancel()
        job.wait(30)
        self.assertLess(time.monotonic() - asked, 15.0)
        self.assertEqual((job.state, job.error), ("cancelled", "Cancelled"))

    def test_a_full_disk_at_the_begin_and_at_the_end(self):
        engine = self.engine(READY + "for job in jobs():\n" + ANSWER)

        def full(_folder):
            raise OSError(28, "No space left on device")

        with self.assertRaisesRegex(JobError, "No space left"):
            self.submit(engine, prepare=full)
        self.assertEqual(engine.jobs, [])
        engine = self.engine(READY + "for job in jobs():\n    send(event='done', job=job.get('job'))\n")
        job = self.submit(engine).wait(30)
        self.assertEqual((job.state, job.error), ("failed", "DiskError"))

    def test_no_place_for_a_job(self):
        engine = self.engine(READY)
        full = mock.patch("tempfile.mkdtemp", side_effect=OSError(30, "Read-only file system"))
        with full, self.assertRaisesRegex(JobError, "Read-only"):
            self.submit(engine)

    def test_an_error_in_a_callback_does_not_stop_the_engine(self):
        engine = self.engine(READY + "for job in jobs():\n" + ANSWER)
        job = engine.submit({"task": "x"}, None, lambda *_: 1 / 0, None)
        self.assertEqual(job.wait(30).state, "done")

    def test_closing_ends_process_and_jobs(self):
        engine = self.engine(READY + "time.sleep(60)\n")
        job = self.submit(engine)
        for _ in range(100):
            engine.pump(0.05)
            if engine.versions:
                break
        process = engine.process_id
        engine.close()
        self.assertEqual(job.state, "cancelled")
        self.assertRaises(ProcessLookupError, os.kill, process, 0)


class Finding(unittest.TestCase):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="cadskin-test-"))
        self.before = preferences.get("WorkerPython")
        preferences.forget_known()

    def tearDown(self):
        preferences.put("WorkerPython", self.before)
        preferences.forget_known()
        shutil.rmtree(self.folder, ignore_errors=True)

    def test_the_worker_is_found_and_says_its_versions(self):
        info = preferences.try_python(python_for_scripts())
        self.assertTrue(info.ok, info.text)
        self.assertIn("numba", info.versions)

    def test_a_python_without_cadskin(self):
        bare = shutil.which("python3", path="/usr/bin:/bin")
        if bare is None:
            self.skipTest("there is no Python of the system")
        preferences.put("WorkerPython", bare)
        with self.assertRaisesRegex(JobError, "has no cadskin.*Preferences"):
            preferences.find_worker()
        self.assertFalse(preferences.try_python().ok)

    def test_a_chosen_python_that_is_gone_is_not_replaced_in_silence(self):
        preferences.put("WorkerPython", str(self.folder / "gone"))
        with self.assertRaisesRegex(JobError, "gone cannot be started"):
            preferences.find_worker()

    def test_another_version(self):
        other = stand_in(
            self.folder, "print(json.dumps({'python': '3.11', 'cadskin': '7.0', 'protocol': 7}))\n"
        )
        info = preferences.try_python(other)
        self.assertFalse(info.ok)
        self.assertIn("protocol 7", info.text)

    def test_what_is_no_python(self):
        nonsense = stand_in(self.folder, "print('hello')\n")
        self.assertFalse(preferences.try_python(nonsense).ok)

    def test_an_environment_needs_consent(self):
        calls = []
        with self.assertRaisesRegex(JobError, "consent"):
            preferences.create_environment(consent=False, run=lambda *step, **_: calls.append(step))
        self.assertEqual(calls, [])

    def test_making_an_environment(self):
        calls = []

        def run(step, **_options):
            calls.append(step)
            return mock.Mock(
                returncode=0 if len(calls) < 2 or "fail" not in step[-1] else 1,
                stderr=b"no network",
                stdout=b"",
            )

        target = self.folder / "env"
        preferences.create_environment(consent=True, python=python_for_scripts(), folder=target, run=run)
        self.assertEqual(calls[0][1:4], ["-m", "venv", "--clear"])
        self.assertEqual(calls[1][-1], "cadskin")
        self.assertEqual(preferences.get("WorkerPython"), str(preferences.python_in(target)))
        calls.clear()
        with self.assertRaisesRegex(JobError, "no network"):
            preferences.create_environment(
                consent=True, python=python_for_scripts(), folder=target, requirement="fail", run=run
            )


class Protocol(unittest.TestCase):
    def test_lines_and_messages(self):
        buffer = LineBuffer()
        self.assertEqual(buffer.feed(b'{"event"'), [])
        (line,) = buffer.feed(b': "done"}\nrest')
        self.assertEqual(parse_message(line), {"event": "done"})
        for noise in (b"", b"[1]", b"{}", b'{"event": 1}', b"\xff"):
            self.assertIsNone(parse_message(noise))

    def test_the_environment_of_another_python(self):
        given = {"PATH": "/bin", "PYTHONPATH": "x", "PYTHONHOME": "y", "LD_LIBRARY_PATH": "own"}
        self.assertEqual(clean_environment(given)["LD_LIBRARY_PATH"], "own")
        self.assertNotIn("PYTHONPATH", clean_environment(given))
        self.assertNotIn("LD_LIBRARY_PATH", clean_environment({**given, "APPIMAGE": "/a"}))
