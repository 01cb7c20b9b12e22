"""Published limit deviations of ISO 286-2, spot by spot, in µm."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cadskin.errors import SpecificationError
from cadskin.spec import fit_deviations, size, standard_tolerance

PUBLISHED = [
    (20, "H7", 0, 21), (20, "g6", -20, -7), (20, "h6", -13, 0), (20, "p6", 22, 35),
    (20, "s6", 35, 48), (20, "P7", -35, -14), (20, "N7", -28, -7), (20, "M7", -21, 0),
    (20, "K7", -15, 6), (20, "k6", 2, 15), (20, "F8", 20, 53), (20, "E9", 40, 92),
    (20, "D10", 65, 149), (20, "H11", 0, 130), (20, "c11", -240, -110), (50, "H8", 0, 39),
    (50, "f7", -50, -25), (50, "n6", 17, 33), (50, "R7", -50, -25), (50, "js6", -8, 8),
    (3, "N9", -29, -4), (10, "N9", -36, 0), (100, "H7", 0, 35), (100, "u6", 124, 146),
    (300, "M6", -41, -9), (250, "r6", 84, 113), (400, "a11", -1710, -1350), (6, "x6", 28, 36),
    (30, "t6", 41, 54), (500, "H6", 0, 40), (25, "k8", 0, 33),
    (18, "m5", 7, 15), (80, "S7", -78, -48),
]  # fmt: skip


@pytest.mark.parametrize(("nominal", "code", "low", "high"), PUBLISHED)
def test_published_deviations(nominal, code, low, high):
    assert fit_deviations(nominal, code) == pytest.approx((low / 1000, high / 1000), abs=1e-9)


@given(st.floats(0.1, 500), st.integers(1, 18), st.sampled_from(list("abcdefghkmnprsux")))
def test_the_width_is_the_standard_tolerance(nominal, grade, letter):
    for code in (f"{letter}{grade}", f"{letter.upper()}{grade}"):
        low, high = fit_deviations(nominal, code)
        assert high - low == pytest.approx(standard_tolerance(nominal, str(grade)), abs=1e-9)


@given(st.floats(0.1, 500), st.integers(5, 11), st.sampled_from(list("abcdefgh")))
def test_holes_a_to_h_mirror_the_shafts(nominal, grade, letter):
    low, high = fit_deviations(nominal, f"{letter}{grade}")
    assert fit_deviations(nominal, f"{letter.upper()}{grade}") == pytest.approx((-high, -low), abs=1e-12)


@pytest.mark.parametrize("code", ["H", "7", "H19", "H99", "za6", "t6 ", "J7", "", "HH7"])
def test_codes_that_are_none(code):
    with pytest.raises(SpecificationError):
        fit_deviations(20.0, code)


@pytest.mark.parametrize("nominal", [0.0, -1.0, 501.0, float("nan")])
def test_sizes_out_of_range(nominal):
    with pytest.raises(SpecificationError, match="500 mm"):
        fit_deviations(nominal, "H7")


def test_a_size_with_a_fit():
    hole = size("%CYLINDER", 12.0, fit="H7")
    assert (hole.lower, hole.upper, hole.fit) == (12.0, 12.018, "H7")
    with pytest.raises(SpecificationError, match="not both"):
        size("%CYLINDER", 12.0, (0, 0.1), fit="H7")
