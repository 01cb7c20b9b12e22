"""Job folders with a drilled plate, and a client that listens."""

import io
import json

import pytest

from cadskin.worker.channel import Channel
from cadskin.worker.parts import PartMemory
from cadskin.worker.serve import Client, run_job


@pytest.fixture(scope="session")
def plate_brep():
    """Text BREP of a drilled plate: Face3 above, Face5 below, Face7 the hole."""
    cq = pytest.importorskip("cadquery")
    stream = io.BytesIO()
    cq.Workplane().box(30, 20, 6).faces(">Z").workplane().hole(8).val().exportBrep(stream)
    return stream.getvalue()


@pytest.fixture(scope="session")
def memory():
    """One memory of parts for all jobs, so that the plate is meshed once."""
    return PartMemory()


class Jobs:
    """Runs jobs in this process and collects their messages."""

    def __init__(self, folder, brep, memory):
        self.folder, self.memory = folder, memory
        (folder / "part.brep").write_bytes(brep)
        self.messages = []

    def run(self, task="simulate", *, cancel=False, protocol=1, **options):
        values = {"protocol": protocol, "job": "j", "task": task, "edge_length": 2.5, **options}
        (self.folder / "request.json").write_text(json.dumps(values), encoding="utf-8")
        stream, client = io.StringIO(), Client()
        if cancel:
            client._cancelled.add("j")
        run_job(self.folder, Channel(stream), client, self.memory, "j")
        self.messages = [json.loads(line) for line in stream.getvalue().splitlines()]
        return self.messages[-1]

    def result(self):
        return json.loads((self.folder / "result.json").read_text(encoding="utf-8"))


@pytest.fixture
def jobs(tmp_path, plate_brep, memory):
    return Jobs(tmp_path, plate_brep, memory)
