"""Read a spec file: tolerances that a person wrote in TOML."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any, get_args

from cadskin.errors import ReadError, SpecificationError
from cadskin.shape.fingerprint import FaceFingerprint
from cadskin.spec.characteristics import CHARACTERISTICS, characteristic
from cadskin.spec.constructors import tolerance
from cadskin.spec.datums import Datum, DatumTarget
from cadskin.spec.dimension import Dimension, clean_sum
from cadskin.spec.fits import fit_deviations
from cadskin.spec.selection import Derived, FeatureSelection
from cadskin.spec.specification import FaceRecord, Specification, Unresolved
from cadskin.spec.tolerance import Scope, Tolerance
from cadskin.spec.toml_lines import locate
from cadskin.spec.toml_table import SpecTable, Where
from cadskin.spec.zone import AreaUnit

__all__ = ["parse_spec", "read_spec"]

UNKNOWN = "?"
_TOP = ("datums", "tolerances", "dimensions", "default", "unresolved", "fingerprints")
_FEATURE_KEYS = ("on", "faces", "step_faces", "groups", "derived", "part")
_TOLERANCE_KEYS = (
    *_FEATURE_KEYS,
    *("datums", "diameter", "spherical", "material", "modifiers", "scope", "value"),
    *("form", "projected", "projected_offset", "outside", "offset", "maximum", "per_length", "per_area"),
    *("combined", "angle_deg", "angle_rad", "id", "name", "parent", "raw", "standard", "model", "source"),
)
_DIMENSION_KEYS = (
    *_FEATURE_KEYS,
    *("size", "distance", "angle", "angle_rad", "to", "name", "fit", "limits", "deviations", "plus_minus"),
    *("lower", "upper", "qualifier", "modifiers", "raw_unit", "kind", "id", "source"),
)
_MAX_BYTES = 16 << 20


def read_spec(path: str | Path) -> Specification:
    """Read a spec file.

    Parameters
    ----------
    path : str or Path
        A TOML file, ``part.spec.toml``.

    Returns
    -------
    Specification

    Raises
    ------
    ReadError
        No such file, or no TOML.
    SpecificationError
        A key is unknown (the message has its line and the nearest known key), a value has the wrong
        type, or the tolerances contradict each other.
    """
    file = Path(path)
    try:
        if file.stat().st_size > _MAX_BYTES:
            raise ReadError(f"{file.name} has more than {_MAX_BYTES >> 20} MiB: no spec file is that long")
        text = file.read_bytes().decode("utf-8")
    except OSError as error:
        raise ReadError(f"cannot read {file}: {error.strerror or error}") from error
    except UnicodeDecodeError as error:
        raise ReadError(f"{file.name} is no TOML file: it is not UTF-8 text ({error.reason})") from error
    return parse_spec(text, name=file.name)


def parse_spec(text: str, *, name: str = "spec") -> Specification:
    """Return the specification of the text of a spec file; see `read_spec`.

    Examples
    --------
    >>> spec = parse_spec('flatness = {value = 0.02, on = ">Z"}')
    >>> str(spec.tolerances[0])
    '⏥ 0.02'
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ReadError(f"{name} is no TOML file: {error}") from error
    except RecursionError as error:
        raise ReadError(f"{name}: brackets nested too deep") from error
    table = SpecTable(values, (), Where(name, locate(text)))
    known = (*_TOP, *CHARACTERISTICS)
    spec = Specification(
        *_tolerances(table),
        datums=tuple(_datums(table)),
        dimensions=tuple(_dimension(item) for item in table.tables("dimensions")),
        default=_default(table),
        unresolved=tuple(_unresolved(item) for item in table.tables("unresolved")),
        fingerprints=tuple(_fingerprint(item) for item in table.tables("fingerprints")),
        checked=False,
    )
    table.finish(known)
    return _checked(spec)


