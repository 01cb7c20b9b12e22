"""Files written on the spot and read back: units, names, places, colours, surfaces, damage."""

import hashlib
import re

import cadquery as cq
import numpy as np
import pytest
from OCP.BinTools import BinTools
from OCP.BRep import BRep_Builder
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.IGESControl import IGESControl_Writer
from OCP.Interface import Interface_Static
from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
from OCP.TopoDS import TopoDS_Shell, TopoDS_Solid

from cadskin.cad import describe_faces, read_parts
from cadskin.cad._occ import compound_of, faces_of, is_valid
from cadskin.cad.discretise import part_faces
from cadskin.cad.faces import bounding_box, surface_area, volume
from cadskin.cad.solids import repaired
from cadskin.cad.triangulation import to_ocp
from cadskin.errors import Cancelled, GeometryError, ReadError
from cadskin.shape import DiscreteShape

PLATE_VOLUME = 60 * 40 * 8 - np.pi * 36 * 8


def write_step(shape, path, *, unit="MM", **settings):
    """Write a raw shape with OCCT's own writer; the kernel's settings are put back afterwards."""
    writer = STEPControl_Writer()  # before the settings: it registers them
    wanted = {"write.step.unit": unit, **settings}
    before = {key: Interface_Static.CVal_s(key) for key in wanted}
    try:
        for key, value in wanted.items():
            assert Interface_Static.SetCVal_s(key, value)
        writer.Model(True)
        writer.Transfer(shape, STEPControl_StepModelType.STEPControl_AsIs)
        writer.Write(str(path))
    finally:
        for key, value in before.items():
            Interface_Static.SetCVal_s(key, value)
    return path


@pytest.fixture(scope="module")
def step_file(plate, tmp_path_factory):
    return write_step(plate.val().wrapped, tmp_path_factory.mktemp("step") / "plate.step")


@pytest.fixture(scope="module")
def assembly_file(tmp_path_factory):
    bolt = cq.Workplane().circle(3).extrude(20)
    assembly = cq.Assembly(name="frame")
    assembly.add(cq.Workplane().box(50, 50, 5), name="base", color=cq.Color(0.25, 0.5, 0.75))
    for i in range(3):
        assembly.add(bolt, name=f"bolt{i}", loc=cq.Location((20 * i, 0, 10)), color=cq.Color("red"))
    path = tmp_path_factory.mktemp("assembly") / "frame.step"
    assembly.export(str(path))
    return path


def test_a_step_file_comes_back_as_one_solid(step_file, plate):
    (part,) = read_parts(step_file)
    assert part.is_solid
    assert volume(part.shape) == pytest.approx(PLATE_VOLUME, rel=1e-9)
    assert part.source.kind == "step"
    assert part.source.path == "plate.step"
    assert part.source.units == "mm"
    assert part.source.sha256 == hashlib.sha256(step_file.read_bytes()).hexdigest()
    assert part.notes == ()
    areas = [face.Area() for face in plate.val().Faces()]
    np.testing.assert_allclose([f.area for f in describe_faces(part.shape)], areas, rtol=1e-9)


def test_step_numbers_point_at_the_right_advanced_face(step_file):
    """The entity of each planar face, followed through the text, leads to a plane at the face's place."""
    (part,) = read_parts(step_file)
    entities = dict(re.findall(r"#(\d+)\s*=\s*(.*?);", step_file.read_text(), re.S))
    for face in part_faces(part):
        record = entities[str(face.step_id)]
        assert record.startswith("ADVANCED_FACE")
        surface = entities[re.findall(r"#(\d+),\.[TF]\.\s*\)\s*$", record)[0]]
        assert (
            surface.split("(")[0].strip() == {"plane": "PLANE", "cylinder": "CYLINDRICAL_SURFACE"}[face.kind]
        )
        placement = entities[re.findall(r"#(\d+)", surface)[0]]
        point = entities[re.findall(r"#(\d+)", placement)[0]]
        origin = np.array([float(x) for x in re.search(r"\(([^()]*)\)\)", point).group(1).split(",")])
        if face.kind == "plane":
            assert (origin - face.centre) @ face.normal == pytest.approx(0, abs=1e-9)
        else:
            assert float(re.search(r",([\d.E+]+)\)$", surface).group(1)) == pytest.approx(face.radius)


