"""Everything of the data model that AP242 can hold reads back from what was written."""

from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from spec.strategies import specifications

import cadskin as cs
from cadskin.cad.pmi.compose import Composer
from cadskin.cad.pmi.compose_dimensions import compose_dimensions
from cadskin.cad.pmi.compose_tolerances import compose_datums, compose_tolerances
from cadskin.cad.pmi.part21 import Part21File
from cadskin.cad.pmi.pmi import _NumberedPart
from cadskin.cad.pmi.read import specification_of
from cadskin.cad.pmi.write import _joined, write_step
from cadskin.errors import CadskinWarning, ExportError, SpecificationError
from cadskin.spec import FeatureSelection, Specification

KINDS = ("plane",) * 6 + ("cylinder",) * 2 + ("sphere",)


@pytest.fixture(scope="module")
def plate_file(tmp_path_factory):
    """A plate with two holes and a spherical dimple: text, and STEP numbers in the order of KINDS."""
    cq = pytest.importorskip("cadquery")
    plate = cq.Workplane().box(80, 50, 12).faces(">Z").workplane().pushPoints([(-25, 0), (25, 0)]).hole(8)
    plate = plate.cut(cq.Workplane("XY", origin=(0, 0, 6)).sphere(5))
    path = write_step(tmp_path_factory.mktemp("step") / "plate.step", plate)
    from cadskin.cad.describing import describe_part
    from cadskin.cad.documents import read_parts

    faces = describe_part(read_parts(path)[0]).faces
    ordered = [
        face.step_id for kind in ("plane", "cylinder", "sphere") for face in faces if face.kind == kind
    ]
    assert sorted(face.kind for face in faces) == sorted(KINDS)
    return path.read_text(encoding="latin-1"), tuple(sorted(ordered[:6])) + tuple(sorted(ordered[6:8])) + (
        ordered[8],
    )


def written_and_read(spec, plate_file):
    text, numbers = plate_file
    composer = Composer(Part21File(text.encode("latin-1"), "plate.step"), numbers)
    letters = compose_datums(composer, spec.datums)
    compose_tolerances(composer, spec.tolerances, letters)
    compose_dimensions(composer, spec.dimensions)
    joined = _joined(text, composer.out.text())
    return specification_of(
        Part21File(joined.encode("latin-1"), "plate.step"), [_NumberedPart("plate", numbers)]
    ), composer


def plain(spec):
    """Forget what the file numbers: ids by position, STEP numbers, millimetres as raw unit."""
    place = {item.id: str(i) for i, item in enumerate(spec.tolerances)}

    def feature(one):
        groups = tuple(tuple(sorted(group)) for group in one.groups)
        return replace(one, step_faces=(), faces=tuple(sorted(one.faces)), groups=groups)

    return (
        [
            replace(
                item,
                id=place[item.id],
                parent=place.get(item.parent),
                feature=feature(item.feature),
                raw_value=item.raw_value if item.raw_unit == "inch" else None,
                raw_unit=item.raw_unit if item.raw_unit == "inch" else None,
            )
            for item in spec.tolerances
        ],
        [
            replace(
                datum,
                feature=feature(datum.feature),
                targets=tuple(replace(t, feature=feature(t.feature)) for t in datum.targets),
            )
            for datum in spec.datums
        ],
        [
            replace(item, id="", raw_unit=None, feature=feature(item.feature), second=feature(item.second))
            for item in spec.dimensions
        ],
    )