def _checked(spec: Specification) -> Specification:
    # What a STEP file left unresolved has been said; the rest must hold.
    return Specification(
        *spec.tolerances,
        datums=spec.datums,
        dimensions=spec.dimensions,
        default=spec.default,
        unresolved=spec.unresolved,
        fingerprints=spec.fingerprints,
        checked=not spec.unresolved and not any(_from_step(item) for item in spec.tolerances),
    )


def _from_step(item: Tolerance) -> bool:
    return bool(item.feature.step_faces) or item.id.startswith("#")


# -- features --------------------


def _selection(table: SpecTable) -> FeatureSelection:
    on = table.raw("on", [])
    selectors = on if isinstance(on, list) else [on]
    if not all(isinstance(item, int | str) and not isinstance(item, bool) for item in selectors):
        raise table.error(
            f"on must be a selector like '>Z', a face index, or a list of those, not {on!r}", "on"
        )
    groups = table.raw("groups", [])
    if not isinstance(groups, list) or not all(_is_indices(group) for group in groups):
        raise table.error(f"groups must be lists of face numbers, not {groups!r}", "groups")
    derived = table.text("derived", "none") or "none"
    if derived not in get_args(Derived):
        raise table.error(
            f"derived must be one of {', '.join(get_args(Derived))}, not {derived!r}", "derived"
        )
    found: FeatureSelection = _guarded(
        table,
        FeatureSelection,
        faces=table.indices("faces"),
        step_faces=table.indices("step_faces"),
        selectors=tuple(selectors),
        groups=tuple(tuple(group) for group in groups),
        derived=derived,
        part=table.text("part"),
    )
    return found


def _is_indices(group: Any) -> bool:
    return isinstance(group, list) and all(isinstance(x, int) and not isinstance(x, bool) for x in group)


def _guarded(table: SpecTable, make: Any, *args: Any, **values: Any) -> Any:
    """Make an object; put the line before what it complains about."""
    try:
        return make(*args, **values)
    except SpecificationError as error:
        raise table.error(str(error)) from None


# -- tolerances --------------------


def _tolerances(table: SpecTable) -> Iterator[Tolerance]:
    for key, value in table.values.items():
        if key == "tolerances":
            yield from _tolerance_section(table)
        elif key not in _TOP and _is_characteristic(key):
            yield from _named(table, key, value)


def _is_characteristic(key: str) -> bool:
    try:
        characteristic(key)
    except SpecificationError:
        return False
    return True


def _tolerance_section(table: SpecTable) -> Iterator[Tolerance]:
    if isinstance(table.values["tolerances"], list):
        for item in table.tables("tolerances"):
            yield _tolerance(item, *_characteristic_of(item))
        return
    section = table.table("tolerances")
    if section is not None:
        for key, value in section.values.items():
            if _is_characteristic(key):
                yield from _named(section, key, value)
        section.finish(CHARACTERISTICS)


def _named(table: SpecTable, key: str, value: Any) -> Iterator[Tolerance]:
    """Yield the tolerances of ``flatness = {value = 0.02, on = ">Z"}`` or of an array of such tables."""
    if isinstance(value, list):
        for item in table.tables(key):
            yield _tolerance(item, key, item.raw("value", UNKNOWN))
    else:
        found = table.table(key)
        if found is not None:
            yield _tolerance(found, key, found.raw("value", UNKNOWN))


def _characteristic_of(item: SpecTable) -> tuple[str, Any]:
    names = [key for key in item.values if key not in _TOLERANCE_KEYS and _is_characteristic(key)]
    if len(names) == 1:
        return names[0], item.raw(names[0])
    if len(names) > 1:
        raise item.error(f"one tolerance cannot be {' and '.join(names)}; write two")
    item.skip(_TOLERANCE_KEYS)
    item.finish((*CHARACTERISTICS, *_TOLERANCE_KEYS))
    raise item.error("this tolerance has no characteristic; write for example {flatness = 0.02, on = '>Z'}")


