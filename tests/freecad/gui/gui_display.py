"""The deviation map on synthetic results: what is on the picture, and what it costs."""

import time
from unittest import mock

import FreeCAD
import Mesh
import numpy as np
from freecad.CadSkin import display, view_skin
from gui_support import OUT, GuiTest, count_colors, legend_area, process_events, view, view_picture
from pivy import coin
from synthetic import box_result


class SyntheticSkin:
    """A skin object whose result comes from arrays."""

    def __init__(self, document, result):
        self.object = document.addObject("Mesh::FeaturePython", "Skin")
        self.object.addProperty("App::PropertyColorList", "VertexColors")
        self.object.addProperty("App::PropertyInteger", "ShownInstance")
        self.object.Mesh = mesh_of(result.points, result.triangles)
        view_skin.attach_view(self.object.ViewObject)

    @property
    def view_object(self):
        """The view object."""
        return self.object.ViewObject


def mesh_of(points, triangles):
    """Return a FreeCAD mesh."""
    return Mesh.Mesh(
        (
            [FreeCAD.Vector(*point) for point in points.tolist()],
            [tuple(three) for three in triangles.tolist()],
        )
    )


class DisplayTest(GuiTest):
    """Pictures of the deviation map."""

    def show(self, result):
        """Return a synthetic skin on the screen."""
        patch = mock.patch.object(view_skin, "_result", return_value=result)
        patch.start()
        self.addCleanup(patch.stop)
        skin = SyntheticSkin(self.document, result)
        view().viewIsometric()
        view().fitAll()
        process_events(0.1)
        return skin

    def test_colours_and_legend_are_on_the_picture(self):
        result = box_result()
        skin = self.show(result)
        skin.view_object.Exaggeration = 50
        palette = display.colors_of(result.range(), display.settings_of(skin.view_object)).colors()
        for background in ("White", "Black", "Current"):
            pixels = view_picture(f"map_{background.lower()}", background)
            assert count_colors(pixels) > 300
            _left, top, right, bottom = legend_area(pixels, palette)
            assert right < 100
            assert bottom - top > 150

    def test_the_legend_goes_where_it_is_told(self):
        result = box_result()
        skin = self.show(result)
        palette = display.colors_of(result.range(), display.settings_of(skin.view_object)).colors()
        for position in display.LEGEND_POSITIONS[:-1]:
            skin.view_object.Legend = position
            _left, _top, right, bottom = legend_area(
                view_picture("legend_" + position.replace(" ", "_").lower()), palette
            )
            assert ("left" in position) == (right < 500), position
            assert ("Top" in position) == (bottom < 350), position
        skin.view_object.Legend = "Hidden"
        assert legend_area(view_picture("legend_hidden"), palette) is None

    def test_the_legend_does_not_change_the_size_of_the_scene(self):
        skin = self.show(box_result())
        with_legend = view().getCameraNode().height.getValue()
        action = coin.SoGetBoundingBoxAction(coin.SbViewportRegion(1000, 700))
        action.apply(skin.view_object.RootNode)
        assert max(action.getBoundingBox().getSize().getValue()) < 61
        skin.view_object.Legend = "Hidden"
        view().fitAll()
        assert abs(view().getCameraNode().height.getValue() - with_legend) < 1e-3

    def test_no_colour_bleeds_over_an_edge(self):
        """Two faces at opposite ends of the range: along their common edge there is nothing in between."""
        result = box_result(amplitude=0.03, instances=1)
        constant = np.where(result.triangle_face == 6, 0.04, -0.04)[:, None].repeat(3, axis=1)
        flat = type(result)(
            points=result.points,
            triangles=result.triangles,
            triangle_face=result.triangle_face,
            displacement=0.0 * result.displacement,
            corner_deviation=constant[None].astype(np.float32),
        )
        skin = self.show(flat)
        skin.view_object.Legend = "Hidden"
        view().viewFront()
        view().viewIsometric()
        pixels = view_picture("no_bleeding", "White").astype(int)
        red, blue = pixels[..., 0] - pixels[..., 2] > 40, pixels[..., 2] - pixels[..., 0] > 40
        coloured = (pixels.max(axis=2) > 90) & (pixels.min(axis=2) < 235)
        between = coloured & ~red & ~blue
        assert red.sum() > 20000
        assert blue.sum() > 20000
        assert between.sum() < 0.02 * coloured.sum()
        assert pixels[red].max() > 120  # the ends of the range belong to it

    def test_exaggeration_moves_the_surface_and_its_value_is_limited(self):
        skin = self.show(box_result())
        points = skin.view_object.Proxy._mode._coordinates.point
        before = np.array([points[k].getValue() for k in range(50)])
        skin.view_object.Exaggeration = 100
        after = np.array([points[k].getValue() for k in range(50)])
        assert np.abs(after - before).max() > 1.0
        skin.view_object.Exaggeration = 5000
        assert skin.view_object.Exaggeration == 1000
        skin.view_object.Exaggeration = 0
        assert skin.view_object.Exaggeration == 1

    def test_without_our_mode_the_mesh_carries_the_colours(self):
        skin = self.show(box_result())
        process_events(0.1)
        assert len(skin.object.VertexColors) == skin.object.Mesh.CountPoints
        skin.view_object.DisplayMode = "Shaded"
        assert skin.view_object.Coloring
        assert count_colors(view_picture("map_vertex_colors")) > 300
        skin.view_object.DeviationMap = False
        assert not skin.view_object.Coloring
        assert count_colors(view_picture("map_off", "White")) < 200

    def test_bands_and_palettes(self):
        result = box_result()
        skin = self.show(result)
        skin.view_object.Exaggeration = 50
        skin.view_object.Bands = 8
        view_picture("bands", "White")
        skin.view_object.RangeMode = "Manual"
        skin.view_object.RangeLow, skin.view_object.RangeHigh = -0.02, 0.02
        skin.view_object.Palette = "Rainbow"
        view_picture("out_of_range", "White")
        skin.view_object.RangeLow = 0.5
        process_events()
        assert display.colors_of(result.range(), display.settings_of(skin.view_object)).low == -0.05

    def test_a_million_vertices_are_recoloured_within_a_second(self):
        result = box_result(cells=408, instances=1)
        assert result.n_points > 990000
        skin = self.show(box_result(cells=2))
        with mock.patch.object(view_skin, "_result", return_value=result):
            skin.view_object.Exaggeration = 20
            view().fitAll()
            first = cpu_seconds(process_events)
            view_picture("million", "White")
            recolour = cpu_seconds(lambda: setattr(skin.view_object, "Bands", 10))
            drawing = cpu_seconds(process_events)
        colors = display.colors_of(result.range(), display.MapSettings())
        by_vertex = cpu_seconds(lambda: display.vertex_colors(result, 0, colors))
        told = (
            f"1 M vertices, CPU s: first drawing {first:.2f}, recolour {recolour:.3f} "
            f"(then drawing {drawing:.2f}), "
            f"vertex colours {by_vertex:.2f}\n"
        )
        (OUT / "million.txt").write_text(told, encoding="utf-8")
        assert recolour + drawing < 1.0, told
        assert by_vertex < 2.0, told


def cpu_seconds(action):
    """Return what an action costs in this process [CPU s]."""
    started = time.process_time()
    action()
    return time.process_time() - started
