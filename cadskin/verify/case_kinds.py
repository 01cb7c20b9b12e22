"""The kinds of cases: from the words of a question to the functions of this package."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np

from cadskin._typing import Points, Vectors
from cadskin.errors import SpecificationError
from cadskin.shape import Cone
from cadskin.shape.association import associate
from cadskin.verify.case_datums import datum_features, override_of
from cadskin.verify.case_location import (
    coaxiality_case,
    frame_of,
    position_case,
    runout_case,
    symmetry_case,
    toleranced_points,
)
from cadskin.verify.case_profile import profile_case
from cadskin.verify.cases import Case
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.filters import FilterKind, filter_roundness, filter_straightness
from cadskin.verify.form import FORMS, FormCharacteristic, Parameter, form
from cadskin.verify.orientation import OrientationCharacteristic, orientation
from cadskin.verify.quantities import Wanted, normalised, read_quantity
from cadskin.verify.size import global_size, local_diameters, rank

__all__ = ["KINDS"]

_SIZE_CRITERION = {"LS": "GG", "MC": "GN", "MI": "GX"}


def named(found: Evaluation, case: Case) -> Evaluation:
    """Return the evaluation of what the case names: one of the details, or the value itself."""
    if case.quantity is None:
        return found
    asked = normalised(case.quantity)
    best, count = None, 0
    for key, value in found.details.items():
        tokens = [normalised(token) for token in key.split("_")]
        fits = isinstance(value, int | float) and all(token in asked for token in tokens)
        enough = len(tokens) > max(count, 1) or normalised(key) == asked
        if fits and not isinstance(value, bool) and enough:
            best, count = key, len(tokens)
    if best is None:
        return found
    return replace(found, value=float(found.details[best]), quantity=best)


def _vector(case: Case, *names: str) -> Vectors | None:
    for name in names:
        value = case.get(name)
        if value is not None:
            return np.asarray(value, dtype=np.float64)
    return None


def form_case(case: Case) -> Evaluation:
    """Form, with the reference element and parameter that the quantity names."""
    characteristic = _form_name(case)
    wanted = read_quantity(case.quantity)
    reference = wanted.reference or _association_reference(case) or "MZ"
    sided = _material_side(case, wanted)
    if sided is not None:
        reference = sided
    if characteristic == "straightness" and reference == "MC":
        reference = "MZ"  # the smallest enclosing cylinder is the minimum zone of a line in space
    if re.search(r"fixed angle", f"{wanted.text} {case.get('association', '')}".lower()):
        raise SpecificationError(
            f"case {case.id}: conicity is about a cone of free angle; ask for the profile of a surface of a "
            "nominal cone where the angle is exact"
        )
    points = case.only()
    options = _form_options(case, characteristic)
    if wanted.what in ("radius", "diameter", "angle", "half angle", "two point"):
        return _element_size(points, characteristic, wanted, reference, options)
    if case.get("filter") and "unfiltered" not in wanted.text.lower():
        points = _filtered(case, points, characteristic, options)
    parameter = cast("Parameter", wanted.what or "t")
    return form(points, characteristic, reference=reference, parameter=parameter, **options)


def _form_name(case: Case) -> FormCharacteristic:
    lower = case.characteristic.lower()
    synonyms = {"circularity": "roundness", "taper": "conicity"}
    for name in (*FORMS, *synonyms):
        if name in lower:
            return cast("FormCharacteristic", synonyms.get(name, name))
    raise SpecificationError(f"case {case.id}: {case.characteristic!r} is not a form")


def _form_options(case: Case, characteristic: str) -> dict[str, Any]:
    options: dict[str, Any] = {
        "axis": _vector(case, "outward_normal_hint", "axis_hint", "normal_hint"),
        "section_normal": _vector(case, "section_plane_normal"),
    }
    if characteristic == "straightness":
        words = f"{case.get('feature_type', '')} {case.get('zone', '')} {case.get('association', '')}".lower()
        options["median"] = bool(re.search(r"median|axis|cylinder|space", words))
    return options


def _material_side(case: Case, wanted: Wanted) -> Any:
    """Return the reference element with a material constraint that the letters CE, CI, GE, GI ask for."""
    letters = re.search(r"\b([CG])([EI])\b", f"{wanted.text} {case.get('association', '')}")
    if letters is None:
        return None
    if letters.group(1) == "G":
        return letters.group()
    if wanted.what not in (None, "t"):
        raise SpecificationError(
            f"case {case.id}: a minimax reference beside the material has only the parameter t here"
        )
    return "MZ"  # the zone is the same, and so is its width


def _association_reference(case: Case) -> Any:
    """Return the one reference element that the association names; None where it names several or none."""
    text = str(case.get("association", ""))
    found = {read_quantity(part).reference for part in re.split(r"[,;/]| and ", text)} - {None}
    return found.pop() if len(found) == 1 else None


def _element_size(
    points: Points, characteristic: str, wanted: Wanted, reference: str, options: dict[str, Any]
) -> Evaluation:
    """Radius, diameter or angle of a reference element."""
    kind = FORMS[characteristic].kind
    if wanted.what == "two point":
        diameters = local_diameters(points, options["section_normal"])
        which = re.search(r"max|min", wanted.text.lower())
        statistic = {"max": "SX", "min": "SN"}.get(which.group() if which else "", "SA")
        return Evaluation(
            "size", rank(diameters, statistic), f"two-point size LP {statistic}", True, len(points)
        )
    criterion = {"LS": "G", "MZ": "C", "MC": "N", "MI": "X"}.get(reference, reference)
    found = associate(points, kind, criterion, axis=options["axis"], section_normal=options["section_normal"])
    if wanted.what in ("angle", "half angle"):
        if not isinstance(found.feature, Cone):
            raise SpecificationError(f"a {kind} has no apex angle")
        value = float(np.degrees(found.feature.half_angle)) * (2.0 if wanted.what == "angle" else 1.0)
        name = f"{reference} cone {'full apex' if wanted.what == 'angle' else 'half'} angle [deg]"
    else:
        radius = found.radius
        if radius is None:
            raise SpecificationError(f"a {kind} has no {wanted.what}")
        value = radius * (2.0 if wanted.what == "diameter" else 1.0)
        name = f"{reference} {wanted.what}"
    return Evaluation(
        characteristic,
        value,
        name,
        found.certified,
        found.n_points,
        operations=("extraction: the given points", "filtration: none", f"association: {found.criterion}"),
        details={"unique": found.unique, "scope": found.certificate.scope, "kkt": found.certificate.kkt},
    )


def _filtered(case: Case, points: Points, characteristic: str, options: dict[str, Any]) -> Points:
    """Return the points of a section or of a line after the filter that the case states."""
    given = case.get("filter")
    words = str(given.get("type", "")).lower()
    kind: FilterKind | None = next(
        (name for name in ("robust", "spline", "gaussian") if name[:5] in words),
        None,
    )
    turns, length = given.get("cutoff_UPR"), given.get("cutoff_mm", given.get("cutoff"))
    cutoff = turns if characteristic == "roundness" else length
    if (
        kind is None
        or not isinstance(cutoff, int | float)
        or characteristic not in ("roundness", "straightness")
    ):
        raise SpecificationError(
            f"case {case.id}: filter {given} of {characteristic} is not known; a Gaussian, robust or spline "
            "filter is, with cutoff_UPR for roundness, with cutoff_mm for straightness"
        )
    section = options["section_normal"]
    if characteristic == "straightness":
        line = associate(points, "profile line", "least squares", section_normal=section).pose
        return filter_straightness(points, line.origin, line.axes, float(cutoff), kind=kind)
    circle = associate(points, "circle", "least squares", section_normal=section)
    short = bool(re.search(r"short.wave|high.pass", words))
    return filter_roundness(
        points, circle.pose.origin, circle.pose.axis, float(cutoff), short_wave=short, kind=kind
    )


def size_case(case: Case) -> Evaluation:
    """Size or datum association of a circle, cylinder or sphere."""
    wanted = read_quantity(case.quantity)
    reference = wanted.reference or read_quantity(str(case.get("association", ""))).reference or "LS"
    if reference == "MZ":
        raise SpecificationError(f"case {case.id}: a size needs least squares, inscribed or circumscribed")
    kind = next(
        (k for k in ("circle", "cylinder", "sphere") if k in str(case.get("feature_type")).lower()), None
    )
    if kind is None:
        raise SpecificationError(f"case {case.id}: no size of a {case.get('feature_type')!r}")
    found = global_size(
        case.only(),
        cast("Any", kind),
        cast("Any", _SIZE_CRITERION[reference]),
        section_normal=_vector(case, "section_plane_normal"),
        axis=_vector(case, "axis_hint"),
    )
    if wanted.what == "diameter":
        return found
    return replace(found, value=0.5 * found.value, quantity=f"{_SIZE_CRITERION[reference]} radius")


def orientation_case(case: Case) -> Evaluation:
    """Orientation, also for the other datum criteria."""
    name = next(
        n for n in ("parallelism", "perpendicularity", "angularity") if n in case.characteristic.lower()
    )
    found = _orientation(case, name, override_of(case))
    details = dict(found.details)
    for key, criterion in (
        ("value_if_LS_datum", "least squares"),
        ("value_if_constrained_L2_datum", "constrained least squares"),
    ):
        if datum_features(case)[0].kind == "plane":
            details[key] = _orientation(case, name, criterion).value
    return replace(found, details=details)


def _orientation(case: Case, name: str, criterion: Any) -> Evaluation:
    toleranced = case.get("toleranced", {})
    zone_text = str(case.get("zone", "two parallel planes")).lower()
    is_line = bool(re.search(r"median|axis|line", str(toleranced.get("type", "plane")).lower()))
    angle = case.get("TED_angle_deg")
    radian = None if angle is None else float(np.radians(angle))
    by_normal = name == "angularity" and "normal" in zone_text
    datums = frame_of(case, criterion)
    return orientation(
        toleranced_points(case, median=is_line),
        cast("OrientationCharacteristic", name),
        datums,
        feature="line" if is_line else "plane",
        zone="cylinder"
        if "cylinder" in zone_text and "plane" not in zone_text.split("cylinder")[0]
        else "planes",
        angle=None if by_normal else radian,
        normal_angle=radian if by_normal else None,
    )


KINDS: tuple[tuple[tuple[str, ...], Callable[[Case], Evaluation]], ...] = (
    (("profile",), profile_case),
    (("size", "datum association"), size_case),
    ((*FORMS, "circularity"), form_case),
    (("parallelism", "perpendicularity", "angularity"), orientation_case),
    (("position",), position_case),
    (("coaxiality", "concentricity"), coaxiality_case),
    (("run-out", "runout"), runout_case),
    (("symmetry",), symmetry_case),
)
