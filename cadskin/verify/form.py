"""Form: straightness, flatness, roundness, cylindricity, and the forms of sphere, cone and torus.

References
----------
.. [1] ISO 1101:2017 (zones), ISO 12780, 12781, 12181, 12180 (reference elements and parameters t, p, v, q).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Association, Kind, associate
from cadskin.verify.evaluation import Evaluation, active_of

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors

__all__ = [
    "FORMS",
    "FormCharacteristic",
    "Parameter",
    "Reference",
    "cylindricity",
    "flatness",
    "form",
    "roundness",
    "straightness",
]

Reference: TypeAlias = Literal["MZ", "LS", "MC", "MI", "GE", "GI"]
Parameter: TypeAlias = Literal["t", "p", "v", "q"]
FormCharacteristic: TypeAlias = Literal[
    "straightness", "flatness", "roundness", "cylindricity", "sphericity", "conicity", "toricity"
]

_CRITERION = {
    "MZ": "minimum zone",
    "LS": "least squares",
    "MC": "minimum circumscribed",
    "MI": "maximum inscribed",
    "GE": "constrained least squares",
    "GI": "constrained least squares, inside",
}


_SIDED = ("GE", "GI")  # with a material constraint: for every feature but a line in space


@dataclass(frozen=True)
class _Form:
    """Symbol and reference suffix of ISO, kind of the feature, references that exist."""

    symbol: str
    suffix: str
    kind: Kind
    references: tuple[Reference, ...]


FORMS: dict[str, _Form] = {
    "straightness": _Form("STR", "LI", "profile line", ("MZ", "LS")),
    "flatness": _Form("FLT", "PL", "plane", ("MZ", "LS")),
    "roundness": _Form("RON", "CI", "circle", ("MZ", "LS", "MC", "MI")),
    "cylindricity": _Form("CYL", "CY", "cylinder", ("MZ", "LS", "MC", "MI")),
    "sphericity": _Form("SPH", "SP", "sphere", ("MZ", "LS", "MC", "MI")),
    "conicity": _Form("CON", "CO", "cone", ("MZ", "LS")),
    "toricity": _Form("TOR", "TO", "torus", ("MZ", "LS")),
}


def form(
    points: Points,
    characteristic: FormCharacteristic,
    *,
    reference: Reference = "MZ",
    parameter: Parameter = "t",
    median: bool = False,
    axis: Vectors | None = None,
    section_normal: Vectors | None = None,
    limit: float | None = None,
) -> Evaluation:
    """Evaluate a form deviation of extracted points.

    Parameters
    ----------
    points : (n, 3) float
    characteristic : str
    reference : {"MZ", "LS", "MC", "MI", "GE", "GI"}
        Reference element: minimum zone (the default of ISO 1101), least squares, minimum circumscribed,
        maximum inscribed, least squares outside or inside of the material (which lies against ``axis``, or
        within a round feature).
    parameter : {"t", "p", "v", "q"}
        Peak to valley, peak to reference, reference to valley, root mean square.
    median : bool
        Straightness of a line in space (a median line): the zone is a cylinder, its diameter the value.
    axis : (3,) float, optional
        Direction that is counted as outward; a guess of the axis of a cylinder or cone.
    section_normal : (3,) float, optional
        Normal of the section of a circle or a line in a plane.
    limit : float, optional
        The tolerance [mm].

    Raises
    ------
    AssociationError, GeometryError, SpecificationError

    Examples
    --------
    >>> found = form([[0, 0, 0], [10, 0, 0.1], [10, 10, 0], [0, 10, 0.1]], "flatness", limit=0.2)
    >>> round(found.value, 12), found.quantity, found.ok
    (0.1, 'FLTt (MZPL)', True)
    """
    entry = _entry(characteristic, reference)
    kind: Kind = "line" if median else entry.kind
    found = associate(points, kind, _CRITERION[reference], axis=axis, section_normal=section_normal)
    value = parameter_of(found, parameter)
    return Evaluation(
        characteristic=characteristic,
        value=value,
        quantity=f"{entry.symbol}{parameter} ({reference}{'' if reference in _SIDED else entry.suffix})",
        certified=found.certified,
        n_points=found.n_points,
        limit=limit,
        zone=_zone(found, characteristic, value),
        active=active_of(found),
        operations=("extraction: the given points", "filtration: none", f"association: {found.criterion}"),
        details={"unique": found.unique, "scope": found.certificate.scope, "kkt": found.certificate.kkt},
        notes=(found.certificate.reason,),
    )


def _entry(characteristic: str, reference: str) -> _Form:
    entry = FORMS.get(characteristic)
    if entry is None:
        raise SpecificationError(f"{characteristic!r} is not a form; choose one of {', '.join(FORMS)}")
    if reference not in (*entry.references, *_SIDED):
        raise SpecificationError(
            f"{characteristic} has no reference element {reference!r}; choose one of "
            f"{', '.join((*entry.references, *_SIDED))}"
        )
    return entry


def parameter_of(found: Association, parameter: Parameter) -> float:
    """Return a form parameter of ISO 12781 and its sisters from the residuals of an association [mm]."""
    if found.kind == "line":
        radius = found.residuals
        if found.criterion == "minimum zone" and parameter == "t":
            return found.value
        value = {"t": 2 * radius.max(), "p": radius.max(), "q": np.sqrt((radius**2).mean())}.get(parameter)
        if value is None:
            raise SpecificationError("the straightness of a line in space has no valley parameter v")
        return float(value)
    if parameter == "t":
        return found.value if found.criterion == "minimum zone" else found.width
    if parameter == "p":
        return float(found.residuals.max())
    if parameter == "v":
        return float(-found.residuals.min())
    return float(np.sqrt((found.residuals**2).mean()))


def _zone(found: Association, characteristic: str, width: float) -> dict[str, Any]:
    shapes = {
        "line": "cylinder",
        "profile line": "two parallel lines",
        "plane": "two parallel planes",
        "circle": "two concentric circles",
        "cylinder": "two coaxial cylinders",
        "sphere": "two concentric spheres",
        "cone": "two equidistant cones",
        "torus": "two equidistant tori",
    }
    place: dict[str, Any] = {"kind": shapes[found.kind], "width": width, "characteristic": characteristic}
    feature = found.feature
    for name in ("origin", "normal", "axis", "direction", "centre", "apex", "radius", "half_angle"):
        value = getattr(feature, name, None)
        if value is not None:
            place[name] = value.tolist() if isinstance(value, np.ndarray) else value
    return place


def straightness(points: Points, *, median: bool = False, **options: Any) -> Evaluation:
    """Evaluate the straightness of a surface line, or of a median line; see `form`."""
    return form(points, "straightness", median=median, **options)


def flatness(points: Points, **options: Any) -> Evaluation:
    """Evaluate the flatness of a plane; see `form`."""
    return form(points, "flatness", **options)


def roundness(points: Points, **options: Any) -> Evaluation:
    """Evaluate the roundness of a section; see `form`."""
    return form(points, "roundness", **options)


def cylindricity(points: Points, **options: Any) -> Evaluation:
    """Evaluate the cylindricity of a cylinder; see `form`."""
    return form(points, "cylindricity", **options)
