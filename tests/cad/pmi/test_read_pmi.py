"""`read_pmi`: whose faces are numbered, parts by name, and what happens where the geometry does not read."""

import pytest

import cadskin as cs
from cadskin.cad import contained
from cadskin.errors import CadskinWarning, GeometryError, KernelError, ReadError


@pytest.fixture(scope="module")
def plate_path(tmp_path_factory):
    cq = pytest.importorskip("cadquery")
    plate = cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12)
    spec = cs.Specification(
        cs.flatness(">Z", 0.02),
        cs.cylindricity("%CYLINDER", 0.03),
        cs.parallelism(">Z", 0.1, datums="A"),
        datums={"A": "<Z"},
    )
    return cs.write_step(tmp_path_factory.mktemp("parts") / "plate.step", plate, spec)


class Part:
    def __init__(self, name, faces):
        self.name, self.faces = name, faces


class Numbered:
    def __init__(self, step_id):
        self.step_id = step_id


def described_as(monkeypatch, parts):
    class Description:
        pass

    found = Description()
    found.parts = parts
    monkeypatch.setattr(contained, "contained_describe", lambda path, time_limit: found)
    monkeypatch.setattr("cadskin.cad.pmi.pmi.fingerprinted", lambda spec, faces, part: spec)


def test_on_a_nominal_model(plate_path):
    part = cs.nominal(plate_path, edge_length=5.0)
    spec = cs.read_pmi(plate_path, part)
    assert spec.tolerances[0].feature.faces == part.feature(">Z").face_indices
    assert spec.tolerances[1].feature.faces == part.feature(kind="cylinder").face_indices
    assert spec.datum("A").feature.faces == part.feature("<Z").face_indices
    assert spec.bind(part) == spec


def test_on_a_cad_part(plate_path):
    (part,) = cs.read_parts(plate_path)
    spec = cs.read_pmi(plate_path, part)
    assert [t.feature.faces for t in spec] == [t.feature.faces for t in cs.read_pmi(plate_path)]


def test_parts_by_name(monkeypatch, plate_path):
    numbers = sorted({n for t in cs.read_pmi(plate_path) for n in t.feature.step_faces})
    flat, hole = cs.read_pmi(plate_path).tolerances[:2]
    box = Part("box", [Numbered(n) for n in numbers if n not in hole.feature.step_faces])
    pin = Part("pin", [Numbered(n) for n in hole.feature.step_faces])
    described_as(monkeypatch, [box, pin])
    both = cs.read_pmi(plate_path)
    assert [t.feature.part for t in both] == ["box", "pin", "box"]
    only = cs.read_pmi(plate_path, "pin")
    assert [t.type for t in only] == ["cylindricity"]
    assert only.notes[-1] == "2 tolerances belong to other parts of the file"
    assert flat.feature.step_faces != hole.feature.step_faces
    with pytest.raises(GeometryError, match="no part 'lid'; it has box, pin"):
        cs.read_pmi(plate_path, "lid")


def test_the_text_is_read_where_the_kernel_fails(monkeypatch, plate_path):
    def crash(path, time_limit):
        raise KernelError("plate.step: the geometry kernel crashed")

    monkeypatch.setattr(contained, "contained_describe", crash)
    with pytest.warns(CadskinWarning, match="only STEP numbers"):
        spec = cs.read_pmi(plate_path)
    assert [t.value for t in spec] == [0.02, 0.03, 0.1]
    assert all(t.feature.step_faces and not t.feature.faces for t in spec)
    assert "the geometry kernel crashed" in spec.unresolved[-1].reason


def test_a_file_without_pmi_needs_no_kernel(monkeypatch, tmp_path):
    cq = pytest.importorskip("cadquery")
    path = cs.write_step(tmp_path / "bare.step", cq.Workplane().box(1, 2, 3))
    monkeypatch.setattr(contained, "contained_describe", None)
    assert "no PMI at all" in cs.read_pmi(path).unresolved[0].reason


def test_a_tessellated_file_is_refused(tmp_path):
    path = tmp_path / "tg.stp"
    path.write_text(
        "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('AP242'));\nENDSEC;\nDATA;\n#1=TESSELLATED_SOLID('',(#2),$);\n"
        "#2=COMPLEX_TRIANGULATED_FACE('',#3,3,(),$,(),(),());\nENDSEC;\nEND-ISO-10303-21;\n"
    )
    with pytest.raises(ReadError, match=r"tg\.stp is tessellated"):
        cs.read_pmi(path)


@pytest.mark.corpus
def test_faces_are_those_of_cadquery(corpus_file):
    """The face indices of the JSON are those of cadquery's ``.Faces()``: same area, same place."""
    cq = pytest.importorskip("cadquery")
    path = corpus_file("nist_ctc_01_asme1_ap242-e1.stp")
    faces = cq.importers.importStep(str(path)).val().Faces()
    spec = cs.read_pmi(path)
    assert len(spec) == 6
    for record in spec.fingerprints:
        face = faces[record.face]
        assert face.Area() == pytest.approx(record.fingerprint.area, rel=1e-6)
        assert face.Center().toTuple() == pytest.approx(record.fingerprint.centre, abs=1e-4)
