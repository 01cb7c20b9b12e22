import warnings

import pytest

from cadskin.errors import CadskinWarning, SelectionError, SpecificationError
from cadskin.spec import (
    CHARACTERISTICS,
    Datum,
    FeatureSelection,
    Specification,
    ToleranceZone,
    angularity,
    characteristic,
    check,
    cylindricity,
    distance,
    flatness,
    line_profile,
    parallelism,
    perpendicularity,
    position,
    roundness,
    size,
    straightness,
    surface_profile,
    tolerance,
)


@pytest.mark.parametrize(
    ("word", "name"),
    [
        ("Circularity", "roundness"),
        ("profile of a surface", "surface_profile"),
        ("profile any surface", "surface_profile"),
        ("Profile Any Line", "line_profile"),
        ("circular run-out", "circular_runout"),
        ("TOTAL_RUNOUT_TOLERANCE", "total_runout"),
        ("⌖", "position"),
        ("⏥", "flatness"),
    ],
)
def test_aliases(word, name):
    assert characteristic(word).name == name


def test_an_unknown_characteristic_names_the_nearest():
    with pytest.raises(SpecificationError, match="did you mean 'flatness'"):
        characteristic("flatnes")


def test_there_are_fifteen_ap242_leaves():
    assert len(CHARACTERISTICS) == 15


def test_constructors_make_what_they_say():
    hole = position("%CYLINDER", 0.1, datums="A|B(M)", diameter=True, material="Ⓜ", projected=15)
    assert (hole.type, hole.value, hole.material) == ("position", 0.1, "MMR")
    assert hole.zone == ToleranceZone(shape="diameter", projected=15)
    assert hole.feature.derived == "axis"
    assert str(hole) == "⌖ ⌀0.1 Ⓜ Ⓟ 15 | A | BⓂ"


def test_material_may_stand_among_the_modifiers():
    hole = position("%CYLINDER", 0.0, datums="A", modifiers=["M", "F", "CZ"])
    assert hole.material == "MMR"
    assert hole.modifiers == ("FREE_STATE", "COMMON_ZONE")
    assert hole.zone.combined is True


@pytest.mark.parametrize(
    ("value", "outside", "bounds", "shift"),
    [
        (0.3, None, (-0.15, 0.15), 0.0),
        (0.3, 0.1, (-0.2, 0.1), -0.05),
        (0.3, 0.3, (0.0, 0.3), 0.15),
        (0.3, 0.0, (-0.3, 0.0), -0.15),
    ],
)
def test_unequal_zones_of_asme_and_iso(value, outside, bounds, shift):
    zone = ToleranceZone(outside=outside)
    assert zone.bounds(value) == pytest.approx(bounds)
    assert zone.offset(value) == pytest.approx(shift)
    assert ToleranceZone.outside_of_offset(value, shift) == pytest.approx(bounds[1])
    assert surface_profile(0, value, offset=shift).bounds == pytest.approx(bounds)


def test_ids_are_given_and_kept():
    spec = Specification(
        flatness(0, 0.1), flatness(1, 0.1, id="flatness-2"), flatness(2, 0.1), cylindricity(3, 0.1)
    )
    assert [t.id for t in spec] == ["flatness-1", "flatness-2", "flatness-3", "cylindricity-1"]
    assert spec["flatness-2"].feature.selectors == (1,)
    with pytest.raises(SelectionError, match="flatness-1"):
        spec["nothing"]


def on(kind, *faces):
    return FeatureSelection(faces=faces or (0,), kinds=(kind,))


A = {"A": 9, "B": 8, "C": 7, "D": 6}


