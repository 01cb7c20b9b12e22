"""Results in QIF 3.0 (Quality Information Framework): probed features and what the file declares of them.

Read are points, edge points and circles with a point profile or a position: what a coordinate measuring
machine reports of a sheet-metal part. Everything else in the file is listed as not read, not dropped.

References
----------
ISO 23952:2020 (QIF 3.0).
"""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import ReadError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["QifCharacteristic", "QifPart", "QifResults", "read_qif"]

_NAMESPACE = "{http://qifstandards.org/xsd/qif3}"
_FEATURES = ("EdgePoint", "Point", "Circle")
_KINDS: dict[str, Literal["profile", "position"]] = {"PointProfile": "profile", "Position": "position"}


@dataclass(frozen=True, eq=False)
class QifCharacteristic:
    """One toleranced feature.

    Parameters
    ----------
    id : str
        Of the characteristic item.
    name : str
    kind : {"profile", "position"}
    tolerance : float
        Width of the profile zone (it lies half on each side), or diameter of the position zone [mm].
    feature : str
        Name of the feature.
    location : (3,) float
        Nominal place [mm].
    normal : (3,) float
        Nominal unit normal: of the surface, or of the plane of the circle.
    """

    id: str
    name: str
    kind: Literal["profile", "position"]
    tolerance: float
    feature: str
    location: Points
    normal: Vectors

    def deviation(self, measured: Points) -> float:
        """Return the signed distance along the normal (profile) or that in the plane (position) [mm]."""
        away = np.asarray(measured, dtype=np.float64) - self.location
        along = float(away @ self.normal)
        return along if self.kind == "profile" else float(np.linalg.norm(away - along * self.normal))

    def value(self, measured: Points) -> float:
        """Return what is compared with the tolerance [mm]: twice the deviation's amount (ISO 1101)."""
        return 2.0 * abs(self.deviation(measured))


@dataclass(frozen=True, eq=False)
class QifPart:
    """One measured part.

    Parameters
    ----------
    id : str
    measured : (c, 3) float
        Measured place of each characteristic's feature [mm]; NaN where the file has none.
    declared : str
        PASS or FAIL (or another word of the standard) of the whole part.
    reported : tuple of tuple of float
        The values that the file reports for each characteristic [mm].
    statuses : tuple of tuple of str
        The words that the file gives them.
    """

    id: str
    measured: Points
    declared: str
    reported: tuple[tuple[float, ...], ...]
    statuses: tuple[tuple[str, ...], ...]

    def __post_init__(self) -> None:
        """Freeze."""
        points = frozen(self.measured, shape=(None, 3), name="measured", finite=False)
        object.__setattr__(self, "measured", points)


@dataclass(frozen=True, eq=False)
class QifResults:
    """Measured parts of a QIF file.

    Parameters
    ----------
    characteristics : tuple of QifCharacteristic
    parts : tuple of QifPart
    not_read : tuple of str
        What the file has and this reader does not know, with its number.
    source : str
        File name.
    """

    characteristics: tuple[QifCharacteristic, ...]
    parts: tuple[QifPart, ...]
    not_read: tuple[str, ...]
    source: str

    def deviations(self) -> Floats:
        """Return `QifCharacteristic.deviation` of all parts (n, c) [mm]; NaN if missing."""
        return self._table("deviation")

    def values(self) -> Floats:
        """Return `QifCharacteristic.value` of all parts (n, c) [mm]; NaN if missing."""
        return self._table("value")

    def verdicts(self) -> tuple[str, ...]:
        """Return PASS, FAIL or UNDEFINED (something was not measured, the rest passes) of each part."""
        limits = np.array([one.tolerance for one in self.characteristics])
        words = []
        for row in self.values():
            failed = bool((row > limits).any())
            words.append("FAIL" if failed else "UNDEFINED" if np.isnan(row).any() else "PASS")
        return tuple(words)

    def _table(self, key: str) -> Floats:
        rows = [
            [getattr(one, key)(place) for one, place in zip(self.characteristics, part.measured, strict=True)]
            for part in self.parts
        ]
        return np.array(rows, dtype=np.float64).reshape(len(self.parts), len(self.characteristics))


def read_qif(path: str | Path) -> QifResults:
    """Read the measured parts of a QIF 3 file.

    Parameters
    ----------
    path : path

    Returns
    -------
    QifResults
        Lengths in mm, whatever the file's unit.

    Raises
    ------
    ReadError
        Not XML, not QIF 3, no results, or a reference to something that is not in the file.
    """
    file = Path(path)
    try:
        root = ElementTree.parse(file).getroot()
    except (OSError, ElementTree.ParseError) as error:
        raise ReadError(f"{file.name} cannot be read as QIF: {error}") from error
    if root.tag != _NAMESPACE + "QIFDocument":
        raise ReadError(f"{file.name} is not a QIF 3 document (its root is {root.tag!r})")
    millimetres = _unit(root)
    try:
        found = _characteristics(root, millimetres)
        results = root.iter(_NAMESPACE + "MeasurementResults")
        parts = tuple(_part(result, found, millimetres) for result in results)
    except (KeyError, AttributeError, ValueError) as error:
        raise ReadError(f"{file.name}: a reference or number is missing or wrong ({error!r})") from error
    if not parts:
        raise ReadError(f"{file.name} has no measurement results")
    return QifResults(tuple(one for one, _ in found), parts, _unread(root), file.name)


