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
from cadskin.spec.checks import enforce
from cadskin.spec.constructors import tolerance
from cadskin.spec.datums import Datum, DatumTarget
from cadskin.spec.indicators import INDICATOR_KINDS
from cadskin.spec.specification import FaceRecord, Specification, Unresolved
from cadskin.spec.tolerance import Scope, Tolerance
from cadskin.spec.toml_dimensions import read_dimension
from cadskin.spec.toml_features import FEATURE_KEYS, UNKNOWN, guarded, read_selection
from cadskin.spec.toml_indicators import read_indicators
from cadskin.spec.toml_lines import locate
from cadskin.spec.toml_table import SpecTable, Where
from cadskin.spec.zone import AreaUnit

__all__ = ["parse_spec", "read_spec"]

_TOP = ("datums", "tolerances", "dimensions", "default", "unresolved", "fingerprints")
_TOLERANCE_KEYS = (
    *FEATURE_KEYS,
    *("datums", "diameter", "spherical", "material", "modifiers", "scope", "value"),
    *("form", "projected", "projected_offset", "outside", "offset", "maximum", "per_length", "per_area"),
    *INDICATOR_KINDS,
    *(
        "combined",
        "angle_deg",
        "angle_rad",
        "id",
        "name",
        "parent",
        "raw",
        "standard",
        "model",
        "policy",
        "source",
    ),
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
        dimensions=tuple(read_dimension(item) for item in table.tables("dimensions")),
        default=_default(table),
        unresolved=tuple(_unresolved(item) for item in table.tables("unresolved")),
        fingerprints=tuple(_fingerprint(item) for item in table.tables("fingerprints")),
        checked=False,
    )
    table.finish(known)
    return _checked(spec)


def _checked(spec: Specification) -> Specification:
    known = spec.tolerances if spec.default is None else (*spec.tolerances, spec.default)
    from_step = any(item.id.startswith("#") for item in known)
    return spec.changed(notes=enforce(spec, lenient=from_step))


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
    feature = read_selection(item)
    zone = _zone_values(item)
    raw = item.raw("raw")
    if raw is not None and not (isinstance(raw, list) and len(raw) == 2 and isinstance(raw[1], str)):
        raise item.error(f"raw must be [number, unit], not {raw!r}", "raw")
    model = item.table("model")
    found: Tolerance = guarded(
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
        policy=item.text("policy"),
        source=item.text("source") or item.source,
        model=None if model is None else model.values,
        indicators=tuple(read_indicators(item)),
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
        found["per_area"] = guarded(table, AreaUnit, shape, size, second)
    elif area is not None:
        found["per_area"] = AreaUnit("square", item.as_number(area, "per_area"))
    return found


def _default(table: SpecTable) -> Tolerance | None:
    item = table.table("default")
    return None if item is None else _tolerance(item, *_characteristic_of(item), is_default=True)


# -- datums, unresolved, fingerprints --------------------


def _datums(table: SpecTable) -> Iterator[Datum]:
    section = table.table("datums")
    if section is None:
        return
    for letter, value in section.values.items():
        given = value if isinstance(value, dict) else {"on": value}
        item = SpecTable(given, (*section.path, letter), section.where)
        feature = read_selection(item)
        targets = tuple(_target(target, letter) for target in item.tables("targets"))
        source = item.text("source") or item.source
        item.finish((*FEATURE_KEYS, "targets", "source"))
        yield guarded(item, Datum, letter, feature, targets, source=source)


def _target(item: SpecTable, letter: str) -> DatumTarget:
    sizes = {key: item.number(key) for key in ("length", "width", "diameter")}
    frame = {key: item.numbers(key, 3) for key in ("origin", "axis", "direction")}
    found: DatumTarget = guarded(
        item,
        DatumTarget,
        label=item.text("label", letter),
        kind=item.text("kind", "point"),
        feature=read_selection(item),
        movable=bool(item.flag("movable")),
        **sizes,
        **frame,
    )
    item.finish((*FEATURE_KEYS, *sizes, *frame, "label", "kind", "movable"))
    return found


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
