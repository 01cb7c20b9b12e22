"""The engine with `QProcess` in the event loop of the window: the tests as without one, and real jobs."""

import time

import FreeCAD
from freecad.CadSkin import api, jobs
from freecad.CadSkin.tests import support, test_engine
from PySide import QtCore


class EngineInTheWindow(test_engine.EngineTest):
    use_qt = True


del test_engine.EngineTest  # the loader would run it twice


class JobsInTheWindow(support.DocumentTest):
    def run_events(self, until, seconds=support.LIMIT):
        deadline = time.monotonic() + seconds
        while not until():
            self.assertLess(time.monotonic(), deadline)
            QtCore.QCoreApplication.processEvents()
            time.sleep(0.01)

    def test_the_window_stays_alive_while_a_skin_model_is_computed(self):
        part = self.plate()
        api.add_tolerance(part, self.face(part, z=6), "flatness", 0.05)
        skin = api.create_skin(part, edge_length=2.5)
        ticks = [time.monotonic()]
        timer = QtCore.QTimer()
        timer.timeout.connect(lambda: ticks.append(time.monotonic()))
        timer.start(50)
        api.compute(skin)
        self.assertIn("Computing", skin.Status)
        self.run_events(lambda: jobs.job_of(skin) is None)
        self.assertEqual(skin.Status, "Up to date")
        ticks.append(time.monotonic())
        self.assertGreater(len(ticks), 2)
        longest = max(b - a for a, b in zip(ticks, ticks[1:]))
        self.assertLess(longest, 0.5 * (ticks[-1] - ticks[0]) + 0.5)  # not frozen for the time of the job

    def test_a_result_waits_for_the_transaction_of_a_panel(self):
        part = self.plate()
        skin = api.create_skin(part, edge_length=2.5)
        api.compute(skin)
        job = jobs.job_of(skin)
        self.document.openTransaction("A panel is open")
        part.Label = "Changed"
        self.run_events(lambda: job.finished)
        self.run_events(lambda: True)
        self.assertIsNone(api.result(skin))
        self.document.abortTransaction()
        self.assertEqual(part.Label, "Plate")
        self.run_events(lambda: jobs.job_of(skin) is None)
        self.assertIsNotNone(api.result(skin))
        self.assertEqual(self.document.UndoNames[0], "Skin model result")
        self.assertFalse(job.folder.exists())

    def test_closing_the_document_during_a_job(self):
        skin = api.create_skin(self.plate(), edge_length=2.5, instances=100_000)
        api.compute(skin)
        job = jobs.job_of(skin)
        self.run_events(lambda: job.text == "drawing parts" or job.finished)
        FreeCAD.closeDocument(self.document.Name)
        self.run_events(lambda: job.finished, 30)
        self.assertEqual(job.state, "cancelled")
