"""Files are read back by readers that know nothing of the writers."""

import io
import json
import warnings
import xml.etree.ElementTree as ElementTree
import zipfile

import meshio
import numpy as np
import pytest
import trimesh

import cadskin.export as export
from cadskin.errors import CadskinWarning, ExportError, GeometryError
from cadskin.export.obj import group_names
from cadskin.shape import DiscreteShape


@pytest.fixture(params=["box", "shaft"])
def part(request, array_box, array_shaft):
    return {"box": array_box, "shaft": array_shaft}[request.param]


@pytest.fixture
def skin(part, plain_skin):
    return plain_skin(part)


def merged(mesh):
    mesh.merge_vertices(merge_norm=True, merge_tex=True)
    return mesh


def assert_same_solid(mesh, surface, *, rtol=1e-6, scale=1.0):
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert len(mesh.faces) == surface.n_triangles
    assert len(mesh.vertices) == surface.n_points
    np.testing.assert_allclose(mesh.volume, surface.volume * scale**3, rtol=rtol)


@pytest.mark.parametrize("ascii", [False, True])
def test_stl_is_the_same_solid_for_trimesh(tmp_path, skin, ascii):
    path = export.write(tmp_path / "a.stl", skin, ascii=ascii)
    assert path.read_bytes().startswith(b"solid") is ascii
    mesh = trimesh.load_mesh(path)
    assert_same_solid(mesh, skin.surface)
    # The triangles keep their order.
    np.testing.assert_allclose(mesh.triangles, skin.surface.points[skin.surface.triangles], atol=1e-5)


def test_binary_stl_normals_are_those_of_the_triangles(tmp_path, skin):
    raw = export.write(tmp_path / "a.stl", skin).read_bytes()
    records = np.frombuffer(raw[84:], dtype=[("v", "<f4", (4, 3)), ("attribute", "<u2")])["v"]
    cross = np.cross(records[:, 2] - records[:, 1], records[:, 3] - records[:, 1])
    cosine = np.einsum("ij,ij->i", cross, records[:, 0]) / np.linalg.norm(cross, axis=1)
    np.testing.assert_allclose(cosine, 1, atol=1e-5)


def test_ascii_and_binary_stl_hold_the_same_32_bit_numbers(tmp_path, skin):
    binary = trimesh.load_mesh(export.write(tmp_path / "b.stl", skin), process=False)
    text = trimesh.load_mesh(export.write(tmp_path / "a.stl", skin, ascii=True), process=False)
    np.testing.assert_array_equal(binary.triangles.astype("f4"), text.triangles.astype("f4"))


@pytest.mark.parametrize("double", [False, True])
def test_ply_keeps_deviation_and_labels_for_trimesh(tmp_path, skin, double):
    path = export.write(tmp_path / "a.ply", skin, double=double)
    mesh = trimesh.load_mesh(path, process=False)
    raw = mesh.metadata["_ply_raw"]
    digits = {"rtol": 0, "atol": 0} if double else {"rtol": 1e-6, "atol": 1e-6}
    np.testing.assert_allclose(mesh.vertices, skin.surface.points, **digits)
    np.testing.assert_allclose(raw["vertex"]["data"]["deviation"], skin.vertex_deviation, **digits)
    np.testing.assert_array_equal(mesh.faces, skin.surface.triangles)
    np.testing.assert_array_equal(raw["face"]["data"]["face_id"].ravel(), skin.surface.face_ids)
    feature_of_face = {k: f.id for f in skin.nominal.features for k in f.face_indices}
    expected = [feature_of_face[k] for k in skin.surface.face_ids]
    np.testing.assert_array_equal(raw["face"]["data"]["feature_id"].ravel(), expected)


def test_ply_is_the_same_solid_for_trimesh(tmp_path, skin):
    assert_same_solid(trimesh.load_mesh(export.write(tmp_path / "a.ply", skin)), skin.surface)


def test_obj_has_one_group_per_face_for_trimesh(tmp_path, skin):
    path = export.write(tmp_path / "a.obj", skin)
    text = path.read_text()
    groups = [line[2:] for line in text.splitlines() if line.startswith("g ")]
    assert groups == [f"face_{i}" for i in range(len(skin.nominal.faces))]
    assert_same_solid(trimesh.load_mesh(path), skin.surface, rtol=1e-10)
    # Count the triangles of each group by hand.
    counts = [block.count("\nf ") for block in text.split("\ng ")[1:]]
    assert counts == np.bincount(skin.surface.face_ids).tolist()


def test_group_names_are_distinct_and_plain():
    names = group_names(["a b", "a b", "", "a_b_0", "Ø"], range(5))
    assert len(set(names)) == 5
    assert all(name.isascii() and " " not in name and name for name in names)


