"""Planted optima: what is prescribed is what comes out, and the contacts carry it."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pytest

from cadskin.errors import SpecificationError
from cadskin.shape.association import associate
from cadskin.verify import DatumFeature, establish, evaluate_case, orientation, read_case
from cadskin.verify.reference import CHARACTERISTICS, reference_set
from cadskin.verify.reference_datums import DATUM_CHARACTERISTICS, datum_reference_set
from cadskin.verify.reference_files import write_references
from cadskin.verify.reference_sampling import SAMPLINGS, unit_square


@pytest.mark.parametrize("characteristic", CHARACTERISTICS)
@pytest.mark.parametrize(
    "options",
    [
        {},
        {"arc": np.radians(200), "sampling": "grid"},
        {"sampling": "sections", "waviness": 4, "n_outliers": 5},
    ],
    ids=["random", "arc", "sections"],
)
def test_written_case_evaluates_to_its_value(tmp_path, characteristic, options):
    value = 0.05 if CHARACTERISTICS[characteristic].is_zone else 20.0
    (path,) = write_references(tmp_path, characteristic, value, rng=5, n_points=400, **options)
    found = evaluate_case(read_case(path))
    assert found.value == pytest.approx(value, abs=1e-12)
    assert found.certified
    question = json.loads(path.read_text())
    assert set(found.active) == set(question["reference"]["active"])
    assert min(question["reference"]["multipliers"]) > 0.05


def test_another_criterion_gives_another_value():
    """The sets tell a minimum zone from a least-squares range."""
    made = reference_set("cylindricity", 0.05, rng=1)
    assert associate(made.points, "cylinder", "G").width > 0.05 * 1.002


def test_same_seed_same_points():
    first, second = (reference_set("flatness", 0.1, rng=11).points for _ in range(2))
    assert np.array_equal(first, second)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("loveliness", 0.1), "choose one of"),
        (("flatness", 0.0), "positive"),
        (("flatness", float("nan")), "positive"),
    ],
)
def test_bad_requests(arguments, text):
    with pytest.raises(SpecificationError, match=text):
        reference_set(*arguments)


def test_no_inscribed_circle_on_half_a_turn():
    with pytest.raises(SpecificationError, match="180"):
        reference_set("inscribed circle", 20.0, arc=np.pi)


def test_command(tmp_path):
    words = [
        "--characteristic",
        "cylindricity",
        "--value",
        "0.05",
        "-n",
        "3",
        "-o",
        tmp_path / "out",
        "--seed",
        "2",
    ]
    command = [sys.executable, "-m", "cadskin.cli.main", "reference", *map(str, words)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stderr
    cases = sorted((tmp_path / "out").glob("*.json"))
    assert len(cases) == 3
    for case in cases:
        assert evaluate_case(read_case(case)).value == pytest.approx(0.05, abs=1e-12)


@pytest.mark.parametrize("sampling", SAMPLINGS)
def test_every_sampling_of_a_form(tmp_path, sampling):
    (path,) = write_references(tmp_path, "cylindricity", 0.05, rng=3, n_points=300, sampling=sampling)
    found = evaluate_case(read_case(path))
    assert found.value == pytest.approx(0.05, abs=1e-12)
    assert found.n_points == 300


def test_strategies_lie_where_they_say():
    rng = np.random.default_rng(0)
    count = {
        name: [len(np.unique(np.round(c, 9))) for c in unit_square(240, name, rng)] for name in SAMPLINGS
    }
    assert count["sections"] == [20, 12]
    assert count["generatrix"] == [12, 20]
    assert count["helix"][1] == 240
    turns = np.unwrap(2 * np.pi * unit_square(240, "helix", rng)[0])
    assert turns[-1] - turns[0] == pytest.approx(2 * np.pi * 12, rel=0.01)
    for name in SAMPLINGS:
        u, v = unit_square(241, name, rng)
        assert len(u) == len(v) == 241
        assert min(u.min(), v.min()) >= 0
        assert max(u.max(), v.max()) <= 1
    with pytest.raises(SpecificationError, match="choose one of"):
        unit_square(9, "spiral", rng)


@pytest.mark.parametrize(("seed", "sampling"), list(enumerate(SAMPLINGS)))
@pytest.mark.parametrize("characteristic", DATUM_CHARACTERISTICS)
def test_datum_case_evaluates_to_its_value(tmp_path, characteristic, seed, sampling):
    """The datums are as uneven as 0.6 of the value, and yet the value is exact."""
    options = {"n_points": 200, "sampling": sampling, "n_outliers": 3}
    (path,) = write_references(tmp_path, characteristic, 0.05, rng=seed, **options)
    found = evaluate_case(read_case(path))
    assert found.value == pytest.approx(0.05, abs=1e-12)
    assert found.certified


def test_datum_sets_tell_criteria_apart():
    """A datum by least squares gives another value."""
    made = datum_reference_set("parallelism", 0.05, rng=2, n_points=60)
    squares = [
        DatumFeature("A", "plane", made.features["A"], hint=made.outward["A"], criterion="least squares")
    ]
    found = orientation(made.features["T"], "parallelism", establish(squares, standard="custom"))
    assert abs(found.value - 0.05) > 1e-5


def test_options_that_have_no_meaning_are_refused(tmp_path):
    with pytest.raises(SpecificationError, match="arc"):
        write_references(tmp_path, "position", 0.05, arc=1.0)
    with pytest.raises(SpecificationError, match="choose one of"):
        datum_reference_set("flatness", 0.05)