@pytest.mark.parametrize(("unit", "word"), [("INCH", "inch"), ("M", "m"), ("CM", "cm"), ("FT", "ft")])
def test_files_in_other_units_come_out_in_mm(plate, tmp_path, unit, word):
    path = write_step(plate.val().wrapped, tmp_path / "plate.stp", unit=unit)
    (part,) = read_parts(path)
    assert part.source.units == word
    assert volume(part.shape) == pytest.approx(PLATE_VOLUME, rel=1e-6)


def test_every_instance_of_an_assembly_is_a_part_at_its_place(assembly_file):
    parts = read_parts(assembly_file)
    assert len(parts) == 4
    assert len({part.name for part in parts}) == 4
    assert all(part.source.part == part.name for part in parts)
    assert "base" in parts[0].name
    centres = np.array([bounding_box(part.shape).mean(axis=0) for part in parts[1:]])
    np.testing.assert_allclose(centres, [[0, 0, 20], [20, 0, 20], [40, 0, 20]], atol=1e-6)
    assert all(part.path[0] == "frame" for part in parts)


def test_colours_are_the_written_ones(assembly_file):
    base, *bolts = read_parts(assembly_file)
    assert {face.colour for bolt in bolts for face in part_faces(bolt)} == {"#ff0000"}
    (colour,) = {face.colour for face in part_faces(base)}
    channels = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    np.testing.assert_allclose(channels, [0.25, 0.5, 0.75], atol=0.01)


def test_face_names_of_the_file(step_file, tmp_path):
    text = step_file.read_text()
    assert text.count("ADVANCED_FACE('',") == 7
    named = tmp_path / "named.step"
    named.write_text(text.replace("ADVANCED_FACE('',", "ADVANCED_FACE('bore; #3=',", 1))
    (part,) = read_parts(named)
    first = min(part_faces(part), key=lambda face: face.step_id)
    assert first.name == "bore; #3="
    assert sum(face.name is not None for face in part_faces(part)) == 1


def test_several_solids_in_one_product(tmp_path):
    two = compound_of(
        [
            cq.Workplane().box(1, 1, 1).val().wrapped,
            cq.Workplane().box(2, 2, 2).translate((9, 0, 0)).val().wrapped,
        ]
    )
    parts = read_parts(write_step(two, tmp_path / "two.step"))
    assert [volume(part.shape) for part in parts] == pytest.approx([1, 8])
    assert len({part.name for part in parts}) == 2


def test_surfaces_beside_a_solid_are_left_out_and_noted(plate, tmp_path):
    sheet = cq.Face.makePlane(5, 5, basePnt=(0, 0, 50)).wrapped
    (part,) = read_parts(write_step(compound_of([plate.val().wrapped, sheet]), tmp_path / "extra.step"))
    assert volume(part.shape) == pytest.approx(PLATE_VOLUME, rel=1e-9)
    assert any("1 face" in note and "left out" in note for note in part.notes)


def test_an_open_shell_is_read_only_when_asked(plate, tmp_path):
    builder, shell = BRep_Builder(), TopoDS_Shell()
    builder.MakeShell(shell)
    for face in plate.val().Faces()[:-1]:
        builder.Add(shell, face.wrapped)
    path = write_step(shell, tmp_path / "open.step")
    with pytest.raises(GeometryError, match=r"open\.step holds no solid.*allow_open=True") as caught:
        read_parts(path)
    assert caught.value.exit_code == 2
    (part,) = read_parts(path, allow_open=True)
    assert not part.is_solid
    assert len(faces_of(part.shape)) == 6
    assert all(number is not None for number in part.face_step_ids)
    assert surface_area(part.shape) == pytest.approx(plate.val().Area() - 2 * np.pi * 6 * 8, rel=1e-9)


