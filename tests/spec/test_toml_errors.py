"""What a person may get wrong in a spec file, and what is said then."""

import re

import pytest

from cadskin.errors import CadskinError, ReadError, SpecificationError
from cadskin.spec import parse_spec, read_spec

GOOD = """\
# a plate
flatness = {value = 0.02, on = ">Z"}

[datums]
A = "<Z"
B = {on = ["<X", 3]}

[[tolerances]]
position = 0.1
on = "%CYLINDER"
datums = "A|B(M)"
diameter = true
material = "MMR"
model.field.length = 12

[[tolerances]]
profile = 0.3
on = ["|X", "|Y"]
offset = 0.05
scope = "all_around"

[[dimensions]]
size = 12.0
on = "%CYLINDER"
fit = "H7"

[[dimensions]]
distance = 60
on = "<X"
to = ">X"
plus_minus = 0.1

[[dimensions]]
angle = 45.0
on = 1
to = 2
deviations = [-0.5, 0.5]

[default]
surface_profile = 0.5
datums = "A"
"""


def test_a_file_as_a_person_writes_it():
    spec = parse_spec(GOOD, name="plate.spec.toml")
    assert [t.type for t in spec] == ["flatness", "position", "surface_profile"]
    hole = spec.tolerances[1]
    assert (hole.value, hole.material, hole.zone.shape, hole.feature.derived) == (
        0.1,
        "MMR",
        "diameter",
        "axis",
    )
    assert hole.model == {"field": {"length": 12}}
    assert hole.source == "plate.spec.toml:8"
    assert spec.tolerances[2].bounds == pytest.approx((-0.1, 0.2))
    assert spec.datum("B").feature.selectors == ("<X", 3)
    assert spec.default.value == 0.5
    assert spec.default.scope == "general"
    fit, span, angle = spec.dimensions
    assert (fit.lower, fit.upper) == (12.0, 12.018)
    assert span.deviations == pytest.approx((-0.1, 0.1))
    assert angle.nominal == pytest.approx(0.7853981633974483)
    assert angle.deviations == pytest.approx((-0.5 * 3.141592653589793 / 180, 0.5 * 3.141592653589793 / 180))


@pytest.mark.parametrize(
    "text",
    [
        'flatness = [{value = 0.02, on = ">Z"}, {value = 0.03, on = "<Z"}]',
        '[tolerances]\nflatness = [{value = 0.02, on = ">Z"}, {value = 0.03, on = "<Z"}]',
        'tolerances = [{flatness = 0.02, on = ">Z"}, {flatness = 0.03, on = "<Z"}]',
        '[[tolerances]]\nflatness = 0.02\non = ">Z"\n[[tolerances]]\nflatness = 0.03\non = "<Z"',
        '[[flatness]]\nvalue = 0.02\non = ">Z"\n[[flatness]]\nvalue = 0.03\non = "<Z"',
    ],
)
def test_the_ways_to_write_tolerances_mean_the_same(text):
    assert parse_spec(text) == parse_spec(
        'tolerances = [{flatness = 0.02, on = ">Z"}, {flatness = 0.03, on = "<Z"}]'
    )


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("flatness =", "flatnes =", 2, "unknown key 'flatnes' (did you mean 'flatness'?)"),
        ("[datums]", "[datum]", 4, "unknown key 'datum' (did you mean 'datums'?)"),
        ("diameter = true", "diametre = true", 12, "unknown key 'diametre' (did you mean 'diameter'?)"),
        ("position = 0.1", "positon = 0.1", 9, "unknown key 'positon' (did you mean 'position'?)"),
        ("diameter = true", "diameter = 1", 12, "diameter must be true or false, not 1"),
        ("position = 0.1", 'position = "0.1 mm"', 9, "position must be a number, not '0.1 mm'"),
        ("value = 0.02", "value = nan", 2, "flatness must be a number, not nan"),
        ("value = 0.02", "value = -0.02", 2, "must be finite and not negative, got -0.02"),
        ('"A|B(M)"', '"A|B(Q)"', 8, "no modifier of a datum reference is called 'Q'"),
        ('"A|B(M)"', '"A||B"', 8, "datum system 'A||B' is not understood"),
        ('material = "MMR"', 'material = "soft"', 8, "material 'soft' is none of"),
        ('scope = "all_around"', 'scope = "around"', 20, "scope must be one of"),
        ('fit = "H7"', 'fit = "H77"', 22, "no standard tolerance grade"),
        ('fit = "H7"', 'fit = "H7"\nlimits = [12, 12.1]\nplus_minus = 0.1', 22, "give the limits once"),
        ("size = 12.0", "sise = 12.0", 23, "unknown key 'sise' (did you mean 'size'?)"),
        ('A = "<Z"', "A = 1.5", 5, "on must be a selector like '>Z'"),
        ('A = "<Z"', '"A-B" = "<Z"', 5, "no datum letter"),
        ("model.field.length = 12", "model = 3", 14, "model must be a table"),
        ("deviations = [-0.5, 0.5]", "deviations = [-0.5]", 37, "deviations must be a list of 2 numbers"),
        ("surface_profile = 0.5", "suface_profile = 0.5", 40, "(did you mean 'surface_profile'?)"),
        ("surface_profile = 0.5", "", 39, "has no characteristic"),
        ("position = 0.1", "position = 0.1\nflatness = 0.1", 8, "cannot be position and flatness"),
    ],
)
def test_mistakes_are_named_with_their_line(old, new, line, message):
    assert old in GOOD
    with pytest.raises(SpecificationError) as caught:
        parse_spec(GOOD.replace(old, new, 1), name="plate.spec.toml")
    assert str(caught.value).startswith(f"plate.spec.toml:{line}: ")
    assert message in str(caught.value)


def test_contradictions_in_a_file_are_errors():
    with pytest.raises(SpecificationError, match="datum X, which is not defined"):
        parse_spec(GOOD.replace('"A|B(M)"', '"X"'))


@pytest.mark.parametrize(
    "text", ["flatness = {value = 0.02, on = \n}", "= 1", "a = 1\na = 2", "x = [" * 5000 + "]" * 5000, "\x00"]
)
def test_text_that_is_no_toml(text):
    with pytest.raises(ReadError, match=r"no TOML|nested too deep"):
        parse_spec(text)


def test_files_that_are_not_there(tmp_path):
    with pytest.raises(ReadError, match="cannot read"):
        read_spec(tmp_path / "missing.toml")
    with pytest.raises(ReadError, match="cannot read"):
        read_spec(tmp_path)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ReadError, match="UTF-8"):
        read_spec(tmp_path / "binary.toml")


def test_no_cut_of_a_good_file_escapes_as_another_error():
    for stop in range(0, len(GOOD), 7):
        try:
            parse_spec(GOOD[:stop])
        except CadskinError as error:
            assert re.match(r"spec|tolerance", str(error))  # noqa: PT017