def test_3mf_follows_the_core_specification(tmp_path, skin):
    path = export.write(tmp_path / "a.3mf", skin)
    with zipfile.ZipFile(path) as package:
        assert package.testzip() is None
        assert package.namelist() == ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]
        types, relations, model = (ElementTree.fromstring(package.read(n)) for n in package.namelist())
    extensions = {child.get("Extension"): child.get("ContentType") for child in types}
    assert extensions["model"] == "application/vnd.ms-package.3dmanufacturing-3dmodel+xml"
    assert extensions["rels"] == "application/vnd.openxmlformats-package.relationships+xml"
    assert [r.get("Target") for r in relations] == ["/3D/3dmodel.model"]
    assert [r.get("Type") for r in relations] == [
        "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
    ]
    ns = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    assert model.tag == ns + "model"
    assert model.get("unit") == "millimeter"
    body = model.find(f"{ns}resources/{ns}object")
    assert (body.get("type"), body.get("id")) == ("model", "1")
    assert [item.get("objectid") for item in model.iterfind(f"{ns}build/{ns}item")] == ["1"]
    points = np.array([[float(v.get(k)) for k in "xyz"] for v in body.iter(ns + "vertex")])
    triangles = np.array([[int(t.get(k)) for k in ("v1", "v2", "v3")] for t in body.iter(ns + "triangle")])
    assert_same_solid(trimesh.Trimesh(points, triangles, process=False), skin.surface, rtol=1e-8)


def test_3mf_reads_back_in_trimesh(tmp_path, skin):
    pytest.importorskip("lxml", reason="trimesh reads 3MF with lxml and networkx")
    pytest.importorskip("networkx", reason="trimesh reads 3MF with lxml and networkx")
    mesh = trimesh.load(export.write(tmp_path / "a.3mf", skin), force="mesh")
    assert_same_solid(mesh, skin.surface, rtol=1e-8)


def test_3mf_of_an_open_shell_is_a_surface_object(tmp_path, array_box):
    keep = array_box.surface.face_ids != 5
    shell = DiscreteShape(
        array_box.surface.points, array_box.surface.triangles[keep], array_box.surface.face_ids[keep]
    )
    with zipfile.ZipFile(export.write(tmp_path / "a.3mf", shell)) as package:
        assert b'type="surface"' in package.read("3D/3dmodel.model")


@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_gltf_is_the_solid_in_metres_with_y_up(tmp_path, skin, suffix):
    scene = trimesh.load(export.write(tmp_path / f"a.{suffix}", skin))
    (mesh,) = scene.geometry.values()
    np.testing.assert_allclose(mesh.vertex_attributes["_DEVIATION"].ravel(), skin.deviation, atol=1e-7)
    np.testing.assert_array_equal(mesh.vertex_attributes["_FEATURE_ID"].ravel(), skin.nominal.feature_ids())
    np.testing.assert_allclose(np.linalg.norm(mesh.vertex_normals, axis=1), 1, atol=1e-5)
    placed = merged(trimesh.util.concatenate(scene.dump()))
    assert_same_solid(placed, skin.surface, rtol=1e-5, scale=1e-3)
    height = np.ptp(skin.surface.points[:, 2])
    np.testing.assert_allclose(np.ptp(placed.vertices[:, 1]), height * 1e-3, rtol=1e-5)


def test_glb_obeys_the_layout_of_the_specification(tmp_path, skin):
    raw = export.write(tmp_path / "a.glb", skin).read_bytes()
    _, version, total = np.frombuffer(raw[:12], "<u4")
    assert (raw[:4], version, total) == (b"glTF", 2, len(raw))
    length = int(np.frombuffer(raw[12:16], "<u4")[0])
    assert length % 4 == 0
    document = json.loads(raw[20 : 20 + length])
    data = raw[28 + length :]
    assert document["buffers"][0]["byteLength"] == len(data)
    primitive = document["meshes"][0]["primitives"][0]
    for name, index in primitive["attributes"].items():
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        values = np.frombuffer(data[view["byteOffset"] :][: view["byteLength"]], "<f4")
        values = values.reshape(accessor["count"], -1)
        np.testing.assert_array_equal(values.min(axis=0), np.float32(accessor["min"]), err_msg=name)
        np.testing.assert_array_equal(values.max(axis=0), np.float32(accessor["max"]), err_msg=name)


def test_vtu_keeps_every_field_exactly_for_meshio(tmp_path, skin):
    mesh = meshio.read(export.write(tmp_path / "a.vtu", skin))
    np.testing.assert_array_equal(mesh.points, skin.surface.points)
    np.testing.assert_array_equal(mesh.cells_dict["triangle"], skin.surface.triangles)
    np.testing.assert_array_equal(mesh.point_data["deviation"], skin.vertex_deviation)
    np.testing.assert_array_equal(mesh.cell_data["face_id"][0], skin.surface.face_ids)
    np.testing.assert_allclose(np.linalg.norm(mesh.point_data["normals"], axis=1), 1, atol=1e-12)


