import pytest
from hypothesis import given
from spec.strategies import datum_systems

from cadskin.errors import SpecificationError
from cadskin.spec import DatumSystem
from cadskin.spec.datums import as_datum_system


@given(datum_systems)
def test_text_reads_back(system):
    assert DatumSystem.parse(system.text()) == system


@pytest.mark.parametrize(
    ("text", "labels"),
    [
        ("A", ("A",)),
        ("A|B|C", ("A", "B", "C")),
        (" A | B-C ", ("A", "B-C")),
        ("A-B(M)|C", ("A-B", "C")),
        ("", ()),
    ],
)
def test_labels(text, labels):
    assert DatumSystem.parse(text).labels == labels


def test_modifiers_belong_to_the_compartment_or_to_the_letter():
    whole, single = DatumSystem.parse("A-B(M)|[C(L)-D](F)").references
    assert [mod.name for mod in whole.modifiers] == ["MAXIMUM_MATERIAL_REQUIREMENT"]
    assert whole.element_modifiers == ()
    assert [mod.name for mod in single.modifiers] == ["FREE_STATE"]
    assert [mod.name for mod in single.element_modifiers[0]] == ["LEAST_MATERIAL_REQUIREMENT"]
    assert single.symbols() == "CⓁ-DⒻ"


def test_a_modifier_with_a_value():
    (reference,) = DatumSystem.parse("A(P=20)").references
    assert (reference.modifiers[0].name, reference.modifiers[0].value) == ("PROJECTED", 20.0)


@pytest.mark.parametrize(
    "text", ["A||B", "|", "A|", "A-", "-A", "A B", "A(Q", "A(NO_SUCH)", "[A", "A(M=x)", "1", "é"]
)
def test_texts_that_are_no_datum_system(text):
    with pytest.raises(SpecificationError):
        DatumSystem.parse(text)


def test_lists_and_none():
    assert as_datum_system(["A", "B-C"]).labels == ("A", "B-C")
    assert not as_datum_system(None)
