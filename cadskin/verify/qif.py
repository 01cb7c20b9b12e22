"""Measurement results as QIF 3.0 (Quality Information Framework): the table of a part for other programs.

Written are the features that are toleranced, datum systems, characteristics with their tolerances, and one
set of results per part with value and verdict of each characteristic. Lengths are in mm.

References
----------
ISO 23952:2020 (QIF 3.0), applications "Results" and the library schemas Features, Characteristics.
"""

from __future__ import annotations

import uuid
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere
from cadskin.spec.binding import bound_to
from cadskin.verify.general import with_general
from cadskin.verify.part_datums import requirement_of

if TYPE_CHECKING:
    from cadskin.shape import Feature, NominalModel
    from cadskin.spec import DatumSystem, Specification, Tolerance
    from cadskin.verify.evaluation import Evaluation
    from cadskin.verify.verification import Verification

__all__ = ["qif_document", "write_qif"]

_NAMESPACE = "http://qifstandards.org/xsd/qif3"
_SCHEMA_INSTANCE = "http://www.w3.org/2001/XMLSchema-instance"
# AP242 name -> (QIF word, whether it has datums, whether it has a zone shape).
_WORDS = {
    "flatness": ("Flatness", False, False),
    "straightness": ("Straightness", False, True),
    "roundness": ("Circularity", False, False),
    "cylindricity": ("Cylindricity", False, False),
    "parallelism": ("Parallelism", True, True),
    "perpendicularity": ("Perpendicularity", True, True),
    "angularity": ("Angularity", True, True),
    "position": ("Position", True, True),
    "coaxiality": ("Coaxiality", True, True),
    "concentricity": ("Concentricity", True, False),
    "symmetry": ("Symmetry", True, False),
    "surface_profile": ("SurfaceProfile", True, False),
    "line_profile": ("LineProfile", True, False),
    "circular_runout": ("CircularRunout", True, False),
    "total_runout": ("TotalRunout", True, False),
}
_PRECEDENCE = ("PRIMARY", "SECONDARY", "TERTIARY")
_MATERIAL = {"RFS": "REGARDLESS", "MMR": "MAXIMUM", "LMR": "LEAST"}


@dataclass
class _Ids:
    """Ids of the document, in order: QIF ids are unique in a file."""

    last: int = 0
    features: dict[str, int] = field(default_factory=dict)
    frames: dict[str, int] = field(default_factory=dict)
    items: dict[str, int] = field(default_factory=dict)

    def fresh(self) -> int:
        self.last += 1
        return self.last


def write_qif(
    path: str | Path, verifications: Sequence[Verification], spec: Specification, nominal: NominalModel
) -> Path:
    """Write the verification of one or several parts as a QIF 3.0 file.

    Parameters
    ----------
    path : path
        Usually ``.qif``.
    verifications : sequence of Verification
        One for each made part.
    spec : Specification
        As it was verified.
    nominal : NominalModel

    Returns
    -------
    Path

    Raises
    ------
    SpecificationError
        Nothing was verified.
    """
    target = Path(path)
    root = qif_document(verifications, spec, nominal)
    ElementTree.indent(root)
    ElementTree.ElementTree(root).write(target, encoding="UTF-8", xml_declaration=True)
    return target


def qif_document(
    verifications: Sequence[Verification], spec: Specification, nominal: NominalModel
) -> ElementTree.Element:
    """Return the document as an element tree; see `write_qif`."""
    if not verifications:
        raise SpecificationError("a QIF file needs at least one verification")
    tolerances = [item for item in with_general(bound_to(spec, nominal), nominal) if item.feature.faces]
    ids = _Ids()
    root = ElementTree.Element(
        "QIFDocument",
        {
            "xmlns": _NAMESPACE,
            "xmlns:xsi": _SCHEMA_INSTANCE,
            "xsi:schemaLocation": f"{_NAMESPACE} QIFDocument.xsd",
            "versionQIF": "3.0.0",
        },
    )
    _head(root)
    _datums(root, ids, tolerances)
    _product(root, ids, nominal)
    _features(root, ids, nominal, tolerances)
    _characteristics(root, ids, nominal, tolerances)
    _results(root, ids, verifications, tolerances)
    root.set("idMax", str(ids.last))
    return root


def _add(
    parent: ElementTree.Element, tag: str, text: str | float | None = None, **attributes: object
) -> ElementTree.Element:
    element = ElementTree.SubElement(parent, tag, {key: str(value) for key, value in attributes.items()})
    if text is not None:
        element.text = " ".join(text.split()) if isinstance(text, str) else _number(text)  # xs:token
    return element


def _number(value: float) -> str:
    """Return the shortest text that reads back as the same number."""
    return repr(float(value))


def _vector(values: Iterable[float]) -> str:
    return " ".join(_number(value) for value in np.asarray(values, dtype=np.float64) + 0.0)


