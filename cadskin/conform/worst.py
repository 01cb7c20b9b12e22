"""The worst part: the deviations inside all zones that make a linear measure largest, by linear programming.

Every zone is a set of linear inequalities in the deviations and a few motions: the surface lies within half
the tolerance of its nominal place after any motion that the datums leave free (form: all of them, and the
size of a cylinder). Features that are datums keep their nominal shape, so that the datum system stands still;
what they could add is left out, and the result is a lower bound where datums may vary.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import csr_array, hstack, vstack

from cadskin.conform.blocks import independent_blocks
from cadskin.conform.bound import bound_part
from cadskin.conform.policy import policies_of
from cadskin.conform.requirements import requirements_of, value_of, welded_part
from cadskin.conform.sizes import SizeLimits
from cadskin.deviation import WhiteNoise
from cadskin.errors import ConformityError
from cadskin.shape.ideal import Cylinder, Plane
from cadskin.skin.model import SkinModel
from cadskin.skin.provenance import provenance_of
from cadskin.verify.extraction import MadePart
from cadskin.verify.part_datums import placement

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Bools, Floats, Ints
    from cadskin.conform.requirements import Requirement
    from cadskin.shape import Feature, NominalModel
    from cadskin.spec import Specification

__all__ = ["WorstPart", "worst_part"]

_MARGIN = 1e-7  # the zones are narrowed by this part, for what is not linear
_FREEDOMS = ("tx", "ty", "tz", "rx", "ry", "rz")


@dataclass(frozen=True, eq=False)
class WorstPart:
    """A part at the edge of its tolerances.

    Parameters
    ----------
    skin : SkinModel
    value : float
        The measure of it, ``weights @ deviation``.
    left_out : tuple of (str, str)
        Tolerances that are no linear zone here, and why; the part was evaluated against them all the same.
    """

    skin: SkinModel
    value: float
    left_out: tuple[tuple[str, str], ...]


def worst_part(nominal: NominalModel, spec: Specification, weights: Floats) -> WorstPart:
    """Return the conforming part with the largest value of a linear measure.

    Parameters
    ----------
    nominal : NominalModel
    spec : Specification
    weights : (n_c,) float
        The measure is ``weights @ deviation``; see `cadskin.conform.measures`.

    Raises
    ------
    ConformityError
        The tolerances do not bound the measure; the message names a feature that is free. Or the part does
        not pass the evaluation.

    Examples
    --------
    >>> import cadquery as cq, cadskin as cs
    >>> from cadskin.conform.measures import measure
    >>> part = cs.nominal(cq.Workplane().box(20, 20, 4), edge_length=5.0)
    >>> spec = cs.Specification(cs.surface_profile(">Z", 0.2, datums="A"), datums={"A": "<Z"})
    >>> round(worst_part(part, spec, measure("mean(>Z)", part)).value, 6)
    0.1
    """
    part = bound_part(spec, nominal)
    bound = part.spec
    blocks = independent_blocks(nominal, WhiteNoise(1.0))
    requirements, unsupported = requirements_of(
        nominal, bound, blocks, policies_of({"*": "conditioned"}, bound), like=part.pattern
    )
    fixed = _datum_rows(nominal, bound)
    zones, left_out = [], [(item.tolerance, item.reason) for item in unsupported]
    for item in requirements:
        found = _zone(item, nominal, bound)
        if isinstance(found, str):
            left_out.append((item.tolerance.id, found))
        else:
            zones.append(found)
    deviation = _solve(nominal, np.asarray(weights, dtype=np.float64), zones, fixed)
    _confirm(nominal, bound, requirements, deviation)
    provenance = provenance_of(nominal, "worst part by linear programming", None)
    skin = SkinModel(nominal, deviation, provenance)
    return WorstPart(skin, float(weights @ deviation), tuple(left_out))


@dataclass(frozen=True, eq=False)
class _Zone:
    """``low <= deviation[rows] - motions @ m <= high``."""

    rows: Ints
    motions: Floats
    low: float
    high: float


def _datum_rows(nominal: NominalModel, spec: Specification) -> Bools:
    """Mark the samples (n_c,) of features that are datums of some tolerance."""
    fixed = np.zeros(nominal.n_samples, dtype=bool)
    used = {letter for tolerance in spec for letter in tolerance.datums.letters}
    for letter in used:
        datum = spec.datum(letter)
        for selection in (datum.feature, *(target.feature for target in datum.targets)):
            for face in selection.faces:
                fixed[nominal.feature_of(face).rows] = True
    return fixed


def _zone(item: Requirement, nominal: NominalModel, spec: Specification) -> _Zone | str:
    """Return the linear zone of a requirement, or why it has none."""
    tolerance = item.tolerance
    if isinstance(tolerance, SizeLimits):
        return _size_zone(tolerance, nominal)
    features = {nominal.feature_of(face).id: nominal.feature_of(face) for face in tolerance.feature.faces}
    group = tolerance.characteristic.group
    if tolerance.material != "RFS":
        return "a material requirement is no linear zone"
    if tolerance.feature.derived not in ("none", "line_element") or tolerance.zone.shape != "width":
        return "the zone of a derived feature is not supported"
    chosen = tuple(features.values())
    half = 0.5 * item.limit
    motions = _rigid(chosen, np.zeros(3), np.eye(3))
    if tolerance.type == "flatness" and all(isinstance(f.ideal, Plane) for f in chosen):
        return _Zone(_rows(chosen), motions, -half, half)
    if tolerance.type == "cylindricity" and all(isinstance(f.ideal, Cylinder) for f in chosen):
        return _Zone(_rows(chosen), np.column_stack([motions, np.ones(len(motions))]), -half, half)
    if tolerance.type not in ("surface_profile", "position", "parallelism", "perpendicularity", "angularity"):
        return f"{tolerance.type} is not supported"
    if tolerance.type != "surface_profile" and not all(isinstance(f.ideal, Plane) for f in chosen):
        return f"{tolerance.type} of a {chosen[0].kind} is not supported"
    if group == "location" and len(chosen) > 1:
        return "a median surface is not supported"
    place = placement(MadePart(nominal.surface, nominal), tolerance, spec, "ISO 5459:2011")
    free = [_FREEDOMS.index(name) for name in place.free]
    if group == "orientation":
        free = sorted({0, 1, 2, *free})
    motions = _rigid(chosen, place.frame.origin, place.frame.axes)[:, free]
    low, high = tolerance.zone.bounds(item.limit) if group == "profile" else (-half, half)
    return _Zone(_rows(chosen), motions, low, high)


def _size_zone(limits: SizeLimits, nominal: NominalModel) -> _Zone | str:
    """Return the zone that keeps every local size within its limits: each radius keeps to half of them."""
    features = [nominal.feature_of(face) for face in limits.feature.faces]
    chosen = tuple({feature.id: feature for feature in features}.values())
    if len(chosen) > 1:
        return "a size of several cylinders is not supported"
    middle = limits.offset(chosen[0])
    half = limits.value * (1.0 if limits.dimension.name == "radius" else 0.5)
    return _Zone(_rows(chosen), _rigid(chosen, np.zeros(3), np.eye(3)), middle - half, middle + half)


def _rows(features: Sequence[Feature]) -> Ints:
    return np.concatenate([np.arange(feature.start, feature.stop) for feature in features])


def _rigid(features: Sequence[Feature], origin: Floats, axes: Floats) -> Floats:
    """Distance that a small motion of the frame adds at each sample (k, 6): three shifts, three turns."""
    points = (np.concatenate([feature.points for feature in features]) - origin) @ axes
    normals = np.concatenate([feature.normals for feature in features]) @ axes
    return np.concatenate([normals, np.cross(points, normals)], axis=1)


def _solve(nominal: NominalModel, weights: Floats, zones: Sequence[_Zone], fixed: Bools) -> Floats:
    """Maximise ``weights @ deviation`` over the zones; return the deviations (n_c,)."""
    from scipy.optimize import linprog

    count, used = nominal.n_samples, weights != 0.0
    covered = np.zeros(count, dtype=bool)
    sides, bounds, extra = [], [], 0
    total = sum(zone.motions.shape[1] for zone in zones)
    for zone in zones:
        k = len(zone.rows)
        covered[zone.rows] = True
        pick = csr_array((np.ones(k), (np.arange(k), zone.rows)), shape=(k, count))
        scale = np.maximum(np.abs(zone.motions).max(axis=0), 1e-12)
        free = np.zeros((k, total))
        free[:, extra : extra + zone.motions.shape[1]] = -zone.motions / scale
        extra += zone.motions.shape[1]
        block = hstack([pick, csr_array(free)])
        sides += [block, -block]
        bounds += [np.full(k, zone.high * (1 - _MARGIN)), np.full(k, -zone.low * (1 - _MARGIN))]
    _refuse_free(nominal, used & ~covered & ~fixed)
    limits = [(0.0, 0.0) if fixed[i] or not covered[i] else (None, None) for i in range(count)]
    size = float(np.abs(weights).max(initial=0.0)) or 1.0
    found = linprog(
        -np.concatenate([weights / size, np.zeros(total)]),
        A_ub=vstack(sides).tocsr() if sides else None,
        b_ub=np.concatenate(bounds) if bounds else None,
        bounds=[*limits, *[(None, None)] * total],
        method="highs",
    )
    if found.status == 3:
        names = [f.name for f in nominal.features if used[f.rows].any()]
        raise ConformityError(
            f"the tolerances do not bound the measure on {', '.join(names)}: form alone leaves a feature "
            "free to move; add a location or a profile with datums"
        )
    if found.x is None:
        raise ConformityError(f"no part lies in all zones at once: {found.message}")
    return np.asarray(found.x[:count])


def _refuse_free(nominal: NominalModel, free: Bools) -> None:
    names = [feature.name for feature in nominal.features if free[feature.rows].any()]
    if names:
        raise ConformityError(
            f"no tolerance bounds {', '.join(names)}, so the measure has no largest value; give them a "
            "tolerance, or the specification a default"
        )


def _confirm(
    nominal: NominalModel, spec: Specification, requirements: Sequence[Requirement], deviation: Floats
) -> None:
    part = welded_part(nominal, deviation)
    for item in requirements:
        value = value_of(item, part, spec)
        if value > item.limit:
            raise ConformityError(
                f"{item.label}: the part that is worst to first order has {value:.9g} mm; this tolerance "
                "is no linear zone here, or the deviations are too large for one"
            )
