"""The page in Edit > Preferences: where the worker's Python is, whether it works, how it is made.

The form is ``resources/ui/preferences.ui``. Its widgets: ``workerPython`` (line edit), ``browseButton``,
``testButton``, ``createButton``, ``versionsLabel``, ``edgeLength``, ``seed`` and ``instances`` (spin boxes),
``keepWorker`` (check box).
"""

from __future__ import annotations

import subprocess
import tempfile
import time
from pathlib import Path
from typing import Any

import FreeCAD
import FreeCADGui

from . import engine, preferences
from .protocol import JobError
from .qt import QtCore, QtWidgets, translate

__all__ = ["UI_FILE", "PreferencesPage", "run_with_events"]

UI_FILE = Path(__file__).resolve().parent / "resources" / "ui" / "preferences.ui"

# Widget -> (preference, how it is read, how it is set).
_WIDGETS = {
    "edgeLength": ("EdgeLength", "value", "setValue"),
    "seed": ("Seed", "value", "setValue"),
    "instances": ("Instances", "value", "setValue"),
    "keepWorker": ("KeepWorker", "isChecked", "setChecked"),
}


def run_with_events(step: list[str], *, timeout: float, env: dict[str, str], **_options: Any) -> Any:
    """Run a program as `subprocess.run` does, while the window stays alive.

    Parameters
    ----------
    step : list of str
    timeout : float
        [s].
    env : dict

    Raises
    ------
    OSError
        It cannot be started.
    subprocess.TimeoutExpired
    """
    deadline = time.monotonic() + timeout
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(step, stdin=subprocess.DEVNULL, stdout=output, stderr=output, env=env)
        while process.poll() is None:
            QtCore.QCoreApplication.processEvents()
            time.sleep(0.02)
            if time.monotonic() > deadline:
                process.kill()
                process.wait()
                raise subprocess.TimeoutExpired(step, timeout)
        output.seek(0)
        printed = output.read()
    return subprocess.CompletedProcess(step, process.returncode, printed, b"")


class PreferencesPage:
    """What FreeCAD calls a preference page: a form, and how it is filled and saved."""

    def __init__(self, _parent: Any = None) -> None:
        self.form = FreeCADGui.PySideUic.loadUi(str(UI_FILE))
        self._connect("browseButton", self.browse)
        self._connect("testButton", self.test)
        self._connect("createButton", self.create)

    def loadSettings(self) -> None:
        """Fill the form."""
        self._set_python(preferences.get("WorkerPython"))
        for name, (preference, _read, write) in _WIDGETS.items():
            getattr(self._widget(name), write)(preferences.get(preference))

    def saveSettings(self) -> None:
        """Take the form; a worker that runs in another Python is ended."""
        before = preferences.get("WorkerPython")
        preferences.put("WorkerPython", self.python())
        for name, (preference, read, _write) in _WIDGETS.items():
            preferences.put(preference, getattr(self._widget(name), read)())
        if self.python() != before:
            preferences.forget_known()
            engine.close()

    def python(self) -> str:
        """Return the path in the form."""
        return str(self._widget("workerPython").text()).strip()

    def browse(self) -> None:
        """Ask for the Python."""
        path, _ = QtWidgets.QFileDialog.getOpenFileName(
            self.form, translate("Python with cadskin"), self.python()
        )
        if path:
            self._set_python(path)

    def test(self) -> None:
        """Run a job in the Python of the form and show its versions, or what is wrong."""
        info = self._busy(lambda: preferences.try_python(self.python() or None))
        self._say(info.text if not info.ok else f"{info.python}: {info.text}")

    def create(self) -> None:
        """Ask for consent, make an environment with cadskin, and enter it into the form."""
        text = translate(
            "This makes a Python environment in {} and downloads cadskin and the packages that it needs, "
            "some hundred megabytes, from the package index. Go on?"
        ).format(preferences.environment_folder())
        box = QtWidgets.QMessageBox
        if box.question(self.form, "CadSkin", text, box.Yes | box.No, box.No) != box.Yes:
            self._say(translate("Nothing was installed."))
            return
        try:
            info = self._busy(lambda: preferences.create_environment(consent=True, run=run_with_events))
        except JobError as error:
            self._say(str(error))
            return
        self._set_python(info.python)
        self._say(info.text)

    def _busy(self, work: Any) -> Any:
        """Do something that takes long; the buttons cannot be pressed again meanwhile."""
        self._say(translate("Please wait..."))
        self.form.setEnabled(False)
        try:
            return work()
        finally:
            self.form.setEnabled(True)

    def _say(self, text: str) -> None:
        self._widget("versionsLabel").setText(text)
        FreeCAD.Console.PrintMessage(f"CadSkin: {text}\n")

    def _set_python(self, path: str) -> None:
        self._widget("workerPython").setText(path)

    def _widget(self, name: str) -> Any:
        return self.form.findChild(QtCore.QObject, name)

    def _connect(self, name: str, function: Any) -> None:
        self._widget(name).clicked.connect(lambda *_checked: function())
