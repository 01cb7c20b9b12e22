"""Write a specification as a spec file (TOML)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from math import degrees, radians
from pathlib import Path
from typing import Any

from cadskin.errors import SpecificationError
from cadskin.spec.constructors import tolerance as construct
from cadskin.spec.datums import Datum, DatumTarget
from cadskin.spec.dimension import Dimension, clean_sum
from cadskin.spec.files import write_text_file
from cadskin.spec.fits import fit_deviations
from cadskin.spec.modifiers import TOLERANCE_MODIFIERS
from cadskin.spec.selection import FeatureSelection
from cadskin.spec.specification import FaceRecord, Specification, _with_ids
from cadskin.spec.tolerance import Tolerance
from cadskin.spec.toml_features import UNKNOWN
from cadskin.spec.toml_indicators import indicator_values
from cadskin.spec.zone import ToleranceZone

__all__ = ["to_toml", "write_spec"]

_BARE = re.compile(r"[A-Za-z0-9_\-]+\Z")
_ESCAPES = {'"': '\\"', "\\": "\\\\", "\n": "\\n", "\t": "\\t", "\r": "\\r", "\b": "\\b", "\f": "\\f"}
_HEAD = "# Tolerances for cadskin. Lengths in mm, angles in degrees; one line per tolerance.\n"


def to_toml(spec: Specification) -> str:
    """Return the text of a spec file that reads back as the same specification.

    Examples
    --------
    >>> from cadskin.spec import Specification, flatness
    >>> print(to_toml(Specification(flatness(">Z", 0.02))).splitlines()[-2].strip())
    {flatness = 0.02, on = ">Z"},
    """
    parts = [_HEAD]
    if spec.default is not None:
        pairs = _tolerance(spec.default, write_id=spec.default.id != "default")
        parts.append(f"default = {inline(pairs)}\n")
    parts.append(
        _array("tolerances", [_tolerance(item, write_id=flag) for item, flag in _id_flags(spec)], spec)
    )
    parts.append(_array("dimensions", [_dimension(item) for item in spec.dimensions]))
    unresolved = [{"entity": u.entity, "kind": u.kind, "reason": u.reason} for u in spec.unresolved]
    parts.append(_array("unresolved", unresolved))
    if spec.fingerprints:
        parts.append("# What the faces looked like, to find them again after another export.\n")
        parts[-1] += _array("fingerprints", [_fingerprint(record) for record in spec.fingerprints])
    if spec.datums:
        lines = [f"{_key(datum.letter)} = {_datum(datum)}" for datum in spec.datums]
        parts.append("[datums]\n" + "\n".join(lines) + "\n")
    return "\n".join(part for part in parts if part)


def write_spec(path: str | Path, spec: Specification) -> Path:
    """Write a spec file, at once or not at all.

    Raises
    ------
    ExportError
        The folder is missing, or nothing can be written there.
    """
    return write_text_file(path, to_toml(spec))


# -- TOML --------------------


def _text(value: str) -> str:
    escaped = "".join(
        _ESCAPES.get(char, char if char >= " " and char != "\x7f" else f"\\u{ord(char):04x}")
        for char in value
    )
    return f'"{escaped}"'


def _key(key: str) -> str:
    return key if _BARE.match(key) else _text(key)


def toml_value(value: Any) -> str:
    """Return a plain value as TOML on one line."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(int(value))
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, str):
        return _text(value)
    if isinstance(value, Mapping):
        return inline(value)
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(item) for item in value) + "]"
    raise SpecificationError(f"a spec file cannot hold {value!r}")


def inline(table: Mapping[str, Any]) -> str:
    """Return a table as TOML on one line; None is left out."""
    pairs = [f"{_key(key)} = {toml_value(value)}" for key, value in table.items() if value is not None]
    return "{" + ", ".join(pairs) + "}"


def _array(name: str, tables: list[dict[str, Any]], spec: Specification | None = None) -> str:
    if not tables:
        return ""
    notes = [item.notes for item in spec.tolerances] if spec is not None else [()] * len(tables)
    lines = []
    for table, said in zip(tables, notes, strict=True):
        lines += [f"  # {' '.join(note.split())}" for note in said]
        lines.append(f"  {inline(table)},")
    return "\n".join([f"{name} = [", *lines, "]\n"])


# -- the objects --------------------


def _id_flags(spec: Specification) -> list[tuple[Tolerance, bool]]:
    """Say of each tolerance whether its id must be written: numbered ids come back by themselves."""
    numbered = [re.fullmatch(rf"{item.type}-\d+", item.id) is not None for item in spec.tolerances]
    blank = tuple(
        replace(item, id="") if flag else item for item, flag in zip(spec.tolerances, numbered, strict=True)
    )
    same = [item.id for item in _with_ids(blank)] == [item.id for item in spec.tolerances]
    return [(item, not (flag and same)) for item, flag in zip(spec.tolerances, numbered, strict=True)]


def _feature(feature: FeatureSelection, *, derived: str = "none") -> dict[str, Any]:
    selectors: Any = feature.selectors[0] if len(feature.selectors) == 1 else list(feature.selectors) or None
    return {
        "on": selectors,
        "faces": list(feature.faces) or None,
        "step_faces": list(feature.step_faces) or None,
        "groups": [list(group) for group in feature.groups] or None,
        "derived": feature.derived if feature.derived != derived else None,
        "part": feature.part,
    }


