"""The worker as a process: messages, cancelling, a client that goes away."""

import json
import os
import queue
import signal
import subprocess
import sys
import threading
import time

import pytest

FLAT = {"id": "T1", "characteristic": "flatness", "value": 0.05, "faces": [3]}
LIMIT = 120.0  # seconds; a loaded machine starts the kernel slowly


def write_job(folder, brep, **options):
    folder.mkdir(exist_ok=True)
    (folder / "part.brep").write_bytes(brep)
    values = {"protocol": 1, "job": folder.name, "task": "simulate", "edge_length": 2.5, **options}
    (folder / "request.json").write_text(json.dumps(values))
    return folder


class Server:
    """A worker that serves, its messages in a queue."""

    def __init__(self, *arguments):
        self.process = subprocess.Popen(
            [sys.executable, "-m", "cadskin.worker", *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self.messages = queue.Queue()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self):
        with self.process.stdout as stream:
            for line in stream:
                self.messages.put(json.loads(line))

    def send(self, **values):
        self.process.stdin.write(json.dumps(values) + "\n")
        self.process.stdin.flush()

    def until(self, *events):
        deadline = time.monotonic() + LIMIT
        while True:
            message = self.messages.get(timeout=max(0.1, deadline - time.monotonic()))
            if message["event"] in events:
                return message

    def ended(self):
        return self.process.wait(timeout=LIMIT)

    def close(self):
        if self.process.poll() is None:
            self.process.kill()
        self.process.wait()
        self.process.stdin.close()


@pytest.fixture
def server():
    made = Server("--serve")
    yield made
    made.close()


def test_one_job_by_its_folder(tmp_path, plate_brep):
    folder = write_job(tmp_path / "Teil äöü", plate_brep, tolerances=[FLAT])
    found = subprocess.run(
        [sys.executable, "-m", "cadskin.worker", str(folder)],
        capture_output=True,
        stdin=subprocess.DEVNULL,
        text=True,
        timeout=LIMIT,
    )
    messages = [json.loads(line) for line in found.stdout.splitlines()]
    assert found.returncode == 0, found.stderr
    assert messages[-1]["event"] == "done"
    assert {message["job"] for message in messages} == {"Teil äöü"}
    assert (folder / "skin.npz").exists()


def test_a_failing_job_has_an_exit_code(tmp_path):
    (tmp_path / "request.json").write_text("{}")
    found = subprocess.run(
        [sys.executable, "-m", "cadskin.worker", str(tmp_path)], capture_output=True, text=True, timeout=LIMIT
    )
    assert found.returncode == 1
    assert json.loads(found.stdout)["error"] == "RequestError"


def test_a_server_runs_jobs_cancels_one_and_quits(tmp_path, plate_brep, server):
    ready = server.until("ready")
    assert ready["protocol"] == 1
    server.process.stdin.write("no json\n[1]\n")  # ignored
    server.send(job="nowhere")
    assert server.until("error")["job"] == "nowhere"
    first = write_job(tmp_path / "first", plate_brep, tolerances=[FLAT])
    server.send(job="first", folder=str(first))
    assert server.until("done", "error")["event"] == "done"
    # The part is known now: a long job is cancelled while it draws.
    long = write_job(tmp_path / "long", plate_brep, tolerances=[FLAT], size=100_000)
    server.send(job="long", folder=str(long))
    while server.until("progress", "error")["text"] != "drawing parts":
        pass
    asked = time.monotonic()
    server.send(cancel="long")
    assert server.until("error")["error"] == "Cancelled"
    assert time.monotonic() - asked < 10.0
    again = write_job(tmp_path / "again", plate_brep, tolerances=[FLAT])
    server.send(job="again", folder=str(again))
    assert server.until("done", "error")["event"] == "done"
    server.send(quit=True)
    assert server.ended() == 0


def test_a_server_ends_with_its_client_even_while_it_works(tmp_path, plate_brep, server):
    long = write_job(tmp_path / "cadskin-job-1", plate_brep, tolerances=[FLAT], size=100_000)
    other = write_job(tmp_path / "other", plate_brep)
    server.send(job="cadskin-job-1", folder=str(long))
    server.send(job="other", folder=str(other))
    while server.until("progress", "error")["text"] != "drawing parts":
        pass
    server.process.stdin.close()
    assert server.ended() == 3
    assert not long.exists()  # nothing of the workbench's own is left behind
    assert other.exists()


def test_an_idle_server_ends():
    server = Server("--serve", "--idle", "0.2")
    assert server.until("ready")["event"] == "ready"
    assert server.ended() == 0
    server.close()


@pytest.mark.skipif(os.name != "posix", reason="signals")
def test_a_killed_worker_is_seen_by_its_client(server):
    server.until("ready")
    server.process.send_signal(signal.SIGABRT)
    assert server.ended() == -signal.SIGABRT


def test_wrong_arguments():
    found = subprocess.run(
        [sys.executable, "-m", "cadskin.worker"], capture_output=True, text=True, timeout=LIMIT
    )
    assert found.returncode == 2
    assert "--serve" in found.stderr
