"""Specifications as tables with FreeCAD's face numbers."""

import pytest

from cadskin.errors import CadskinError, SpecificationError
from cadskin.spec import (
    Datum,
    DatumTarget,
    FeatureSelection,
    Specification,
    distance,
    flatness,
    position,
    size,
    surface_profile,
    tolerance,
)
from cadskin.worker.request import RequestError
from cadskin.worker.tables import specification_from_tables, tables_of_specification


def row(**values):
    return {"id": "T", "characteristic": "flatness", "value": 0.02, "faces": [6], **values}


def test_faces_count_from_one():
    spec = specification_from_tables([row()], [{"letter": "A", "faces": [1, 2]}])
    assert spec["T"].feature.selectors == (5,)
    assert spec.datum("A").feature.selectors == (0, 1)


def test_what_the_tables_hold_comes_back():
    on = FeatureSelection(faces=(3,))
    spec = Specification(
        position(
            on, 0.1, datums="A|B(M)", diameter=True, projected=5.0, material="MMR", id="#12", name="bore"
        ),
        surface_profile(
            FeatureSelection(faces=(5,)),
            0.3,
            outside=0.1,
            modifiers=["free state"],
            model={"field": {"length": 3.0}},
        ),
        tolerance("straightness", FeatureSelection(faces=(4,)), 0.05, intersection_plane="parallel A"),
        datums={"A": FeatureSelection(faces=(0,)), "B": FeatureSelection(faces=(1,))},
        default=tolerance("surface_profile", None, 0.5, scope="general"),
    )
    tables = tables_of_specification(spec)
    assert [item["faces"] for item in tables["tolerances"]] == [[4], [6], [5]]
    back = specification_from_tables(tables["tolerances"], tables["datums"], tables["general"])
    for before, after in zip(spec, back, strict=True):
        assert after.feature.selectors == before.feature.faces
        for key in (
            "id",
            "type",
            "value",
            "datums",
            "material",
            "modifiers",
            "zone",
            "indicators",
            "model",
            "name",
        ):
            assert getattr(after, key) == getattr(before, key), key
    assert back.default.value == 0.5


@pytest.mark.parametrize(
    ("wish", "model"),
    [
        ({"share": 0.1}, {"field": {"sigma": "0.1 of tolerance"}}),
        ({"text": "noise", "share": 0.05}, {"noise": {"sigma": "0.05 of tolerance"}}),
        ({"text": "paraboloid", "share": 0.5}, {"paraboloid": {"amplitude": "0.5 of tolerance"}}),
        (
            {"text": "field:sigma=0.01,kernel=matern32", "length": 3},
            {"field": {"sigma": 0.01, "kernel": "matern32", "length": 3.0}},
        ),
    ],
)
def test_a_wish_becomes_a_model(wish, model):
    spec = specification_from_tables([row(deviation=wish)])
    assert spec["T"].model == model


@pytest.mark.parametrize(
    ("wish", "message"),
    [
        ({"text": "noise", "length": 3}, "tolerance T: the model 'noise' has no correlation length"),
        ({"length": -3}, "tolerance T: length of its deviations must be positive"),
        ({"share": float("inf")}, "share"),
        ({"share": True}, "share"),
        ({"text": "field:length"}, "key=value"),
    ],
)
def test_a_wish_without_meaning_is_refused(wish, message):
    with pytest.raises(CadskinError, match=message):
        specification_from_tables([row(deviation=wish)])


def test_dimensions_stay_on_their_faces():
    bore, left, right = (FeatureSelection(faces=faces) for faces in ((6, 7), (0,), (5,)))
    spec = Specification(
        flatness(FeatureSelection(faces=(2,)), 0.1),
        dimensions=[size(bore, 8.0, fit="H7"), distance(left, right, 30.0, (-0.1, 0.2))],
    )
    tables = tables_of_specification(spec)["dimensions"]
    assert [table["faces"] for table in tables] == [[7, 8], [1, 6]]
    tables[1]["faces"] = [1, 5]
    back = specification_from_tables([row()], dimensions=tables).dimensions
    assert [item.feature.selectors for item in back] == [(6, 7), (0,)]
    assert back[1].second.selectors == (4,)
    for before, after in zip(spec.dimensions, back, strict=True):
        for key in ("id", "kind", "name", "nominal", "lower", "upper", "fit"):
            assert getattr(after, key) == getattr(before, key), key


def test_datum_targets_stay_on_their_faces():
    touched = (
        DatumTarget("A1", feature=FeatureSelection(faces=(7,)), origin=(1.0, 2.0, 0.0)),
        DatumTarget("A2", feature=FeatureSelection(faces=(4,)), origin=(5.0, 2.0, 0.0)),
    )
    spec = Specification(datums=[Datum("A", FeatureSelection(), touched)], checked=False)
    (table,) = tables_of_specification(spec)["datums"]
    assert table["faces"] == [8, 5]
    table["faces"] = [9, 5]  # the first of them has come to another number
    (first, second) = specification_from_tables([], [table]).datum("A").targets
    assert (first.feature.faces, second.feature.faces) == ((8,), (4,))
    assert first.origin == (1.0, 2.0, 0.0)


def test_a_tolerance_without_value_keeps_that():
    tables = tables_of_specification(
        Specification(flatness(FeatureSelection(faces=(0,)), None), checked=False)
    )
    assert tables["tolerances"][0]["value"] is None


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"faces": []}, "tolerance T is on no face"),
        ({"faces": [0]}, "numbers from 1 on"),
        ({"faces": ["Face1"]}, "numbers from 1 on"),
        ({"value": None}, "tolerance T has no value"),
        ({"value": True}, "tolerance T has no value"),
        ({"value": -0.1}, "must be finite and not negative"),
        ({"value": 0.0}, "0"),
        ({"characteristic": None}, "has no characteristic"),
        ({"characteristic": "flatnes"}, "flatness"),
        ({"characteristic": "parallelism"}, "datum"),
        ({"characteristic": "parallelism", "datums": "A"}, "A"),
    ],
)
def test_a_wrong_table_is_refused_by_name(values, message):
    with pytest.raises((SpecificationError, RequestError), match=message):
        specification_from_tables([row(**values)])
