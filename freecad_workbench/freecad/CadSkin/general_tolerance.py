"""The general tolerance: it holds on every face that has no tolerance of its own."""

from __future__ import annotations

from typing import Any

from .faces import InputError, part_problem, whole_part
from .objects import EXTRA, STATUS, Field, Proxy, attach_view, new_object, objects_of, with_extra

__all__ = ["TYPE", "GeneralProxy", "general_of", "general_table", "make_general", "problem"]

TYPE = "CadSkinGeneral"
_KINDS = ["surface_profile", "flatness", "straightness", "roundness", "cylindricity"]


class GeneralProxy(Proxy):
    """`App::FeaturePython` of a general tolerance."""

    Type = TYPE
    GROUP = "Tolerance"
    FIELDS = (
        Field("App::PropertyLinkGlobal", "Part", "The part that it is for"),
        Field("App::PropertyEnumeration", "Characteristic", "What it bounds", _KINDS),
        Field("App::PropertyLength", "Value", "Width of the tolerance zone"),
        EXTRA,
        STATUS,
    )

    def problem(self, obj: Any) -> str | None:
        """Say why it cannot be used; None where it can."""
        return problem(obj)


def make_general(document: Any, part: Any, value: float, characteristic: str = "surface_profile") -> Any:
    """Make the general tolerance of a part, or change the one that it has.

    Raises
    ------
    InputError
        The part cannot be worked with, or the value is not above 0.
    """
    part = whole_part(part)
    told = part_problem(part)
    if told:
        raise InputError(told)
    if not value > 0:
        raise InputError(f"the general tolerance must be above 0, got {value:g} mm")
    if characteristic not in _KINDS:
        raise InputError(f"a general tolerance is one of {', '.join(_KINDS)}, not {characteristic}")
    obj = general_of(part)
    if obj is None:
        with new_object(document, GeneralProxy, "GeneralTolerance") as obj:
            obj.Part = part
        obj.Label = "General tolerance"
        attach_view(obj, "view_tolerance")
    obj.Characteristic = characteristic
    obj.Value = value
    obj.touch()
    return obj


def general_of(part: Any) -> Any:
    """Return the general tolerance of a part; None where it has none."""
    return next((obj for obj in objects_of(part.Document, TYPE) if obj.Part == part), None)


def problem(obj: Any) -> str | None:
    """Say why it cannot be used; None where it can."""
    told = part_problem(obj.Part)
    if told:
        return told
    return None if obj.Value.Value > 0 else "its value is 0; give one above 0"


def general_table(obj: Any) -> dict[str, Any]:
    """Return it as the worker takes it."""
    return with_extra({"characteristic": obj.Characteristic, "value": float(obj.Value.Value)}, obj)