def _head(root: ElementTree.Element) -> None:
    from cadskin import __version__

    _add(root, "QPId", str(uuid.uuid4()))
    version = _add(root, "Version")
    _add(version, "TimeCreated", datetime.now(UTC).replace(microsecond=0, tzinfo=None).isoformat())
    application = _add(_add(root, "Header"), "Application")
    _add(application, "Name", f"cadskin {__version__}")
    units = _add(_add(root, "FileUnits"), "PrimaryUnits")
    for tag, base, name, factor in (
        ("AngularUnit", "radian", "radian", 1.0),
        ("LinearUnit", "meter", "mm", 0.001),
    ):
        unit = _add(units, tag)
        _add(unit, "SIUnitName", base)
        _add(unit, "UnitName", name)
        _add(_add(unit, "UnitConversion"), "Factor", factor)


def _datums(root: ElementTree.Element, ids: _Ids, tolerances: list[Tolerance]) -> None:
    """Datum definitions (a common datum A-B is one) and a datum reference frame per datum system."""
    labels = list(dict.fromkeys(label for item in tolerances for label in item.datums.labels))
    numbers = {label: ids.fresh() for label in labels}
    if labels:
        definitions = _add(root, "DatumDefinitions", n=len(labels))
        for label in labels:
            _add(_add(definitions, "DatumDefinition", id=numbers[label]), "DatumLabel", label)
    systems = {item.datums.text(): item.datums for item in tolerances if item.datums}
    if not systems:
        return
    frames = _add(root, "DatumReferenceFrames", n=len(systems))
    for text, system in systems.items():
        ids.frames[text] = ids.fresh()
        frame = _add(frames, "DatumReferenceFrame", id=ids.frames[text])
        _frame(frame, system, numbers)


def _frame(frame: ElementTree.Element, system: DatumSystem, numbers: dict[str, int]) -> None:
    datums = _add(frame, "Datums", n=len(system))
    for reference, word in zip(system.references, _PRECEDENCE, strict=False):
        datum = _add(datums, "Datum")
        requirement = requirement_of(reference)
        simple = _add(datum, "SimpleDatum")
        _add(simple, "DatumDefinitionId", str(numbers[reference.label]))
        _add(simple, "MaterialModifier", "NONE" if requirement is None else _MATERIAL[requirement])
        _add(simple, "ReferencedComponent", "ACTUAL")
        _add(_add(datum, "Precedence"), "PrecedenceEnum", word)


def _product(root: ElementTree.Element, ids: _Ids, nominal: NominalModel) -> None:
    product = _add(root, "Product")
    part = _add(_add(product, "PartSet", n=1), "Part", id=ids.fresh())
    _add(part, "ModelNumber", nominal.source.part or "part")


def _surfaces(nominal: NominalModel, tolerance: Tolerance) -> list[Feature]:
    """Return the features of a tolerance that QIF has a word for; freeform faces and tori are not written."""
    found = {nominal.feature_of(face).id: nominal.feature_of(face) for face in tolerance.feature.faces}
    return [feature for feature in found.values() if _word(feature)]


def _features(
    root: ElementTree.Element, ids: _Ids, nominal: NominalModel, tolerances: list[Tolerance]
) -> None:
    used = {feature.id: feature for item in tolerances for feature in _surfaces(nominal, item)}
    if not used:
        return
    features = _add(root, "Features")
    sets = {
        name: _add(features, name, n=len(used))
        for name in ("FeatureDefinitions", "FeatureNominals", "FeatureItems")
    }
    for feature in used.values():
        word = _word(feature)
        definition = _add(sets["FeatureDefinitions"], f"{word}FeatureDefinition", id=ids.fresh())
        _shape(definition, feature)
        exact = _add(sets["FeatureNominals"], f"{word}FeatureNominal", id=ids.fresh())
        _add(exact, "FeatureDefinitionId", definition.get("id"))
        _place(exact, feature, feature.ideal)
        item = _add(sets["FeatureItems"], f"{word}FeatureItem", id=ids.fresh())
        _add(item, "FeatureNominalId", exact.get("id"))
        _add(item, "FeatureName", feature.name)
        _add(_add(_add(_add(item, "DeterminationMode"), "Checked"), "CheckDetails"), "Measured")
        ids.features[feature.name] = int(str(item.get("id")))


def _word(feature: Feature) -> str:
    kinds = ((Plane, "Plane"), (Cylinder, "Cylinder"), (Sphere, "Sphere"), (Cone, "Cone"))
    return next((word for kind, word in kinds if isinstance(feature.ideal, kind)), "")


