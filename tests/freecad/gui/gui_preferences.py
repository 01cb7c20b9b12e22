"""The preferences page: filled, tested, saved; the environment is made with consent only."""

import os
import subprocess
import unittest
from unittest import mock

import FreeCADGui
from freecad.CadSkin import preferences, preferences_page
from freecad.CadSkin.qt import QtCore, QtWidgets
from freecad.CadSkin.tests.support import python_for_scripts


class PageTest(unittest.TestCase):
    def setUp(self):
        self.before = {
            name: preferences.get(name) for name in ("WorkerPython", "EdgeLength", "Seed", "Instances")
        }
        self.page = preferences_page.PreferencesPage()
        self.page.loadSettings()

    def tearDown(self):
        for name, value in self.before.items():
            preferences.put(name, value)
        preferences.forget_known()

    def widget(self, kind, name):
        return self.page.form.findChild(kind, name)

    def press(self, name):
        self.widget(QtWidgets.QPushButton, name).click()

    def said(self):
        return self.widget(QtWidgets.QLabel, "versionsLabel").text()

    def test_what_is_saved_is_loaded_again(self):
        self.widget(QtWidgets.QDoubleSpinBox, "edgeLength").setValue(1.25)
        self.widget(QtWidgets.QSpinBox, "seed").setValue(42)
        self.page.saveSettings()
        again = preferences_page.PreferencesPage()
        again.loadSettings()
        self.assertEqual(again.form.findChild(QtWidgets.QDoubleSpinBox, "edgeLength").value(), 1.25)
        self.assertEqual(preferences.get("Seed"), 42)
        self.assertTrue(preferences.get("KeepWorker"))

    def test_the_test_button_shows_versions(self):
        self.widget(QtWidgets.QLineEdit, "workerPython").setText(python_for_scripts())
        self.press("testButton")
        self.assertIn("numba", self.said())

    def test_the_test_button_says_what_is_wrong(self):
        self.widget(QtWidgets.QLineEdit, "workerPython").setText("/nowhere/python")
        self.press("testButton")
        self.assertIn("/nowhere/python cannot be started", self.said())

    def test_no_consent_no_environment(self):
        with (
            mock.patch.object(
                QtWidgets.QMessageBox, "question", return_value=QtWidgets.QMessageBox.No
            ) as asked,
            mock.patch.object(preferences, "create_environment") as made,
        ):
            self.press("createButton")
        self.assertIn("download", asked.call_args[0][2])
        made.assert_not_called()
        self.assertIn("Nothing", self.said())

    def test_with_consent_the_new_python_is_entered(self):
        info = preferences.WorkerInfo("/new/python", True, "cadskin 1")
        with (
            mock.patch.object(QtWidgets.QMessageBox, "question", return_value=QtWidgets.QMessageBox.Yes),
            mock.patch.object(preferences, "create_environment", return_value=info) as made,
        ):
            self.press("createButton")
        self.assertTrue(made.call_args[1]["consent"])
        self.assertEqual(self.page.python(), "/new/python")

    def test_the_window_stays_alive_while_packages_are_installed(self):
        ticks = []
        timer = QtCore.QTimer()
        timer.timeout.connect(lambda: ticks.append(1))
        timer.start(20)
        step = [python_for_scripts(), "-c", "import sys, time; time.sleep(0.5); print('said'); sys.exit(3)"]
        done = preferences_page.run_with_events(step, timeout=30, env=dict(os.environ))
        self.assertEqual((done.returncode, done.stdout.strip()), (3, b"said"))
        self.assertGreater(len(ticks), 5)
        with self.assertRaises(subprocess.TimeoutExpired):
            step[-1] = "import time; time.sleep(60)"
            preferences_page.run_with_events(step, timeout=0.3, env=dict(os.environ))

    def test_the_page_is_known_to_freecad(self):
        self.assertIn("CadSkinWorkbench", FreeCADGui.listWorkbenches())
