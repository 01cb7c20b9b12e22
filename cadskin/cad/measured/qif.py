"""Results in QIF 2 and 3 (Quality Information Framework): probed features and what the file declares of them.

Points, edge points and circles with a point profile or a position are evaluated from their measured places:
what a coordinate measuring machine reports of a sheet-metal part. Of every other characteristic (diameters,
distances, form, orientation ...) the file holds a value and limits, and those are compared. What has neither
is listed as not read, not dropped.

References
----------
ISO 23952:2020 (QIF 3.0).
"""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import ReadError

if TYPE_CHECKING:
    from collections.abc import Callable

    from cadskin._typing import Floats, Points, Vectors

__all__ = ["QifCharacteristic", "QifPart", "QifResults", "read_qif"]

_NAMESPACE = re.compile(r"\{http://qifstandards\.org/xsd/qif[23]\}QIFDocument\Z")
Kind: TypeAlias = Literal["profile", "position", "reported"]
_FEATURES = ("EdgePoint", "Point", "Circle")
_KINDS: dict[str, Kind] = {"PointProfile": "profile", "Position": "position"}
_ANGLES = ("Angle", "AngleFrom", "AngleBetween", "AngularCoordinate")  # degrees or radians, as in the file


@dataclass(frozen=True, eq=False)
class QifCharacteristic:
    """One toleranced feature.

    Parameters
    ----------
    id : str
        Of the characteristic item.
    name : str
    kind : {"profile", "position", "reported"}
        The last: not evaluated from points; the reported value is compared with the limits.
    type : str
        QIF's word: ``PointProfile``, ``Diameter``, ``Flatness`` ...
    tolerance : float
        Width of the profile zone (it lies half on each side), or diameter of the position zone [mm]; for a
        reported one the width between the limits.
    lower, upper : float
        Limits of `value` [mm; angles as in the file]; infinite where there is none.
    feature : str
        Name of the feature.
    location : (3,) float
        Nominal place [mm]; NaN for a reported one.
    normal : (3,) float
        Nominal unit normal: of the surface, or of the plane of the circle.
    """

    id: str
    name: str
    kind: Kind
    type: str
    tolerance: float
    lower: float
    upper: float
    feature: str
    location: Points
    normal: Vectors

    def passes(self, value: float) -> bool:
        """Return whether a value lies inside the limits."""
        return self.lower <= value <= self.upper

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
        PASS or FAIL (or another word of the standard) of the whole part; empty where the file has none.
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
        """Return `QifCharacteristic.deviation` of all parts (n, c) [mm]; NaN if missing or only reported."""
        return self._table(
            lambda one, place, _: float("nan") if one.kind == "reported" else one.deviation(place)
        )

    def values(self) -> Floats:
        """Return `QifCharacteristic.value` of all parts (n, c) [mm]; NaN if missing.

        Of a characteristic that is only reported it is the reported value that is worst against the limits.
        """
        return self._table(
            lambda one, place, said: _worst(one, said) if one.kind == "reported" else one.value(place)
        )

    def verdicts(self) -> tuple[str, ...]:
        """Return PASS, FAIL or UNDEFINED (something was not measured, the rest passes) of each part."""
        words = []
        for row in self.values():
            known = np.isfinite(row)
            inside = [one.passes(value) for one, value in zip(self.characteristics, row, strict=True)]
            failed = bool((known & ~np.array(inside, dtype=bool)).any())
            words.append("FAIL" if failed else "UNDEFINED" if not known.all() else "PASS")
        return tuple(words)

    def _table(self, read: Callable[[QifCharacteristic, Points, tuple[float, ...]], float]) -> Floats:
        rows = [
            [read(*one) for one in zip(self.characteristics, part.measured, part.reported, strict=True)]
            for part in self.parts
        ]
        return np.array(rows, dtype=np.float64).reshape(len(self.parts), len(self.characteristics))


def _worst(one: QifCharacteristic, said: tuple[float, ...]) -> float:
    """Return the value that lies farthest out; NaN where one is missing or none was said."""
    if not said or np.isnan(said).any():
        return float("nan")
    return max(said, key=lambda value: max(one.lower - value, value - one.upper))


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
    if not _NAMESPACE.match(root.tag):
        raise ReadError(f"{file.name} is not a QIF 2 or QIF 3 document (its root is {root.tag!r})")
    for element in root.iter():
        if isinstance(element.tag, str):  # not a comment
            element.tag = element.tag.rpartition("}")[2]
    millimetres = _unit(root)
    try:
        found = _characteristics(root, millimetres)
        parts = tuple(_part(result, found, millimetres) for result in root.iter("MeasurementResults"))
    except (KeyError, AttributeError, ValueError) as error:
        raise ReadError(f"{file.name}: a reference or number is missing or wrong ({error!r})") from error
    if not parts:
        raise ReadError(f"{file.name} has no measurement results")
    return QifResults(tuple(one for one, _ in found), parts, _unread(root, found), file.name)


