"""The modules of the workbench that need no FreeCAD: result, PLY, protocol, characteristics."""

import ast
import json
import sys
import tomllib
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest
from CadSkin import kinds, ply, protocol
from CadSkin.result import ResultError, SkinResult, read_result

from cadskin.spec import CHARACTERISTICS
from cadskin.worker import PROTOCOL

ROOT = Path(__file__).resolve().parents[2]


def two_triangles(**changes):
    """A unit square of two faces that meet at the diagonal, two instances."""
    arrays = {
        "points": np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]]),
        "triangles": np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32),
        "triangle_face": np.array([1, 2], dtype=np.int32),
        "displacement": np.zeros((2, 4, 3), dtype=np.float32),
        "corner_deviation": np.array([[[1, 2, 3], [-4, 0, 0]], [[0, 0, 0], [0, 0, 0]]], dtype=np.float32),
        "report": {"instances": [{"tolerances": [{"id": "T", "value": 0.5}]}, {"tolerances": []}]},
    }
    return SkinResult(**{**arrays, **changes})


def test_statistics_are_weighted_by_area():
    found = two_triangles(points=np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 1, 0.0]]))
    low, high, rms = found.statistics(0)
    assert (low, high) == (-4.0, 3.0)
    first, second = 2.0, 1.0  # areas
    assert rms == pytest.approx(np.sqrt((first * 14 / 3 + second * 16 / 3) / 3))
    assert found.statistics(0, face=2)[:2] == (-4.0, 0.0)
    assert found.statistics(0, face=9) == (0.0, 0.0, 0.0)
    assert found.range() == (-4.0, 3.0)


def test_a_vertex_shows_the_largest_deviation_of_its_faces():
    assert two_triangles().vertex_deviation(0).tolist() == [-4.0, 2.0, 3.0, 0.0]


def test_exaggeration_and_nearest_vertex():
    moved = np.zeros((2, 4, 3), dtype=np.float32)
    moved[0, 1, 2] = 0.5
    found = two_triangles(displacement=moved)
    assert found.instance_points(0, exaggeration=10)[1].tolist() == [1, 0, 5]
    assert found.nearest_corner((1, 0, 0.6))[2] == 2.0


def test_values_of_a_tolerance():
    values = two_triangles().tolerance_values("T")
    assert values[0] == 0.5
    assert np.isnan(values[1])


def test_a_file_there_and_back(tmp_path):
    found = two_triangles()
    path = tmp_path / "skin.npz"
    path.write_bytes(found.to_bytes())
    back = read_result(path)
    assert np.array_equal(back.corner_deviation, found.corner_deviation)
    assert back.report == found.report
    assert read_result(path, {"x": 1}).report == {"x": 1}
    with pytest.raises(ValueError, match="read-only"):
        back.points[0] = 1


@pytest.mark.parametrize(
    "changes",
    [
        {"triangle_face": np.zeros(3, dtype=np.int32)},
        {"displacement": np.zeros((2, 3, 3), dtype=np.float32)},
        {"corner_deviation": np.zeros((1, 2, 3), dtype=np.float32)},
        {"triangles": np.array([[0, 1, 2], [0, 2, 4]], dtype=np.int32)},
        {"triangles": np.array([[0, 1, 2], [0, 2, -1]], dtype=np.int32)},
    ],
)
def test_arrays_that_do_not_fit_are_refused(changes):
    with pytest.raises(ResultError, match="damaged"):
        two_triangles(**changes)


@pytest.mark.parametrize("cut", [0, 3, 100, 700])
def test_a_damaged_file_is_named(tmp_path, cut):
    path = tmp_path / "skin.npz"
    path.write_bytes(two_triangles().to_bytes()[:cut])
    with pytest.raises(ResultError, match=r"skin\.npz"):
        read_result(path)
    np.save(tmp_path / "one.npy", np.zeros(3))  # an array, no archive
    with pytest.raises(ResultError, match=r"one\.npy"):
        read_result(tmp_path / "one.npy")
    with pytest.raises(ResultError, match=r"none\.npz"):
        read_result(tmp_path / "none.npz")


def test_ply_is_what_its_header_says(tmp_path):
    found = two_triangles()
    path = tmp_path / "skin.ply"
    ply.write_ply(path, found.points, found.triangles)
    head, body = path.read_bytes().split(b"end_header\n")
    assert b"element vertex 4" in head
    assert np.frombuffer(body[:48], "<f4").reshape(4, 3).tolist() == found.points.tolist()
    assert np.frombuffer(body[49:61], "<i4").tolist() == [0, 1, 2]
    assert len(body) == 48 + 2 * 13


def test_workbench_and_worker_speak_the_same_protocol():
    assert protocol.PROTOCOL == PROTOCOL


def test_the_characteristics_are_those_of_cadskin():
    assert set(kinds.CHARACTERISTICS) == set(CHARACTERISTICS)
    for name, row in kinds.CHARACTERISTICS.items():
        assert (row.symbol, row.datums) == (CHARACTERISTICS[name].symbol, CHARACTERISTICS[name].datums)


def test_characteristics_by_surface():
    assert "flatness" in kinds.characteristics_for(["Plane", "Plane"])
    assert kinds.characteristics_for(["BSplineSurface"]) == ["line_profile", "surface_profile"]
    assert "has no meaning" in kinds.refusal("flatness", ["Plane", "Cone"])
    assert "is called" in kinds.refusal("flat", ["Plane"])
    assert kinds.refusal("flatness", ["Plane"]) is None


def test_a_request_file(tmp_path):
    protocol.write_request(tmp_path, "7", {"task": "simulate", "part": "Größe"})
    assert json.loads((tmp_path / "request.json").read_text("utf-8")) == {
        "protocol": PROTOCOL,
        "job": "7",
        "task": "simulate",
        "part": "Größe",
    }
    with pytest.raises(protocol.JobError) as caught:
        protocol.write_request(tmp_path / "missing", "7", {})
    assert caught.value.kind == "DiskError"


def test_only_own_folders_are_removed(tmp_path):
    protocol.remove_folder(tmp_path)
    assert tmp_path.exists()
    folder = protocol.new_folder()
    protocol.remove_folder(folder)
    assert not folder.exists()


def test_the_package_file_points_to_what_is_there():
    space = "{https://wiki.freecad.org/Package_Metadata}"
    package = ElementTree.parse(ROOT / "package.xml").getroot()
    workbench = package.find(f"{space}content/{space}workbench")
    folder = ROOT / workbench.findtext(f"{space}subdirectory")
    code = (folder / "freecad" / "CadSkin" / "init_gui.py").read_text("utf-8")
    assert f"class {workbench.findtext(f'{space}classname')}(" in code
    assert (ROOT / package.findtext(f"{space}icon")).is_file()
    assert (ROOT / package.find(f"{space}license").get("file")).is_file()
    assert not (folder / "freecad" / "__init__.py").exists()  # the namespace belongs to nobody
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    assert package.findtext(f"{space}license") == project["project"]["license"]


def test_the_client_imports_nothing_heavy():
    allowed = {"FreeCAD", "FreeCADGui", "Part", "Mesh", "PySide", "pivy", "numpy", "freecad"}
    for path in (ROOT / "freecad_workbench").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            names = []
            if isinstance(node, ast.Import):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                names = [node.module]
            for name in names:
                top = name.split(".")[0]
                assert top in allowed or top in sys.stdlib_module_names, f"{path.name} imports {name}"