def _shape(definition: ElementTree.Element, feature: Feature) -> None:
    if isinstance(feature.ideal, Cylinder | Sphere | Cone):
        _add(definition, "InternalExternal", "INTERNAL" if feature.internal else "EXTERNAL")
    if isinstance(feature.ideal, Cylinder | Sphere):
        _add(definition, "Diameter", 2.0 * feature.ideal.radius)
    elif isinstance(feature.ideal, Cone):  # its place is the apex, where the diameter is zero
        _add(definition, "Diameter", 0.0)
        _add(definition, "HalfAngle", feature.ideal.half_angle)


def _place(nominal: ElementTree.Element, feature: Feature, ideal: object) -> None:
    if isinstance(ideal, Plane):
        _add(nominal, "Location", _vector(ideal.origin))
        _add(nominal, "Normal", _vector(feature.faces[0].normal))
    elif isinstance(ideal, Cylinder | Cone):
        axis = _add(nominal, "Axis")
        _add(axis, "AxisPoint", _vector(ideal.origin if isinstance(ideal, Cylinder) else ideal.apex))
        _add(axis, "Direction", _vector(ideal.axis))
    elif isinstance(ideal, Sphere):
        _add(nominal, "Location", _vector(ideal.centre))


def _characteristics(
    root: ElementTree.Element, ids: _Ids, nominal: NominalModel, tolerances: list[Tolerance]
) -> None:
    if not tolerances:
        return
    characteristics = _add(root, "Characteristics")
    names = ("CharacteristicDefinitions", "CharacteristicNominals", "CharacteristicItems")
    sets = {name: _add(characteristics, name, n=len(tolerances)) for name in names}
    for tolerance in tolerances:
        word = _WORDS[tolerance.type][0]
        definition = _add(sets[names[0]], f"{word}CharacteristicDefinition", id=ids.fresh())
        _definition(definition, ids, tolerance)
        exact = _add(sets[names[1]], f"{word}CharacteristicNominal", id=ids.fresh())
        _add(exact, "CharacteristicDefinitionId", definition.get("id"))
        item = _add(sets[names[2]], f"{word}CharacteristicItem", id=ids.fresh())
        _add(item, "Name", tolerance.id)
        features = [ids.features[feature.name] for feature in _surfaces(nominal, tolerance)]
        if features:
            listed = _add(item, "FeatureItemIds", n=len(features))
            for number in features:
                _add(listed, "Id", str(number))
        _add(item, "CharacteristicNominalId", exact.get("id"))
        ids.items[tolerance.id] = int(str(item.get("id")))


def _definition(definition: ElementTree.Element, ids: _Ids, tolerance: Tolerance) -> None:
    """Tolerance value, datums and zone, in the order of the schema."""
    has_datums, has_zone = _WORDS[tolerance.type][1:]
    if tolerance.value is not None:
        _add(definition, "ToleranceValue", tolerance.value)
    if tolerance.zone.outside is not None:
        _add(definition, "OuterDisposition", tolerance.zone.outside)
    if has_datums and tolerance.datums:
        _add(definition, "DatumReferenceFrameId", str(ids.frames[tolerance.datums.text()]))
    group = tolerance.characteristic.group
    form_of_size = group == "form" and tolerance.material != "RFS"
    if tolerance.type == "position" or group == "orientation" or form_of_size:
        _add(definition, "MaterialCondition", _MATERIAL[tolerance.material])
    if has_zone:
        flat = "PlanarZone" if group == "orientation" else "NonDiametricalZone"
        words = {"diameter": "DiametricalZone", "spherical_diameter": "SphericalZone"}
        _add(_add(definition, "ZoneShape"), words.get(tolerance.zone.shape, flat))


def _results(
    root: ElementTree.Element,
    ids: _Ids,
    verifications: Sequence[Verification],
    tolerances: list[Tolerance],
) -> None:
    results = _add(root, "Results")
    listed = _add(results, "MeasurementResultsSet", n=len(verifications))
    words = {item.id: _WORDS[item.type][0] for item in tolerances}
    for verification in verifications:
        one = _add(listed, "MeasurementResults", id=ids.fresh())
        found = dict(verification.evaluations)
        if words:
            measured = _add(_add(one, "MeasuredCharacteristics"), "CharacteristicMeasurements", n=len(words))
            for name, word in words.items():
                entry = _add(measured, f"{word}CharacteristicMeasurement", id=ids.fresh())
                _add(_add(entry, "Status"), "CharacteristicStatusEnum", _status(found.get(name)))
                _add(entry, "CharacteristicItemId", str(ids.items[name]))
                if name in found:
                    _add(entry, "Value", found[name].value)
        verdict = "UNDEFINED" if verification.unresolved else "PASS"
        if any(evaluation.ok is False for evaluation in found.values()):
            verdict = "FAIL"
        _add(_add(one, "InspectionStatus"), "InspectionStatusEnum", verdict)


def _status(found: Evaluation | None) -> str:
    if found is None:
        return "NOT_ANALYZED"
    return {True: "PASS", False: "FAIL", None: "INDETERMINATE"}[found.ok]