def _unit(root: ElementTree.Element) -> float:
    """Return millimetres per length unit of the file; QIF's default is the metre's conversion factor."""
    factor = root.find("FileUnits//LinearUnit//Factor")
    name = root.find("FileUnits//LinearUnit/UnitName")
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
        word = _word(one, "CharacteristicItem")
        between = middle[_text(one, "CharacteristicNominalId")]
        definition = definitions[_text(between, "CharacteristicDefinitionId")]
        item_id = one.findtext("FeatureItemIds/Id", "").strip()
        item = items[item_id] if item_id else None
        known = item is not None and _word(item, "FeatureItem") in _FEATURES
        kind = _KINDS.get(word, "reported") if known else "reported"
        scale = 1.0 if word in _ANGLES else mm
        limits = _limits(definition, between, kind, scale)
        if limits is None:
            continue
        place = np.full((2, 3), np.nan)
        if kind != "reported" and item is not None:
            nominal = nominals[_text(item, "FeatureNominalId")]
            normal = _vector(nominal, "Normal")
            place = np.array([mm * _vector(nominal, "Location"), normal / np.linalg.norm(normal)])
        found.append(
            (
                QifCharacteristic(
                    id=one.attrib["id"],
                    name=one.findtext("Name", "").strip(),
                    kind=kind,
                    type=word,
                    tolerance=limits[1] - max(limits[0], 0.0)
                    if kind != "reported"
                    else limits[1] - limits[0],
                    lower=limits[0],
                    upper=limits[1],
                    feature="" if item is None else item.findtext("FeatureName", "").strip(),
                    location=place[0],
                    normal=place[1],
                ),
                item_id,
            )
        )
    return found


def _limits(
    definition: ElementTree.Element, nominal: ElementTree.Element, kind: Kind, scale: float
) -> tuple[float, float] | None:
    """Return the least and the greatest value allowed; None where the definition has no tolerance."""
    width = definition.findtext("ToleranceValue")
    if width is not None:
        return (0.0 if kind == "reported" else -np.inf), scale * float(width)
    low, high = definition.findtext("Tolerance/MinValue"), definition.findtext("Tolerance/MaxValue")
    if low is None and high is None:
        return None
    as_limit = definition.findtext("Tolerance/DefinedAsLimit", "false").strip().lower() in ("true", "1")
    about = 0.0 if as_limit else float(_text(nominal, "TargetValue"))
    return (
        -np.inf if low is None else scale * (about + float(low)),
        np.inf if high is None else scale * (about + float(high)),
    )


def _part(result: ElementTree.Element, found: list[tuple[QifCharacteristic, str]], mm: float) -> QifPart:
    places: dict[str, Points] = {}
    for feature in result.findall("MeasuredFeatures/*"):
        if feature.find("Location") is not None:
            places[_text(feature, "FeatureItemId")] = mm * _vector(feature, "Location")
    reported: dict[str, list[float]] = {}
    statuses: dict[str, list[str]] = {}
    scales = {one.id: 1.0 if one.type in _ANGLES else mm for one, _ in found}
    for one in result.findall("MeasuredCharacteristics/CharacteristicMeasurements/*"):
        key = _text(one, "CharacteristicItemId")
        value = one.findtext("Value")  # a characteristic that was not analysed has none
        reported.setdefault(key, []).append(
            float("nan") if value is None else scales.get(key, mm) * float(value)
        )
        statuses.setdefault(key, []).append(one.findtext("Status/CharacteristicStatusEnum", "").strip())
    return QifPart(
        id=result.attrib["id"],
        measured=np.array([places.get(item, np.full(3, np.nan)) for _, item in found]).reshape(-1, 3),
        declared=result.findtext("InspectionStatus/InspectionStatusEnum", "").strip(),
        reported=tuple(tuple(reported.get(one.id, ())) for one, _ in found),
        statuses=tuple(tuple(statuses.get(one.id, ())) for one, _ in found),
    )


def _unread(root: ElementTree.Element, found: list[tuple[QifCharacteristic, str]]) -> tuple[str, ...]:
    """Characteristics without limits, and features that no characteristic that was read refers to."""
    read = {one.id for one, _ in found} | {item for _, item in found}
    counts: dict[str, int] = {}
    for path, ending in (
        ("Characteristics/CharacteristicItems", "CharacteristicItem"),
        ("Features/FeatureItems", "FeatureItem"),
    ):
        for key, element in _by_id(root, path).items():
            if key not in read and (
                ending == "CharacteristicItem" or _word(element, ending) not in _FEATURES
            ):
                word = _word(element, ending)
                counts[word + ending] = counts.get(word + ending, 0) + 1
    return tuple(f"{count} x {word}" for word, count in sorted(counts.items()))


def _by_id(root: ElementTree.Element, path: str) -> dict[str, ElementTree.Element]:
    return {element.attrib["id"]: element for element in root.findall(path + "/*") if "id" in element.attrib}


def _word(element: ElementTree.Element, ending: str) -> str:
    return element.tag.removesuffix(ending)


def _text(element: ElementTree.Element, path: str) -> str:
    found = element.findtext(path)
    if found is None:
        raise KeyError(f"{path} of {element.tag} {element.attrib.get('id', '')}")
    return found.strip()


def _vector(element: ElementTree.Element, path: str) -> Floats:
    values = np.array(_text(element, path).split(), dtype=np.float64)
    if values.shape != (3,):
        raise ValueError(f"{path} has {values.size} numbers instead of three")
    return values
