"""Every kind of CAD object ends up as the same parts."""

import subprocess
import sys

import cadquery as cq
import numpy as np
import pytest

from cadskin.cad import CadPart, read_parts
from cadskin.cad.faces import bounding_box, surface_area, volume
from cadskin.cad.objects import as_parts, as_shape
from cadskin.cad.part import pick_part, with_unique_names
from cadskin.errors import GeometryError
from cadskin.shape import Source


class Builder:
    """Looks like a build123d builder."""

    def __init__(self, part):
        self.part = part


class FreeCadShape:
    """Looks like FreeCAD's Part.Shape."""

    def __init__(self, text):
        self.text = text

    def exportBrepToString(self):
        return self.text


@pytest.fixture
def box():
    return cq.Workplane().box(2, 3, 4)


def test_all_ways_to_hand_over_a_shape_agree(box, tmp_path):
    shape = box.val()
    step, brep = tmp_path / "box.step", tmp_path / "box.brep"
    shape.exportStep(str(step))
    shape.exportBrep(str(brep))
    ways = [
        box,
        shape,
        shape.wrapped,
        cq.Compound.makeCompound([shape]),
        cq.Assembly(box),
        Builder(shape),
        [shape],
        str(step),
        step,
        brep,
        FreeCadShape(brep.read_text()),
        as_parts(shape)[0],
        list(as_parts(shape)),
    ]
    for way in ways:
        (part,) = as_parts(way)
        assert part.is_solid
        assert volume(part.shape) == pytest.approx(24, rel=1e-9)
        assert volume(as_shape(way)) == pytest.approx(24, rel=1e-9)


def test_the_source_says_which_library(box):
    assert as_parts(box)[0].source.kind == "cadquery"
    assert as_parts(box.val().wrapped)[0].source.kind == "shape"


def test_a_workplane_with_several_solids_gives_several_parts():
    parts = as_parts(cq.Workplane().pushPoints([(0, 0), (9, 0), (18, 0)]).box(1, 1, 1, combine=False))
    assert [part.name for part in parts] == ["part", "part-2", "part-3"]
    assert [part.source.part for part in parts] == ["part", "part-2", "part-3"]


def test_an_assembly_keeps_names_places_and_colours(box):
    assembly = cq.Assembly(name="top")
    assembly.add(box, name="a", loc=cq.Location((10, 0, 0)), color=cq.Color("red"))
    inner = cq.Assembly(box, name="inner", loc=cq.Location((0, 0, 5)))
    inner.add(box, name="b", loc=cq.Location((0, 7, 0)))
    assembly.add(inner)
    parts = {part.name: part for part in as_parts(assembly)}
    assert set(parts) == {"a", "inner", "b"}
    for name, centre in (("a", [10, 0, 0]), ("inner", [0, 0, 5]), ("b", [0, 7, 5])):
        np.testing.assert_allclose(bounding_box(parts[name].shape).mean(axis=0), centre, atol=1e-6)
    assert set(parts["a"].face_colours) == {"#ff0000"}


def test_what_holds_no_solid_says_so(box):
    for empty, words in (
        (cq.Workplane(), "is empty"),
        ([], "is empty"),
        (42, "holds no CAD shape"),
        (Builder(None), "holds no CAD shape"),
        (box.edges(">Z"), "no solid and no surface"),
        (box.faces(">Z"), "allow_open"),
    ):
        with pytest.raises(GeometryError, match=words):
            as_parts(empty)
    (sheet,) = as_parts(box.faces(">Z"), allow_open=True)
    assert not sheet.is_solid
    assert surface_area(sheet.shape) == pytest.approx(6)


def test_build123d_objects():
    b3d = pytest.importorskip("build123d")
    with b3d.BuildPart() as builder:
        b3d.Box(2, 3, 4)
    labelled = b3d.Box(2, 3, 4)
    labelled.label = "block"
    labelled.color = b3d.Color(1, 0, 0)
    for way in (builder, builder.part, b3d.Box(2, 3, 4), b3d.Solid.make_box(2, 3, 4), [b3d.Box(2, 3, 4)]):
        (part,) = as_parts(way)
        assert part.source.kind == "build123d"
        assert volume(part.shape) == pytest.approx(24, rel=1e-9)
    (part,) = as_parts(labelled)
    assert part.name == "block"
    assert set(part.face_colours) == {"#ff0000"}


def test_no_cad_library_is_imported_for_it():
    code = (
        "import sys; from cadskin.cad.objects import as_parts;"
        "from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox;"
        "print(len(as_parts(BRepPrimAPI_MakeBox(1., 2., 3.).Solid())), "
        "[m for m in ('cadquery', 'build123d', 'vtkmodules') if m in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.split(maxsplit=1) == ["1", "[]\n"]


def test_names_become_unique_and_parts_are_picked_by_them(box):
    shape = box.val().wrapped
    parts = with_unique_names(CadPart(name, shape, Source()) for name in ["nut", "nut", "nut-2", "rod"])
    assert len({part.name for part in parts}) == 4
    assert parts[0].name == "nut"
    assert pick_part(parts, "rod", where="x") is parts[3]
    assert pick_part(parts, 1, where="x") is parts[1]
    with pytest.raises(GeometryError, match=r"x\.step has no part 'bolt'; it has nut, "):
        pick_part(parts, "bolt", where="x.step")
    with pytest.raises(GeometryError, match=r"x\.step holds 4 solids \(nut, .*part=.*nominals"):
        pick_part(parts, None, where="x.step")
    with pytest.raises(GeometryError, match="parts 0 to 3"):
        pick_part(parts, 9, where="x.step")


def test_reading_an_own_export_of_build123d(tmp_path):
    b3d = pytest.importorskip("build123d")
    path = tmp_path / "b.step"
    b3d.export_step(b3d.Cylinder(2, 5), str(path))
    (part,) = read_parts(path)
    assert volume(part.shape) == pytest.approx(np.pi * 20, rel=1e-9)
