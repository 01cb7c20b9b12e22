"""The tolerance: faces, characteristic, value, datums, and what deviations its faces get."""

from __future__ import annotations

from typing import Any

from .faces import check_faces, face_numbers, link_faces, part_of, surfaces_of
from .kinds import CHARACTERISTICS, refusal
from .objects import EXTRA, SIGNATURE, STATUS, Field, Proxy, attach_view, extra_of, new_object, with_extra

__all__ = ["TYPE", "ToleranceProxy", "make_tolerance", "problem", "tolerance_table"]

TYPE = "CadSkinTolerance"


class ToleranceProxy(Proxy):
    """`App::FeaturePython` of a tolerance."""

    Type = TYPE
    GROUP = "Tolerance"
    FIELDS = (
        Field("App::PropertyLinkSubGlobal", "Faces", "The faces that the tolerance is on"),
        Field("App::PropertyEnumeration", "Characteristic", "What it bounds", list(CHARACTERISTICS)),
        Field("App::PropertyLength", "Value", "Width or diameter of the tolerance zone"),
        Field("App::PropertyBool", "Diameter", "The zone is round: the value is its diameter"),
        Field("App::PropertyString", "Datums", "Datum system: A|B-C|D(M)"),
        Field("App::PropertyStringList", "Modifiers", "CZ, free state, tangent plane, ..."),
        Field("App::PropertyString", "Model", "Deviation model: field, noise, field:kernel=matern32, ..."),
        Field("App::PropertyLength", "CorrelationLength", "Of the deviations; 0: a fifth of the part"),
        Field("App::PropertyFloat", "ZoneShare", "Standard deviation over value; 0: as the process allows"),
        EXTRA,
        SIGNATURE,
        STATUS,
    )

    def problem(self, obj: Any) -> str | None:
        """Say why it cannot be used; None where it can."""
        return problem(obj)


def make_tolerance(document: Any, part: Any, faces: Any, characteristic: str, value: float) -> Any:
    """Make a tolerance on faces of a part.

    Raises
    ------
    InputError
        See `faces.link_faces`; the document is left as it was.
    """
    with new_object(document, ToleranceProxy, "Tolerance") as obj:
        link_faces(obj, part, faces)
    obj.Characteristic = characteristic
    obj.Value = value
    obj.Label = characteristic.replace("_", " ").capitalize()
    attach_view(obj, "view_tolerance")
    obj.touch()
    return obj


def problem(obj: Any) -> str | None:
    """Say why a tolerance cannot be used; None where it can."""
    told = check_faces(obj)
    if told:
        return told
    name = obj.Characteristic
    told = refusal(name, surfaces_of(obj))
    if told:
        return told
    if obj.Value.Value <= 0 and not _zero_is_meant(obj):
        return "its value is 0; give one above 0"
    needs, has = CHARACTERISTICS[name].datums, bool(obj.Datums.strip())
    if needs == "always" and not has:
        return f"{name} needs a datum"
    if needs == "never" and has:
        return f"{name} has no datum; clear it"
    return _datum_problem(obj) or _model_problem(obj)


def _zero_is_meant(obj: Any) -> bool:
    return extra_of(obj).get("material") in ("MMR", "LMR")


def _datum_problem(obj: Any) -> str | None:
    from .datum import datum_of_letter, letters_in

    missing = [letter for letter in letters_in(obj.Datums) if datum_of_letter(part_of(obj), letter) is None]
    return f"there is no datum {', '.join(missing)} on {part_of(obj).Label}" if missing else None


def _model_problem(obj: Any) -> str | None:
    if obj.ZoneShare < 0 or obj.CorrelationLength.Value < 0:
        return "correlation length and share of the zone must not be negative"
    try:
        extra_of(obj)
    except ValueError:
        return "its further properties are no JSON table"
    return None


def tolerance_table(obj: Any) -> dict[str, Any]:
    """Return a tolerance as the worker takes it."""
    table: dict[str, Any] = {
        "id": obj.Name,
        "name": obj.Label,
        "characteristic": obj.Characteristic,
        "value": float(obj.Value.Value),
        "faces": face_numbers(obj),
    }
    if obj.Diameter:
        table["diameter"] = True
    if obj.Datums.strip():
        table["datums"] = obj.Datums.strip()
    if obj.Modifiers:
        table["modifiers"] = list(obj.Modifiers)
    wish = {
        "text": obj.Model.strip(),
        "length": float(obj.CorrelationLength.Value),
        "share": float(obj.ZoneShare),
    }
    asked = {key: value for key, value in wish.items() if value}
    if asked:
        table["deviation"] = asked
    return with_extra(table, obj)
