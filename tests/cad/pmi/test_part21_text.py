"""The Part 21 reader: values, escapes, sections, limits, hostile text."""

import re
import time
import tracemalloc

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cadskin.cad.pmi.part21 import Part21File, read_part21
from cadskin.cad.pmi.statements import Statements, encode, encode_string
from cadskin.cad.pmi.tokens import DERIVED, Enumeration, Reference, Typed, decode_string
from cadskin.errors import ReadError

HEAD = "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\nFILE_NAME('','',(''),(''),'','','');\n"
HEAD += "FILE_SCHEMA(('AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF { 1 0 10303 442 3 1 4 }'));\nENDSEC;\n"


def step(data, head=HEAD):
    text = f"{head}DATA;\n{data}\nENDSEC;\nEND-ISO-10303-21;\n"
    return Part21File(text.encode("latin-1") if isinstance(text, str) else text, "test.stp")


@pytest.mark.parametrize(
    ("raw", "text"),
    [
        (rb"plain", "plain"),
        (rb"it''s", "it's"),
        (rb"\X2\2300\X0\8", "⌀8"),
        (rb"\X2\03B103B2\X0\ ", "αβ "),
        (rb"\X4\0001F600\X0\!", "😀!"),
        (rb"\X\B0", "°"),
        (rb"\S\D", "Ä"),
        (rb"\PE\\S\!", "\u0401"),  # Cyrillic: ISO 8859-5
        (rb"a\\b", "a\\b"),
        (rb"\\X2\\", "\\X2\\"),
        (rb"\X2\23\X0\ ", "\\X2\\23\\X0\\ "),  # no whole character: kept
        (rb"\Q", "\\Q"),
        ("grün".encode(), "grün"),
        ("grün".encode("latin-1"), "grün"),
    ],
)
def test_string_escapes(raw, text):
    assert decode_string(raw) == text


@given(st.text(st.characters(exclude_categories=["Cs"])))
@example("'\\X2\\")
def test_strings_read_back_as_written(text):
    encoded = encode_string(text)
    assert re.fullmatch(r"[ -~]*", encoded)
    assert decode_string(encoded[1:-1].encode("ascii")) == text


values = st.recursive(
    st.none()
    | st.just(DERIVED)
    | st.integers(-(10**9), 10**9)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
    | st.sampled_from([Enumeration("T"), Enumeration("MILLI"), Reference(7)]),
    lambda inner: (
        st.lists(inner, max_size=3).map(tuple)
        | st.lists(inner, min_size=1, max_size=2).map(lambda v: Typed("LENGTH_MEASURE", tuple(v)))
    ),
    max_leaves=6,
)


@given(st.lists(values, max_size=4).map(tuple))
def test_values_read_back_as_written(given_values):
    found = step(f"#1=A{encode(given_values)};").values(1)
    assert found == given_values
    assert [type(value) for value in found] == [type(value) for value in given_values]


def test_simple_and_complex_instances_comments_and_spaces():
    file = step("/* #9=NO(); */ #1 = b_c ( 'x;y' , /* ; */ 2 ) ;\n#2=(A(1)B()\n C(#1));")
    assert file.values(1) == ("x;y", 2)
    assert file.types(2) == ("A", "B", "C")
    assert file.of_type("B_C") == [1]
    assert file.of_type("C") == [2]
    assert list(file) == [1, 2]


def test_a_name_inside_a_string_or_a_typed_value_is_no_record():
    file = step("#1=(A('FLATNESS_TOLERANCE(')B(LENGTH_MEASURE(1.)));")
    assert file.of_type("FLATNESS_TOLERANCE") == []
    assert file.of_type("LENGTH_MEASURE") == []


def test_several_data_sections_and_edition_three_sections():
    text = HEAD + "ANCHOR;\n<a>=#1;\nENDSEC;\nDATA('one',('AP242'));\n#1=A();\nENDSEC;\n"
    text += "DATA;\n#2=A();\nENDSEC;\nEND-ISO-10303-21;"
    assert Part21File(text.encode(), "two.stp").of_type("A") == [1, 2]


