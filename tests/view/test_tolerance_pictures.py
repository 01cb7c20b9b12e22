"""The signs of tolerances in the lettering, and views from where faces are seen."""

import numpy as np
import pytest

import cadskin as cs
from cadskin.errors import ExportError
from cadskin.spec.characteristics import CHARACTERISTICS
from cadskin.spec.modifiers import DATUM_MODIFIERS, TOLERANCE_MODIFIERS
from cadskin.view import sheet
from cadskin.view.camera import CANDIDATES
from cadskin.view.stroke_font import _GLYPHS, text_segments
from cadskin.view.visibility import seen_areas, views_of


def test_every_sign_of_a_frame_has_a_glyph():
    signs = "".join(row.symbol for row in CHARACTERISTICS.values()) + "⌀□ⓊⓅⓂⓁ◁▷←○"
    tables = (*TOLERANCE_MODIFIERS.values(), *DATUM_MODIFIERS.values())
    signs += "".join(symbol for symbol, _ in tables if not symbol.isascii())
    assert sorted({sign for sign in signs if sign not in _GLYPHS}) == []


def test_signs_are_about_as_high_as_capitals():
    for sign in "⏥○⌭∥⟂⌖◎↗⌰⌀Ⓜ":
        rows = text_segments(sign, 0.0, 0.0, 10.0)[:, [1, 3]]
        assert -10.3 <= rows.min() <= -7.0, sign
        assert -2.0 <= rows.max() <= 0.3, sign


@pytest.fixture(scope="module")
def pocketed():
    """A box of 20 with a pocket of 6 x 6, 12 deep, in its lower side; its floor looks down."""
    cq = pytest.importorskip("cadquery")
    return cs.nominal(
        cq.Workplane().box(20, 20, 20).faces("<Z").workplane().rect(6, 6).cutBlind(-12), edge_length=4
    )


def test_faces_are_looked_at_from_their_side(pocketed):
    areas = seen_areas(pocketed.surface)
    for selector, normal in ((">Z", (0, 0, 1)), ("<Z", (0, 0, -1)), (">X", (1, 0, 0)), ("<Y", (0, -1, 0))):
        (face,) = pocketed.feature(selector).face_indices
        (view,) = views_of([face], areas)
        assert view @ normal > 0.25
        assert areas[:, face].max() == pytest.approx(pocketed.faces[face].area, rel=0.06)
    top, bottom = (pocketed.feature(word).face_indices[0] for word in (">Z", "<Z"))
    views = views_of([top, bottom], areas)
    assert [view[2] > 0 for view in views] == [True, False]


def test_a_hidden_face_is_not_seen_through_the_part(pocketed):
    areas = seen_areas(pocketed.surface)
    floor = next(face for face in pocketed.faces if face.kind == "plane" and abs(face.centre[2] - 2) < 1e-6)
    from_above = [k for k, direction in enumerate(CANDIDATES) if direction[2] > 0]
    assert np.all(areas[from_above, floor.index] == 0)
    assert areas[:, floor.index].max() < 0.2 * floor.area


def test_a_face_that_no_view_shows_has_a_view_all_the_same():
    assert len(views_of([0], np.zeros((8, 1)))) == 1
    assert len(views_of([7], np.zeros((8, 1)))) == 1


def test_a_sheet_wants_one_view_for_each_shape(tmp_path, pocketed):
    with pytest.raises(ExportError, match="one view for each shape: 2 and 1"):
        sheet(tmp_path / "no.png", [pocketed.surface] * 2, ["a", "b"], views=["top"])
    path = sheet(
        tmp_path / "two.png", [pocketed.surface] * 2, ["a", "a"], views=["top", "bottom"], tile=(160, 120)
    )
    assert path.stat().st_size > 0
