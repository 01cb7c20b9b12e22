"""The real NIST files, against counts and values taken from their text by regular expressions."""

import importlib.util
import warnings
from collections import Counter
from functools import cache
from pathlib import Path

import pytest

from cadskin.cad.pmi.read import read_pmi_text
from cadskin.errors import CadskinWarning

spec = importlib.util.spec_from_file_location("raw_text", Path(__file__).with_name("raw_text.py"))
raw_text = importlib.util.module_from_spec(spec)
spec.loader.exec_module(raw_text)

pytestmark = pytest.mark.corpus


@cache
def quietly(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CadskinWarning)
        return read_pmi_text(path)


def test_every_tolerance_entity_appears_with_its_characteristic(nist_file):
    found = quietly(nist_file)
    assert {int(t.id[1:]): t.type for t in found} == raw_text.tolerance_ids(nist_file)
    assert Counter(t.type for t in found) == raw_text.leaf_counts(nist_file)


def test_values_are_the_magnitudes_of_the_text_in_mm(nist_file):
    lines = raw_text.statements(nist_file)
    for tolerance in quietly(nist_file):
        raw, factor = raw_text.magnitude(lines, int(tolerance.id[1:]))
        assert tolerance.raw_value == raw
        assert tolerance.value == pytest.approx(raw * factor, rel=1e-12)
        assert tolerance.raw_unit == ("inch" if factor == 25.4 else "mm")


def test_datum_letters_are_those_of_the_text_in_order(nist_file):
    lines = raw_text.statements(nist_file)
    for tolerance in quietly(nist_file):
        assert list(tolerance.datums.labels) == raw_text.datum_letters(lines, int(tolerance.id[1:]))


def test_modifiers_and_material_are_those_of_the_text(nist_file):
    lines = raw_text.statements(nist_file)
    for tolerance in quietly(nist_file):
        text = lines[int(tolerance.id[1:])]
        inner = text.partition("WITH_MODIFIERS")[2].partition("))")[0]
        words = {word for word in inner.replace(".", ",").replace("(", ",").split(",") if word.strip()}
        want = {"MMR": "MAXIMUM_MATERIAL_REQUIREMENT", "LMR": "LEAST_MATERIAL_REQUIREMENT"}
        material = {want[tolerance.material]} if tolerance.material in want else set()
        assert set(tolerance.modifiers) | material == words


def test_every_tolerance_is_on_faces_or_says_why_not(nist_file):
    found = quietly(nist_file)
    lines = raw_text.statements(nist_file)
    reasons = {item.entity for item in found.unresolved}
    for tolerance in found:
        numbers = tolerance.feature.step_faces
        assert numbers or tolerance.scope == "general" or tolerance.id in reasons
        assert all(lines[number].startswith("ADVANCED_FACE") for number in numbers)


def test_every_datum_letter_has_a_feature_or_targets(nist_file):
    found = quietly(nist_file)
    lines = raw_text.statements(nist_file)
    letters = {
        text.rpartition("'")[0].rpartition("'")[2] for text in lines.values() if text.startswith("DATUM(")
    }
    assert {datum.letter for datum in found.datums} == letters
    assert all(datum.feature or datum.targets for datum in found.datums)


def test_every_valued_dimension_has_its_numbers(nist_file):
    found = {int(d.id[1:]): d for d in quietly(nist_file).dimensions}
    lines = raw_text.statements(nist_file)
    represented = [t for t in lines.values() if t.startswith("DIMENSIONAL_CHARACTERISTIC_REPRESENTATION")]
    with_value = [d for d in found.values() if (d.nominal, d.lower, d.upper) != (None, None, None)]
    assert len(with_value) == len(represented)
    limited = [text for text in lines.values() if text.startswith("PLUS_MINUS_TOLERANCE")]
    limited += [text for text in lines.values() if "'upper limit'" in text and "MEASURE_WITH_UNIT" in text]
    assert sum(d.lower is not None and d.upper is not None for d in found.values()) == len(limited)


@pytest.mark.parametrize(
    ("name", "dimension", "nominal", "deviations"),
    [
        ("nist_ctc_01_asme1_ap242-e1.stp", "#120", 35.0, (-0.2, 0.0)),
        ("nist_ctc_05_asme1_ap242-e1.stp", "#888", 254.0, (-0.0254, 0.0254)),
        ("nist_ftc_08_asme1_ap242-e1-2021.stp", "#12424", 0.213 * 25.4, (-0.001 * 25.4, 0.005 * 25.4)),
        ("nist_stc_07_asme1_ap242-e3.stp", "#14717", 6.35, (0.0, 0.0762)),
    ],
)
def test_limits_of_a_dimension(corpus_file, name, dimension, nominal, deviations):
    found = {d.id: d for d in quietly(corpus_file(name)).dimensions}[dimension]
    assert found.nominal == pytest.approx(nominal, rel=1e-12)
    assert found.deviations == pytest.approx(deviations, abs=1e-12)


def test_composite_frames_know_their_upper_segment(corpus_file):
    found = quietly(corpus_file("nist_ftc_06_asme1_ap242-e2.stp"))
    lower = {t.id: t.parent for t in found if t.parent}
    assert lower == {"#338": "#337", "#340": "#339", "#345": "#344", "#347": "#346"}


def test_a_hole_pattern_has_one_group_for_each_hole(corpus_file):
    found = quietly(corpus_file("nist_stc_07_asme1_ap242-e3.stp"))
    pattern = found["#17226"]
    assert pattern.scope == "pattern"
    assert [len(group) for group in pattern.feature.groups] == [2, 2, 2, 2]


def test_graphical_pmi_only_says_so(corpus_file):
    found = quietly(corpus_file("nist_ctc_01_asme1_ap203.stp"))
    assert len(found) == 0
    assert "no semantic PMI" in found.unresolved[0].reason
    assert "graphical" in found.unresolved[0].reason
