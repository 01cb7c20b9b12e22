"""The array-only selectors and cadquery's own must pick the same faces."""

from functools import cache

import cadquery as cq
import pytest

from cadskin.cad import describe_faces, face_indices
from cadskin.errors import SelectionError
from cadskin.shape.selectors import select_faces

PARTS = {
    "plate": lambda: cq.Workplane().box(60, 40, 8).faces(">Z").workplane().hole(12),
    "stairs": lambda: (
        cq.Workplane()
        .box(10, 10, 2)
        .faces(">Z")
        .workplane()
        .rect(6, 6)
        .extrude(3)
        .faces(">Z")
        .rect(2, 2)
        .extrude(3)
    ),
    "wedge": lambda: cq.Workplane().polyline([(0, 0), (10, 0), (4, 6)]).close().extrude(5),
    "turned": lambda: cq.Workplane().circle(5).extrude(4).faces(">Z").chamfer(1).faces("<Z").fillet(0.5),
    "tilted": lambda: cq.Workplane().transformed(rotate=(30, 20, 10)).box(4, 6, 8).edges().fillet(0.5),
    "ball": lambda: cq.Workplane().sphere(4).union(cq.Workplane().box(10, 2, 2)),
}
STRINGS = [
    ">Z",
    "<Z",
    ">X",
    "<Y",
    "|X",
    "|Z",
    "#Z",
    "#Y",
    "+Z",
    "-X",
    "%PLANE",
    "%CYLINDER",
    "%cone",
    "%Torus",
]
STRINGS += [
    ">Z and |Z",
    ">X or <X",
    "not |Z",
    "#Z and (not %CYLINDER)",
    "%PLANE exc >Z",
    ">(1,1,0)",
    "|(1,0,1)",
]
STRINGS += [
    ">Z[-2]",
    "<Z[0]",
    ">>Z[-1]",
    ">>Z[0]",
    "<<X[0]",
    "<<Z[-1]",
    ">>Y",
    ">XY",
    "|X or |Y and >Z",
    "top",
    "left",
]


@cache
def made(name):
    shape = PARTS[name]().val().wrapped
    return shape, describe_faces(shape)


@pytest.mark.parametrize("name", PARTS)
@pytest.mark.parametrize("selector", STRINGS)
def test_both_agree(name, selector):
    shape, faces = made(name)
    try:
        wanted = face_indices(shape, selector)
    except SelectionError:
        wanted = None
    if not wanted:
        with pytest.raises(SelectionError):
            select_faces(faces, selector)
    else:
        assert select_faces(faces, selector) == wanted


def test_nonsense_is_refused(plate):
    with pytest.raises(SelectionError, match="not understood"):
        face_indices(plate, ">>>Q")
