"""Scans: meshes and clouds without labels, files of single precision, and what reaches over a rim."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from cadskin.errors import CadskinWarning, GeometryError, ReadError
from cadskin.export import write
from cadskin.shape import DiscreteShape
from cadskin.spec import Specification, cylindricity, flatness, parallelism, roundness
from cadskin.verify import verify
from cadskin.verify.scans import Scan, labelled_points, labelled_scan, read_scan

SPEC = Specification(flatness(5, 0.1), parallelism(5, 0.1, datums="A"), datums={"A": 4})


def bowed(part):
    points = np.array(part.surface.points)
    top = np.isclose(points[:, 2], points[:, 2].max())
    points[top, 2] += 0.05 * (1 - (points[top, 0] / 30.0) ** 2)
    return part.surface.with_points(points)


def values(part, surface, spec=SPEC):
    found = verify(surface, spec, nominal=part)
    assert not found.unresolved, found.unresolved
    return [evaluation.value for _, evaluation in found.evaluations]


def test_a_mesh_without_labels_takes_them_from_the_nearest_faces(array_box):
    made = bowed(array_box)
    scan = labelled_scan(Scan(made.points, made.triangles), array_box)
    assert (scan.face_ids == made.face_ids).mean() > 0.99
    assert values(array_box, scan) == pytest.approx(values(array_box, made), abs=1e-12)


def test_a_cloud_is_evaluated_by_its_points(array_box):
    made = bowed(array_box)
    inner = np.array(made.points[array_box.feature_of(5).vertex_ids])
    below = np.array(made.points[array_box.feature_of(4).vertex_ids])
    inside = np.abs(inner[:, 0]) < 29.0
    cloud = np.concatenate([inner[inside], below])
    scan = labelled_scan(Scan(cloud), array_box)
    assert set(np.unique(scan.face_ids)) >= {4, 5}
    known = labelled_points(cloud, np.repeat([5, 4], [inside.sum(), len(below)]))
    found = values(array_box, known)
    assert found[0] == pytest.approx(np.ptp(inner[inside, 2]), abs=1e-9)


def test_triangles_over_a_rim_belong_to_no_face(array_box):
    """A scanner rounds the edges: a triangle from the top to the wall must not make the top unflat."""
    made = array_box.surface
    top = np.flatnonzero(np.isclose(made.points[:, 2], 10.0) & (np.abs(made.points[:, 0] - 20) < 8))
    corner = np.array([[30.0, 0.0, 10.0], [30.0, 5.0, 5.0], [27.0, 0.0, 10.0]])
    points = np.concatenate([made.points, corner])
    over = len(made.points) + np.array([[0, 1, 2]])
    scan = labelled_scan(Scan(points, np.concatenate([made.triangles, over])), array_box)
    assert len(top)
    assert scan.face_ids[-1] == -1
    assert values(array_box, scan)[0] == pytest.approx(0.0, abs=1e-12)


def test_roundness_of_a_cloud_in_sections(array_shaft):
    turn = 2 * np.pi * np.arange(48) / 48
    radius = array_shaft.feature_of(0).radius
    rings = [
        np.column_stack([(radius + 0.01 * np.cos(3 * turn)) * np.cos(turn),
                         (radius + 0.01 * np.cos(3 * turn)) * np.sin(turn), np.full(48, z)])
        for z in (2.0, 5.0, 8.0)
    ]  # fmt: skip
    cloud = labelled_points(np.concatenate(rings), np.zeros(144, dtype=int))
    found = values(array_shaft, cloud, Specification(roundness(0, 0.1), cylindricity(0, 0.1)))
    assert found == pytest.approx([0.02, 0.02], abs=1e-9)


def test_files_come_back(array_box, tmp_path):
    made = bowed(array_box)
    full = read_scan(write(tmp_path / "made.npz", made))
    assert (full.face_ids == made.face_ids).all()
    with pytest.warns(CadskinWarning, match="single precision"):
        stl = read_scan(write(tmp_path / "made.stl", made))
    assert stl.face_ids is None
    assert len(stl.points) == made.n_points
    surface = labelled_scan(stl, array_box)
    assert values(array_box, surface) == pytest.approx(values(array_box, made), abs=1e-5)
    np.savetxt(tmp_path / "cloud.csv", made.points, delimiter=",", header="x,y,z", comments="")
    assert read_scan(tmp_path / "cloud.csv").triangles is None
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_allclose(read_scan(tmp_path / "cloud.csv").points, made.points, atol=1e-12)


def test_a_plane_of_250_mm_in_single_precision_is_unflat(tmp_path):
    """What the warning says: about 7e-6 mm."""
    rng = np.random.default_rng(0)
    normal = np.array([0.3, 0.2, 0.933])
    flat = rng.uniform(-125, 125, (2000, 2)) @ np.array([[0.952, 0, -0.306], [0, 0.978, -0.2096]])
    flat -= np.outer(flat @ normal, normal) / (normal @ normal)
    from cadskin.verify import flatness as of_points

    assert of_points(flat).value < 1e-12
    assert 1e-6 < of_points(flat.astype(np.float32).astype(float)).value < 3e-5


@pytest.mark.parametrize(
    ("name", "data", "text"),
    [
        ("a.stl", b"solid nothing", "no STL"),
        ("a.xyz", b"1 2\n3 4\n", "x, y, z"),
        ("a.csv", b"x,y,z\n1,2,nan\n", "NaN"),
        ("a.obj", b"v 0 0 0", "no kind of mesh"),
        ("missing.ply", None, "cannot be read"),
    ],
)
def test_bad_files_are_named(tmp_path, name, data, text):
    path = tmp_path / name
    if data is not None:
        path.write_bytes(data)
    with pytest.raises(ReadError, match=text) as caught:
        read_scan(path)
    assert name in str(caught.value)


def test_labels_must_fit_the_points():
    with pytest.raises(GeometryError, match="as many labels"):
        labelled_points(np.zeros((3, 3)), np.zeros(2, dtype=int))
    with pytest.raises(GeometryError, match="NaN"):
        labelled_points(np.full((3, 3), np.nan), np.zeros(3, dtype=int))
    assert isinstance(labelled_points(np.zeros((3, 3)), np.zeros(3, dtype=int)), DiscreteShape)