def _tolerance(item: Tolerance, *, write_id: bool) -> dict[str, Any]:
    zone = item.zone
    # What the reader would assume without being told.
    assumed = construct(
        item.type,
        replace(item.feature, derived="none"),
        item.value,
        diameter=zone.shape == "diameter",
        spherical=zone.shape == "spherical_diameter",
    )
    return {
        item.type: UNKNOWN if item.value is None else item.value,
        **_feature(item.feature, derived=assumed.feature.derived),
        "datums": item.datums.text() or None,
        "diameter": True if zone.shape == "diameter" else None,
        "spherical": True if zone.shape == "spherical_diameter" else None,
        "material": item.material if item.material != "RFS" else None,
        "modifiers": [_modifier(name) for name in item.modifiers] or None,
        "scope": item.scope if item.scope != assumed.scope else None,
        **_zone(zone),
        **indicator_values(item.indicators),
        "id": item.id if write_id else None,
        "parent": item.parent,
        "name": item.name or None,
        "raw": [item.raw_value, item.raw_unit] if item.raw_value is not None and item.raw_unit else None,
        "standard": item.standard,
        "model": item.model,
        "policy": item.policy,
        "source": _kept_source(item.source),
    }


def _modifier(name: str) -> str:
    return name.lower() if name in TOLERANCE_MODIFIERS else f"AP242:{name}"


def _kept_source(source: str | None) -> str | None:
    """Keep where a tolerance comes from in a STEP file; a line of a spec file is told by the reader."""
    return source if source is not None and "#" in source else None


def _zone(zone: ToleranceZone) -> dict[str, Any]:
    area = zone.per_area
    return {
        "form": zone.form,
        "projected": zone.projected,
        "projected_offset": zone.projected_offset,
        "outside": zone.outside,
        "maximum": zone.maximum,
        "per_length": zone.per_length,
        "per_area": None if area is None else {"shape": area.shape, "size": area.size, "second": area.second},
        "combined": zone.combined,
        **_angle(zone.angle, "angle_deg", "angle_rad"),
    }


def _angle(value: float | None, in_degrees: str, in_radians: str) -> dict[str, Any]:
    """Write degrees where they read back as the same angle, else radians."""
    if value is None:
        return {}
    for candidate in (round(degrees(value), 9), degrees(value)):
        if radians(candidate) == value:
            return {in_degrees: candidate}
    return {in_radians: value}


def _datum(datum: Datum) -> str:
    pairs = _feature(datum.feature)
    targets = [_target(target) for target in datum.targets]
    pairs |= {"targets": targets or None, "source": _kept_source(datum.source)}
    given = {key: value for key, value in pairs.items() if value is not None}
    return toml_value(given["on"]) if set(given) == {"on"} else inline(given)


def _target(target: DatumTarget) -> dict[str, Any]:
    pairs = {
        "label": target.label,
        "kind": target.kind,
        "origin": target.origin,
        "axis": target.axis,
        "direction": target.direction,
        "length": target.length,
        "width": target.width,
        "diameter": target.diameter,
        **_feature(target.feature),
        "movable": True if target.movable else None,
    }
    return {key: value for key, value in pairs.items() if value is not None}


def _dimension(item: Dimension) -> dict[str, Any]:
    head, scale_back = _dimension_head(item)
    kinds = {"size": "size", "distance": "location"}
    has_second = item.second != FeatureSelection()
    assumed = kinds.get(head, "angular_location" if has_second else "angular_size")
    second = {key: value for key, value in _feature(item.second).items() if value is not None}
    return {
        head: UNKNOWN if item.nominal is None else scale_back(item.nominal),
        "name": item.name or None,
        **_feature(item.feature),
        "to": second["on"] if set(second) == {"on"} else second or None,
        "fit": item.fit,
        **_dimension_limits(item, scale_back),
        "qualifier": item.qualifier if item.qualifier != "none" else None,
        "modifiers": list(item.modifiers) or None,
        "raw_unit": item.raw_unit,
        "kind": item.kind if item.kind != assumed else None,
        "id": item.id,
        "source": _kept_source(item.source),
    }


def _dimension_head(item: Dimension) -> tuple[str, Any]:
    if not item.angular:
        return ("distance" if item.kind == "location" else "size"), float
    values = [value for value in (item.nominal, item.lower, item.upper) if value is not None]
    if all(radians(1.0) * degrees(value) == value and radians(degrees(value)) == value for value in values):
        return "angle", degrees
    return "angle_rad", float


def _dimension_limits(item: Dimension, scale_back: Any) -> dict[str, Any]:
    if item.fit is not None and item.nominal is not None:
        try:
            low, high = fit_deviations(item.nominal, item.fit)
        except SpecificationError:
            low = high = float("nan")
        if (item.lower, item.upper) == (clean_sum(item.nominal, low), clean_sum(item.nominal, high)):
            return {}
    if item.lower is not None and item.upper is not None:
        return {"limits": [scale_back(item.lower), scale_back(item.upper)]}
    return {
        "lower": None if item.lower is None else scale_back(item.lower),
        "upper": None if item.upper is None else scale_back(item.upper),
    }


def _fingerprint(record: FaceRecord) -> dict[str, Any]:
    found = record.fingerprint
    return {
        "face": record.face,
        "part": record.part,
        "kind": found.kind,
        "internal": True if found.internal else None,
        "area": found.area,
        "centre": found.centre,
        "normal": found.normal,
        "axis": found.axis,
        "radius": found.radius,
        "size": found.size,
    }
