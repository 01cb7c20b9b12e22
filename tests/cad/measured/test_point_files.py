"""Point files: what other programs write comes back; what is broken is refused with its line."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from cadskin.cad.measured import read_points
from cadskin.errors import ReadError

POINTS = np.array([[0, 0, 0], [1.5, 0, 0], [0, 2.25, 0], [0, 0, -3.125]])


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.xyz", "0 0 0\n1.5 0 0\n0 2.25 0\n0 0 -3.125\n"),
        ("a.csv", "x,y,z\n0,0,0\n1.5,0,0\n0,2.25,0\n0,0,-3.125\n"),
        ("a.csv", "X;Y;Z\n0,0;0,0;0,0\n1,5;0;0\n0;2,25;0\n0;0;-3,125\n"),
        ("a.asc", "# scanner\n\n0\t0\t0\n1.5\t0\t0\n0\t2.25\t0\n0\t0\t-3.125"),
        ("a.pts", "4\n0 0 0 7\n1.5 0 0 7\n0 2.25 0 7\n0 0 -3.125 7\n"),
        ("a.txt", "\ufeff// head\n 0, 0, 0\n 1.5, 0, 0\n 0, 2.25, 0\n 0, 0, -3.125e0\n"),
    ],
)
def test_columns_of_numbers(tmp_path, name, text):
    (tmp_path / name).write_text(text, encoding="utf-8")
    cloud = read_points(tmp_path / name)
    np.testing.assert_array_equal(cloud.points, POINTS)
    assert cloud.source == name


def test_columns_can_be_chosen_and_units_are_converted(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("1 0 0 1 0.5 1 2\n2 0 0 1 0.5 1 3\n")
    cloud = read_points(path, unit="inch", columns=(4, 5, 6, 1, 2, 3))
    np.testing.assert_allclose(cloud.points, 25.4 * np.array([[0.5, 1, 2], [0.5, 1, 3]]))
    np.testing.assert_array_equal(cloud.normals, [[0, 0, 1], [0, 0, 1]])
    with pytest.raises(ReadError, match="7 columns"):
        read_points(path, columns=(0, 1, 7))
    with pytest.raises(ReadError, match="three"):
        read_points(path, columns=(0, 1))
    with pytest.raises(ReadError, match="unit"):
        read_points(path, unit="ft")


def test_missing_measurements_stay_nan(tmp_path):
    (tmp_path / "a.xyz").write_text("0 0 0\nnan nan nan\n1 1 1\n")
    assert np.isnan(read_points(tmp_path / "a.xyz").points[1]).all()


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.xyz", "0 0 0\n1 1\n", "line 2"),
        ("a.xyz", "0 0 0\n1 1 one\n", "line 2"),
        ("a.csv", "name\n", "no line of numbers"),
        ("a.ply", "plain text", "no header"),
        ("a.stl", "no solid", "neither"),
        ("a.stl", "solid a\n vertex 0 0 0\n", "cut off"),
        ("a.stl", "solid a\n vertex 0 0 x\n", "three numbers"),
        ("a.docx", "", "read from"),
    ],
)
def test_broken_files_name_the_place(tmp_path, name, text, message):
    (tmp_path / name).write_text(text)
    with pytest.raises(ReadError, match=message):
        read_points(tmp_path / name)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ReadError, match="cannot be read"):
        read_points(tmp_path / "none.xyz")


@pytest.mark.parametrize("encoding", ["ascii", "binary_little_endian"])
def test_ply_of_trimesh(tmp_path, encoding):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=7.0)
    path = tmp_path / "a.ply"
    mesh.export(path, encoding="ascii" if encoding == "ascii" else "binary", vertex_normal=True)
    cloud = read_points(path)
    np.testing.assert_allclose(cloud.points, mesh.vertices, atol=1e-5)
    np.testing.assert_array_equal(cloud.triangles, mesh.faces)
    np.testing.assert_allclose(np.abs((cloud.normals * mesh.vertices).sum(1)), 7.0, atol=1e-3)


def test_big_endian_ply_with_polygons_and_other_elements(tmp_path):
    header = (
        "ply\nformat binary_big_endian 1.0\ncomment made by hand\nelement vertex 4\nproperty double x\n"
        "property float y\nproperty short z\nproperty uchar red\nelement camera 1\nproperty int id\n"
        "element face 2\nproperty list uchar int vertex_index\nend_header\n"
    )
    body = b"".join(struct.pack(">dfhB", *row, 9) for row in [(0, 0, 0), (1, 0, 0), (1, 1, 2), (0, 1, -2)])
    body += struct.pack(">i", 5) + struct.pack(">B4i", 4, 0, 1, 2, 3) + struct.pack(">B3i", 3, 0, 2, 3)
    path = tmp_path / "a.ply"
    path.write_bytes(header.encode() + body)
    cloud = read_points(path)
    np.testing.assert_array_equal(cloud.points, [[0, 0, 0], [1, 0, 0], [1, 1, 2], [0, 1, -2]])
    np.testing.assert_array_equal(cloud.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 3]])
    path.write_bytes(header.encode() + body[:-20])
    with pytest.raises(ReadError, match="cut off"):
        read_points(path)
    path.write_text(header.replace("short z", "short w").replace("double x", "double q"))
    with pytest.raises(ReadError):
        read_points(path)


@pytest.mark.parametrize("form", ["stl", "stl_ascii"])
def test_stl_of_trimesh(tmp_path, form):
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.box((3, 4, 5))
    path = tmp_path / "a.stl"
    mesh.export(path, file_type=form)
    cloud = read_points(path)
    assert len(cloud) == 8
    corners = cloud.points[cloud.triangles]
    volume = np.einsum("ij,ij->", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    assert volume == pytest.approx(60)
