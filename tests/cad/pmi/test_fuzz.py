"""Mutated corpus files: nothing but a `CadskinError`, and no file takes long."""

import time
import warnings

import numpy as np
import pytest
from cad.pmi.mutations import mutated, shortened

from cadskin.cad.pmi.part21 import Part21File
from cadskin.cad.pmi.read import specification_of
from cadskin.errors import CadskinError, CadskinWarning
from cadskin.spec import parse_spec

NAMES = [
    "nist_ctc_01_asme1_ap242-e1.stp",
    "nist_ctc_03_asme1_ap242-e2.stp",
    "nist_ctc_05_asme1_ap242-e1.stp",
    "nist_ftc_08_asme1_ap242-e1-2021.stp",
    "nist_ftc_11_asme1_ap242-e2.stp",
    "nist_stc_07_asme1_ap242-e3.stp",
]
LONGEST = 10.0  # s

pytestmark = pytest.mark.corpus


def read(text):
    """Read and, where it reads, write the spec file and read that."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CadskinWarning)
        try:
            spec = specification_of(Part21File(text, "fuzz.stp"))
        except CadskinError:
            return "error"
    assert parse_spec(spec.to_toml()) == spec
    assert spec.table() or not spec.tolerances
    spec.to_dict()
    return "read"


def run(path, count, seed):
    text, focus = shortened(path.read_bytes())
    rng = np.random.default_rng(seed)
    outcomes = {"read": 0, "error": 0}
    for i in range(count):
        attempt = mutated(rng, text, focus)
        begin = time.process_time()
        try:
            outcomes[read(attempt)] += 1
        except Exception as error:
            raise AssertionError(f"{path.name}, seed {seed}, mutation {i}: {error!r}") from error
        assert time.process_time() - begin < LONGEST
    return outcomes


@pytest.mark.parametrize("name", NAMES)
def test_mutated_files_give_an_answer_or_a_clear_error(corpus_file, name):
    outcomes = run(corpus_file(name), 40, seed=7)
    assert outcomes["read"] > 0
    assert outcomes["error"] > 0


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_ten_thousand_mutations(corpus_file, name):
    outcomes = run(corpus_file(name), 10_000 // len(NAMES) + 1, seed=2026)
    assert outcomes["read"] > 100
    assert outcomes["error"] > 100
