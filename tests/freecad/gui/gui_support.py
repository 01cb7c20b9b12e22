"""What the GUI tests share: waiting, the real mouse, pictures and what is on them."""

import os
import subprocess
import time
import unittest
from pathlib import Path

import FreeCAD
import FreeCADGui
import numpy as np
from freecad.CadSkin.qt import QtWidgets
from PySide import QtCore, QtGui

OUT = Path(os.environ["CADSKIN_GUI_OUT"])


def process_events(seconds=0.05):
    """Let FreeCAD work for a while."""
    end = time.monotonic() + seconds
    while True:
        FreeCADGui.updateGui()
        QtCore.QCoreApplication.sendPostedEvents()
        if time.monotonic() >= end:
            return
        time.sleep(0.01)


def wait_until(condition, seconds=20.0, what=""):
    """Let FreeCAD work until a condition holds; fail after a time."""
    end = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > end:
            raise AssertionError(f"not within {seconds} s: {what or condition}")
        process_events(0.03)


def view():
    """Return the 3D view of the active document."""
    return FreeCADGui.activeDocument().activeView()


def point_on_screen(point):
    """Return where on the screen a point in space (mm) is drawn."""
    x, y = view().getPointOnScreen(FreeCAD.Vector(*point))
    viewport = view().graphicsView().viewport()
    place = viewport.mapToGlobal(QtCore.QPoint(x, viewport.height() - 1 - y))
    return place.x(), place.y()


def click(point, button=1):
    """Click with the real mouse on a point in space; it comes near first, for the preselection."""
    x, y = point_on_screen(point)
    for step in (3, 0):
        xdotool("mousemove", str(x - step), str(y - step))
        process_events(0.15)
    xdotool("click", str(button))
    process_events(0.25)


def move_mouse(x, y):
    """Move the real mouse to a place in the coordinates of Qt's widgets.

    Without a window manager Qt and the X server do not agree about where the window is; the second move
    makes up for the difference. (The 3D view is a window of its own, and right about its place.)
    """
    xdotool("mousemove", str(x), str(y))
    process_events(0.1)
    here = QtGui.QCursor.pos()
    if (here.x(), here.y()) != (x, y):
        xdotool("mousemove", str(2 * x - here.x()), str(2 * y - here.y()))
        process_events(0.1)


def xdotool(*arguments):
    """Run xdotool."""
    subprocess.run(["xdotool", *arguments], check=True, timeout=10)


def arrange_window():
    """Show the tree and the panels, hide the consoles: as a user has it, and with room for the pictures."""
    wanted = {"Combo View": True, "Model": True, "Tasks": True, "Python console": False, "Report view": False}
    for dock in FreeCADGui.getMainWindow().findChildren(QtWidgets.QDockWidget):
        if dock.objectName() in wanted:
            dock.setVisible(wanted[dock.objectName()])


def press(button):
    """Press a button with the real mouse, once its panel has unfolded and stands still."""
    places = []
    while len(places) < 4 or places[-1] != places[-4]:
        process_events(0.12)
        places.append(button.mapToGlobal(button.rect().center()))
    middle = places[-1]
    move_mouse(middle.x(), middle.y())
    xdotool("click", "1")
    process_events(0.2)


def panel_button(text):
    """Return the button of the open task panel with this text."""
    for box in FreeCADGui.getMainWindow().findChildren(QtWidgets.QDialogButtonBox):
        for button in box.buttons():
            if box.isVisible() and button.text().replace("&", "") == text:
                return button
    raise AssertionError(f"no task panel with {text}")


def tool_button(command):
    """Return the button of a command in a tool bar that is seen."""
    for button in FreeCADGui.getMainWindow().findChildren(QtWidgets.QToolButton):
        action = button.defaultAction()
        if action is not None and action.objectName() == command and button.isVisible():
            return button
    raise AssertionError(f"no tool bar shows {command}")