def test_loose_faces_that_close_a_volume_become_a_solid(plate, tmp_path):
    loose = compound_of([face.copy().wrapped for face in plate.val().Faces()])
    (part,) = read_parts(write_step(loose, tmp_path / "loose.step"))
    assert part.is_solid
    assert volume(part.shape) == pytest.approx(PLATE_VOLUME, rel=1e-6)
    assert any("sewn into a solid" in note for note in part.notes)


def test_an_inside_out_solid_is_turned(plate, tmp_path):
    from cadskin.cad.objects import as_parts

    (part,) = as_parts(plate.val().wrapped.Reversed())
    assert volume(part.shape) == pytest.approx(PLATE_VOLUME, rel=1e-9)
    assert any("inside out" in note for note in part.notes)


def test_an_invalid_solid_is_healed_and_its_faces_are_followed(plate):
    builder, shell, solid = BRep_Builder(), TopoDS_Shell(), TopoDS_Solid()
    builder.MakeShell(shell)
    for i, face in enumerate(plate.val().Faces()):
        builder.Add(shell, face.wrapped.Reversed() if i == 2 else face.wrapped)
    builder.MakeSolid(solid)
    builder.Add(solid, shell)
    assert not is_valid(solid)
    healed = repaired(solid, where="bad.step")
    assert healed.notes == ("bad.step: healed by ShapeFix (7 faces before, 7 after)",)
    assert is_valid(healed.shape)
    assert volume(healed.shape) == pytest.approx(PLATE_VOLUME, rel=1e-9)
    before, after = describe_faces(solid), describe_faces(healed.shape)
    assert sorted(healed.origin) == list(range(7))
    for face, origin in zip(after, healed.origin, strict=True):
        np.testing.assert_allclose(face.centre, before[origin].centre, atol=1e-9)
        assert face.area == pytest.approx(before[origin].area)


@pytest.mark.parametrize("brep_mode", [0, 1])
def test_iges(plate, tmp_path, brep_mode):
    path = tmp_path / "plate.igs"
    writer = IGESControl_Writer("MM", brep_mode)
    assert writer.AddShape(plate.val().wrapped)
    assert writer.Write(str(path))
    (part,) = read_parts(path)
    assert part.source.kind == "iges"
    assert part.source.units == "mm"
    assert part.is_solid
    assert volume(part.shape) == pytest.approx(PLATE_VOLUME, rel=1e-5)


def test_iges_in_inch(plate, tmp_path):
    path = tmp_path / "plate.iges"
    writer = IGESControl_Writer("INCH", 1)
    writer.AddShape(plate.val().wrapped)
    writer.Write(str(path))
    (part,) = read_parts(path)
    assert part.source.units == "inch"
    assert volume(part.shape) == pytest.approx(PLATE_VOLUME, rel=1e-5)


def test_brep_as_text_and_binary(plate, tmp_path):
    text, binary = tmp_path / "plate.brep", tmp_path / "binary.brep"
    plate.val().exportBrep(str(text))
    BinTools.Write_s(plate.val().wrapped, str(binary))
    for path in (text, binary):
        (part,) = read_parts(path)
        assert part.name == path.stem
        assert part.source.kind == "brep"
        assert volume(part.shape) == pytest.approx(PLATE_VOLUME, rel=1e-12)


