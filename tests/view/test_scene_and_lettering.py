"""Exaggeration, edge lines, colour maps and letters."""

import string

import numpy as np
import pytest
from support.parts import plate_with_hole

from cadskin.export.colours import COLORMAPS, colormap_table, feature_colours, map_colours, to_linear, to_srgb
from cadskin.export.content import content_of
from cadskin.shape import DiscreteShape
from cadskin.view.canvas import draw_text
from cadskin.view.pictures import headline, shown
from cadskin.view.raster import EDGE_SHARP
from cadskin.view.scene import automatic_exaggeration, scene_of
from cadskin.view.stroke_font import text_segments, text_width

# Dichromats confuse colours along these projections of linear sRGB (Vienot, Brettel, Mollon 1999).
PROTANOPIA = np.array([[0.11238, 0.88762, 0], [0.11238, 0.88762, 0], [0.00401, -0.00401, 1]])
DEUTERANOPIA = np.array([[0.29275, 0.70725, 0], [0.29275, 0.70725, 0], [-0.02234, 0.02234, 1]])


def oklab(srgb):
    to_lms = np.array(
        [
            [0.4122214708, 0.5363325363, 0.0514459929],
            [0.2119034982, 0.6806995451, 0.1073969566],
            [0.0883024619, 0.2817188376, 0.6299787005],
        ]
    )
    to_lab = np.array(
        [
            [0.2104542553, 0.7936177850, -0.0040720468],
            [1.9779984951, -2.4285922050, 0.4505937099],
            [0.0259040371, 0.7827717662, -0.8086757660],
        ]
    )
    return np.cbrt(to_linear(srgb) @ to_lms.T) @ to_lab.T


@pytest.mark.parametrize("name", ["blue-red", "green-purple"])
def test_diverging_maps_have_equal_lightness_on_both_sides(name):
    lightness = oklab(colormap_table(name))[:, 0]
    np.testing.assert_allclose(lightness, lightness[::-1], atol=0.03)
    assert (np.diff(lightness[:256]) > -1e-6).all()
    assert lightness.max() - lightness.min() > 0.5


@pytest.mark.parametrize("vision", [np.eye(3), PROTANOPIA, DEUTERANOPIA], ids=["normal", "protan", "deutan"])
@pytest.mark.parametrize("name", ["blue-red"])
def test_signs_can_be_told_apart_by_every_reader(name, vision):
    seen = oklab(to_srgb(to_linear(colormap_table(name)) @ vision.T))
    low, high = seen[:256], seen[:255:-1]
    apart = np.linalg.norm(low - high, axis=1)
    at_least = np.linspace(0.15, 0.0, 256)  # the colours meet in the middle
    assert (apart > at_least - 0.02).all()
    steps = np.linalg.norm(np.diff(seen, axis=0), axis=1)
    assert steps.sum() > 0.9  # and the map as a whole is long enough to be read


@pytest.mark.parametrize("name", COLORMAPS)
def test_maps_are_colours_and_hold_their_ends(name):
    table = colormap_table(name)
    assert table.min() >= 0
    assert table.max() <= 1
    np.testing.assert_allclose(map_colours(np.array([-9.0, -1, 1, 9]), -1, 1, name), table[[0, 0, -1, -1]])


def test_srgb_round_trip_and_own_map():
    values = np.linspace(0, 1, 33)
    np.testing.assert_allclose(to_srgb(to_linear(values)), values, atol=1e-12)
    own = map_colours(np.array([0.25]), 0, 1, [[0, 0, 0], [1, 0.5, 0]])
    np.testing.assert_allclose(own, [[0.25, 0.125, 0]], atol=2e-3)


def test_neighbouring_features_have_different_colours():
    lab = oklab(feature_colours(60))
    for gap in (1, 2, 3):
        assert np.linalg.norm(lab[gap:] - lab[:-gap], axis=1).min() > 0.05


def test_automatic_exaggeration_scales_with_the_deviation(array_box, plain_skin):
    factors = [
        automatic_exaggeration(content_of(plain_skin(array_box, plain_skin(array_box).deviation * k)))
        for k in (1.0, 0.1, 0.01, 1000.0)
    ]
    assert factors[1] == 10 * factors[0]
    assert factors[2] == 100 * factors[0]
    assert factors[3] == 1.0
    assert automatic_exaggeration(content_of(plain_skin(array_box, np.zeros(array_box.n_samples)))) == 1.0


