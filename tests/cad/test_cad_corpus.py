"""Real files: counts known from the files' makers and from an independent reading of their text."""

import re

import numpy as np
import pytest

from cadskin.cad import describe_faces, partition, read_parts
from cadskin.cad.describing import describe_file
from cadskin.cad.discretise import part_faces
from cadskin.cad.faces import bounding_box, surface_area, volume
from cadskin.cad.step_text import read_step_text

pytestmark = pytest.mark.corpus

# file: (unit, parts, faces of all parts, geometric tolerances, datums)
FILES = {
    "as1-oc-214.stp": ("mm", 18, 160, 0, 0),
    "cube-in.step": ("inch", 1, 6, 0, 0),
    "dm1-id-214.stp": ("inch", 7, 48, 0, 0),
    "face_recognition_sample_part.stp": ("mm", 1, 23, 0, 0),
    "io1-cm-214.stp": ("mm", 1, 29, 0, 0),
    "nist_ctc_01_asme1_ap203.stp": ("mm", 1, 139, 0, 0),
    "nist_ctc_01_asme1_ap242-e1.stp": ("mm", 1, 117, 6, 3),
    "nist_ctc_02_asme1_ap242-e2.stp": ("mm", 1, 635, 22, 10),
    "nist_ctc_03_asme1_ap242-e2.stp": ("mm", 1, 120, 13, 6),
    "nist_ctc_05_asme1_ap242-e1.stp": ("inch", 1, 156, 10, 4),
    "nist_ftc_06_asme1_ap242-e2.stp": ("mm", 1, 187, 28, 10),
    "nist_ftc_08_asme1_ap242-e1-2021.stp": ("inch", 1, 247, 33, 11),
    "nist_ftc_11_asme1_ap242-e2.stp": ("mm", 1, 42, 4, 2),
    "nist_stc_06_asme1_ap242-e3.stp": ("mm", 1, 144, 25, 6),
    "nist_stc_07_asme1_ap242-e3.stp": ("inch", 1, 304, 22, 5),
    "s1-tail-turbine-214.stp": ("inch", 1, 20, 0, 0),
    "sg1-c5-214.stp": ("mm", 1, 16, 0, 0),
}


@pytest.mark.parametrize("name", FILES)
def test_parts_faces_units_and_entity_numbers(corpus, name):
    unit, n_parts, n_faces, n_tolerances, n_datums = FILES[name]
    parts = read_parts(corpus / name)
    text = read_step_text(corpus / name)
    assert len(parts) == n_parts
    assert {part.source.units for part in parts} == {unit}
    assert len({part.name for part in parts}) == n_parts
    numbers = {number for part in parts for number in part.face_step_ids}
    assert sum(len(part.face_step_ids) for part in parts) == n_faces
    faces_in_text = {int(n) for n in re.findall(r"#(\d+)\s*=\s*ADVANCED_FACE\b", text.original)}
    assert numbers <= faces_in_text
    assert (text.n_tolerances, text.n_datums) == (n_tolerances, n_datums)
    for part in parts:
        assert part.is_solid
        assert volume(part.shape) > 0


@pytest.mark.parametrize(
    "name", ["nist_ctc_01_asme1_ap242-e1.stp", "nist_ftc_08_asme1_ap242-e1-2021.stp", "io1-cm-214.stp"]
)
def test_face_records_of_real_parts(corpus, name):
    (part,) = read_parts(corpus / name)
    faces = part_faces(part)
    assert sum(face.area for face in faces) == pytest.approx(surface_area(part.shape), rel=1e-9)
    groups = partition(part.shape, faces)
    assert sorted(i for group in groups for i in group) == list(range(len(faces)))
    for face in faces:
        np.testing.assert_allclose(np.linalg.norm(face.normal), 1.0, atol=1e-12)
        assert (face.bounds[0] <= face.centre + 1e-6).all() or face.kind != "plane"


def test_the_cube_in_inches_measures_as_its_text_says(corpus):
    """Vertices of the text, in inch, against the box that was read, in mm."""
    (part,) = read_parts(corpus / "cube-in.step")
    text = (corpus / "cube-in.step").read_text()
    vertices = re.findall(r"VERTEX_POINT\s*\(\s*'[^']*'\s*,\s*#(\d+)", text)
    points = dict(re.findall(r"#(\d+)\s*=\s*CARTESIAN_POINT\s*\(\s*'[^']*'\s*,\s*\(([^)]*)\)", text))
    inches = np.array([[float(x) for x in points[v].split(",")] for v in vertices])
    size = 25.4 * np.ptp(inches, axis=0)
    np.testing.assert_allclose(np.ptp(bounding_box(part.shape), axis=0), size, rtol=1e-6)
    assert volume(part.shape) == pytest.approx(np.prod(size), rel=1e-9)


def test_instances_of_the_as1_assembly(corpus):
    parts = read_parts(corpus / "as1-oc-214.stp")
    kinds = [re.sub(r"-\d+$", "", part.name) for part in parts]
    assert {kind: kinds.count(kind) for kind in set(kinds)} == {
        "nut": 8,
        "bolt": 6,
        "l-bracket": 2,
        "rod": 1,
        "plate": 1,
    }
    assert parts[0].path == ("as1", "rod-assembly_1", "nut_1", "nut")
    places = np.round([bounding_box(part.shape).mean(axis=0) for part in parts], 6)
    assert len(np.unique(places, axis=0)) == 18


def test_the_red_faces_of_io1(corpus):
    (part,) = read_parts(corpus / "io1-cm-214.stp")
    colours = [face.colour for face in part_faces(part)]
    assert colours.count("#ff0000") == 2
    assert len(set(colours)) == 2


def test_surfaces_beside_the_solid_are_noted(corpus):
    (part,) = read_parts(corpus / "nist_stc_07_asme1_ap242-e3.stp")
    assert any("2 faces outside of the solids" in note for note in part.notes)


def test_half_cylinders_of_a_real_part_are_joined(corpus):
    (part,) = read_parts(corpus / "nist_ctc_01_asme1_ap242-e1.stp")
    faces = describe_faces(part.shape)
    groups = partition(part.shape, faces)
    joined = [group for group in groups if len(group) > 1]
    assert joined
    for group in joined:
        kinds = {(faces[i].kind, faces[i].internal, round(faces[i].radius or 0, 6)) for i in group}
        assert len(kinds) == 1


def test_description_of_a_file_with_pmi(corpus):
    described = describe_file(corpus / "nist_ctc_01_asme1_ap242-e1.stp")
    assert described.has_pmi
    assert described.schema.startswith("AP242")
    (part,) = described.parts
    assert part.valid
    assert part.name == "NIST Complex Test Case 1"
    assert all(face.name for face in part.faces)
