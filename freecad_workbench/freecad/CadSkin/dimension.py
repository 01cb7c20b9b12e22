"""The dimension of an imported file: sizes and distances with limits, which material requirements need."""

from __future__ import annotations

import json
from typing import Any

from .faces import check_faces, face_numbers, link_faces
from .objects import HIDDEN, READ_ONLY, SIGNATURE, STATUS, Field, Proxy, attach_view, extra_of, new_object

__all__ = ["TYPE", "DimensionProxy", "dimension_table", "make_dimension", "problem"]

TYPE = "CadSkinDimension"


class DimensionProxy(Proxy):
    """`App::FeaturePython` of a dimension; it is imported, not edited."""

    Type = TYPE
    GROUP = "Dimension"
    FIELDS = (
        Field("App::PropertyLinkSubGlobal", "Faces", "The faces that it measures"),
        Field("App::PropertyString", "Text", "The dimension", None, READ_ONLY),
        Field("App::PropertyString", "Extra", "Its values, as in a spec file (JSON)", "{}", HIDDEN),
        SIGNATURE,
        STATUS,
    )

    def problem(self, obj: Any) -> str | None:
        """Say why it cannot be used; None where it can."""
        return problem(obj)


def make_dimension(document: Any, part: Any, row: dict[str, Any]) -> Any:
    """Make a dimension of a table of the worker: ``{id, faces, extra}``."""
    with new_object(document, DimensionProxy, "Dimension") as obj:
        link_faces(obj, part, [f"Face{number}" for number in row["faces"]])
    obj.Extra = json.dumps(row["extra"], ensure_ascii=False)
    obj.Text = _text(row["extra"])
    obj.Label = f"{obj.Text} ({row['id']})"
    attach_view(obj, "view_dimension")
    return obj


def _text(values: dict[str, Any]) -> str:
    """Return what a dimension says, in words: ``size 8 H7``, ``distance 30 (29.9 to 30.2)``."""
    head = next(key for key in ("size", "distance", "angle", "angle_rad") if key in values)
    words = [head.replace("_rad", ""), str(values[head])]
    if "fit" in values:
        words.append(values["fit"])
    if "limits" in values:
        low, high = values["limits"]
        words.append(f"({low:g} to {high:g})")
    return " ".join(words)


def problem(obj: Any) -> str | None:
    """Say why a dimension cannot be used; None where it can."""
    return check_faces(obj)


def dimension_table(obj: Any) -> dict[str, Any]:
    """Return a dimension as the worker takes it."""
    return {"id": obj.Name, "faces": face_numbers(obj), "extra": extra_of(obj)}