def _unit(root: ElementTree.Element) -> float:
    """Return millimetres per length unit of the file; QIF's default is the metre's conversion factor."""
    factor = root.find(f"{_NAMESPACE}FileUnits//{_NAMESPACE}LinearUnit//{_NAMESPACE}Factor")
    name = root.find(f"{_NAMESPACE}FileUnits//{_NAMESPACE}LinearUnit/{_NAMESPACE}UnitName")
    if factor is not None and factor.text:
        return 1000.0 * float(factor.text)
    return 1.0 if name is None or name.text == "mm" else {"m": 1000.0, "inch": 25.4}.get(str(name.text), 1.0)


def _characteristics(root: ElementTree.Element, mm: float) -> list[tuple[QifCharacteristic, str]]:
    """Characteristics with the id of their feature item, in the order of the file."""
    nominals = _by_id(root, "Features/FeatureNominals")
    items = _by_id(root, "Features/FeatureItems")
    definitions = _by_id(root, "Characteristics/CharacteristicDefinitions")
    middle = _by_id(root, "Characteristics/CharacteristicNominals")
    found = []
    for one in _by_id(root, "Characteristics/CharacteristicItems").values():
        kind = _KINDS.get(_word(one, "CharacteristicItem"))
        if kind is None:
            continue
        item = items[_text(one, "FeatureItemIds/Id")]
        if _word(item, "FeatureItem") not in _FEATURES:
            continue
        nominal = nominals[_text(item, "FeatureNominalId")]
        between = middle[_text(one, "CharacteristicNominalId")]
        definition = definitions[_text(between, "CharacteristicDefinitionId")]
        normal = _vector(nominal, "Normal")
        found.append(
            (
                QifCharacteristic(
                    id=one.attrib["id"],
                    name=_text(one, "Name"),
                    kind=kind,
                    tolerance=mm * float(_text(definition, "ToleranceValue")),
                    feature=_text(item, "FeatureName"),
                    location=mm * _vector(nominal, "Location"),
                    normal=normal / np.linalg.norm(normal),
                ),
                item.attrib["id"],
            )
        )
    return found


def _part(result: ElementTree.Element, found: list[tuple[QifCharacteristic, str]], mm: float) -> QifPart:
    places: dict[str, Points] = {}
    for feature in result.findall(f"{_NAMESPACE}MeasuredFeatures/*"):
        if feature.find(_NAMESPACE + "Location") is not None:
            places[_text(feature, "FeatureItemId")] = mm * _vector(feature, "Location")
    reported: dict[str, list[float]] = {}
    statuses: dict[str, list[str]] = {}
    for one in result.findall(
        f"{_NAMESPACE}MeasuredCharacteristics/{_NAMESPACE}CharacteristicMeasurements/*"
    ):
        key = _text(one, "CharacteristicItemId")
        value = one.find(_NAMESPACE + "Value")  # a characteristic that was not analysed has none
        reported.setdefault(key, []).append(
            float("nan") if value is None else mm * float(_text(one, "Value"))
        )
        statuses.setdefault(key, []).append(_text(one, "Status/CharacteristicStatusEnum"))
    return QifPart(
        id=result.attrib["id"],
        measured=np.array([places.get(item, np.full(3, np.nan)) for _, item in found]).reshape(-1, 3),
        declared=_text(result, "InspectionStatus/InspectionStatusEnum"),
        reported=tuple(tuple(reported.get(one.id, ())) for one, _ in found),
        statuses=tuple(tuple(statuses.get(one.id, ())) for one, _ in found),
    )


def _unread(root: ElementTree.Element) -> tuple[str, ...]:
    counts: dict[str, int] = {}
    for path, ending, known in (
        ("Characteristics/CharacteristicItems", "CharacteristicItem", tuple(_KINDS)),
        ("Features/FeatureItems", "FeatureItem", _FEATURES),
    ):
        for element in _by_id(root, path).values():
            word = _word(element, ending)
            if word not in known:
                counts[word + ending] = counts.get(word + ending, 0) + 1
    return tuple(f"{count} x {word}" for word, count in sorted(counts.items()))


def _by_id(root: ElementTree.Element, path: str) -> dict[str, ElementTree.Element]:
    inside = root.findall("/".join(_NAMESPACE + word for word in path.split("/")) + "/*")
    return {element.attrib["id"]: element for element in inside if "id" in element.attrib}


def _word(element: ElementTree.Element, ending: str) -> str:
    return element.tag.removeprefix(_NAMESPACE).removesuffix(ending)


def _text(element: ElementTree.Element, path: str) -> str:
    found = element.find("/".join(_NAMESPACE + word for word in path.split("/")))
    if found is None or found.text is None:
        raise KeyError(f"{path} of {element.tag.removeprefix(_NAMESPACE)} {element.attrib.get('id', '')}")
    return found.text.strip()


def _vector(element: ElementTree.Element, path: str) -> Floats:
    values = np.array(_text(element, path).split(), dtype=np.float64)
    if values.shape != (3,):
        raise ValueError(f"{path} has {values.size} numbers instead of three")
    return values