def test_automatic_exaggeration_keeps_its_limits(array_shaft, plain_skin):
    rng = np.random.default_rng(3)
    for deviation in (rng.normal(0, 0.01, array_shaft.n_samples), np.full(array_shaft.n_samples, 0.01)):
        skin = plain_skin(array_shaft, deviation)
        content = content_of(skin)
        factor = automatic_exaggeration(content)
        scene = scene_of(content, exaggeration=factor, low=-1, high=1)
        shift = np.linalg.norm(scene.points - array_shaft.surface.points, axis=1)
        assert np.quantile(shift, 0.98) <= 0.012 * array_shaft.surface.diagonal * (1 + 1e-9)
        assert factor > 1


def test_edge_lines_are_the_borders_of_features(array_shaft):
    content = content_of(array_shaft)
    scene = scene_of(content)
    ends = scene.points[scene.edges]
    # Both rims, 48 lines each; the seam between the two half cylinders of one feature is none.
    assert len(ends) == 96
    assert np.isin(ends[:, :, 2], [0.0, 40.0]).all()
    np.testing.assert_allclose(np.linalg.norm(ends[:, :, :2], axis=2), 10.0)
    assert (scene.edge_codes == EDGE_SHARP).all()
    bare = scene_of(content_of(array_shaft.surface))
    assert len(bare.edges) == 96 + 2 * 12  # a bare shape knows faces only


def test_every_printable_sign_has_a_shape_of_its_own():
    shapes = {}
    for sign in string.digits + string.ascii_letters + string.punctuation + "°µ×±−–·²³Øøß…":
        segments = text_segments(sign, 0.0, 0.0, 10.0)
        assert len(segments), sign
        assert segments[:, [1, 3]].min() >= -11.1, sign
        assert segments[:, [1, 3]].max() <= 3.1, sign
        assert segments[:, [0, 2]].min() >= -0.75, sign
        assert segments[:, [0, 2]].max() <= text_width(sign, 10.0) + 0.75, sign
        shapes.setdefault(np.round(segments, 3).tobytes(), []).append(sign)
    assert all(len(signs) == 1 for signs in shapes.values()), shapes


def test_letters_without_a_shape_fall_back(array_box):
    assert (text_segments("é", 0, 0, 10) == text_segments("e", 0, 0, 10)).all()
    assert len(text_segments("中", 0, 0, 10)) == 4  # a box
    assert text_width("", 10) == 0
    assert (text_segments("a\n b", 0, 0, 10) == text_segments("a b", 0, 0, 10)).all()


def test_text_is_clipped_at_the_border_and_anchored():
    pixels = np.ones((20, 40, 3))
    draw_text(pixels, "MMMMMMMM", 30, 15, height=10, colour=(0, 0, 0))
    assert pixels[:, 28:].min() < 0.2
    middle = np.ones((20, 41, 3))
    draw_text(middle, "H", 20.5, 15, height=10, colour=(0, 0, 0), anchor="middle")
    np.testing.assert_allclose(middle, middle[:, ::-1], atol=1e-9)


@pytest.mark.parametrize(
    ("labels", "words"),
    [
        ([0, 0, 0, 0], "mesh"),
        ([-1, -1, -1, -1], "mesh"),
        ([7, 7, 7, 7], "face 7"),
        ([1, 1, 4, 9], "faces 1, 4 and 9"),
        ([0, 2, 4, 9], "4 faces"),
    ],
)
def test_the_line_below_a_mesh_names_the_faces_that_are_there(labels, words):
    """Not the largest label: a piece with face 7 alone is no part of eight faces."""
    tet = DiscreteShape(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]], labels
    )
    assert headline(content_of(tet), None) == f"{words} · 4 triangles · 1 × 1 × 1 mm"


def test_the_line_below_a_part_tells_its_faces_by_kind():
    part = plate_with_hole()
    kinds = [face.kind for face in part.faces]
    (words, *_) = shown(content_of(part))
    planes, cylinders = kinds.count("plane"), kinds.count("cylinder")
    ending = "" if cylinders == 1 else "s"
    assert words == f"{len(kinds)} faces: {planes} planes, {cylinders} cylinder{ending}"