@pytest.mark.parametrize(("version", "edition"), [("1 1 4", 1), ("3 1 4", 2), ("4 1 4", 3)])
def test_edition(version, edition):
    assert step("#1=A();", HEAD.replace("3 1 4", version)).edition == edition


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (b"solid cube", "no STEP file"),
        (b"ISO-10303-21;", "no HEADER section"),
        (HEAD.encode(), "no DATA section"),
        (HEAD.encode() + b"DATA;\n#1=A('x", "cut off"),
        (HEAD.encode() + b"DATA;\n#1=A(1);\n#2=A(", "line 9: the file ends inside"),
        (HEAD.encode() + b"DATA;\n#1=A(1);", "cut off"),
        (HEAD.encode() + b"DATA;\n#1=A(/* 1);\nENDSEC;", "cut off"),
        (HEAD.encode() + b"DATA;\n#1=A(1);\nfoo bar;\nENDSEC;", "line 9: not an instance: 'foo bar'"),
        (HEAD.encode() + b"DATA;\n#1=A(1);\n#1=A(2);\nENDSEC;", "used twice"),
    ],
)
def test_text_that_is_no_whole_step_file(text, message):
    with pytest.raises(ReadError, match=re.escape(message)):
        Part21File(text, "bad.stp")


@pytest.mark.parametrize("body", ["A(1", "A(1))", "A(1)B(2)", "(A(1)", "A(,@)", "A 1", "1", "A('x' 'y'"])
def test_a_malformed_instance_is_listed_and_the_rest_is_read(body):
    file = step(f"#1={body};\n#2=B(3);")
    assert file.values(1) in ((), ("x", "y"))
    assert file.values(2) == (3,)
    if body != "A(1)B(2)":
        assert 1 in file.broken
    assert "#1" in file.broken[1]


@pytest.mark.parametrize(("opening", "closing"), [("(", ")"), ("( ", " )"), ("A(", ")")])
def test_deep_nesting_is_refused(opening, closing):
    with pytest.raises(ReadError, match="nested more than 64 deep"):
        step("#1=A(" + opening * 10_000 + closing * 10_000 + ");").records(1)


def test_deep_nesting_is_refused_even_where_nobody_asks():
    with pytest.raises(ReadError, match="#2: brackets nested"):
        step("#1=A();\n#2=A(" + "(" * 10_000 + ")" * 10_000 + ");\n#3=A();")


def test_a_long_string_is_refused_in_bounded_memory():
    text = (HEAD + "DATA;\n#1=A('" + "x" * (40 << 20) + "');\nENDSEC;\nEND-ISO-10303-21;\n").encode()
    tracemalloc.start()
    with pytest.raises(ReadError, match="a string of"):
        Part21File(text, "long.stp")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2.5 * len(text)


def test_a_file_beyond_the_limit_is_refused_before_it_is_read(tmp_path):
    path = tmp_path / "sparse.stp"
    with path.open("wb") as stream:
        stream.truncate(1 << 30)
    with pytest.raises(ReadError, match=r"sparse\.stp has 1024 MiB; the limit is 512 MiB"):
        read_part21(path)


@pytest.mark.parametrize("name", ["missing.stp", "."])
def test_a_missing_file_or_a_folder(tmp_path, name):
    with pytest.raises(ReadError, match="cannot read"):
        read_part21(tmp_path / name)


def test_an_empty_file(tmp_path):
    (tmp_path / "empty.stp").write_bytes(b"  \n")
    with pytest.raises(ReadError, match="is empty"):
        read_part21(tmp_path / "empty.stp")


def _time(text):
    best = 1e9
    for _ in range(3):
        begin = time.process_time()
        Part21File(text, "timed.stp")
        best = min(best, time.process_time() - begin)
    return best


@pytest.mark.parametrize(
    "line",
    [
        "#{}=CARTESIAN_POINT('',(1.,2.,3.));\n",
        "#{}=A('a''b;c',$,(#1,#2));\n",
        "/* c */ #{}=(A(1)B('x')C());\n",
    ],
)
def test_the_index_is_linear_in_the_size_of_the_file(line):
    small, large = (
        (
            HEAD + "DATA;\n" + "".join(line.format(i + 1) for i in range(n)) + "ENDSEC;\nEND-ISO-10303-21;\n"
        ).encode()
        for n in (20_000, 160_000)
    )
    assert _time(large) < 8 * 2.5 * _time(small)


@pytest.mark.parametrize("piece", [b"/*", b"'", b"/*/", b"(", b"/", b"''/*", b"#1=", b"#1=A("])
def test_unclosed_pieces_take_no_quadratic_time(piece):
    times = []
    for count in (50_000, 400_000):
        text = HEAD.encode() + b"DATA;\n#1=A(" + piece * count
        begin = time.process_time()
        with pytest.raises(ReadError):
            Part21File(text, "bad.stp")
        times.append(time.process_time() - begin)
    assert times[1] < 0.5 or times[1] < 8 * 4 * times[0]


def test_statements_are_numbered_and_sorted():
    out = Statements(5)
    assert out.add("A", "x", Reference(2)) == 5
    assert out.add_complex(("C", ()), ("B", (1,))) == 6
    assert out.text() == "#5=A('x',#2);\n#6=(B(1)C());\n"