def _tolerance(item: SpecTable, name: str, value: Any, *, is_default: bool = False) -> Tolerance:
    if "value" in item.values and item.raw("value") is not value:
        raise item.error(
            f"give the value once: {name} = {value!r} and value = {item.raw('value')!r}", "value"
        )
    number = None if value == UNKNOWN else item.as_number(value, name)
    feature = _selection(item)
    zone = _zone_values(item)
    raw = item.raw("raw")
    if raw is not None and not (isinstance(raw, list) and len(raw) == 2 and isinstance(raw[1], str)):
        raise item.error(f"raw must be [number, unit], not {raw!r}", "raw")
    model = item.table("model")
    found: Tolerance = _guarded(
        item,
        tolerance,
        name,
        feature,
        number,
        datums=item.raw("datums"),
        diameter=bool(item.flag("diameter")),
        spherical=bool(item.flag("spherical")),
        material=item.text("material", "RFS"),
        modifiers=item.texts("modifiers"),
        derived=feature.derived if "derived" in item else None,
        scope=_scope(item),
        id=item.text("id", "default" if is_default else "") or "",
        name=item.text("name", "") or "",
        parent=item.text("parent"),
        standard=item.text("standard"),
        source=item.text("source") or item.source,
        model=None if model is None else model.values,
        **zone,
    )
    item.finish((*_TOLERANCE_KEYS, *CHARACTERISTICS))
    if raw is None:
        return found
    return replace(found, raw_value=item.as_number(raw[0], "raw"), raw_unit=raw[1])


def _scope(item: SpecTable) -> str | None:
    scope = item.text("scope")
    if scope is not None and scope not in get_args(Scope):
        raise item.error(f"scope must be one of {', '.join(get_args(Scope))}, not {scope!r}", "scope")
    return scope


def _zone_values(item: SpecTable) -> dict[str, Any]:
    keys = ("projected", "projected_offset", "outside", "offset", "maximum", "per_length")
    found: dict[str, Any] = {key: item.number(key) for key in keys if key in item}
    if "form" in item:
        found["form"] = item.text("form")
    if "combined" in item:
        found["combined"] = item.flag("combined")
    for key in ("angle_deg", "angle_rad"):
        if key in item:
            angle = item.number(key) or 0.0
            found["angle"] = radians(angle) if key == "angle_deg" else angle
    area = item.raw("per_area")
    if isinstance(area, dict):
        table = SpecTable(area, (*item.path, "per_area"), item.where)
        shape, size, second = table.text("shape", "square"), table.number("size"), table.number("second")
        table.finish(("shape", "size", "second"))
        found["per_area"] = _guarded(table, AreaUnit, shape, size, second)
    elif area is not None:
        found["per_area"] = AreaUnit("square", item.as_number(area, "per_area"))
    return found


def _default(table: SpecTable) -> Tolerance | None:
    item = table.table("default")
    return None if item is None else _tolerance(item, *_characteristic_of(item), is_default=True)


# -- datums, dimensions, unresolved --------------------


def _datums(table: SpecTable) -> Iterator[Datum]:
    section = table.table("datums")
    if section is None:
        return
    for letter, value in section.values.items():
        given = value if isinstance(value, dict) else {"on": value}
        item = SpecTable(given, (*section.path, letter), section.where)
        feature = _selection(item)
        targets = tuple(_target(target, letter) for target in item.tables("targets"))
        source = item.text("source") or item.source
        item.finish((*_FEATURE_KEYS, "targets", "source"))
        yield _guarded(item, Datum, letter, feature, targets, source=source)


def _target(item: SpecTable, letter: str) -> DatumTarget:
    sizes = {key: item.number(key) for key in ("length", "width", "diameter")}
    frame = {key: item.numbers(key, 3) for key in ("origin", "axis", "direction")}
    found: DatumTarget = _guarded(
        item,
        DatumTarget,
        label=item.text("label", letter),
        kind=item.text("kind", "point"),
        feature=_selection(item),
        movable=bool(item.flag("movable")),
        **sizes,
        **frame,
    )
    item.finish((*_FEATURE_KEYS, *sizes, *frame, "label", "kind", "movable"))
    return found


