"""The corpus of real STEP files; tests that need it are skipped where it is not there."""

import os
from pathlib import Path

import pytest

CORPUS = Path(os.environ.get("CADSKIN_CORPUS", Path(__file__).parents[4] / "shared" / "corpus")) / "step"


@pytest.fixture(scope="session")
def corpus_file():
    def find(name):
        path = CORPUS / name
        if not path.is_file():
            pytest.skip(f"{name} is not in the corpus (CADSKIN_CORPUS)")
        return path

    return find


def pytest_generate_tests(metafunc):
    if "nist_file" in metafunc.fixturenames:
        names = sorted(path.name for path in CORPUS.glob("nist_*ap242*.stp"))
        metafunc.parametrize("nist_file", names or ["nist_ctc_01_asme1_ap242-e1.stp"], indirect=True)


@pytest.fixture
def nist_file(request, corpus_file):
    return corpus_file(request.param)
