"""Constructors, one per characteristic: ``flatness(top, 0.02)``, ``position(bore, 0.1, datums="A|B")``."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from cadskin.errors import SpecificationError
from cadskin.spec.characteristics import CHARACTERISTICS, characteristic
from cadskin.spec.datums import DatumSystem, as_datum_system
from cadskin.spec.dimension import Dimension, clean_sum
from cadskin.spec.fits import fit_deviations
from cadskin.spec.indicators import INDICATOR_KINDS, Indicator, as_indicator
from cadskin.spec.modifiers import MATERIAL_MODIFIERS, tolerance_modifier
from cadskin.spec.selection import Derived, FeatureSelector, as_selection
from cadskin.spec.tolerance import Material, Scope, Tolerance
from cadskin.spec.zone import AreaUnit, ToleranceZone, ZoneShape

__all__ = [
    "angularity",
    "circular_runout",
    "coaxiality",
    "concentricity",
    "cylindricity",
    "distance",
    "flatness",
    "line_profile",
    "parallelism",
    "perpendicularity",
    "position",
    "roundness",
    "size",
    "straightness",
    "surface_profile",
    "symmetry",
    "tolerance",
    "total_runout",
]

_MATERIALS: dict[str, Material] = {"RFS": "RFS", "S": "RFS", "MMR": "MMR", "MMC": "MMR", "M": "MMR"}
_MATERIALS |= {"Ⓜ": "MMR", "LMR": "LMR", "LMC": "LMR", "L": "LMR", "Ⓛ": "LMR"}


def as_material(text: str) -> Material:
    """Return ``RFS``, ``MMR`` or ``LMR`` of any of their usual names."""
    key = text.strip().upper()
    if key in _MATERIALS:
        return _MATERIALS[key]
    raise SpecificationError(f"material {text!r} is none of RFS, MMR (M), LMR (L)")


def tolerance(  # noqa: PLR0913
    type: str,
    on: FeatureSelector,
    value: float | None,
    *,
    datums: DatumSystem | str | Iterable[str] | None = None,
    diameter: bool = False,
    spherical: bool = False,
    material: str = "RFS",
    modifiers: Iterable[str] = (),
    derived: Derived | None = None,
    scope: Scope | None = None,
    **more: Any,
) -> Tolerance:
    """Make a tolerance of any characteristic.

    Parameters
    ----------
    type : str
        Name or alias of the characteristic.
    on : Feature, Face, int, str, or a list of those
        What it bounds; several features make a pattern. None for a general tolerance.
    value : float or None
        [mm].
    datums : str, list of str or DatumSystem
        ``"A|B-C|D(M)"``.
    diameter, spherical : bool
        The value is the diameter of a cylindrical, of a spherical zone.
    material : {"RFS", "MMR", "LMR"}
        Or ``M``, ``L``.
    modifiers : iterable of str
        AP242 names or short forms (``"CZ"``, ``"free state"``).
    derived : str, optional
        The derived feature it bounds; a diameter zone bounds the axis, a spherical one the centre point.
    scope : str, optional
        See `Tolerance`.
    **more
        ``projected=``, ``outside=``, ``offset=`` (ISO UZ), ``maximum=``, ``per_length=``, ``per_area=``,
        ``combined=`` of the zone; ``intersection_plane="parallel A"``, ``orientation_plane=``,
        ``direction_feature=``, ``collection_plane=``;
        ``id=``, ``name=``, ``parent=``, ``model=``, ``policy=``, ``standard=``.

    Raises
    ------
    SpecificationError
        A name or a value has no meaning.

    Examples
    --------
    >>> tolerance("circularity", "%CYLINDER", 0.01).type
    'roundness'
    """
    kind = characteristic(type).name
    words = [tolerance_modifier(word) for word in ([modifiers] if isinstance(modifiers, str) else modifiers)]
    stated = [MATERIAL_MODIFIERS[word] for word in words if word in MATERIAL_MODIFIERS]
    requirement = as_material(stated[0] if stated and material == "RFS" else material)
    shape: ZoneShape = "spherical_diameter" if spherical else "diameter" if diameter else "width"
    zone, rest = _zone(shape, value, more)
    if derived is None and shape != "width":
        derived = "axis" if shape == "diameter" else "centre_point"
    feature = as_selection(on, derived=derived)
    if scope is None:
        scope = "general" if not feature else "pattern" if _count(feature) > 1 else "feature"
    own = {
        key: rest.pop(key) for key in ("id", "name", "parent", "policy", "standard", "source") if key in rest
    }
    model = rest.pop("model", None)
    indicators = _indicators(rest)
    if rest:
        raise SpecificationError(f"{kind}: unknown argument {sorted(rest)[0]!r}")
    return Tolerance(
        id=str(own.pop("id", "")),
        type=kind,
        value=None if value is None else float(value),
        feature=feature,
        scope=scope,
        datums=as_datum_system(datums),
        material=requirement,
        modifiers=tuple(word for word in words if word not in MATERIAL_MODIFIERS),
        zone=zone,
        indicators=indicators,
        model=_plain(model) if model is not None else None,
        **own,
    )


def _count(feature: Any) -> int:
    return max(len(feature.groups), len(feature.selectors))


def _indicators(rest: dict[str, Any]) -> tuple[Indicator, ...]:
    found = list(rest.pop("indicators", ()))
    for kind in INDICATOR_KINDS:
        given = rest.pop(kind, None)
        if given is not None:
            found.append(given if isinstance(given, Indicator) else as_indicator(kind, given))
    return tuple(found)


def _plain(model: Any) -> Mapping[str, Any]:
    if not isinstance(model, Mapping):
        raise SpecificationError(f"the deviation model must be a table, not {model!r}")
    return dict(model)


def _zone(
    shape: ZoneShape, value: float | None, more: Mapping[str, Any]
) -> tuple[ToleranceZone, dict[str, Any]]:
    rest = dict(more)
    keys = (
        "form",
        "projected",
        "projected_offset",
        "outside",
        "maximum",
        "per_length",
        "per_area",
        "combined",
        "angle",
    )
    given = {key: rest.pop(key) for key in keys if key in rest}
    offset = rest.pop("offset", None)
    if offset is not None:
        if "outside" in given or value is None:
            raise SpecificationError("give either outside= (ASME Ⓤ) or offset= (ISO UZ), with a value")
        given["outside"] = ToleranceZone.outside_of_offset(value, float(offset))
    area = given.get("per_area")
    if isinstance(area, int | float):
        given["per_area"] = AreaUnit("square", float(area))
    return ToleranceZone(shape=shape, **given), rest


def _constructor(name: str) -> Callable[..., Tolerance]:
    facts = CHARACTERISTICS[name]

    def make(on: FeatureSelector, value: float | None, **options: Any) -> Tolerance:
        return tolerance(name, on, value, **options)

    make.__name__ = make.__qualname__ = name
    make.__doc__ = (
        f"Make a tolerance of {facts.iso} ({facts.symbol}); see `tolerance` for the arguments.\n\n"
        "Parameters\n----------\n"
        "on : Feature, Face, int, str, or a list of those\nvalue : float or None\n    [mm].\n"
        "**options\n    As of `tolerance`.\n"
    )
    return make


straightness = _constructor("straightness")
flatness = _constructor("flatness")
roundness = _constructor("roundness")
cylindricity = _constructor("cylindricity")
line_profile = _constructor("line_profile")
surface_profile = _constructor("surface_profile")
parallelism = _constructor("parallelism")
perpendicularity = _constructor("perpendicularity")
angularity = _constructor("angularity")
position = _constructor("position")
coaxiality = _constructor("coaxiality")
concentricity = _constructor("concentricity")
symmetry = _constructor("symmetry")
circular_runout = _constructor("circular_runout")
total_runout = _constructor("total_runout")


def size(
    on: FeatureSelector,
    nominal: float,
    limits: tuple[float, float] | None = None,
    *,
    fit: str | None = None,
    name: str = "diameter",
    id: str = "",
) -> Dimension:
    """Make a size dimension.

    Parameters
    ----------
    on : Feature, Face, int, str, or a list of those
    nominal : float
        [mm].
    limits : (float, float), optional
        Signed lower and upper deviation from the nominal [mm].
    fit : str, optional
        Tolerance class of ISO 286 (``"H7"``) instead of the limits.
    name : str
        ``diameter``, ``radius``, ``thickness``, ...

    Raises
    ------
    SpecificationError
        Both limits and a fit, or limits in the wrong order.

    Examples
    --------
    >>> size("%CYLINDER", 12.0, fit="H7").upper
    12.018
    """
    if fit is not None and limits is not None:
        raise SpecificationError(f"size {nominal:g}: give limits or a fit, not both")
    pair = fit_deviations(nominal, fit) if fit is not None else limits
    low, high = (None, None) if pair is None else (clean_sum(nominal, pair[0]), clean_sum(nominal, pair[1]))
    return Dimension(id, "size", name, float(nominal), low, high, as_selection(on), fit=fit)


def distance(
    first: FeatureSelector,
    second: FeatureSelector,
    nominal: float,
    limits: tuple[float, float] | None = None,
    *,
    name: str = "linear distance",
    id: str = "",
) -> Dimension:
    """Make a distance between two features; see `size` for the limits."""
    low, high = (
        (None, None) if limits is None else (clean_sum(nominal, limits[0]), clean_sum(nominal, limits[1]))
    )
    return Dimension(
        id, "location", name, float(nominal), low, high, as_selection(first), as_selection(second)
    )
