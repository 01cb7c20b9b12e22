"""The same PMI from another writer: OCCT's XCAF reads a NIST file and writes it again."""

import warnings
from collections import Counter

import pytest

from cadskin.cad.pmi.read import read_pmi_text
from cadskin.errors import CadskinWarning

pytestmark = pytest.mark.corpus

# Files of which XCAF keeps every value (it loses complex magnitudes, general and per-unit tolerances).
WHOLE = [
    "nist_ctc_05_asme1_ap242-e1.stp",
    "nist_ftc_06_asme1_ap242-e2.stp",
    "nist_ftc_08_asme1_ap242-e1-2021.stp",
    "nist_stc_06_asme1_ap242-e3.stp",
]


def rewritten(source, target):
    from OCP.Interface import Interface_Static
    from OCP.STEPCAFControl import STEPCAFControl_Reader, STEPCAFControl_Writer
    from OCP.STEPControl import STEPControl_StepModelType
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFApp import XCAFApp_Application

    document = TDocStd_Document(TCollection_ExtendedString("XCAF"))
    XCAFApp_Application.GetApplication_s().InitDocument(document)
    reader = STEPCAFControl_Reader()
    reader.SetGDTMode(True)
    reader.ReadFile(str(source))
    reader.Transfer(document)
    writer = STEPCAFControl_Writer()
    kept = Interface_Static.CVal_s("write.step.schema")
    Interface_Static.SetCVal_s("write.step.schema", "AP242DIS")
    writer.SetDimTolMode(True)
    writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(target))
    Interface_Static.SetCVal_s("write.step.schema", kept)
    return target


def key(tolerance):
    return (
        tolerance.type,
        round(tolerance.value, 9),
        tolerance.datums.labels,
        tolerance.material,
        tolerance.zone.shape,
        len(tolerance.feature.step_faces),
    )


@pytest.mark.parametrize("name", WHOLE)
def test_tolerances_survive_the_other_writer(corpus_file, tmp_path, name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CadskinWarning)
        ours = read_pmi_text(corpus_file(name))
        theirs = read_pmi_text(rewritten(corpus_file(name), tmp_path / "again.stp"))
    on_faces = Counter(key(t) for t in ours if t.scope != "general")
    assert Counter(map(key, theirs)) == on_faces