class FileAnswer(QtCore.QObject):
    """Waits for the dialog that asks for a file, writes a path into it and clicks Save."""

    def __init__(self, path):
        super().__init__()
        self.path, self.name = path, ""
        self.timer = QtCore.QTimer(self)
        self.timer.timeout.connect(self.look)
        self.timer.start(100)

    def look(self):
        """Answer the dialog once it is there; whatever goes wrong, close it: it would wait for ever."""
        dialog = QtWidgets.QApplication.activeModalWidget()
        if not isinstance(dialog, QtWidgets.QFileDialog) or not dialog.isVisible():
            return
        self.timer.stop()
        try:
            edit = dialog.findChild(QtWidgets.QLineEdit, "fileNameEdit")
            self.name = edit.text()
            edit.setText(str(self.path))
            press(dialog.findChild(QtWidgets.QDialogButtonBox).button(QtWidgets.QDialogButtonBox.Save))
        finally:
            if dialog.isVisible():
                dialog.reject()


def answer_file_dialog(path):
    """Answer the next dialog that asks for a file; return who does it and what name was offered."""
    return FileAnswer(path)


def view_picture(name, background="Current", size=(1000, 700)):
    """Save a picture of the 3D view as an artifact and return its pixels (height, width, 3)."""
    path = OUT / f"{name}.png"
    view().saveImage(str(path), *size, background)
    return pixels_of(path)


def screen_picture(name):
    """Save a picture of the whole screen as an artifact and return its pixels."""
    process_events(0.2)
    path = OUT / f"{name}.png"
    subprocess.run(["import", "-window", "root", str(path)], check=True, timeout=20)
    return pixels_of(path)


def widget_picture(name, widget):
    """Save a picture of a widget as an artifact and return its pixels."""
    path = OUT / f"{name}.png"
    widget.grab().save(str(path))
    return pixels_of(path)


def pixels_of(path):
    """Return the pixels (height, width, 3) of a picture."""
    image = QtGui.QImage(str(path)).convertToFormat(QtGui.QImage.Format_RGBA8888)
    array = np.frombuffer(bytes(image.constBits()), dtype=np.uint8)
    return array.reshape(image.height(), image.bytesPerLine() // 4, 4)[:, : image.width(), :3]


def count_colors(pixels):
    """Return how many different colours a picture has."""
    packed = pixels.reshape(-1, 3).astype(np.int64) @ np.array([65536, 256, 1])
    return len(np.unique(packed))


def legend_area(pixels, palette):
    """Return (left, top, right, bottom) of the colour bar, or None: columns that hold most of the palette."""
    inner = palette[1:-1].astype(np.int64) @ np.array([65536, 256, 1])
    packed = pixels.astype(np.int64) @ np.array([65536, 256, 1])
    in_palette = np.isin(packed, inner)
    columns = [
        column
        for column in np.flatnonzero(in_palette.sum(axis=0) >= 100)
        if len(np.intersect1d(packed[in_palette[:, column], column], inner)) > 0.6 * len(np.unique(inner))
    ]
    if len(columns) < 5:
        return None
    rows = np.flatnonzero(in_palette[:, columns].any(axis=1))
    return int(columns[0]), int(rows[0]), int(columns[-1]), int(rows[-1])


class GuiTest(unittest.TestCase):
    """A test with a document of its own and clean hands afterwards."""

    def setUp(self):
        """Make a document."""
        FreeCADGui.activateWorkbench("CadSkinWorkbench")
        self.document = FreeCAD.newDocument("Gui")
        arrange_window()
        process_events()

    def tearDown(self):
        """Close panel and documents."""
        FreeCADGui.Control.closeDialog()
        FreeCADGui.Selection.clearSelection()
        process_events()
        for name in list(FreeCAD.listDocuments()):
            FreeCAD.closeDocument(name)
        process_events()

    def box(self, size=(60, 40, 20)):
        """Return a box, drawn and fitted to the view."""
        box = self.document.addObject("Part::Box", "Box")
        box.Length, box.Width, box.Height = size
        self.document.recompute()
        view().viewIsometric()
        view().fitAll()
        process_events(0.1)
        return box
