"""Ranges, palettes, ticks and split meshes: arrays in, arrays out, no FreeCAD."""

import math

import numpy as np
import pytest
import synthetic
from CadSkin import colormap, split_mesh
from hypothesis import given
from hypothesis import strategies as st

lengths = st.floats(-50.0, 50.0, allow_nan=False).filter(lambda value: value == 0.0 or abs(value) > 1e-7)


@given(st.lists(lengths, min_size=1, max_size=20), st.sampled_from(["Automatic", "Symmetric"]))
def test_a_range_holds_its_values_and_zero_is_in_the_middle_of_a_symmetric_one(values, mode):
    colors = colormap.color_map(values, mode)
    assert colors.low < colors.high
    slack = 1e-5 * colors.span
    assert colors.low - slack <= min(values)
    assert max(values) <= colors.high + slack
    ids = colors.ids(values)
    assert ids.min() >= 1
    assert ids.max() <= 254
    if mode == "Symmetric":
        assert colors.low == -colors.high


@given(st.lists(lengths, min_size=1, max_size=20), st.integers(0, 12))
def test_ticks_are_inside_sorted_different_and_short(values, bands):
    colors = colormap.color_map(values, "Automatic", bands=bands)
    ticks = colors.ticks()
    places, labels = [value for value, _ in ticks], [label for _, label in ticks]
    assert 2 <= len(ticks) <= 11
    assert places == sorted(places)
    assert len(set(labels)) == len(labels)
    assert all(
        colors.low - 1e-5 * colors.span <= place <= colors.high + 1e-5 * colors.span for place in places
    )
    assert all("e" not in label and len(label) <= 10 for label in labels)
    assert "-0" not in labels
    assert "+0" not in labels


def test_zero_is_labelled_0():
    assert dict(colormap.color_map([-0.03, 0.03]).ticks())[0.0] == "0"
    assert [label for _, label in colormap.color_map([-0.03, 0.03]).ticks(7)] == [
        "-30", "-20", "-10", "0", "+10", "+20", "+30",
    ]  # fmt: skip


def test_ranges_by_tolerance_and_by_hand():
    assert colormap.color_map([-1, 5], "Tolerance", zone=0.1).high == 0.05
    assert colormap.color_map([-1, 5], "Tolerance", zone=None).high == 5.0
    assert colormap.color_map([], "Automatic").span > 0.0
    assert colormap.color_map([np.nan, np.inf, 0.5], "Symmetric").high == 0.5
    by_hand = colormap.color_map([-1, 5], "Manual", limits=(-0.2, 0.7))
    assert (by_hand.low, by_hand.high) == (-0.2, 0.7)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"mode": "Manual", "limits": (1.0, 1.0)}, "low < high"),
        ({"mode": "Manual", "limits": (0.0, math.nan)}, "low < high"),
        ({"mode": "Manual"}, "low < high"),
        ({"mode": "By eye"}, "Symmetric"),
        ({"palette": "Mud"}, "Viridis"),
    ],
)
def test_what_is_no_range_is_refused_with_the_way_out(arguments, words):
    with pytest.raises(ValueError, match=words):
        colormap.color_map([0.0, 1.0], **arguments)


def test_values_outside_the_range_have_colours_of_their_own():
    ids = colormap.palette_ids([-2.0, -1.0, 0.0, 1.0, 2.0, np.nan], -1.0, 1.0)
    assert ids.tolist() == [0, 1, 128, 254, 255, 0]
    palette = colormap.palette_colors("Blue-red")
    assert not (palette[[0, 255]] == palette[[1, 254]]).all(axis=1).any()


@pytest.mark.parametrize("name", colormap.PALETTES)
@pytest.mark.parametrize("bands", [1, 2, 7, 32])
def test_a_palette_with_bands_has_as_many_colours(name, bands):
    assert len(np.unique(colormap.palette_colors(name, bands)[1:-1], axis=0)) == bands
    assert len(np.unique(colormap.palette_colors(name)[1:-1], axis=0)) > 150


def test_texture_and_entry_agree():
    """The display mode colours by texture, the mesh by entry: one value, one colour."""
    colors = colormap.color_map([-0.04, 0.04])
    values = np.linspace(-0.05, 0.05, 4001, dtype=np.float32)
    scale, shift = colors.texture_transform()
    texels = np.clip(np.floor((values * np.float32(scale) + np.float32(shift)) * 256), 0, 255).astype(int)
    assert np.abs(texels - colors.ids(values).astype(int)).max() <= 1
    assert (texels == colors.ids(values)).mean() > 0.98
    ends = np.array([colors.low, colors.high], dtype=np.float32)
    assert np.floor((ends * np.float32(scale) + np.float32(shift)) * 256).tolist() == [1, 254]


def test_lengths_are_told_as_people_read_them():
    shown = [
        colormap.format_deviation(value, signed=True)
        for value in (0.0123, -0.5, 0.0, 2.5, -1e-9, None, np.nan)
    ]
    assert shown == ["+12.3 µm", "-500.0 µm", "0 µm", "+2.500 mm", "0 µm", "–", "–"]


def test_a_split_mesh_has_one_vertex_per_face_and_vertex():
    points, triangles, faces = synthetic.box_mesh(cells=6)
    split = split_mesh.split_mesh(triangles, faces, len(points))
    pairs = {(int(vertex), int(faces[t])) for t, three in enumerate(triangles) for vertex in three}
    assert split.n_vertices == len(pairs) == 6 * 7 * 7
    assert np.array_equal(split.vertex_ids[split.triangles], triangles)
    face_of = np.zeros(split.n_vertices, dtype=int)
    face_of[split.triangles.ravel()] = np.repeat(faces, 3)
    assert (face_of[split.triangles] == faces[:, None]).all()
    assert len(split.border) == 12 * 6


def test_corner_values_go_to_their_own_face():
    result = synthetic.box_result(cells=5)
    split = split_mesh.split_mesh(result.triangles, result.triangle_face, result.n_points)
    values = split.values(result.corner_deviation[0])
    assert np.array_equal(values[split.triangles], result.corner_deviation[0])


def test_normals_are_those_of_the_faces():
    points, triangles, faces = synthetic.box_mesh(cells=4)
    split = split_mesh.split_mesh(triangles, faces, len(points))
    normals = split_mesh.vertex_normals(points[split.vertex_ids], split.triangles)
    expected = np.zeros_like(normals)
    for number, (axis, side) in enumerate(synthetic.BOX_FACES, start=1):
        expected[np.unique(split.triangles[faces == number]), axis] = 1.0 if side else -1.0
    assert np.allclose(normals, expected)


def test_an_empty_mesh_is_split_into_nothing():
    split = split_mesh.split_mesh(np.zeros((0, 3), int), np.zeros(0, int), 0)
    assert split.n_vertices == 0
    assert split.border.shape == (0, 2)
    assert split_mesh.vertex_normals(np.zeros((0, 3)), split.triangles).shape == (0, 3)