def test_a_tessellated_model_says_so(tmp_path):
    tetrahedron = DiscreteShape(
        [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
        [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        [0, 1, 2, 3],
    )
    path = write_step(
        to_ocp(tetrahedron),
        tmp_path / "mesh.step",
        **{"write.step.tessellated": "On", "write.step.schema": "AP242DIS"},
    )
    assert "TESSELLATED" in path.read_text() or "TRIANGULATED" in path.read_text()
    with pytest.raises(ReadError, match=r"mesh\.step holds a tessellated model"):
        read_parts(path)


def test_a_solid_with_triangles_beside_its_surfaces_is_read(plate, tmp_path):
    shape = plate.val().copy().wrapped
    BRepMesh_IncrementalMesh(shape, 0.5)
    path = write_step(shape, tmp_path / "both.step")
    assert volume(read_parts(path)[0].shape) == pytest.approx(PLATE_VOLUME, rel=1e-9)


BAD_NAMES = [
    *("missing.step", "empty.step", "text.step", "half.step", "header.step", "nodata.step", "nothing.step"),
    *("wire.step", "text.igs", "text.brep", "half.brep", "long half.brep", "half binary.brep"),
    *("drawing.dxf", "mesh.stl"),
]


def bad_files(folder, step_file):
    whole = step_file.read_bytes()
    plate = read_parts(step_file)[0].shape
    BRepTools.Write_s(plate, str(folder / "t"))
    BinTools.Write_s(plate, str(folder / "b"))
    text_brep, binary_brep = ((folder / key).read_bytes() for key in "tb")
    curve = cq.Workplane().moveTo(0, 0).lineTo(1, 1).val().wrapped
    return {
        "missing.step": (None, ReadError, "no such file"),
        "empty.step": (b"", ReadError, "is empty"),
        "text.step": (b"hello world\n" * 20, ReadError, "is no STEP file"),
        "text.igs": (b"hello world\n" * 20, ReadError, "is no IGES file"),
        "text.brep": (b"hello world\n" * 20, ReadError, "is no BREP file"),
        "half.step": (whole[: len(whole) // 2], ReadError, "truncated"),
        "header.step": (whole[:200], ReadError, "truncated"),
        "nodata.step": (
            b"ISO-10303-21;\nHEADER;\nENDSEC;\nEND-ISO-10303-21;\n",
            ReadError,
            "no DATA section",
        ),
        "nothing.step": (
            b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n",
            GeometryError,
            "cannot be read|no shape|holds no solid",
        ),
        "wire.step": (
            write_step(curve, folder / "w.stp").read_bytes(),
            GeometryError,
            "no solid and no surface",
        ),
        "drawing.dxf": (b"0\nSECTION\n", ReadError, "format that is not known"),
        "mesh.stl": (b"solid x\nendsolid x\n", ReadError, "is a mesh"),
        "half.brep": (
            b"DBRep_DrawableShape\n\nCASCADE Topology V1, (c) Matra-Datavision\nLoc",
            ReadError,
            "truncated",
        ),
        "long half.brep": (text_brep[: len(text_brep) // 2], ReadError, "truncated"),
        "half binary.brep": (binary_brep[: len(binary_brep) // 2], ReadError, "cannot be read as BREP"),
    }


@pytest.mark.parametrize("name", BAD_NAMES)
def test_bad_files_give_one_clear_line_and_print_nothing(name, tmp_path, step_file, capfd):
    content, kind, words = bad_files(tmp_path, step_file)[name]
    capfd.readouterr()
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(kind, match=words) as caught:
        read_parts(path)
    message = str(caught.value)
    assert name in message
    assert "\n" not in message
    assert caught.value.exit_code == (3 if isinstance(caught.value, ReadError) else 2)
    assert capfd.readouterr() == ("", "")


def test_a_folder_is_no_file(tmp_path):
    with pytest.raises(ReadError, match="is a folder"):
        read_parts(tmp_path)


def test_reading_can_be_cancelled(step_file):
    with pytest.raises(Cancelled):
        read_parts(step_file, progress=lambda done, total: False)


def test_step_in_a_file_of_another_name_is_recognised(step_file, tmp_path):
    path = tmp_path / "part.txt"
    path.write_bytes(step_file.read_bytes())
    assert read_parts(path)[0].source.kind == "step"
