"""Pictures are judged by their pixels, against what geometry says they must show."""

import struct
import zlib

import numpy as np
import pytest

from cadskin.errors import ExportError, GeometryError
from cadskin.export.colours import colormap_table, map_colours
from cadskin.shape import DiscreteShape
from cadskin.stats import MeasuredPart
from cadskin.view import picture, sheet
from cadskin.view.camera import VIEWS, fit, view_direction
from cadskin.view.software import BACKGROUND

INK = np.array([0x20, 0x26, 0x2E])
BACK = np.round(np.array(BACKGROUND) * 255)
BARE = {"legend": False, "edges": False, "lit": False}


def decode_png(data):
    """Decode an 8-bit RGB file with the filters none, sub and up."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, []
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        assert struct.unpack(">I", data[at + 8 + length : at + 12 + length])[0] == zlib.crc32(kind + body)
        chunks.append((kind, body))
        at += 12 + length
    assert chunks[0][0] == b"IHDR"
    assert chunks[-1] == (b"IEND", b"")
    width, height, depth, colour = struct.unpack(">IIBB", chunks[0][1][:10])
    assert (depth, colour) == (8, 2)
    raw = zlib.decompress(b"".join(body for kind, body in chunks if kind == b"IDAT"))
    rows = np.frombuffer(raw, np.uint8).reshape(height, 1 + 3 * width)
    result = np.zeros((height, width, 3), np.uint8)
    above = np.zeros(3 * width, np.uint8)
    for i, row in enumerate(rows):
        assert row[0] in (0, 1, 2)
        above = row[1:] + (above if row[0] == 2 else 0)
        if row[0] == 1:
            above = np.cumsum(above.reshape(width, 3), axis=0, dtype=np.uint8).ravel()
        result[i] = above.reshape(width, 3)
    return result


@pytest.fixture
def shoot(tmp_path):
    def take(shape, **options):
        return decode_png(picture(tmp_path / "a.png", shape, **options).read_bytes()).astype(float)

    return take


def drawn(pixels, tolerance=3):
    return np.abs(pixels - BACK).max(axis=2) > tolerance


def per_face(part, values):
    return np.asarray(values)[part.feature_ids()]


def coverage(pixels, colour):
    """Share of each pixel that a uniformly coloured part covers, from its linear light."""

    def linear(values):
        values = np.asarray(values) / 255
        return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)

    back, front = linear(BACK), linear(colour)
    return ((linear(pixels) - back) @ (front - back)) / ((front - back) @ (front - back))


def test_front_view_of_a_box_is_a_rectangle_of_the_right_size(shoot, array_box, plain_skin):
    skin = plain_skin(array_box, per_face(array_box, np.full(6, 0.05)))
    pixels = shoot(skin, size=(800, 600), view="front", clim=0.05, exaggeration=1e-9, **BARE)
    scale = (800 - 2 * 18) / 60  # the margin is 3 % of 600 pixels, the box is 60 mm wide
    red = 255 * colormap_table("blue-red")[-1]
    np.testing.assert_allclose(coverage(pixels, red).sum(), 60 * 20 * scale**2, rtol=1e-3)


@pytest.mark.parametrize("direction", [(1, -1, 1), (0.3, 0.9, -0.5), (-2, 0.1, 0.4)])
def test_silhouette_of_a_box_has_its_projected_area(shoot, array_box, plain_skin, direction):
    skin = plain_skin(array_box, per_face(array_box, np.full(6, -0.05)))
    options = {"size": (700, 700), "view": direction, "clim": 0.05, "exaggeration": 1e-9}
    pixels = shoot(skin, **options, **BARE)
    unit = np.array(direction) / np.linalg.norm(direction)
    right = np.cross([0, 0, 1], unit)
    right /= np.linalg.norm(right)
    up = np.cross(unit, right)
    size = np.array([60.0, 40.0, 20.0])
    area = np.abs(unit) @ (size.prod() / size)
    frame = np.abs(right) @ size, np.abs(up) @ size  # of the projection
    mask = drawn(pixels)
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    scale = 0.94 * 700 / max(frame)
    np.testing.assert_allclose(np.ptp(columns) + 1, frame[0] * scale, atol=2)
    np.testing.assert_allclose(np.ptp(rows) + 1, frame[1] * scale, atol=2)
    blue = 255 * colormap_table("blue-red")[0]
    np.testing.assert_allclose(coverage(pixels, blue).sum(), area * scale**2, rtol=2e-3)
    # With lines, which lie half outside, still within one percent.
    lined = drawn(shoot(skin, **options, legend=False, lit=False, edges=True), 60)
    np.testing.assert_allclose(lined.sum(), area * scale**2, rtol=0.01)


@pytest.mark.parametrize("direction", [(1, -1, 1), (-1, 0.5, -0.3), (0, 0, 1)])
def test_only_faces_turned_to_the_eye_are_seen_in_exactly_their_colours(
    shoot, array_box, plain_skin, direction
):
    values = np.array([-0.05, -0.03, -0.01, 0.01, 0.03, 0.05])
    skin = plain_skin(array_box, per_face(array_box, values))
    pixels = shoot(skin, size=(500, 500), view=direction, clim=0.06, exaggeration=1e-9, **BARE)
    normals = np.repeat(np.eye(3), 2, axis=0) * np.tile([-1, 1], 3)[:, None]
    colours = np.round(255 * map_colours(values, -0.06, 0.06))
    counts = np.array([(np.abs(pixels - colour).max(axis=2) <= 1).sum() for colour in colours])
    visible = normals @ np.array(direction, dtype=float) > 1e-9
    assert (counts[visible] > 2000).all()
    assert (counts[~visible] == 0).all()
    # No bleeding across the sharp edges: all but the pixels on edges have one of the colours.
    total = coverage(pixels, colours[visible][0]).size
    mixed = total - counts.sum() - (~drawn(pixels, 0)).sum()
    assert mixed < 0.02 * total


def test_edges_are_drawn_where_they_are_seen_and_nowhere_else(shoot, array_box):
    direction = view_direction("iso")
    pixels = shoot(array_box, size=(600, 600), view="iso", legend=False)
    dark = np.abs(pixels - INK).max(axis=2) < 40
    margin = 0.03 * 600
    camera = fit(direction, array_box.surface.points, (margin, margin, 600 - margin, 600 - margin))
    corner = np.array([30.0, -20.0, 10.0])  # the nearest one
    rows, columns = np.nonzero(dark)
    centres = np.stack([columns + 0.5, rows + 0.5], axis=1)
    nearest = np.full(len(centres), np.inf)
    for axis in range(3):
        for signs in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            ends = np.zeros((2, 3))
            ends[:, axis] = -corner[axis], corner[axis]
            others = [k for k in range(3) if k != axis]
            ends[:, others] = corner[others] * np.array(signs)
            if signs == (-1, -1):
                continue  # hidden
            a, b = camera.project(ends)[:, :2]
            share = np.clip((centres - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
            distance = np.linalg.norm(centres - a - share[:, None] * (b - a), axis=1)
            nearest = np.minimum(nearest, distance)
            steps = a + np.linspace(0.05, 0.95, 50)[:, None] * (b - a)
            on = [dark[int(y) - 1 : int(y) + 2, int(x) - 1 : int(x) + 2].any() for x, y in steps]
            assert np.mean(on) == 1.0
    assert nearest.max() < 2.5


def test_exaggeration_multiplies_the_displacement(shoot, array_box, plain_skin):
    deviation = per_face(array_box, [0.05, 0.05, 0, 0, 0, 0])  # grows along x only

    def width_over_height(exaggeration):
        skin = plain_skin(array_box, deviation)
        pixels = shoot(skin, size=(900, 900), view="front", exaggeration=exaggeration, clim=0.05, **BARE)
        middle = drawn(pixels)[440:460].any(axis=0)
        return middle.sum() / drawn(pixels).any(axis=1).sum()

    np.testing.assert_allclose(width_over_height(1), 60.1 / 20, rtol=0.01)
    np.testing.assert_allclose(width_over_height(100), 70 / 20, rtol=0.01)


def test_the_colour_bar_shows_the_colour_map(shoot, array_box, plain_skin):
    pixels = shoot(plain_skin(array_box), size=(1200, 900), colormap="green-purple")
    table = np.round(255 * colormap_table("green-purple"))[::-1]
    column = pixels[:, 1200 - 138 + 12]
    found = [np.abs(column - table[k]).max(axis=1).argmin() for k in (20, 128, 256, 384, 490)]
    assert all(
        np.abs(column[row] - table[k]).max() <= 2
        for row, k in zip(found, (20, 128, 256, 384, 490), strict=True)
    )
    assert (np.diff(found) > 50).all()
    assert np.ptp(np.diff(found)[1:3]) <= 2
    beside = shoot(array_box, size=(1200, 900))[:, 1200 - 138 + 12]
    assert np.abs(beside[150:250] - BACK).max() == 0  # no bar for a nominal part


def test_background_is_light_and_the_text_is_dark(shoot, array_box, plain_skin):
    pixels = shoot(plain_skin(array_box))
    assert BACK.min() > 245
    for corner in (pixels[0, 0], pixels[0, -1], pixels[-1, 0], pixels[-1, -1]):
        np.testing.assert_array_equal(corner, BACK)
    title = pixels[30:70, 30:200]
    assert (np.abs(title - INK).max(axis=2) < 30).sum() > 40


def test_title_and_numbers_change_only_their_own_place(shoot, array_box, plain_skin):
    skin = plain_skin(array_box)
    one, other = shoot(skin, title="A"), shoot(skin, title="B")
    changed = np.argwhere(np.abs(one - other).max(axis=2) > 0)
    assert len(changed)
    assert changed.max(axis=0)[0] < 70
    assert changed.max(axis=0)[1] < 80


def test_light_keeps_the_hue_and_the_top_bright(shoot, array_box, plain_skin):
    skin = plain_skin(array_box, per_face(array_box, np.full(6, 0.05)))
    options = {"size": (400, 400), "view": "iso", "clim": 0.05, "exaggeration": 1e-9}
    options |= {"legend": False, "edges": False}
    lit, flat = shoot(skin, **options), shoot(skin, lit=False, **options)
    inside = coverage(flat, 255 * colormap_table()[-1]) > 0.999
    share = lit[inside] / np.maximum(flat[inside], 1)
    assert share[:, 0].min() > 0.5
    assert share[:, 0].max() < 1.1


def test_a_curved_face_is_shaded_without_facets(shoot, array_shaft):
    pixels = shoot(array_shaft, size=(600, 600), view="front", legend=False, edges=False)
    row = pixels[300]
    inside = np.flatnonzero(drawn(pixels)[300])[3:-3]
    # 48 facets would jump by more; exact normals give a smooth row.
    assert np.abs(np.diff(row[inside], axis=0)).max() <= 4
    assert np.ptp(row[inside, 0]) > 15


def test_an_open_shell_shows_its_inside(shoot, array_box):
    keep = array_box.surface.face_ids != 5
    surface = array_box.surface
    shell = DiscreteShape(surface.points, surface.triangles[keep], surface.face_ids[keep])
    pixels = shoot(shell, size=(300, 300), view="top", legend=False, edges=False, lit=False)
    colours = {tuple(c) for c in pixels[140:160, 140:160].reshape(-1, 3)}
    assert len(colours) == 1
    assert colours != {tuple(BACK)}


@pytest.mark.parametrize("view", ["auto", *VIEWS])
def test_every_view_fills_the_frame(shoot, array_shaft, view):
    mask = drawn(shoot(array_shaft, size=(400, 300), view=view, **BARE))
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    assert abs(rows[0] + rows[-1] - 299) <= 2
    assert abs(columns[0] + columns[-1] - 399) <= 2
    assert np.ptp(rows) > 280 or np.ptp(columns) > 380


def test_same_input_gives_the_same_bytes(tmp_path, array_box, plain_skin):
    files = [picture(tmp_path / f"{i}.png", plain_skin(array_box)).read_bytes() for i in range(2)]
    assert files[0] == files[1]


def test_a_sheet_has_one_tile_per_shape_and_common_limits(tmp_path, array_box, plain_skin):
    small = plain_skin(array_box, per_face(array_box, np.full(6, 0.01)))
    large = plain_skin(array_box, per_face(array_box, np.full(6, 0.05)))
    path = sheet(
        tmp_path / "s.png",
        [small, large, small],
        columns=2,
        tile=(300, 200),
        view="front",
        exaggeration=1,
        **BARE,
    )
    pixels = decode_png(path.read_bytes()).astype(float)
    assert pixels.shape == (400, 600, 3)
    colours = np.round(255 * map_colours(np.array([0.01, 0.05]), -0.05, 0.05))
    np.testing.assert_allclose(pixels[100, 150], colours[0], atol=1)
    np.testing.assert_allclose(pixels[100, 450], colours[1], atol=1)
    np.testing.assert_allclose(pixels[300, 150], colours[0], atol=1)
    np.testing.assert_array_equal(pixels[300, 450], BACK)


def test_a_sheet_with_one_colour_bar(tmp_path, array_box, plain_skin):
    """Tiles keep their colours; title and bar are drawn outside of the part; bare shapes are refused."""
    small = plain_skin(array_box, per_face(array_box, np.full(6, 0.01)))
    large = plain_skin(array_box, per_face(array_box, np.full(6, 0.05)))
    options = {
        "columns": 2,
        "tile": (280, 210),
        "view": "front",
        "exaggeration": 1,
        "lit": False,
        "edges": False,
    }
    path = sheet(tmp_path / "s.png", [small, large], ["one", "two"], common_bar=True, **options)
    pixels = decode_png(path.read_bytes()).astype(float)
    assert pixels.shape == (210, 2 * 280 + 96, 3)
    colours = np.round(255 * map_colours(np.array([0.01, 0.05]), -0.05, 0.05))
    np.testing.assert_allclose(pixels[130, 140], colours[0], atol=4)
    np.testing.assert_allclose(pixels[130, 420], colours[1], atol=4)
    for left in (0, 280):
        assert (pixels[:44, left : left + 280] < 100).any(), "a title above each part"
    bar = pixels[:, 560:]
    assert np.abs(bar - colours[1]).sum(axis=2).min() < 12
    np.testing.assert_array_equal(pixels[-1, -1], BACK)
    with pytest.raises(ExportError, match="a common colour bar is for skin models"):
        sheet(tmp_path / "n.png", [array_box], common_bar=True)


def test_wrong_options_are_refused_and_leave_nothing(tmp_path, array_box, plain_skin):
    skin = plain_skin(array_box)
    for options, words in (
        ({"size": (10, 10)}, "size must be"),
        ({"size": (400.5, 300)}, "size must be"),
        ({"view": "under"}, "no view 'under'"),
        ({"view": (0, 0, 0)}, "vector of three"),
        ({"exaggeration": 0}, "exaggeration must be positive"),
        ({"exaggeration": float("nan")}, "exaggeration must be positive"),
        ({"clim": -1}, "clim must be"),
        ({"clim": (1, 1)}, "clim must be"),
        ({"unit": "inch"}, "unit must be"),
        ({"colormap": "jet"}, "no colormap 'jet'"),
        ({"colormap": [[2, 0, 0], [0, 0, 0]]}, "colormap is a name or"),
        ({"engine": "gl"}, "engine must be"),
    ):
        with pytest.raises(ExportError, match=words):
            picture(tmp_path / "a.png", skin, **options)
    with pytest.raises(TypeError, match="colour"):
        picture(tmp_path / "a.png", skin, colour="red")
    with pytest.raises(GeometryError, match="has no mesh"):
        picture(tmp_path / "a.png", "part")
    with pytest.raises(ExportError, match="does not exist"):
        picture(tmp_path / "no" / "a.png", skin, size=(200, 200))
    with pytest.raises(ExportError, match="one title for each"):
        sheet(tmp_path / "a.png", [skin], ["a", "b"])
    with pytest.raises(ExportError, match="columns must be"):
        sheet(tmp_path / "a.png", [skin], columns=0)
    assert list(tmp_path.iterdir()) == []


def test_what_was_not_measured_is_grey(shoot, array_box):
    part = array_box
    values = per_face(part, np.full(len(part.faces), 0.05))
    values[part.features[0].rows] = np.nan
    made = MeasuredPart(
        part, values, values, np.where(np.isnan(values), 0, 9), np.zeros(1, dtype=int), np.zeros(1)
    )
    unseen, seen = part.faces[0].normal, -part.faces[0].normal
    grey = round(255 * 0.62)
    shares = [
        (np.abs(shoot(made, view=tuple(view), **BARE) - grey).max(axis=2) <= 2).mean()
        for view in (unseen, seen)
    ]
    assert shares[0] > 0.3
    assert shares[1] == 0
    assert made.measured_surface.n_triangles == (part.surface.face_ids != 0).sum()
    assert np.isnan(made.vertex_deviation).sum() == len(
        set(part.features[0].vertex_ids) - {v for f in part.features[1:] for v in f.vertex_ids}
    )