@pytest.mark.parametrize(
    ("tolerances", "message"),
    [
        ([cylindricity(on("plane"), 0.1)], r"cylindricity-1 \(cylindricity 0.1 on face 0\) is on a plane"),
        ([roundness(on("plane"), 0.1)], "roundness is for a cylinder or cone"),
        ([flatness(on("cylinder"), 0.1)], "is on a cylinder"),
        ([flatness(0, 0.1, datums="A")], "form takes none"),
        ([parallelism(0, 0.1)], "needs at least one datum"),
        ([parallelism(0, 0.1, datums="X")], "datum X, which is not defined"),
        ([position(0, 0.1, datums="A|B|C|D")], "4 datums"),
        ([flatness(0, 0.0)], "zero without a material modifier"),
        ([flatness(0, 0.1, id="a"), flatness(1, 0.1, id="a")], "2 tolerances have the id 'a'"),
        ([flatness(0, 0.1, parent="nobody")], "parent 'nobody', which is not there"),
        ([flatness(0, 0.1, id="a", parent="b"), flatness(0, 0.1, id="b", parent="a")], "its own parent"),
        ([tolerance("flatness", None, 0.1, scope="feature")], "on no feature"),
    ],
)
def test_contradictions_are_errors(tolerances, message):
    with pytest.raises(SpecificationError, match=message):
        Specification(*tolerances, datums=A)


@pytest.mark.parametrize(
    ("tolerances", "message"),
    [
        (
            [flatness(0, 0.2, id="form"), surface_profile(0, 0.1, datums="A", id="place")],
            "form .* is larger than .*place",
        ),
        ([perpendicularity(0, 0.3, datums="A"), position(0, 0.2, datums="A")], "perpendicularity-1 .*larger"),
        ([position(0, 0.1, datums="A", id="up"), position(0, 0.2, datums="A", parent="up")], "upper segment"),
        ([surface_profile(0, 0.1, outside=0.2)], "wholly outside"),
        ([position(0, 0.1, datums="A|A")], "names datum A 2 times"),
        ([flatness(0, None)], "has no value"),
    ],
)
def test_doubtful_ones_are_warnings(tolerances, message):
    with pytest.warns(CadskinWarning, match=message):
        Specification(*tolerances, datums=A)


def test_sensible_ones_are_silent():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        spec = Specification(
            flatness(0, 0.02),
            surface_profile(0, 0.1, datums="A"),
            position(on("cylinder", 2, 3), 0.0, datums="A|B", diameter=True, material="MMR"),
            straightness(on("cylinder", 2, 3), 0.01),
            flatness(on("plane", 4, 5), 0.1, derived="median_plane"),
            angularity(1, 0.1, datums="A"),
            line_profile(1, 0.1),
            flatness(6, 0.5, per_length=25),
            datums=A,
            default=surface_profile(None, 0.5, datums="A|B|C"),
        )
    assert check(spec) == ()


@pytest.mark.parametrize("value", [-0.1, float("nan"), float("inf")])
def test_values_that_are_none(value):
    with pytest.raises(SpecificationError, match="finite and not negative"):
        flatness(0, value)


@pytest.mark.parametrize(
    "make",
    [
        lambda: flatness(0, 0.1, no_such=1),
        lambda: flatness(1.5, 0.1),
        lambda: flatness(True, 0.1),
        lambda: flatness(0, 0.1, modifiers="NO_SUCH"),
        lambda: flatness(0, 0.1, material="hard"),
        lambda: flatness(0, 0.1, scope="somewhere"),
        lambda: flatness(0, 0.1, derived="somehow"),
        lambda: flatness(0, 0.1, projected=-1),
        lambda: flatness(0, 0.1, outside=0.1, offset=0.1),
        lambda: flatness(0, 0.1, model="field"),
        lambda: Datum("A-B"),
        lambda: size(0, 10, (0.1, -0.1)),
        lambda: FeatureSelection(faces=(1,), groups=((2,),)),
    ],
)
def test_arguments_without_a_meaning(make):
    with pytest.raises(SpecificationError):
        make()


