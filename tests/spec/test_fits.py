"""Published limit deviations of ISO 286-2, spot by spot, in µm."""

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cadskin.errors import SpecificationError
from cadskin.spec import fit_deviations, size, standard_tolerance
from cadskin.spec.fit_tables import FINE_SIZES, SHAFT_DEVIATIONS, SIZES

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
    # The letters between and beyond.
    (2, "cd8", -48, -34), (6, "CD8", 46, 64), (10, "ef6", -27, -18), (3, "EF7", 10, 20), (8, "fg6", -17, -8),
    (4, "FG7", 6, 18), (20, "j5", -4, 5), (20, "j6", -4, 9), (20, "j7", -8, 13), (3, "j8", -6, 8),
    (300, "j6", -16, 16), (450, "j7", -32, 31), (3, "J6", -4, 2), (20, "J7", -9, 12), (100, "J7", -13, 22),
    (100, "J8", -20, 34), (5, "J7", -6, 6), (240, "J8", -25, 47), (16, "v6", 39, 50), (50, "v7", 81, 106),
    (200, "V8", -356, -284), (20, "y6", 63, 76), (50, "Y7", -130, -105), (6, "z6", 35, 43),
    (10, "z7", 42, 57),     (50, "Z7", -152, -127),
    (24, "za7", 98, 119), (100, "ZA8", -389, -335), (3, "zb8", 40, 54),
    (160, "zb9", 700, 800), (500, "zc8", 2600, 2697), (30, "ZC9", -270, -218), (10, "ZC7", -106, -91),
    # Delta and its exceptions: K, M, N up to IT8, P to ZC up to IT7.
    (6, "K8", -13, 5), (50, "K6", -13, 3), (180, "K7", -28, 12), (3, "K8", -14, 0), (3, "K9", -25, 0),
    (6, "M8", -16, 2), (6, "M9", -34, -4), (280, "M7", -52, 0), (80, "M8", -41, 5), (3, "M8", -16, -2),
    (225, "N6", -51, -22), (225, "N7", -60, -14), (225, "N8", -77, -5), (3, "N7", -14, -4),
    (40, "P8", -65, -26),
    (8, "R7", -28, -13), (65, "R6", -54, -35), (120, "U7", -166, -131), (2, "U7", -28, -18),
    (20, "k3", 0, 4), (20, "k4", 2, 8),
]  # fmt: skip


@pytest.mark.parametrize(("nominal", "code", "low", "high"), PUBLISHED)
def test_published_deviations(nominal, code, low, high):
    assert fit_deviations(nominal, code) == pytest.approx((low / 1000, high / 1000), abs=1e-9)


@given(st.floats(1.01, 500), st.integers(1, 18), st.sampled_from(list("abcdefghkmnprsuxz")))
def test_the_width_is_the_standard_tolerance(nominal, grade, letter):
    codes = [f"{letter}{grade}"]
    if letter <= "h" or 3 <= grade <= 8:
        codes.append(f"{letter.upper()}{grade}")
    for code in codes:
        low, high = fit_deviations(nominal, code)
        assert high - low == pytest.approx(standard_tolerance(nominal, str(grade)), abs=1e-9)


@given(
    st.floats(1.01, 10), st.integers(5, 11), st.sampled_from(["a", "b", "c", "cd", "d", "e", "ef", "f", "fg"])
)
def test_holes_a_to_h_mirror_the_shafts(nominal, grade, letter):
    low, high = fit_deviations(nominal, f"{letter}{grade}")
    assert fit_deviations(nominal, f"{letter}{grade}".upper()) == pytest.approx((-high, -low), abs=1e-12)


@given(
    st.sampled_from([*pairwise(SIZES)][2:]),
    st.sampled_from(["k", "m", "n", "p", "r", "s", "u", "x", "z", "za", "zb", "zc"]),
    st.integers(4, 8),
)
def test_a_fit_has_the_same_interference_by_hole_and_by_shaft(sizes, letter, grade):
    """The rule behind delta: H(n)/p(n-1) and P(n)/h(n-1) have the same limits (ISO 286-1)."""
    nominal = sizes[1]
    if grade == 8 and letter not in "kmn":
        return
    if letter == "k" and grade == 4:
        return  # k3 is 0, k4 is not
    if letter == "m" and grade == 6 and 250 < nominal <= 315:
        return  # the exception that the standard makes
    shaft_low = fit_deviations(nominal, f"{letter}{max(grade - 1, 4)}")[0]
    hole_high = fit_deviations(nominal, f"{letter.upper()}{grade}")[1]
    width = standard_tolerance(nominal, str(grade)), standard_tolerance(nominal, str(grade - 1))
    # Least interference: shaft low - hole high (H) against -shaft tolerance - hole high (h).
    assert shaft_low - width[0] == pytest.approx(-width[1] - hole_high, abs=1e-9)


@pytest.mark.parametrize(
    ("letter", "grade", "factor"),
    [("u", 7, 1.0), ("v", 7, 1.25), ("x", 7, 1.6), ("y", 7, 2.0), ("z", 7, 2.5),
     ("za", 8, 3.15), ("zb", 9, 4.0), ("zc", 10, 5.0)],
)  # fmt: skip
def test_the_tables_follow_the_formulas_of_the_standard(letter, grade, factor):
    """Above 18 mm: IT + factor D, D the geometric mean of the range; rounded (100 in 2052 at most)."""
    rows = dict(zip(FINE_SIZES, SHAFT_DEVIATIONS[letter], strict=True))
    seen = 0
    for above, upto in pairwise(FINE_SIZES):
        if above >= 18 and rows[upto] is not None:
            exact = 1000 * standard_tolerance(upto, str(grade)) + factor * (above * upto) ** 0.5
            assert rows[upto] == pytest.approx(exact, rel=0.026, abs=1.0)
            seen += 1
    assert seen >= 18


@pytest.mark.parametrize(
    "code", ["H", "7", "H19", "H99", "za19", "t6 ", "", "HH7", "I7", "o6", "Za7", "cd", "W6"]
)
def test_codes_that_are_none(code):
    with pytest.raises(SpecificationError):
        fit_deviations(20.0, code)


@pytest.mark.parametrize(
    ("nominal", "code"),
    [(10.5, "cd7"), (11, "EF6"), (400, "fg5"), (20, "t6"), (14, "v6"), (18, "Y6"), (20, "j9"), (20, "J5"),
     (20, "J9"), (5, "j8"), (20, "K9"), (20, "N2"), (20, "P01"), (1, "a11"), (0.5, "B9"), (1, "N9"),
     (1, "h14")],
)  # fmt: skip
def test_what_the_standard_does_not_have_is_refused(nominal, code):
    with pytest.raises(SpecificationError, match=rf"ISO 286 (has no|excludes) tolerance class '{code}'"):
        fit_deviations(nominal, code)


@pytest.mark.parametrize("nominal", [0.0, -1.0, 501.0, float("nan")])
def test_sizes_out_of_range(nominal):
    with pytest.raises(SpecificationError, match="500 mm"):
        fit_deviations(nominal, "H7")


def test_a_size_with_a_fit():
    hole = size("%CYLINDER", 12.0, fit="H7")
    assert (hole.lower, hole.upper, hole.fit) == (12.0, 12.018, "H7")
    with pytest.raises(SpecificationError, match="not both"):
        size("%CYLINDER", 12.0, (0, 0.1), fit="H7")
