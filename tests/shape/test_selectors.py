"""Selectors on face records (their agreement with cadquery is tested beside the kernel)."""

from __future__ import annotations

import numpy as np
import pytest

from cadskin.errors import SelectionError
from cadskin.shape import Cylinder, Face, Plane
from cadskin.shape.selectors import select_faces


def _plane(index: int, centre: list[float], normal: list[float], **more: object) -> Face:
    return Face(
        index, Plane(centre, normal), 4.0, centre, normal, [np.subtract(centre, 1), np.add(centre, 1)], **more
    )


BOX = [
    _plane(0, [-1, 0, 0], [-1, 0, 0], colour="#ff0000"),
    _plane(1, [1, 0, 0], [1, 0, 0], name="right"),
    _plane(2, [0, -1, 0], [0, -1, 0]),
    _plane(3, [0, 1, 0], [0, 1, 0]),
    _plane(4, [0, 0, -1], [0, 0, -1], step_id=120),
    _plane(5, [0, 0, 1], [0, 0, 1], name="seat"),
    Face(
        6, Cylinder([0, 0, 0], [0, 0, 1], 0.5), 6.0, [0, 0, 0], [1, 0, 0], [[-1] * 3, [1] * 3], internal=True
    ),
]


@pytest.mark.parametrize(
    ("selector", "expected"),
    [
        (5, (5,)),
        (">Z", (5,)),
        ("<Z", (4,)),
        ("|Z", (4, 5)),
        ("#Z", (0, 1, 2, 3)),
        ("+X", (1,)),
        ("-X", (0,)),
        ("X", (1,)),
        (">Z[0]", (4,)),
        (">>Z[1]", (0, 1, 2, 3, 6)),
        ("<<Z[0]", (5,)),
        ("<<Z", (4,)),
        (">(1,0,1)", (1, 5)),
        ("> (0, 0, 1)", (5,)),
        ("%CYLINDER", (6,)),
        ("%plane and |Y", (2, 3)),
        (">X or <X", (0, 1)),
        ("not %PLANE", (6,)),
        ("not >Z and %PLANE", (0, 1, 2, 3, 4, 6)),  # cadquery: `not` binds loosest
        ("(not >Z) and %PLANE", (0, 1, 2, 3, 4)),
        ("%PLANE exc |Z", (0, 1, 2, 3)),
        ("top", (3,)),
        ("right", (1,)),  # a name in the part wins over the view of the same name (here the same face)
        ("seat", (5,)),
        ("#120", (4,)),
        ([0, ">Z"], (0, 5)),
    ],
)
def test_selects(selector: object, expected: tuple[int, ...]) -> None:
    assert select_faces(BOX, selector) == expected


@pytest.mark.parametrize(
    ("filters", "expected"),
    [
        ({"kind": "cylinder"}, (6,)),
        ({"radius": 0.5}, (6,)),
        ({"radius": (0.4, None)}, (6,)),
        ({"area": (5, 7)}, (6,)),
        ({"internal": True}, (6,)),
        ({"colour": "#FF0000"}, (0,)),
        ({"name": "seat"}, (5,)),
        ({"kind": "plane", "area": 4.0}, (0, 1, 2, 3, 4, 5)),
    ],
)
def test_filters(filters: dict, expected: tuple[int, ...]) -> None:
    assert select_faces(BOX, None, **filters) == expected


@pytest.mark.parametrize(
    ("selector", "message"),
    [
        (7, "there is no face 7; the part has faces 0 to 6"),
        (-1, "there is no face -1"),
        (True, "a selector is a face index"),
        (">W", "not understood"),
        (">Z and", "not understood"),
        ("(>Z", "not understood"),
        ("%SOMETHING", "unknown surface type"),
        (">Z[9]", "out of range"),
        ("seet", "names in this part: seat"),
        ("#999", "matches none of the 7 faces"),
        ("", "not understood"),
        (">(0,0,0)", "no length"),
    ],
)
def test_a_selector_that_finds_nothing_says_so(selector: object, message: str) -> None:
    with pytest.raises(SelectionError, match=message.replace("(", r"\(")):
        select_faces(BOX, selector)


def test_an_unknown_filter_is_named() -> None:
    with pytest.raises(SelectionError, match="unknown filter 'colur'"):
        select_faces(BOX, None, colur="#ff0000")
