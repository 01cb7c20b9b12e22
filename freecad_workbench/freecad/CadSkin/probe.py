"""Read the deviation under the mouse: a click pins a label to the surface, until the probe is put away."""

from __future__ import annotations

from typing import Any

import FreeCAD
import FreeCADGui
import numpy as np
from pivy import coin

from . import skin as skins
from .coin_mode import MODE_NAME
from .colormap import format_deviation
from .legend_picture import draw_label
from .qt import QtCore
from .ray import first_hit
from .result import SkinResult

__all__ = ["Probe", "Reading", "active_probe", "read_along", "start_probe", "stop_probe"]

_active: Probe | None = None


class Reading:
    """One value that was read.

    Attributes
    ----------
    face : int
        1 for ``Face1``.
    deviation : float
        [mm], interpolated in the triangle.
    position : (3,) float
        On the surface as it is drawn, in the frame of the skin model [mm].
    """

    def __init__(self, face: int, deviation: float, position: np.ndarray) -> None:
        self.face, self.deviation, self.position = face, deviation, position

    def __str__(self) -> str:
        return f"Face{self.face}: {format_deviation(self.deviation, signed=True)}"


def read_along(
    result: SkinResult, instance: int, exaggeration: float, origin: Any, direction: Any
) -> Reading | None:
    """Return what a ray meets first on an instance as it is drawn; None where it passes by."""
    points = result.instance_points(instance, exaggeration=exaggeration)
    found = first_hit(np.asarray(origin, float), np.asarray(direction, float), points, result.triangles)
    if found is None:
        return None
    triangle, weights = found
    deviation = float(weights @ result.corner_deviation[instance, triangle])
    position = weights @ points[result.triangles[triangle]]
    return Reading(int(result.triangle_face[triangle]), deviation, position)


def active_probe() -> Probe | None:
    """Return the probe that is in use; None otherwise."""
    return _active


def start_probe(obj: Any) -> Probe:
    """Begin reading values of a skin model in the active view, and return the probe."""
    global _active
    stop_probe()
    _active = Probe(obj)
    return _active


def stop_probe() -> None:
    """End reading, and take the labels away."""
    global _active
    if _active is not None:
        _active.stop()
        _active = None


class Probe:
    """Takes clicks of the left button in one view; Escape ends it."""

    def __init__(self, obj: Any) -> None:
        self.obj = obj
        self.readings: list[Reading] = []
        self._view = FreeCADGui.activeDocument().activeView()
        self._labels = coin.SoSeparator()
        self._root = coin.SoType.fromName("SoSkipBoundingGroup").createInstance()
        self._root.addChild(self._labels)
        obj.ViewObject.RootNode.addChild(self._root)
        self._selectable = obj.ViewObject.Selectable
        obj.ViewObject.Selectable = False  # a click reads, and does not select
        FreeCADGui.Selection.clearSelection()
        self._callbacks = [
            (kind, self._view.addEventCallback(kind, function))
            for kind, function in (
                ("SoMouseButtonEvent", self._on_button),
                ("SoKeyboardEvent", self._on_key),
            )
        ]

    def stop(self) -> None:
        """Let go of the view."""
        for kind, callback in self._callbacks:
            try:
                self._view.removeEventCallback(kind, callback)
            except (RuntimeError, ReferenceError):
                continue  # the view is closed
        self._callbacks = []
        try:
            self.obj.ViewObject.RootNode.removeChild(self._root)
            self.obj.ViewObject.Selectable = self._selectable
        except (RuntimeError, ReferenceError, AttributeError):
            return  # the document is closed

    def _on_key(self, event: dict[str, Any]) -> None:
        if event.get("Key") == "ESCAPE" and event.get("State") == "DOWN":
            QtCore.QTimer.singleShot(0, stop_probe)

    def _on_button(self, event: dict[str, Any]) -> None:
        if event.get("Button") == "BUTTON1" and event.get("State") == "DOWN":
            self.read_at(event["Position"])

    def read_at(self, pixel: Any) -> Reading | None:
        """Read the value at a place of the view, pin a label there, and write it to the report view."""
        try:
            found = skins.result(self.obj)
        except (ReferenceError, RuntimeError):
            QtCore.QTimer.singleShot(0, stop_probe)
            return None
        if found is None:
            return None
        view_object = self.obj.ViewObject
        enlarged = view_object.Exaggeration if view_object.DisplayMode == MODE_NAME else 1.0
        origin, direction = self._ray(pixel)
        reading = read_along(found, max(self.obj.ShownInstance, 0), enlarged, origin, direction)
        if reading is not None:
            self.readings.append(reading)
            self._pin(reading)
            FreeCAD.Console.PrintMessage(f"{self.obj.Label}, {reading}\n")
            FreeCADGui.getMainWindow().statusBar().showMessage(f"{self.obj.Label}, {reading}")
        return reading

    def _ray(self, pixel: Any) -> tuple[np.ndarray, np.ndarray]:
        """Return the line of sight through a pixel, in the frame of the skin model."""
        x, y = int(pixel[0]), int(pixel[1])
        through = self._view.getPoint(x, y)
        direction = self._view.getViewDirection()
        if self._view.getCameraType() == "Perspective":
            eye = FreeCAD.Vector(*self._view.getCameraNode().position.getValue().getValue())
            direction = through - eye
        inverse = self.obj.Placement.inverse()
        base = inverse.multVec(through)
        tip = inverse.multVec(through + direction)
        return np.array(base), np.array(tip - base)

    def _pin(self, reading: Reading) -> None:
        picture = draw_label(str(reading))
        pin = coin.SoSeparator()
        place = coin.SoTranslation()
        place.translation = tuple(float(value) for value in reading.position)
        unpickable = coin.SoPickStyle()
        unpickable.style = coin.SoPickStyle.UNPICKABLE
        depth = coin.SoDepthBuffer()
        depth.test = False
        image = coin.SoImage()
        image.vertAlignment = coin.SoImage.BOTTOM
        image.horAlignment = coin.SoImage.LEFT
        pixels = bytes(picture.mirrored().constBits())
        image.image.setValue(coin.SbVec2s(picture.width(), picture.height()), 4, pixels)
        for node in (unpickable, depth, place, image):
            pin.addChild(node)
        self._labels.addChild(pin)
