"""From a CAD part to a nominal model: the whole way, checked against the exact part."""

import cadquery as cq
import numpy as np
import pytest
import trimesh

import cadskin
from cadskin.cad import nominal, nominals, read_parts, to_ocp
from cadskin.cad._occ import faces_of
from cadskin.cad.faces import surface_area, volume
from cadskin.errors import GeometryError, MeshingError, SelectionError


@pytest.fixture(scope="module")
def model(plate):
    return nominal(plate, edge_length=3.0)


def test_the_front_doors_are_open(plate):
    assert cadskin.nominal is nominal
    assert cadskin.nominals is nominals
    assert cadskin.read_parts is read_parts


def test_the_mesh_is_watertight_and_close_to_the_part(model, plate):
    mesh = trimesh.Trimesh(model.surface.points, model.surface.triangles, process=False)
    assert model.closed
    assert mesh.is_watertight
    assert mesh.is_winding_consistent
    assert mesh.volume == pytest.approx(plate.val().Volume(), rel=0.01)
    assert model.source.kind == "cadquery"
    assert model.source.edge_length == 3.0


def test_every_triangle_lies_on_its_face(model):
    areas = np.bincount(model.surface.face_ids, weights=model.surface.triangle_areas)
    for face in model.faces:
        assert areas[face.index] == pytest.approx(face.area, rel=0.02)
        points = model.surface.points[model.surface.triangles[model.surface.face_ids == face.index]]
        np.testing.assert_allclose(face.ideal.distance(points.reshape(-1, 3)), 0.0, atol=1e-9)


def test_samples_hold_each_feature_and_vertex_once(model):
    pairs = np.stack([model.feature_ids(), model.samples.vertex_ids], axis=1)
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    for feature in model.features:
        used = np.unique(model.surface.triangles[feature.triangle_ids])
        np.testing.assert_array_equal(np.sort(feature.vertex_ids), used)
        assert set(feature.sample_faces.tolist()) <= set(feature.face_indices)
    assert model.corner_samples.min() >= 0


def test_exact_normals_and_curvatures_of_a_bore(model):
    bore = model.feature("%CYLINDER")
    radial = bore.points * [1, 1, 0]
    np.testing.assert_allclose(bore.normals, -radial / 6.0, atol=1e-9)
    np.testing.assert_allclose(bore.curvatures, np.tile([1 / 6, 0.0], (bore.n_points, 1)), atol=1e-9)
    np.testing.assert_allclose(np.abs(bore.directions[:, 1] @ [0, 0, 1]), 1.0, atol=1e-9)


def test_half_cylinders_share_one_row_per_vertex(half_cylinder_plate):
    model = nominal(half_cylinder_plate, edge_length=4.0)
    hole = model.feature("%CYLINDER")
    assert len(hole.faces) == 2
    assert hole.internal
    assert len(np.unique(hole.vertex_ids)) == hole.n_points
    assert hole.area == pytest.approx(2 * np.pi * 6 * 10, rel=1e-9)


def test_number_of_points_and_default_length(plate):
    assert nominal(plate, n_points=600).surface.n_points == pytest.approx(600, rel=0.2)
    diagonal = float(np.linalg.norm([60, 40, 8]))
    assert nominal(plate).source.edge_length == pytest.approx(diagonal / 100, rel=1e-6)


def test_edge_lengths_by_selector(plate):
    coarse = nominal(plate, edge_length=4.0)
    fine = nominal(plate, edge_length=4.0, face_edge_lengths={">Z": 1.5, "%CYLINDER": 1.5})
    counts = [len(m.feature(">Z").triangle_ids) for m in (coarse, fine)]
    assert counts[1] > 3 * counts[0]
    assert len(fine.feature("<Z").triangle_ids) < 2 * len(coarse.feature("<Z").triangle_ids)
    with pytest.raises(SelectionError):
        nominal(plate, edge_length=4.0, face_edge_lengths={"%TORUS": 1.0})
    with pytest.raises(GeometryError, match="two edge lengths"):
        nominal(plate, edge_length=4.0, face_edge_lengths={">Z": 1.0, "|Z": 2.0})


def test_errors_of_the_mesher_name_the_part(plate, tmp_path):
    path = tmp_path / "plate.step"
    plate.val().exportStep(str(path))
    with pytest.raises(MeshingError, match=r"^plate\.step: .*triangles"):
        nominal(path, edge_length=0.5, max_triangles=1000)


def test_one_part_out_of_several():
    two = cq.Assembly(name="pair")
    two.add(cq.Workplane().box(4, 4, 4), name="cube")
    two.add(cq.Workplane().sphere(2), name="ball", loc=cq.Location((10, 0, 0)))
    with pytest.raises(GeometryError, match=r"2 solids \(cube, ball\).*part=.*nominals"):
        nominal(two, edge_length=1.0)
    assert nominal(two, edge_length=1.0, part="ball").features[0].kind == "sphere"
    with pytest.raises(GeometryError, match="has no part 'cone'; it has cube, ball"):
        nominal(two, edge_length=1.0, part="cone")
    seen = []
    models = nominals(two, edge_length=1.0, progress=lambda done, total: seen.append((done, total)))
    assert [m.source.part for m in models] == ["cube", "ball"]
    assert seen == [(0, 2), (1, 2), (2, 2)]


def test_an_open_shell_when_asked(plate):
    sheet = plate.faces(">Z")
    with pytest.raises(GeometryError, match="allow_open"):
        nominal(sheet, edge_length=3.0)
    model = nominal(sheet, edge_length=3.0, allow_open=True)
    assert not model.closed
    assert model.surface.area == pytest.approx(60 * 40 - np.pi * 36, rel=0.01)


def test_back_into_the_kernel(model):
    shape = to_ocp(model.surface)
    assert len(faces_of(shape)) == len(model.faces)
    assert surface_area(shape) == pytest.approx(model.surface.area, rel=1e-9)
    assert volume(shape) == pytest.approx(model.surface.volume, rel=1e-9)
    for face, record in zip(cq.Shape.cast(shape).Faces(), model.faces, strict=True):
        assert face.Area() == pytest.approx(record.area, rel=0.02)


def test_a_step_file_and_the_object_give_the_same_model(plate, tmp_path):
    path = tmp_path / "plate.step"
    plate.val().exportStep(str(path))
    from_file, from_object = nominal(path, edge_length=4.0), nominal(plate, edge_length=4.0)
    assert from_file.surface.n_triangles == pytest.approx(from_object.surface.n_triangles, rel=0.03)
    assert from_file.source.part == "plate"
    assert from_file.source.path == "plate.step"
    assert from_file.feature(f"#{from_file.faces[3].step_id}").face_indices == (3,)
