"""What we write against the rules of the QIF 3.0.0 schemas: order, cardinality and type of every element.

The rules are written out by hand for the elements that are written. Document, results, base types of features
and characteristics, and the statuses follow the text of the schemas (QIFDocument.xsd, QIFResults.xsd,
Features.xsd, Characteristics.xsd of ISO 23952) and their published bindings; the inside of feature
definitions, of datum frames and of units follows published files. The schema files themselves are not a
dependency.
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest

from cadskin.spec import (
    Specification,
    circular_runout,
    coaxiality,
    cylindricity,
    flatness,
    parallelism,
    perpendicularity,
    position,
    roundness,
    straightness,
    surface_profile,
    total_runout,
)
from cadskin.verify import verify
from cadskin.verify.qif import write_qif

Q = "{http://qifstandards.org/xsd/qif3}"
FEATURES = ("Plane", "Cylinder", "Sphere", "Cone")
CHARACTERISTICS = (
    "Flatness", "Straightness", "Circularity", "Cylindricity", "Parallelism", "Perpendicularity",
    "Angularity", "Position", "Coaxiality", "Concentricity", "Symmetry", "SurfaceProfile", "LineProfile",
    "CircularRunout", "TotalRunout",
)  # fmt: skip

# Children in order: "name" exactly once, "name?" at most once, "name+" once or more, "a|b" a choice.
SEQUENCES = {
    "QIFDocument": "QPId Version? Header? FileUnits DatumDefinitions? DatumReferenceFrames? Product? "
    "Features? Characteristics? Results?",
    "Version": "TimeCreated?",
    "Header": "Application?",
    "Application": "Name?",
    "FileUnits": "PrimaryUnits",
    "PrimaryUnits": "AngularUnit? LinearUnit?",
    "AngularUnit": "SIUnitName UnitName UnitConversion?",
    "LinearUnit": "SIUnitName UnitName UnitConversion?",
    "UnitConversion": "Factor",
    "DatumDefinitions": "DatumDefinition+",
    "DatumDefinition": "DatumLabel",
    "DatumReferenceFrames": "DatumReferenceFrame+",
    "DatumReferenceFrame": "Datums",
    "Datums": "Datum+",
    "Datum": "SimpleDatum Precedence",
    "SimpleDatum": "DatumDefinitionId MaterialModifier ReferencedComponent",
    "Precedence": "PrecedenceEnum",
    "Product": "PartSet",
    "PartSet": "Part+",
    "Part": "ModelNumber?",
    "Features": "FeatureDefinitions FeatureNominals FeatureItems",
    "FeatureDefinitions": "FeatureDefinition+",
    "FeatureNominals": "FeatureNominal+",
    "FeatureItems": "FeatureItem+",
    "FeatureDefinition": "InternalExternal? Diameter? HalfAngle?",
    "FeatureNominal": "FeatureDefinitionId Axis? Location? Normal?",
    "Axis": "AxisPoint Direction",
    "FeatureItem": "FeatureNominalId FeatureName DeterminationMode",
    "DeterminationMode": "Checked",
    "Checked": "CheckDetails",
    "CheckDetails": "Measured",
    "Characteristics": "CharacteristicDefinitions CharacteristicNominals CharacteristicItems",
    "CharacteristicDefinitions": "CharacteristicDefinition+",
    "CharacteristicNominals": "CharacteristicNominal+",
    "CharacteristicItems": "CharacteristicItem+",
    "CharacteristicDefinition": "ToleranceValue? OuterDisposition? DatumReferenceFrameId? MaterialCondition? "
    "ZoneShape?",
    "ZoneShape": "DiametricalZone|NonDiametricalZone|SphericalZone|PlanarZone",
    "CharacteristicNominal": "CharacteristicDefinitionId",
    "CharacteristicItem": "Name? FeatureItemIds? CharacteristicNominalId",
    "FeatureItemIds": "Id+",
    "Results": "MeasurementResultsSet",
    "MeasurementResultsSet": "MeasurementResults+",
    "MeasurementResults": "MeasuredCharacteristics? InspectionStatus",
    "MeasuredCharacteristics": "CharacteristicMeasurements",
    "CharacteristicMeasurements": "CharacteristicMeasurement+",
    "CharacteristicMeasurement": "Status CharacteristicItemId Value?",
    "Status": "CharacteristicStatusEnum",
    "InspectionStatus": "InspectionStatusEnum",
}
NUMBER = r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?"
REFERENCE = r"[1-9]\d*"
TOKEN = r"\S+( \S+)*"
TEXTS = {
    "QPId": r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}",
    "TimeCreated": r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d",
    "Name": TOKEN, "UnitName": TOKEN, "SIUnitName": "radian|meter", "DatumLabel": TOKEN, "FeatureName": TOKEN,
    "ModelNumber": TOKEN, "Factor": NUMBER, "Diameter": NUMBER, "HalfAngle": NUMBER, "ToleranceValue": NUMBER,
    "OuterDisposition": NUMBER, "Value": NUMBER,
    "Location": f"({NUMBER} ){{2}}{NUMBER}", "Normal": f"({NUMBER} ){{2}}{NUMBER}",
    "AxisPoint": f"({NUMBER} ){{2}}{NUMBER}", "Direction": f"({NUMBER} ){{2}}{NUMBER}",
    "InternalExternal": "INTERNAL|EXTERNAL|NOT_APPLICABLE",
    "MaterialModifier": "NONE|REGARDLESS|MAXIMUM|LEAST",
    "MaterialCondition": "NONE|REGARDLESS|MAXIMUM|LEAST",
    "ReferencedComponent": "BASIC|TOLERANCED|ACTUAL|NOT_APPLICABLE",
    "PrecedenceEnum": "PRIMARY|SECONDARY|TERTIARY|QUATERNARY|QUINARY|SENARY",
    "CharacteristicStatusEnum": "PASS|FAIL|REWORK|SYSERROR|INDETERMINATE|NOT_ANALYZED|BASIC|UNDEFINED",
    "InspectionStatusEnum": "PASS|FAIL|REWORK|SYSERROR|UNKNOWN|NOT_CALCULATED|NOT_MEASURED|UNDEFINED",
    **dict.fromkeys(
        ("DatumDefinitionId", "FeatureDefinitionId", "FeatureNominalId", "CharacteristicDefinitionId",
         "CharacteristicNominalId", "CharacteristicItemId", "DatumReferenceFrameId", "Id"),
        REFERENCE,
    ),
}  # fmt: skip
EMPTY = {"Measured", "DiametricalZone", "NonDiametricalZone", "SphericalZone", "PlanarZone"}
COUNTED = {
    "DatumDefinitions", "DatumReferenceFrames", "Datums", "PartSet", "FeatureDefinitions", "FeatureNominals",
    "FeatureItems", "CharacteristicDefinitions", "CharacteristicNominals", "CharacteristicItems",
    "FeatureItemIds", "MeasurementResultsSet", "CharacteristicMeasurements",
}  # fmt: skip
NAMED = (
    "DatumDefinition", "DatumReferenceFrame", "Part", "MeasurementResults", "FeatureDefinition",
    "FeatureNominal", "FeatureItem", "CharacteristicDefinition", "CharacteristicNominal",
    "CharacteristicItem", "CharacteristicMeasurement",
)  # fmt: skip


def general(tag):
    """``PlaneFeatureItem`` -> ``FeatureItem``: members of a substitution group share its rules."""
    for words, group in ((FEATURES, "Feature"), (CHARACTERISTICS, "Characteristic")):
        for word in words:
            if tag.startswith(word + group):
                return tag.removeprefix(word)
    return tag


def pattern_of(sequence):
    """A regular expression over ``name `` for the children in order."""
    out = ""
    for item in sequence.split():
        suffix = item[-1] if item[-1] in "?+" else ""
        out += f"(?:{'|'.join(f'{name} ' for name in item.rstrip('?+').split('|'))}){suffix}"
    return out


def faults(element):
    tag = general(element.tag.removeprefix(Q))
    text = (element.text or "").strip()
    if tag in SEQUENCES:
        children = "".join(general(child.tag.removeprefix(Q)) + " " for child in element)
        if text or not re.fullmatch(pattern_of(SEQUENCES[tag]), children):
            yield f"{tag}: children {children!r}, text {text!r}"
    elif tag in TEXTS:
        if len(element) or not re.fullmatch(TEXTS[tag], element.text or ""):
            yield f"{tag}: {element.text!r}"
    elif tag not in EMPTY or len(element) or text:
        yield f"{tag}: no such element, or not empty"
    if (tag in COUNTED) != ("n" in element.attrib) or element.get("n", str(len(element))) != str(
        len(element)
    ):
        yield f"{tag}: n = {element.get('n')} of {len(element)}"
    if (tag in NAMED) != ("id" in element.attrib) or not re.fullmatch(REFERENCE, element.get("id", "1")):
        yield f"{tag}: id = {element.get('id')}"
    for child in element:
        yield from faults(child)


def box_specification():
    return Specification(
        flatness(5, 0.05), straightness(5, 0.05), parallelism(5, 0.05, datums="A"),
        perpendicularity(5, 0.05, datums="B"), surface_profile(1, 0.2),
        position(5, 0.3, datums="A|B", id="name  with   spaces"),
        surface_profile(3, 0.2, datums="A", outside=0.15),
        datums={"A": 4, "B": 2},
    )  # fmt: skip


def shaft_specification():
    return Specification(
        cylindricity(0, 0.03), roundness(0, 0.03), circular_runout(0, 0.03, datums="B"),
        total_runout(3, 0.03, datums="A"), coaxiality(0, 0.05, datums="A", diameter=True),
        perpendicularity(0, 0.03, datums="B", diameter=True, material="MMR"),
        datums={"A": 0, "B": 2}, checked=False,
    )  # fmt: skip


@pytest.mark.parametrize("name", ["box", "shaft"])
def test_every_element_obeys_its_rule(array_box, array_shaft, tmp_path, name):
    part = {"box": array_box, "shaft": array_shaft}[name]
    spec = {"box": box_specification, "shaft": shaft_specification}[name]()
    bent = part.surface.with_points(part.surface.points * np.array([1.0, 1.0, 1.001]))
    found = [verify(surface, spec, nominal=part) for surface in (part.surface, bent)]
    root = ElementTree.parse(write_qif(tmp_path / "part.qif", found, spec, part)).getroot()
    assert list(faults(root)) == []
    kinds = {general(element.tag.removeprefix(Q)) for element in root.iter()}
    assert {"CharacteristicMeasurement", "FeatureItem", "InspectionStatus", "Value"} <= kinds


def test_the_rules_find_faults(array_box, tmp_path):
    """Order, cardinality, type and counts: each damage is seen."""
    spec = box_specification()
    path = write_qif(
        tmp_path / "box.qif", [verify(array_box.surface, spec, nominal=array_box)], spec, array_box
    )

    def damaged(change):
        root = ElementTree.parse(path).getroot()
        change(root)
        return list(faults(root))

    assert damaged(lambda root: None) == []
    assert damaged(lambda root: root.insert(0, root[-1]))
    assert damaged(lambda root: root.remove(root.find(f"{Q}FileUnits")))
    assert damaged(lambda root: next(root.iter(f"{Q}ToleranceValue")).__setattr__("text", "0,05"))
    assert damaged(lambda root: next(root.iter(f"{Q}FeatureItems")).set("n", "9"))
    assert damaged(lambda root: ElementTree.SubElement(root, f"{Q}Results"))
    assert damaged(lambda root: next(root.iter(f"{Q}CharacteristicStatusEnum")).__setattr__("text", "GOOD"))
