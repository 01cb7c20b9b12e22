"""The view provider of a skin model: deviation map, exaggeration and legend."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import FreeCADGui

from . import display
from .coin_mode import MODE_NAME, DeviationMode
from .colormap import ColorMap
from .icons import icon_path
from .legend import Legend
from .legend_picture import LegendText
from .qt import QtCore, translate
from .result import SkinResult
from .view_base import open_or_tell

__all__ = ["ViewProviderSkin", "attach_view"]

_COLOR_PROPERTIES = ("RangeMode", "RangeLow", "RangeHigh", "Palette", "Bands")
_DATA_PROPERTIES = ("Mesh", "ShownInstance", "Report", "ResultFile")
_PLAIN_MODE = "Shaded"


def attach_view(view_object: Any) -> None:
    """Give the view object of a new skin object its view provider."""
    ViewProviderSkin(view_object)
    view_object.DisplayMode = MODE_NAME
    view_object.SelectionStyle = "BoundBox"  # the colour of the selection would falsify those of the map


class ViewProviderSkin:
    """Shows the result of a skin object in the mode ``Deviation``, or by vertex colours in all the others."""

    def __init__(self, view_object: Any) -> None:
        display.add_map_properties(view_object)
        view_object.Proxy = self

    def attach(self, view_object: Any) -> None:
        """Build the scene; FreeCAD calls it when the object appears, new or from a file."""
        display.add_map_properties(view_object)
        self._object = view_object.Object
        self._pending = False
        self._drawn = _Drawn()
        self._colors: ColorMap | None = None
        self._mode = DeviationMode()
        self._legend = Legend()
        view_object.addDisplayMode(self._mode.root, MODE_NAME)
        view_object.Annotation.addChild(self._legend.root)
        self._later()

    def getDisplayModes(self, _obj: Any) -> list[str]:
        """Return our own display mode beside those of every mesh."""
        return [MODE_NAME]

    def getDefaultDisplayMode(self) -> str:
        """Return the mode of a new object."""
        return MODE_NAME

    def setDisplayMode(self, mode: str) -> str:
        """Take the mode as it is."""
        return mode

    def getIcon(self) -> str:
        """Return the icon of the tree."""
        return icon_path("skin")

    def updateData(self, obj: Any, name: str) -> None:
        """Draw again when the result, or the instance that is shown, is another."""
        if name in _DATA_PROPERTIES:
            self._object = obj
            self._later()

    def onChanged(self, view_object: Any, name: str) -> None:
        """Draw again when a setting changes, at once, so that a slider is felt."""
        if not hasattr(self, "_mode"):
            return
        if name in display.PROPERTY_NAMES or name in ("Visibility", "DisplayMode"):
            if name == "DeviationMap":
                _switch_mode(view_object)
            self.refresh(view_object)
            if name in _COLOR_PROPERTIES:
                self._later()

    def doubleClicked(self, view_object: Any) -> bool:
        """Open the panel of the skin model."""
        return open_or_tell("skin", view_object.Object)

    def refresh(self, view_object: Any) -> None:
        """Draw the result with the settings of now."""
        result = _result(view_object.Object)
        if result is None or not result.size:
            self._mode.clear()
            self._drawn = _Drawn()
            self._legend.set_visible(False)
            return
        settings = display.settings_of(view_object)
        instance = _instance(view_object.Object, result)
        if not self._drawn.is_that(result, instance, settings.exaggeration):
            self._mode.show(result, instance, settings.exaggeration)
            self._drawn = self._drawn.followed_by(result, instance, settings.exaggeration)
        colors = display.colors_of(self._drawn.extremes, settings, display.zone_of(view_object.Object))
        self._colors = colors
        self._mode.color(colors)
        self._refresh_legend(view_object, colors)

    def colors(self) -> ColorMap | None:
        """Return the colours that are drawn now; None before the first result."""
        return self._colors

    def _refresh_legend(self, view_object: Any, colors: ColorMap) -> None:
        settings = display.settings_of(view_object)
        drawn = self._drawn
        enlarged = settings.exaggeration if view_object.DisplayMode == MODE_NAME else 1.0
        zone = display.zone_of(view_object.Object)
        text = LegendText(
            translate("Deviation"),
            display.legend_lines(drawn.statistics, drawn.instance, drawn.result.size, enlarged),
            (-zone / 2.0, zone / 2.0) if zone else (),
        )
        self._legend.update(colors, text, settings.legend)
        shown = bool(view_object.Visibility and settings.show)
        self._legend.set_visible(shown)
        if shown:
            _hide_other_legends(view_object)

    def _later(self) -> None:
        """Draw and store the colours once, after the changes of this moment have all been made."""
        if not self._pending:
            self._pending = True
            QtCore.QTimer.singleShot(0, self._catch_up)

    def _catch_up(self) -> None:
        self._pending = False
        try:
            view_object = self._object.ViewObject
        except (ReferenceError, RuntimeError):
            return  # the object, or its document, is gone
        if view_object is not None and getattr(view_object, "Proxy", None) is self:
            self.refresh(view_object)
            store_vertex_colors(self._object)

    def dumps(self) -> None:
        """Nothing is stored: all settings are properties."""

    def loads(self, _state: Any) -> None:
        """Nothing was stored."""

    __getstate__ = dumps  # FreeCAD 0.20
    __setstate__ = loads


@dataclass(frozen=True, eq=False)
class _Drawn:
    """What the scene shows, with the numbers that another colour does not change."""

    result: SkinResult | None = None
    instance: int = -1
    exaggeration: float = 0.0
    extremes: tuple[float, float] = (0.0, 0.0)
    statistics: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def is_that(self, result: SkinResult, instance: int, exaggeration: float) -> bool:
        """Whether this is what shall be shown."""
        return self.result is result and (self.instance, self.exaggeration) == (instance, exaggeration)

    def followed_by(self, result: SkinResult, instance: int, exaggeration: float) -> _Drawn:
        """Return what is shown next, with as little work as can be."""
        same = self.result is result
        extremes = self.extremes if same else result.range()
        known = same and self.instance == instance
        statistics = self.statistics if known else result.statistics(instance)
        return _Drawn(result, instance, exaggeration, extremes, statistics)


def store_vertex_colors(obj: Any) -> None:
    """Write the colours of the map into the mesh object, for all display modes and for FreeCAD without us."""
    result = _result(obj)
    if result is None or not result.size or obj.Mesh.CountPoints != result.n_points:
        return
    colors = display.colors_of(result.range(), display.settings_of(obj.ViewObject), display.zone_of(obj))
    obj.VertexColors = display.vertex_colors(result, _instance(obj, result), colors)
    obj.purgeTouched()
    obj.ViewObject.Coloring = bool(obj.ViewObject.DeviationMap)


def _switch_mode(view_object: Any) -> None:
    """Show or hide the map: our display mode, or the mesh as FreeCAD draws it."""
    shown = bool(view_object.DeviationMap)
    view_object.Coloring = shown
    if shown or view_object.DisplayMode == MODE_NAME:
        view_object.DisplayMode = MODE_NAME if shown else _PLAIN_MODE


def _result(obj: Any) -> Any:
    from . import skin

    return skin.result(obj)


def _instance(obj: Any, result: Any) -> int:
    return min(max(int(getattr(obj, "ShownInstance", 0)), 0), result.size - 1)


def _hide_other_legends(view_object: Any) -> None:
    """Leave one legend in a document: that of the map that changed last."""
    gui_document = FreeCADGui.getDocument(view_object.Object.Document.Name)
    for other in view_object.Object.Document.Objects:
        proxy = getattr(gui_document.getObject(other.Name), "Proxy", None)
        if (
            isinstance(proxy, ViewProviderSkin)
            and other is not view_object.Object
            and hasattr(proxy, "_legend")
        ):
            proxy._legend.set_visible(False)