def test_vtu_and_ply_read_back_in_vtk(tmp_path, skin):
    pyvista = pytest.importorskip("pyvista", reason="reads VTU and PLY through VTK")
    grid = pyvista.read(export.write(tmp_path / "a.vtu", skin))
    assert (grid.n_points, grid.n_cells) == (skin.surface.n_points, skin.surface.n_triangles)
    np.testing.assert_array_equal(grid.point_data["deviation"], skin.vertex_deviation)
    np.testing.assert_array_equal(grid.cell_data["face_id"], skin.surface.face_ids)
    np.testing.assert_allclose(grid.extract_surface(algorithm=None).volume, skin.surface.volume, rtol=1e-9)
    poly = pyvista.read(export.write(tmp_path / "a.ply", skin))
    assert (poly.n_points, poly.n_cells) == (skin.surface.n_points, skin.surface.n_triangles)
    np.testing.assert_allclose(poly.volume, skin.surface.volume, rtol=1e-6)


def test_npz_holds_all_arrays_exactly_without_pickle(tmp_path, skin):
    with np.load(export.write(tmp_path / "a.npz", skin), allow_pickle=False) as archive:
        np.testing.assert_array_equal(archive["points"], skin.surface.points)
        np.testing.assert_array_equal(archive["deviation"], skin.deviation)
        np.testing.assert_array_equal(archive["vertex_deviation"], skin.vertex_deviation)
        np.testing.assert_array_equal(archive["nominal_points"], skin.nominal.surface.points)
        np.testing.assert_array_equal(archive["sample_normals"], skin.nominal.samples.normals)
        np.testing.assert_array_equal(archive["sample_feature_ids"], skin.nominal.feature_ids())
        provenance = json.loads(str(archive["provenance"]))
    assert provenance["unit"] == "mm"
    assert provenance["source"]["part"] == skin.nominal.source.part


@pytest.mark.parametrize("format", export.FORMATS)
def test_every_format_writes_nominal_and_bare_shapes_reproducibly(tmp_path, part, format):
    for i, shape in enumerate((part, part.surface)):
        first = export.write(tmp_path / f"a{i}.{format}", shape).read_bytes()
        again = export.write(tmp_path / f"b{i}", shape, format=format).read_bytes()
        assert first == again


@pytest.mark.parametrize("convert", ["to_trimesh", "to_meshio"])
def test_conversions_carry_fields_and_own_their_arrays(skin, convert):
    mesh = getattr(export, convert)(skin)
    points = np.asarray(mesh.points if convert == "to_meshio" else mesh.vertices)
    fields = mesh.point_data if convert == "to_meshio" else mesh.vertex_attributes
    faces = mesh.cell_data["face_id"][0] if convert == "to_meshio" else mesh.face_attributes["face_id"]
    np.testing.assert_array_equal(points, skin.surface.points)
    np.testing.assert_array_equal(fields["deviation"], skin.vertex_deviation)
    np.testing.assert_array_equal(faces, skin.surface.face_ids)
    assert not np.shares_memory(points, skin.surface.points)


def test_32_bit_formats_warn_where_they_lose_the_deviation(tmp_path, array_box, plain_skin):
    far = DiscreteShape(
        array_box.surface.points + 2e5, array_box.surface.triangles, array_box.surface.face_ids
    )

    class FarSkin:
        nominal = array_box
        surface = far
        deviation = np.full(array_box.n_samples, 0.0)
        vertex_deviation = np.linspace(0, 0.01, far.n_points)

    with pytest.warns(CadskinWarning, match="32-bit"):
        export.write(tmp_path / "a.stl", FarSkin())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        export.write(tmp_path / "a.ply", FarSkin(), double=True)


def test_32_bit_formats_warn_where_corners_fall_together(tmp_path):
    tiny = DiscreteShape([[1e4, 0, 0], [1e4 + 1e-5, 0, 0], [1e4, 1, 0]], [[0, 1, 2]], [0])
    with pytest.warns(CadskinWarning, match="fall together"):
        export.write(tmp_path / "a.stl", tiny)


def test_wrong_requests_are_refused_before_a_file_appears(tmp_path, array_box):
    with pytest.raises(ExportError, match=r"suffix '\.xyz'.*known are stl, ply"):
        export.write(tmp_path / "a.xyz", array_box)
    with pytest.raises(ExportError, match="without a suffix"):
        export.write(tmp_path / "a", array_box)
    with pytest.raises(ExportError, match="ascii=True is for STL"):
        export.write(tmp_path / "a.ply", array_box, ascii=True)
    with pytest.raises(ExportError, match="double=True is for PLY"):
        export.write(tmp_path / "a.stl", array_box, double=True)
    with pytest.raises(GeometryError, match="has no mesh"):
        export.write(tmp_path / "a.stl", object())
    with pytest.raises(GeometryError, match="no triangles"):
        export.write(tmp_path / "a.stl", DiscreteShape(np.zeros((0, 3)), np.zeros((0, 3), int), []))
    assert list(tmp_path.iterdir()) == []


def test_xml_survives_hostile_part_names(tmp_path, array_box):
    named = array_box.with_source(part='a<b>&"c"\x07 --> Ø')
    for suffix in ("3mf", "vtu"):
        raw = export.write(tmp_path / f"a.{suffix}", named).read_bytes()
        if suffix == "3mf":
            raw = zipfile.ZipFile(io.BytesIO(raw)).read("3D/3dmodel.model")
        ElementTree.fromstring(raw)
