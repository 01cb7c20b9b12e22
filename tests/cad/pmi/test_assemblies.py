"""PMI of a part that stands several times in an assembly: every instance has it."""

import json
from pathlib import Path

import numpy as np
import pytest

import cadskin as cs
from cadskin.cad.discretise import part_faces
from cadskin.cad.partitioning import partition
from cadskin.cad.pmi.compose import Composer
from cadskin.cad.pmi.compose_tolerances import compose_datums, compose_tolerances
from cadskin.cad.pmi.part21 import Part21File
from cadskin.cli.main import main
from cadskin.errors import GeometryError
from cadskin.spec.binding import bind_faces

NUTS = ("nut", "nut-2", "nut-3")


def add_pmi(path, name, specs):
    """Add PMI to parts of an assembly that cadquery has written."""
    text = path.read_text()
    for part_name, make in specs.items():
        part = next(item for item in cs.read_parts(path) if item.name == part_name)
        faces = part_faces(part)
        bound = bind_faces(make(faces), faces, partition(part.shape, faces))
        composer = Composer(Part21File(text.encode(), name), part.face_step_ids)
        compose_tolerances(composer, bound.tolerances, compose_datums(composer, bound.datums))
        end = text.rindex("ENDSEC;")
        text = text[:end] + composer.out.text() + text[end:]
    path.with_name(name).write_text(text)
    return path.with_name(name)


def nut_spec(faces):
    top = max(faces, key=lambda face: face.centre[2]).index
    bottom = min(faces, key=lambda face: face.centre[2]).index
    return cs.Specification(
        cs.flatness(top, 0.02),
        cs.perpendicularity("%CYLINDER", 0.05, datums="A", diameter=True),
        datums={"A": bottom},
    )


def plate_spec(faces):
    return cs.Specification(cs.flatness(max(faces, key=lambda face: face.centre[2]).index, 0.3))


@pytest.fixture(scope="module")
def assembly(tmp_path_factory):
    cq = pytest.importorskip("cadquery")
    nut = cq.Workplane().polygon(6, 10).extrude(4).faces(">Z").workplane().hole(5)
    places = [((10, 0, 4), 0), ((-10, 0, 4), 30), ((0, 10, -4), 0)]
    whole = cq.Assembly(name="top").add(cq.Workplane().box(60, 40, 8), name="plate")
    for i, (place, angle) in enumerate(places):
        name = "nut" if i == 0 else f"n{i}"
        whole.add(nut, name=name, loc=cq.Location(place, (0, 0, 1), angle))
    folder = tmp_path_factory.mktemp("assembly")
    whole.export(str(folder / "bare.step"))
    return add_pmi(folder / "bare.step", "nuts.step", {"nut": nut_spec, "plate": plate_spec})


def faces_of(spec):
    return [tolerance.feature.faces for tolerance in spec], spec.datum("A").feature.faces


def test_every_instance_has_the_same_pmi_in_its_own_place(assembly):
    specs = [cs.read_pmi(assembly, name) for name in NUTS]
    assert [t.value for t in specs[0]] == [0.02, 0.05]
    assert all(spec.tolerances == specs[0].tolerances for spec in specs)
    assert all(spec.datums == specs[0].datums for spec in specs)
    tops = [
        next(r for r in spec.fingerprints if r.face == spec.tolerances[0].feature.faces[0]) for spec in specs
    ]
    assert [record.fingerprint.centre for record in tops] == [(10, 0, 8), (-10, 0, 8), (0, 10, 0)]


def test_it_is_on_the_meshed_instance(assembly):
    part = cs.nominal(assembly, part="nut-3", edge_length=5.0)
    spec = cs.read_pmi(assembly, part)
    assert faces_of(spec) == faces_of(cs.read_pmi(assembly, "nut-3"))
    assert spec.bind(part) == spec
    (top,) = spec.tolerances[0].feature.faces
    assert np.allclose(part.faces[top].normal, [0, 0, 1])
    assert spec.notes == ("1 tolerances belong to other parts of the file",)


def test_a_part_does_not_get_the_pmi_of_another(assembly):
    plate = cs.nominal(assembly, part="plate", edge_length=10.0)
    for part in ("plate", plate, next(p for p in cs.read_parts(assembly) if p.name == "plate")):
        spec = cs.read_pmi(assembly, part)
        assert [t.value for t in spec] == [0.3]
        assert spec.datums == ()


def test_all_parts_at_once_say_that_there_are_more_instances(assembly):
    spec = cs.read_pmi(assembly)
    assert sorted((t.feature.part, t.value) for t in spec) == [("nut", 0.02), ("nut", 0.05), ("plate", 0.3)]
    assert spec.notes[-1] == (
        "nut stands 3 times; its PMI is on the first one here, choose another by its name: nut-2, nut-3"
    )


def test_on_the_command_line(assembly, capsys):
    assert main(["spec", str(assembly), "--part", "nut-2", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["tolerances"]
    first = cs.read_pmi(assembly, "nut")
    assert [item["faces"] for item in found] == [list(t.feature.faces) for t in first]
    assert main(["spec", str(assembly), "--part", "nut-4"]) == 2
    assert "no part 'nut-4'; it has" in capsys.readouterr().err
    with pytest.raises(GeometryError, match="no part 'nut-4'"):
        cs.read_pmi(Path(assembly), "nut-4")
