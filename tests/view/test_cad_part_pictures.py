"""Pictures of parts from the CAD kernel: tangent edges, the automatic view, clipped limits."""

import numpy as np
import pytest

from cadskin.export.colours import colormap_table
from cadskin.export.content import content_of
from cadskin.view.pictures import draw
from cadskin.view.raster import EDGE_SHARP, EDGE_SMOOTH
from cadskin.view.scene import automatic_exaggeration, scene_of
from cadskin.view.software import BACKGROUND, best_direction
from cadskin.view.style import Style

cadquery = pytest.importorskip("cadquery")


@pytest.fixture(scope="module")
def rounded():
    import cadskin

    return cadskin.nominal(cadquery.Workplane().box(60, 40, 10).edges("|Z").fillet(8), edge_length=3.0)


def test_tangent_edges_are_smooth_and_the_others_sharp(rounded):
    scene = scene_of(content_of(rounded))
    ends = scene.points[scene.edges]
    upright = np.ptp(ends[:, :, 2], axis=1) > 0
    assert (scene.edge_codes[upright] == EDGE_SMOOTH).all()
    assert (scene.edge_codes[~upright] == EDGE_SHARP).all()
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    assert length[upright].sum() == pytest.approx(8 * 10)
    rim = 2 * (60 + 40 - 4 * 8) + 2 * np.pi * 8
    assert length[~upright].sum() == pytest.approx(2 * rim, rel=0.01)


@pytest.mark.parametrize("side", [">Z", "<Z"])
def test_the_automatic_view_shows_the_side_with_the_features(side):
    import cadskin

    solid = (
        cadquery.Workplane().box(60, 40, 10).faces(side).workplane().rarray(15, 15, 3, 2).circle(4).extrude(6)
    )
    scene = scene_of(content_of(cadskin.nominal(solid, edge_length=3.0)))
    direction = best_direction(scene)
    assert np.sign(direction[2]) == (1 if side == ">Z" else -1)


def test_the_automatic_view_of_a_plain_box_is_from_front_right_and_above(array_box):
    x, y, z = best_direction(scene_of(content_of(array_box)))
    assert x > 0
    assert y < 0
    assert z > 0


def test_exaggeration_respects_curvature_and_narrow_features(plain_skin):
    import cadskin

    solid = cadquery.Workplane().box(60, 40, 10).edges(">Z").chamfer(1.5)
    part = cadskin.nominal(solid, edge_length=1.5)
    # One value for each feature: no slope and no curvature limits, only shift and width do.
    deviation = np.where(part.feature_ids() % 2 == 0, 0.01, -0.01)
    factor = automatic_exaggeration(content_of(plain_skin(part, deviation)))
    width = 1.5 * np.sqrt(2)
    assert 0.4 * width / 0.01 / 2.5 <= factor <= 0.4 * width / 0.01 * 1.05


def test_the_bar_ends_in_a_point_only_where_values_are_beyond(array_box, plain_skin):
    deviation = np.linspace(-0.01, 0.05, array_box.n_samples)
    content = content_of(plain_skin(array_box, deviation))
    pixels = draw(content, Style(clim=0.02, view="iso"), "box", (1200, 900))
    x = 1200 - 138 + 12
    above = np.abs(pixels[188, x] - colormap_table()[-1]).max()
    below = np.abs(pixels[753, x] - np.array(BACKGROUND)).max()
    assert above < 0.02
    assert below < 1e-9
