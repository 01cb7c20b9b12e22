"""The way of the tutorial, with the real worker and real clicks; it makes the pictures of the tutorial."""

import tempfile
from pathlib import Path

import FreeCADGui
import Mesh
import numpy as np
from freecad.CadSkin import api, display, jobs, probe
from freecad.CadSkin import skin as skins
from freecad.CadSkin.panels import base, color_map, instances
from freecad.CadSkin.panels import skin as skin_panel
from gui_support import (
    GuiTest,
    answer_file_dialog,
    click,
    count_colors,
    legend_area,
    panel_button,
    press,
    process_events,
    screen_picture,
    tool_button,
    view,
    view_picture,
    wait_until,
)


def active_panel():
    """Return our panel that is open now."""
    return base.current()


class WorkflowTest(GuiTest):
    """One document from the bare part to the histogram."""

    def bracket(self):
        """Return a small angle with a hole: plain to look at, with planes and a cylinder."""
        import Part
        from FreeCAD import Vector

        solid = Part.makeBox(60, 40, 10).fuse(Part.makeBox(10, 40, 40)).removeSplitter()
        solid = solid.cut(Part.makeCylinder(7, 10, Vector(40, 20, 0)))
        part = self.document.addObject("Part::Feature", "Bracket")
        part.Shape = solid
        self.document.recompute()
        view().viewIsometric()
        view().fitAll()
        process_events(0.2)
        return part

    def test_from_a_click_on_a_face_to_pass_and_fail(self):
        part = self.bracket()
        self.assert_active("CadSkin_AddTolerance", False)
        screen_picture("tutorial_1_part")
        click((25, 8, 10))
        names = FreeCADGui.Selection.getSelectionEx()[0].SubElementNames
        assert len(names) == 1
        assert part.getSubObject(names[0]).CenterOfMass.z == 10
        self.assert_active("CadSkin_AddTolerance", True)
        FreeCADGui.runCommand("CadSkin_AddTolerance")
        panel = active_panel()
        assert panel.picker.faces == list(names)
        assert panel.status.text() == "can be used"
        panel.value.setProperty("rawValue", 0.04)
        process_events(0.2)
        screen_picture("tutorial_2_tolerance")
        press(panel_button("OK"))
        tolerance = self.document.getObject("Tolerance")
        assert tolerance.Characteristic == "flatness"
        assert abs(tolerance.Value.Value - 0.04) < 1e-12
        assert tolerance.Status == "OK"

        FreeCADGui.Selection.clearSelection()
        api.general_tolerance(part, 0.1)
        FreeCADGui.runCommand("CadSkin_CreateSkin")
        panel = active_panel()
        panel.edge.setProperty("rawValue", 4.0)
        panel.length.setProperty("rawValue", 25.0)
        panel.store()
        skin = panel.obj
        press(panel.compute)
        assert jobs.job_of(skin) is not None, panel.status.text()
        self.assert_active("CadSkin_Cancel", True)
        self.assert_active("CadSkin_Compute", False)
        wait_until(lambda: jobs.job_of(skin) is None, 90, "the skin model")
        assert skin.Status == "Up to date", skin.Status
        part.ViewObject.Visibility = False
        skin.ViewObject.Exaggeration = 100
        view().fitAll()
        process_events(0.3)
        pixels = screen_picture("tutorial_3_skin")
        palette = skin.ViewObject.Proxy.colors().colors()
        assert legend_area(pixels, palette) is not None
        assert count_colors(pixels) > 500
        rows = skins.result(skin).tolerance_rows(0)
        assert panel.table.rowCount() == len(rows) >= 1
        assert panel.table.item(0, 2).text() == "✓"

        self.document.undo()
        process_events(0.3)
        assert skin.Mesh.CountPoints == 0
        assert legend_area(view_picture("undone"), palette) is None
        self.document.redo()
        process_events(0.3)
        assert skin.Mesh.CountPoints == skins.result(skin).n_points
        assert legend_area(view_picture("redone"), palette) is not None

        self.probe_and_map(skin)
        self.many(skin)
        self.export(skin)

    def probe_and_map(self, skin):
        """Read a value by a click, then try the panel of the map."""
        FreeCADGui.Control.closeDialog()
        skin.ViewObject.Exaggeration = 50
        process_events(0.2)
        FreeCADGui.runCommand("CadSkin_Probe")
        click((25, 8, 10))
        click((50, 30, 10))
        found = probe.active_probe().readings
        assert len(found) == 2
        assert not FreeCADGui.Selection.getSelection()
        result = skins.result(skin)
        for reading in found:
            values = result.face_deviation(reading.face)
            assert values.min() - 1e-6 <= reading.deviation <= values.max() + 1e-6
            assert abs(reading.position[2] - 10 - 50 * reading.deviation) < 0.5
        screen_picture("tutorial_4_probe")
        FreeCADGui.runCommand("CadSkin_Probe")
        assert probe.active_probe() is None
        FreeCADGui.runCommand("CadSkin_Exaggeration")
        panel = active_panel()
        assert isinstance(panel, color_map.ColorMapPanel)
        panel.slider.setValue(60)
        assert skin.ViewObject.Exaggeration == 1000
        panel.factor.setValue(100)
        panel.bands.setValue(10)
        panel.mode.setCurrentIndex(panel.mode.findData("Tolerance"))
        assert np.isclose(skin.ViewObject.Proxy.colors().high, display.zone_of(skin) / 2)
        process_events(0.3)
        screen_picture("tutorial_5_map")
        FreeCADGui.Control.closeDialog()
        FreeCADGui.runCommand("CadSkin_DeviationMap")
        process_events(0.2)
        assert skin.ViewObject.DisplayMode != "Deviation"
        assert not skin.ViewObject.Proxy._legend.visible
        FreeCADGui.runCommand("CadSkin_DeviationMap")
        assert skin.ViewObject.DisplayMode == "Deviation"
        skin.ViewObject.Bands = 0
        skin.ViewObject.RangeMode = "Symmetric"

    def many(self, skin):
        """Draw several parts and go through them."""
        FreeCADGui.runCommand("CadSkin_Sample")
        panel = active_panel()
        assert isinstance(panel, instances.InstancesPanel)
        panel.count.setValue(12)
        press(panel.draw)
        wait_until(lambda: jobs.job_of(skin) is None, 90, "twelve parts")
        assert skins.result(skin).size == 12, skin.Status
        panel.slider.setValue(7)
        process_events(0.3)
        assert skin.ShownInstance == 7
        screen_picture("tutorial_6_instances")
        assert "8 / 12" in panel.which.text()
        FreeCADGui.Control.closeDialog()
        skin_panel.show(skin)
        process_events(0.2)
        screen_picture("panel_skin_of_many")

    def export(self, skin):
        """Click Export in the tool bar, name a file, click Save: the file holds the part that is shown."""
        FreeCADGui.Control.closeDialog()
        FreeCADGui.Selection.clearSelection()
        FreeCADGui.Selection.addSelection(skin)
        process_events(0.3)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "shown.stl"
            save = answer_file_dialog(path)
            press(tool_button("CadSkin_Export"))
            wait_until(path.exists, 60, "the exported mesh")
            assert save.name.startswith(skin.Label), save.name
            mesh = Mesh.Mesh(str(path))
        number = skin.ShownInstance
        assert number == 7
        result = skins.result(skin)
        assert mesh.CountFacets == len(result.triangles)
        box = mesh.BoundBox
        lower, upper = np.array([[box.XMin, box.YMin, box.ZMin], [box.XMax, box.YMax, box.ZMax]])
        shown = result.points + result.displacement[number]
        np.testing.assert_allclose([lower, upper], [shown.min(axis=0), shown.max(axis=0)], atol=1e-4)
        other = result.points + result.displacement[0]
        assert np.abs(other.max(axis=0) - upper).max() > 1e-4

    def assert_active(self, command, expected):
        """Check whether a command is offered."""
        FreeCADGui.updateGui()
        assert FreeCADGui.Command.get(command).isActive() == expected, command
