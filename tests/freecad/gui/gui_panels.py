"""Panels and commands on what users do wrong, and on what changes under an open panel; without a worker."""

import tempfile
from pathlib import Path
from unittest import mock

import FreeCAD
import FreeCADGui
import numpy as np
import Part
from freecad.CadSkin import api, command, display, jobs, skin
from freecad.CadSkin.faces import InputError
from freecad.CadSkin.panels import base, color_map, datum, instances, tolerance
from freecad.CadSkin.panels import skin as skin_panel
from freecad.CadSkin.panels.histogram import histogram_bins
from gui_support import (
    GuiTest,
    click,
    panel_button,
    press,
    process_events,
    view,
    widget_picture,
)
from PySide import QtCore
from synthetic import box_result

#: What FreeCAD 0.20 gives a panel, less its frame and scroll bar.
NARROW = 240


class PanelTest(GuiTest):
    """A box, and panels on it."""

    def run_refused(self, name):
        """Run a command that is to be refused, and return the message."""
        with mock.patch.object(command, "tell") as tell:
            FreeCADGui.runCommand(name)
            process_events()
        tell.assert_called_once()
        return tell.call_args[0][0]

    def active(self, name):
        """Return whether a command is offered."""
        return FreeCADGui.Command.get(name).isActive()

    def with_result(self, box, instances=2, **more):
        """Return a skin model with a result that no worker made."""
        obj = api.create_skin(box, **more)
        result = box_result(size=(60, 40, 20), cells=8, instances=instances)
        obj.Instances = instances
        patches = [
            mock.patch.object(skin, "result", side_effect=lambda other: result if other == obj else None),
            mock.patch.object(skin, "has_result", side_effect=lambda other: other == obj),
        ]
        for patch in patches:
            patch.start()
            self.addCleanup(patch.stop)
        obj.ShownInstance = 0
        skin._show(obj, result, 0)
        process_events(0.1)
        return obj

    def test_commands_are_offered_only_where_they_make_sense(self):
        assert not self.active("CadSkin_AddTolerance")
        box = self.box()
        for name in ("AddTolerance", "AddDatum", "Compute", "Cancel", "Check", "Sample", "Export", "Probe"):
            assert not self.active(f"CadSkin_{name}"), name
        assert self.active("CadSkin_CreateSkin")
        FreeCADGui.Selection.addSelection(box, "Edge3")
        assert not self.active("CadSkin_AddTolerance")
        FreeCADGui.Selection.clearSelection()
        FreeCADGui.Selection.addSelection(box, "Face6")
        assert self.active("CadSkin_AddTolerance")
        assert self.active("CadSkin_AddDatum")
        FreeCAD.closeDocument(self.document.Name)
        process_events()
        assert not self.active("CadSkin_CreateSkin")
        assert self.active("CadSkin_ImportStep")

    def test_nothing_that_can_be_worked_with(self):
        assert "no solid part" in self.run_refused("CadSkin_CreateSkin")
        broken = self.document.addObject("Part::Fillet", "Broken")
        broken.Base = self.box()
        broken.Edges = [(1, 500.0, 500.0)]
        self.document.recompute()
        assert not broken.isValid()
        FreeCADGui.Selection.addSelection(broken)
        assert "error" in self.run_refused("CadSkin_CreateSkin")
        assert not [obj for obj in self.document.Objects if obj.Name.startswith("Skin")]
        assert not self.document.HasPendingTransaction

    def test_picking_with_the_mouse_adds_and_takes_away(self):
        box = self.box()
        other = self.document.addObject("Part::Box", "Other")
        other.Placement.Base = FreeCAD.Vector(0, 80, 0)
        self.document.recompute()
        view().fitAll()
        FreeCADGui.Selection.addSelection(box, "Face6")
        FreeCADGui.runCommand("CadSkin_AddTolerance")
        panel = base.current()
        process_events(0.5)
        click((30, 0, 10))
        assert panel.picker.faces == ["Face6", "Face3"]
        assert panel.table.rowCount() == 2
        click((30, 20, 20))
        assert panel.picker.faces == ["Face3"]
        FreeCADGui.Selection.addSelection(other, "Face6")
        assert "no face of Box" in panel.status.text(), panel.status.text()
        assert panel.picker.faces == ["Face3"]
        click((-20, 40, 0))  # into the void: the list stays, and stays marked
        assert panel.picker.faces == ["Face3"]
        chosen = FreeCADGui.Selection.getSelectionEx()[0]
        assert (chosen.ObjectName, list(chosen.SubElementNames)) == ("Box", ["Face3"])
        panel.pick.setChecked(False)
        click((60, 20, 10))
        assert panel.picker.faces == ["Face3"]
        press(panel_button("Cancel"))
        process_events(0.2)
        assert self.document.getObject("Tolerance") is None
        assert not self.document.HasPendingTransaction

    def test_an_edge_instead_of_a_face_is_refused_in_the_panel(self):
        box = self.box()
        panel = tolerance.show(api.add_tolerance(box, ["Face6"], "flatness", 0.1))
        FreeCADGui.Selection.addSelection(box, "Edge3")
        process_events()
        assert "Edge3 is no face" in panel.status.text()
        assert panel.picker.faces == ["Face6"]

    def test_a_value_of_zero_and_no_face_keep_the_panel_open(self):
        box = self.box()
        panel = tolerance.show(api.add_tolerance(box, ["Face6"], "flatness", 0.1))
        panel.value.setProperty("rawValue", 0.0)
        assert "0" in panel.status.text()
        assert panel.accept() is False
        assert base.current() is panel
        panel.value.setProperty("rawValue", 0.02)
        panel.table.selectRow(0)
        panel.remove.click()
        assert panel.picker.faces == []
        assert panel.accept() is False
        assert "no face" in panel.status.text()
        panel.picker.set_faces(["Face5"])
        assert panel.accept() is True
        FreeCADGui.Control.closeDialog()
        made = self.document.getObject("Tolerance")
        assert list(made.Faces[1]) == ["Face5"]
        assert made.Label == "Flatness 0.02 mm"

    def test_the_type_follows_the_faces_and_datums_are_asked_for(self):
        box = self.box()
        api.add_datum(box, ["Face5"])
        panel = tolerance.show(api.add_tolerance(box, ["Face1"], "flatness", 0.1))
        names = [panel.characteristic.itemData(k) for k in range(panel.characteristic.count())]
        assert "flatness" in names
        assert "cylindricity" not in names
        assert not panel.datums.isEnabled()
        panel.obj.Characteristic = "cylindricity"
        panel.fill_faces()
        assert panel.table.item(0, 1).text() == "✗ Plane"
        assert "no meaning" in panel.table.item(0, 1).toolTip()
        panel.characteristic.setCurrentIndex(names.index("perpendicularity"))
        assert panel.datums.isEnabled()
        assert "datum" in panel.status.text()
        panel.datums.setText("X")
        assert "X" in panel.status.text()
        panel.datums.setText("A")
        assert panel.status.text() == "can be used"
        self.narrow(panel, "panel_tolerance")

    def test_a_face_that_vanished_is_shown_as_gone(self):
        box = self.box()
        cut = self.document.addObject("Part::Cut", "Cut")
        tool = self.document.addObject("Part::Cylinder", "Tool")
        tool.Radius, tool.Height = 5, 50
        tool.Placement.Base = FreeCAD.Vector(20, 20, -5)
        cut.Base, cut.Tool = box, tool
        self.document.recompute()
        last = f"Face{len(cut.Shape.Faces)}"
        made = api.add_tolerance(cut, [last], "surface_profile", 0.1)
        tool.Placement.Base = FreeCAD.Vector(500, 0, 0)
        self.document.recompute()
        process_events()
        assert made.Status != "OK"
        assert made.ViewObject.Proxy.getIcon().endswith("tolerance_bad.svg")
        panel = tolerance.show(made)
        assert panel.table.item(0, 1).text() == "gone"
        assert panel.accept() is False
        self.narrow(panel, "panel_face_gone")

    def test_the_document_is_closed_under_an_open_panel(self):
        box = self.box()
        for open_one in (
            lambda part: tolerance.show(api.add_tolerance(part, ["Face6"], "flatness", 0.1)),
            lambda part: skin_panel.show(api.create_skin(part)),
        ):
            panel = open_one(box)
            process_events(0.1)
            FreeCAD.closeDocument(box.Document.Name)
            process_events(0.2)
            FreeCADGui.Control.closeDialog()
            process_events(0.1)
            assert not getattr(panel, "picker", mock.Mock(active=False)).active
            assert panel._job_changed not in jobs._listeners if hasattr(panel, "_job_changed") else True
            self.document = FreeCAD.newDocument("Again")
            box = self.box()

    def test_the_skin_model_is_deleted_under_an_open_panel(self):
        box = self.box()
        panel = skin_panel.show(api.create_skin(box))
        self.document.removeObject(panel.obj.Name)
        process_events(0.1)
        panel.refresh()
        panel.store()
        FreeCADGui.Control.closeDialog()

    def test_another_task_is_not_pushed_aside(self):
        box = self.box()
        panel = tolerance.show(api.add_tolerance(box, ["Face6"], "flatness", 0.1))
        assert not self.active("CadSkin_CreateSkin")
        with self.assertRaisesRegex(InputError, "another task"):
            skin_panel.show(api.create_skin(box))
        assert base.current() is panel
        with mock.patch.object(command, "tell") as tell:
            self.document.getObject("Skin").ViewObject.Proxy.doubleClicked(self.document.Skin.ViewObject)
        assert "another task" in tell.call_args[0][0]
        assert base.current() is panel
        panel.reject()
        FreeCADGui.Control.closeDialog()
        made = api.add_datum(box, ["Face5"])
        assert made.ViewObject.Proxy.doubleClicked(made.ViewObject)
        assert isinstance(base.current(), datum.DatumPanel)

    def test_two_jobs_at_once_are_refused_in_the_panel(self):
        box = self.box()
        panel = skin_panel.show(api.create_skin(box))
        with mock.patch.object(jobs, "start_compute", side_effect=InputError("it is being computed; wait")):
            panel.compute.click()
        assert "being computed" in panel.status.text()

    def test_five_hundred_faces_are_listed_in_time(self):

        points = [
            FreeCAD.Vector(50 * c, 50 * s, 0)
            for c, s in (
                (__import__("math").cos(k / 80.0), __import__("math").sin(k / 80.0)) for k in range(502)
            )
        ]
        prism = Part.Face(Part.makePolygon([*points, points[0]])).extrude(FreeCAD.Vector(0, 0, 10))
        part = self.document.addObject("Part::Feature", "Prism")
        part.Shape = prism
        self.document.recompute()
        names = [f"Face{k}" for k in range(1, len(prism.Faces) + 1)]
        assert len(names) >= 500
        panel = tolerance.show(api.add_tolerance(part, names, "surface_profile", 0.1))
        process_events(0.2)
        assert panel.table.rowCount() == len(names)
        assert panel.form.sizeHint().height() < 700
        assert panel.status.text() == "can be used"

    def test_panels_are_readable_at_240_pixels(self):
        box = self.box()
        api.add_tolerance(box, ["Face6"], "flatness", 0.05, label="Flatness 0.05 mm")
        obj = self.with_result(box, instances=2)
        panel = skin_panel.show(obj)
        assert panel.table.item(0, 2).text() == "✓"
        assert "flatness" in panel.table.item(0, 0).text()
        assert "30 / 50 µm" in panel.table.item(0, 1).text()
        assert panel.table.item(1, 2).text() == "?"
        assert "datum B has no face" in panel.table.item(1, 0).toolTip()
        self.narrow(panel, "panel_skin")
        panel = skin_panel.show(obj)
        panel.shown.setValue(1)
        assert obj.ShownInstance == 1
        assert panel.table.item(0, 2).text() == "✗"
        assert "not held" in panel.extent.text()
        self.narrow(panel, "panel_skin_failed")
        self.narrow(instances.show(obj), "panel_instances")
        self.narrow(color_map.show(obj), "panel_color_map")
        self.narrow(datum.show(api.add_datum(box, ["Face5"])), "panel_datum")

    def narrow(self, panel, name):
        """Check that a panel can be as narrow as FreeCAD 0.20 makes it, and keep a picture."""
        process_events(0.2)
        assert panel.form.minimumSizeHint().width() <= NARROW, panel.form.minimumSizeHint().width()
        panel.form.setParent(None)
        panel.form.resize(NARROW, max(panel.form.sizeHint().height(), panel.form.heightForWidth(NARROW)))
        panel.form.show()
        process_events(0.2)
        for box in panel.form.findChildren(base.QtWidgets.QWidget):
            if box.isVisible() and box.parentWidget() is panel.form:
                assert box.geometry().right() <= NARROW, (name, box)
        widget_picture(name, panel.form)
        panel.dropped()
        FreeCADGui.Control.closeDialog()

    def test_a_range_that_is_none_is_told(self):
        obj = self.with_result(self.box())
        panel = color_map.show(obj)
        panel.low.setValue(5.0)
        panel.high.setValue(-5.0)
        assert "lower end" in panel.status.text()
        assert obj.ViewObject.RangeLow < obj.ViewObject.RangeHigh
        panel.low.setValue(-8.0)
        assert (obj.ViewObject.RangeLow, obj.ViewObject.RangeHigh) == (-0.008, -0.005)
        assert obj.ViewObject.RangeMode == "Manual"
        panel.mode.setCurrentIndex(panel.mode.findData("Tolerance"))
        assert "no tolerance" in panel.status.text()

    def test_settings_and_colours_survive_save_and_reopen(self):
        obj = self.with_result(self.box())
        obj.ViewObject.Exaggeration, obj.ViewObject.Bands, obj.ViewObject.Legend = 200, 7, "Bottom right"
        process_events(0.2)
        with tempfile.TemporaryDirectory() as folder:
            path = f"{folder}/Prüfstück 部品.FCStd"
            self.document.saveAs(path)
            FreeCAD.closeDocument(self.document.Name)
            self.document = FreeCAD.openDocument(path)
            process_events(0.3)
            again = self.document.getObject("Skin")
            found = again.ViewObject
            assert (found.Exaggeration, found.Bands, found.Legend) == (200, 7, "Bottom right")
            assert found.DisplayMode == "Deviation"
            assert len(again.VertexColors) == again.Mesh.CountPoints > 0
            assert found.SelectionStyle == "BoundBox"

    def test_histogram_bins_hold_all_values_and_the_limit(self):

        for values, limit in (
            ([0.01, 0.02, 0.03], 0.05),
            ([0.06, np.nan], 0.05),
            ([0.0, 0.0], None),
            ([], 0.1),
        ):
            counts, edges = histogram_bins(np.array(values), limit)
            assert counts.sum() == np.isfinite(values).sum()
            if limit is not None and counts.size:
                assert edges[0] <= limit <= edges[-1]

    def test_german_is_found_by_qt(self):
        folder = Path(display.__file__).parent / "resources" / "translations"
        translator = QtCore.QTranslator()
        assert translator.load(str(folder / "CadSkin_de.qm"))
        assert translator.translate("CadSkin_Probe", "Probe value") == "Wert ablesen"
        assert (
            translator.translate("CadSkin", "all tolerances are held") == "alle Toleranzen sind eingehalten"
        )
        assert not translator.translate("CadSkin", "nothing of ours")