def _dimension(item: SpecTable) -> Dimension:
    heads = [key for key in ("size", "distance", "angle", "angle_rad") if key in item]
    if len(heads) != 1:
        item.skip(_DIMENSION_KEYS)
        item.finish(_DIMENSION_KEYS)
        raise item.error("a dimension is one of size = ..., distance = ..., angle = ... (degrees)")
    head = heads[0]
    to = item.raw("to")
    second = SpecTable(
        to if isinstance(to, dict) else {"on": [] if to is None else to}, (*item.path, "to"), item.where
    )
    kinds = {"size": "size", "distance": "location"}
    kind = item.text("kind") or kinds.get(head, "angular_location" if to is not None else "angular_size")
    scale = radians(1.0) if head == "angle" else 1.0
    value = item.raw(head)
    nominal = None if value == UNKNOWN else _scaled(item.as_number(value, head), head)
    fit = item.text("fit")
    low, high = _limits(item, nominal, fit, scale)
    found: Dimension = _guarded(
        item,
        Dimension,
        id=item.text("id", "") or "",
        kind=kind,
        name=item.text("name", "") or "",
        nominal=nominal,
        lower=low,
        upper=high,
        feature=_selection(item),
        second=_selection(second),
        fit=fit,
        qualifier=item.text("qualifier", "none"),
        modifiers=item.texts("modifiers"),
        raw_unit=item.text("raw_unit"),
        source=item.text("source") or item.source,
    )
    second.finish(_FEATURE_KEYS)
    item.finish(_DIMENSION_KEYS)
    return found


def _scaled(value: float, head: str) -> float:
    return radians(value) if head == "angle" else value


def _limits(
    item: SpecTable, nominal: float | None, fit: str | None, scale: float
) -> tuple[float | None, float | None]:
    ways = [key for key in ("limits", "deviations", "plus_minus") if key in item]
    single = [key for key in ("lower", "upper") if key in item]
    if len(ways) + bool(single) > 1:
        raise item.error(f"give the limits once, not as {' and '.join([*ways, *single])}")
    if single:
        low, high = item.number("lower"), item.number("upper")
        return (None if low is None else low * scale), (None if high is None else high * scale)
    if not ways:
        if fit is None or nominal is None:
            return None, None
        pair = _guarded(item, fit_deviations, nominal, fit)
        return clean_sum(nominal, pair[0]), clean_sum(nominal, pair[1])
    if ways == ["limits"]:
        limits = item.numbers("limits", 2)
        return (None, None) if limits is None else (limits[0] * scale, limits[1] * scale)
    if nominal is None:
        raise item.error(f"{ways[0]} needs a nominal value")
    if ways == ["plus_minus"]:
        half = item.number("plus_minus") or 0.0
        return clean_sum(nominal, -half * scale), clean_sum(nominal, half * scale)
    deviations = item.numbers("deviations", 2) or (0.0, 0.0)
    return clean_sum(nominal, deviations[0] * scale), clean_sum(nominal, deviations[1] * scale)


def _unresolved(item: SpecTable) -> Unresolved:
    found = Unresolved(
        item.text("entity", "") or "", item.text("kind", "") or "", item.text("reason", "") or ""
    )
    item.finish(("entity", "kind", "reason"))
    return found


def _fingerprint(item: SpecTable) -> FaceRecord:
    faces = item.indices("face")
    numbers = {key: item.number(key) for key in ("area", "radius", "size")}
    vectors = {key: item.numbers(key, 3) for key in ("centre", "normal", "axis")}
    if len(faces) != 1 or numbers["area"] is None or vectors["centre"] is None or vectors["normal"] is None:
        raise item.error("a fingerprint needs face, area, centre and normal")
    kind, internal, part = item.text("kind", "other"), item.flag("internal"), item.text("part")
    item.finish(("face", "part", "kind", "internal", *numbers, *vectors))
    values: dict[str, Any] = {"kind": kind, "internal": bool(internal), **numbers, **vectors}
    return FaceRecord(part, faces[0], FaceFingerprint(**values))