def test_features_of_a_part_are_taken_as_they_are(array_box, array_shaft):
    top = flatness(array_box.feature(">Z"), 0.02)
    assert top.feature.faces == (5,)
    assert top.feature.kinds == ("plane",)
    side = cylindricity(array_shaft.feature(kind="cylinder"), 0.02)
    assert side.feature.faces == (0, 1)
    assert side.scope == "feature"
    both = surface_profile(array_box.select("|Z"), 0.1)
    assert both.feature.groups == ((4,), (5,))
    assert both.scope == "pattern"
    with pytest.raises(SpecificationError, match="cylindricity"):
        Specification(cylindricity(array_box.feature(">Z"), 0.02))


def test_binding_resolves_selectors(array_box, array_shaft):
    spec = Specification(
        flatness(">Z", 0.02),
        perpendicularity("|X", 0.1, datums="A"),
        datums={"A": "<Z"},
        dimensions=[distance("<X", ">X", 60)],
    )
    bound = spec.bind(array_box)
    assert bound.tolerances[0].feature.faces == (5,)
    assert bound.tolerances[1].feature.groups == ((0,), (1,))
    assert bound.tolerances[1].scope == "pattern"
    assert bound.datum("A").feature.faces == (4,)
    assert (bound.dimensions[0].feature.faces, bound.dimensions[0].second.faces) == ((0,), (1,))
    assert bound.bind(array_box) == bound
    assert bound.on_face(5) == (bound.tolerances[0],)
    with pytest.raises(SpecificationError, match="cylindricity-1"):
        Specification(cylindricity("%PLANE", 0.1)).bind(array_shaft)
    with pytest.raises(SpecificationError, match=r"tolerance flatness-1 .*matches none"):
        Specification(flatness("%SPHERE", 0.1)).bind(array_box)
    with pytest.raises(SpecificationError, match="face 77; the part has faces 0 to 5"):
        Specification(flatness(FeatureSelection(faces=(77,)), 0.1)).bind(array_box)


@pytest.mark.parametrize(
    ("item", "text"),
    [
        (flatness(0, 0.1, per_length=25), "⏥ 0.1 / 25"),
        (flatness(0, 0.1, per_area=25), "⏥ 0.1 / □25"),
        (surface_profile(0, 0.3, outside=0.1, datums="A-B"), "⌓ 0.3 Ⓤ 0.1 | A-B"),
        (position(0, 0.1, spherical=True, material="L", datums="A"), "⌖ S⌀0.1 Ⓛ | A"),
        (position(0, 0.0, material="M", maximum=0.5), "⌖ 0 Ⓜ 0.5 MAX"),
        (flatness(0, None), "⏥ ?"),
        (size(0, 8, (-0.028, -0.013)), "⌀8 -0.013/-0.028"),
        (size(0, 8, (-0.1, 0.1), name="radius"), "R8 ±0.1"),
        (size(0, 8, fit="g6", name=""), "8 g6 -0.005/-0.014"),
    ],
)
def test_frames(item, text):
    assert str(item) == text


def test_plain_data_has_the_promised_fields():
    spec = Specification(position([1, 2], 0.1, datums="A|B-C", modifiers="F"), datums=A)
    (item,) = spec.to_dict()["tolerances"]
    wanted = "id type value_mm raw_value raw_unit datums modifiers material scope faces step_faces"
    wanted += " zone parent source"
    assert set(wanted.split()) <= set(item)
    assert item["datums"] == ["A", "B-C"]
    assert set(spec.to_dict()) >= {"tolerances", "datums", "dimensions", "unresolved"}


def test_the_general_tolerance():
    default = surface_profile(None, 0.5)
    assert Specification(flatness(0, 0.1)).general is None
    assert Specification(flatness(0, 0.1), default=default).general is default
    stated = surface_profile(None, 0.8, id="note")
    assert Specification(flatness(0, 0.1), stated).general == stated


def test_table_lists_everything():
    spec = Specification(flatness(">Z", 0.02), datums={"A": "<Z"}, dimensions=[size(3, 8, fit="H7")])
    text = spec.table()
    for word in ("⏥ 0.02", ">Z", "<Z", "⌀8 H7"):
        assert word in text
