"""Every tolerance of the nine AP242 files of NIST is evaluated on the part, and the perfect part keeps it."""

from __future__ import annotations

import os
import warnings
from pathlib import Path

import pytest

from cadskin.errors import CadskinWarning

CORPUS = (
    Path(os.environ.get("CADSKIN_CORPUS", Path(__file__).resolve().parents[3] / "shared" / "corpus")) / "step"
)
# Name, tolerances, and the most that the file's own geometry lies off its ideal surfaces [mm].
FILES = [
    ("nist_ctc_01_asme1_ap242-e1", 6, 1e-6),
    ("nist_ctc_02_asme1_ap242-e2", 22, 1e-6),
    ("nist_ctc_03_asme1_ap242-e2", 13, 1e-6),
    ("nist_ctc_05_asme1_ap242-e1", 10, 2e-5),
    ("nist_ftc_06_asme1_ap242-e2", 28, 5e-3),
    ("nist_ftc_08_asme1_ap242-e1-2021", 33, 1e-6),
    ("nist_ftc_11_asme1_ap242-e2", 4, 8e-3),
    ("nist_stc_06_asme1_ap242-e3", 25, 1e-6),
    ("nist_stc_07_asme1_ap242-e3", 22, 3e-4),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "count", "off"), FILES, ids=[row[0][5:11] for row in FILES])
def test_every_tolerance_is_evaluated_on_the_perfect_part(name, count, off):
    from cadskin.cad import contained_nominals, read_pmi
    from cadskin.verify import verify

    path = CORPUS / f"{name}.stp"
    if not path.exists():
        pytest.skip(f"{path.name} is not in the corpus folder; set CADSKIN_CORPUS")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CadskinWarning)
        (nominal,) = contained_nominals(path, {}, time_limit=600.0)
        spec = read_pmi(path, nominal)
    found = verify(nominal.surface, spec, nominal=nominal)
    assert len(spec) == count
    assert not found.unresolved
    assert found.conforming
    one_sided = {tolerance.id for tolerance in spec if tolerance.zone.outside is not None}
    assert max(evaluation.value for key, evaluation in found.evaluations if key not in one_sided) <= off