@pytest.mark.filterwarnings("ignore:.*mixes length units")
@settings(max_examples=80, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(spec=specifications(KINDS))
def test_the_data_model_round_trips_through_ap242(plate_file, spec):
    again, composer = written_and_read(spec, plate_file)
    assert composer.lost == []
    assert plain(again) == plain(spec)


@pytest.fixture(scope="module")
def drilled_plate():
    cq = pytest.importorskip("cadquery")
    return cq.Workplane().box(80, 50, 12).faces(">Z").workplane().pushPoints([(-25, 0), (25, 0)]).hole(8)


@pytest.fixture(scope="module")
def authored():
    return cs.Specification(
        cs.flatness("<Z", 0.05),
        cs.perpendicularity("<X", 0.1, datums="A"),
        cs.position("%CYLINDER", 0.2, datums="A|B|C(M)", diameter=True, material="M", id="upper"),
        cs.position("%CYLINDER", 0.05, datums="A", diameter=True, parent="upper"),
        cs.surface_profile(">Z", 0.3, datums="A|B-C", outside=0.1),
        datums={"A": "<Z", "B": "<X", "C": "<Y"},
        dimensions=[cs.size("%CYLINDER", 8, (-0.028, -0.013)), cs.distance("<X", ">X", 80, (-0.1, 0.1))],
    )


def test_geometry_is_unchanged(tmp_path, drilled_plate, authored):
    import cadquery as cq

    path = write_step(tmp_path / "plate.step", drilled_plate, authored)
    again = cq.importers.importStep(str(path)).val()
    assert again.isValid()
    assert again.Volume() == pytest.approx(drilled_plate.val().Volume(), rel=1e-12)
    for one, other in zip(drilled_plate.val().Faces(), again.Faces(), strict=True):
        assert one.Area() == pytest.approx(other.Area(), rel=1e-12)
        assert one.Center().toTuple() == pytest.approx(other.Center().toTuple(), abs=1e-9)


def test_faces_are_the_selected_ones(tmp_path, drilled_plate, authored):
    path = write_step(tmp_path / "plate.step", drilled_plate, authored)
    faces = drilled_plate.val().Faces()
    found = cs.read_pmi(path)
    heights = {faces[i].Center().z for i in found.tolerances[0].feature.faces}
    assert heights == {-6.0}
    holes = found.tolerances[2].feature
    assert len(holes.groups) == 2
    assert {faces[i].geomType() for i in holes.faces} == {"CYLINDER"}
    assert found.tolerances[3].parent == found.tolerances[2].id


def test_occt_agrees_where_it_reads_rightly(tmp_path, drilled_plate, authored):
    """Type, value, datum letters in order and number of faces through OCCT's own XCAF reader."""
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDF import TDF_LabelSequence
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFApp import XCAFApp_Application
    from OCP.XCAFDoc import XCAFDoc_Datum, XCAFDoc_DimTolTool, XCAFDoc_DocumentTool, XCAFDoc_GeomTolerance

    path = write_step(tmp_path / "plate.step", drilled_plate, authored)
    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    reader = STEPCAFControl_Reader()
    reader.SetGDTMode(True)
    reader.ReadFile(str(path))
    assert reader.Transfer(document)
    tool = XCAFDoc_DocumentTool.DimTolTool_s(document.Main())
    labels = TDF_LabelSequence()
    tool.GetGeomToleranceLabels(labels)
    seen = []
    for i in range(1, labels.Length() + 1):
        item = XCAFDoc_GeomTolerance.Set_s(labels.Value(i)).GetObject()
        held = TDF_LabelSequence()
        XCAFDoc_DimTolTool.GetDatumWithObjectOfTolerLabels_s(labels.Value(i), held)
        pairs = []
        for k in range(1, held.Length() + 1):
            datum = XCAFDoc_Datum.Set_s(held.Value(k)).GetObject()
            pairs.append((datum.GetPosition(), datum.GetName().ToCString()))
        name = item.GetType().name.rpartition("_")[2].lower()
        first, second = TDF_LabelSequence(), TDF_LabelSequence()
        XCAFDoc_DimTolTool.GetRefShapeLabel_s(labels.Value(i), first, second)
        seen.append((name, round(item.GetValue(), 9), sorted(pairs), first.Length()))
    ours = [
        ("flatness", 0.05, [], 1),
        ("perpendicularity", 0.1, [(1, "A")], 1),
        ("position", 0.2, [(1, "A"), (2, "B"), (3, "C")], 2),
        ("position", 0.05, [(1, "A")], 2),
        ("profileofsurface", 0.3, [(1, "A"), (2, "B"), (2, "C")], 1),
    ]
    assert sorted(seen) == sorted(ours)


def test_what_ap242_has_no_place_for_is_said(tmp_path, drilled_plate):
    spec = cs.Specification(cs.flatness("<Z", 0.05, model={"field": {"length": 12}}, standard="ISO"))
    with pytest.warns(CadskinWarning, match=r"does not hold tolerance flatness-1 \(flatness\): model"):
        write_step(tmp_path / "plate.step", drilled_plate, spec)


def test_a_selector_without_a_face_is_refused(tmp_path, drilled_plate):
    with pytest.raises(SpecificationError, match="flatness-1"):
        write_step(tmp_path / "plate.step", drilled_plate, cs.Specification(cs.flatness("%SPHERE", 0.05)))
    assert not (tmp_path / "plate.step").exists()


def test_a_face_that_does_not_exist_is_refused(tmp_path, drilled_plate):
    from cadskin.spec import FeatureSelection

    spec = Specification(cs.flatness(FeatureSelection(faces=(99,)), 0.05))
    with pytest.raises(SpecificationError, match="face 99; the part has faces 0 to 7"):
        write_step(tmp_path / "plate.step", drilled_plate, spec)


def test_a_missing_folder_is_an_export_error(tmp_path, drilled_plate):
    with pytest.raises(ExportError):
        write_step(tmp_path / "no" / "plate.step", drilled_plate)


def test_build123d_parts_are_written_too(tmp_path):
    bd = pytest.importorskip("build123d")
    box = bd.Box(10, 20, 30)
    path = write_step(tmp_path / "box.step", box, cs.Specification(cs.flatness(">Z", 0.01)))
    assert [(t.type, t.value) for t in cs.read_pmi(path)] == [("flatness", 0.01)]


def test_indicators_that_ap242_does_not_hold_are_named(plate_file):
    spec = cs.Specification(
        cs.straightness(FeatureSelection(faces=(0,)), 0.1, intersection_plane="parallel A"),
        datums={"A": FeatureSelection(faces=(1,))},
    )
    back, composer = written_and_read(spec, plate_file)
    assert back.tolerances[0].indicators == ()
    assert composer.lost == ["tolerance straightness-1 (straightness): intersection plane by datum"]
