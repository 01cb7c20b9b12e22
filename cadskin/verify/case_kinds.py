"""The kinds of cases: from the words of a question to the functions of this package."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, cast

import numpy as np

from cadskin._typing import Points, Vectors
from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape import Cone
from cadskin.shape.association import Line, Pose, associate
from cadskin.verify.case_datums import datum_features, override_of, standard_of
from cadskin.verify.case_profile import profile_case
from cadskin.verify.cases import Case
from cadskin.verify.datums import DatumFrame, establish
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.filters import filter_roundness
from cadskin.verify.form import FORMS, FormCharacteristic, Parameter, form
from cadskin.verify.location import Target, material_report, position, symmetry
from cadskin.verify.median import median_line, median_points
from cadskin.verify.orientation import OrientationCharacteristic, orientation
from cadskin.verify.quantities import Wanted, normalised, read_quantity
from cadskin.verify.runout import runout
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
    if characteristic == "straightness" and reference == "MC":
        reference = "MZ"  # the smallest enclosing cylinder is the minimum zone of a line in space
    points = case.only()
    options = _form_options(case, characteristic)
    if wanted.what in ("radius", "diameter", "angle", "half angle", "two point"):
        return _element_size(points, characteristic, wanted, reference, options)
    if case.get("filter") and "unfiltered" not in wanted.text.lower():
        points = _filtered(case, points, options["section_normal"])
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
    criterion = {"LS": "G", "MZ": "C", "MC": "N", "MI": "X"}[reference]
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


def _filtered(case: Case, points: Points, normal: Vectors | None) -> Points:
    given = case.get("filter")
    kind, cutoff = str(given.get("type", "")).lower(), given.get("cutoff_UPR")
    if cutoff is None or "gauss" not in kind:
        raise SpecificationError(
            f"case {case.id}: filter {given} is not known; a Gaussian with cutoff_UPR is"
        )
    circle = associate(points, "circle", "least squares", section_normal=normal)
    short = bool(re.search(r"short.wave|high.pass", kind))
    return filter_roundness(points, circle.pose.origin, circle.pose.axis, float(cutoff), short_wave=short)


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


def _frame(case: Case, criterion: Any = None) -> DatumFrame:
    features = datum_features(case, criterion)
    return establish(features, standard=standard_of(case))


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
    datums = _frame(case, criterion)
    return orientation(
        _toleranced_points(case, median=is_line),
        cast("OrientationCharacteristic", name),
        datums,
        feature="line" if is_line else "plane",
        zone="cylinder"
        if "cylinder" in zone_text and "plane" not in zone_text.split("cylinder")[0]
        else "planes",
        angle=None if by_normal else radian,
        normal_angle=radian if by_normal else None,
    )


def _toleranced_points(case: Case, *, median: bool) -> Points:
    """Points of the toleranced feature; the median line of a cylinder where that is toleranced."""
    toleranced = case.get("toleranced", {})
    label = str(toleranced.get("feature", "T"))
    given = case.features.get(f"{label}_median_line")
    if median and given is not None:
        return given
    points = case.points(label)
    if median and "cylinder" in str(toleranced.get("type", "")).lower():
        return median_line(points, sections=toleranced.get("sections"))
    return points


def position_case(case: Case) -> Evaluation:
    """Position of one feature in a datum system, or of a pattern from a start pose."""
    ted = case.get("TED")
    if isinstance(ted, list) and ted and isinstance(ted[0], Mapping):
        return _pattern(case, ted)
    toleranced = case.get("toleranced", {})
    kind = str(toleranced.get("type", "cylinder")).lower()
    frame = _frame(case, override_of(case))
    place, axes = np.zeros(3), _position_axes(case, frame)
    place[: len(ted)] = ted
    pose = Pose(frame.origin, axes, np.zeros(2))
    label = str(toleranced.get("feature", "T"))
    is_point = bool(re.search(r"sphere|point|centre|center", kind))
    points = _toleranced_points(case, median=not is_point)
    if "sphere" in kind:
        points = associate(points, "sphere", "least squares").pose.origin[None, :]
    direction = np.array([0.0, 0.0, 1.0])
    target = Target(points, place, direction, "point" if is_point else "line")
    found = position(
        [target], pose, free=frame.free, certified=frame.certified, operations=frame.operations()
    )
    if "cylinder" not in kind or label not in case.features:
        return found
    exact = Line(
        np.asarray(found.zone["origin"]) + np.asarray(found.zone["axes"]) @ place,
        np.ascontiguousarray(np.asarray(found.zone["axes"])[:, 2]),
    )
    return replace(found, details={**found.details, **_material(case, exact)})


def _position_axes(case: Case, frame: DatumFrame) -> Vectors:
    """Return the frame's axes with x and y from the datums that the case names."""
    words = str(case.get("TED_axes", ""))
    axes = np.array(frame.axes)
    for column, letter in ((0, "x"), (1, "y")):
        match = re.search(rf"\b{letter} from (\w+)", words)
        if match:
            datum = next((d for d in frame.datums if d.label == match.group(1)), None)
            if datum is not None and datum.kind == "plane":
                axes[:, column] = -datum.direction
    return np.ascontiguousarray(axes)


def _material(case: Case, exact: Line) -> dict[str, Any]:
    toleranced, tolerance = case.get("toleranced", {}), case.get("tolerance", {}) or {}
    given = tolerance if isinstance(tolerance, Mapping) else {"t": tolerance}
    report = material_report(
        case.points(str(toleranced.get("feature", "T"))),
        exact,
        internal="internal" in str(toleranced.get("type", "")).lower(),
        tolerance=given.get("t"),
        maximum_material=given.get("MMS_diameter"),
        length=toleranced.get("length"),
    )
    return {
        "position_ASME_UAME_axis": report.envelope_position,
        "UAME_diameter": report.unrelated_diameter,
        "related_AME_diameter": report.related_diameter,
        "largest_inscribed_at_TED_diameter": report.diameter_at_place,
        "MMVS": report.virtual_size,
        "conforms_ISO2692_MMR": report.conforms_iso,
        "bonus_ASME_axis_method": report.bonus,
        "allowed_ASME": report.allowed,
        "conforms_ASME_axis_method": report.conforms_bonus,
    }


def _pattern(case: Case, ted: list[Mapping[str, Any]]) -> Evaluation:
    given = case.get("start_pose")
    if given is None:
        frame = _frame(case, override_of(case))
        pose, free = frame.pose, tuple(case.get("free_dof", frame.free))
        certified, operations = frame.certified, frame.operations()
    else:
        pose, free = start_pose(given), tuple(case.get("free_dof", ()))
        certified, operations = True, ("datum system: given by the case",)
    targets = []
    for entry in ted:
        place = np.zeros(3)
        exact = entry.get("xyz", entry.get("xy"))
        if exact is None:
            raise SpecificationError(
                f"case {case.id}: TED of {entry.get('feature')!r} has neither xy nor xyz"
            )
        place[: len(exact)] = exact
        points = case.points(str(entry["feature"]))
        direction = np.asarray(entry.get("direction", [0.0, 0.0, 1.0]))
        targets.append(Target(points, place, direction, "point" if "xyz" in entry else "line"))
    return position(targets, pose, free=free, certified=certified, operations=operations)


def start_pose(given: Mapping[str, Any]) -> Pose:
    """Return the pose of a case: ``world = axes @ local + origin``."""
    axes = np.asarray(given["axes"], dtype=np.float64)
    return Pose(np.asarray(given["origin"], dtype=np.float64), np.ascontiguousarray(axes), np.zeros(2))


def coaxiality_case(case: Case) -> Evaluation:
    """Coaxiality or concentricity; run-outs of the same points among the details."""
    frame = _frame(case, override_of(case))
    found = symmetry(_toleranced_points(case, median=True), frame, characteristic=case.characteristic)
    details = dict(found.details)
    label, sections = (
        str(case.get("toleranced", {}).get("feature", "T")),
        case.get("toleranced", {}).get("sections"),
    )
    for key, feature, direction, total, circles in (
        ("circular_runout_radial", label, "radial", False, sections),
        ("total_runout_radial", label, "radial", True, None),
        ("total_runout_axial", "face", "axial", True, None),
        ("circular_runout_axial", "face", "axial", False, None),
    ):
        if feature in case.features and frame.datums[0].kind == "cylinder":
            try:
                value = runout(
                    case.points(feature),
                    frame,
                    direction=cast("Any", direction),
                    total=total,
                    circles=circles,
                ).value
            except AssociationError:
                continue
            details[key] = value
    return replace(found, details=details)


def runout_case(case: Case) -> Evaluation:
    """Circular or total run-out."""
    words = f"{case.characteristic} {case.quantity or ''}".lower()
    toleranced = case.get("toleranced", {})
    axial = "axial" in words or "axial" in str(toleranced.get("direction", case.get("direction", "")))
    label = str(toleranced.get("feature", "face" if axial and "face" in case.features else "T"))
    frame = _frame(case, override_of(case))
    return runout(
        case.points(label),
        frame,
        direction="axial" if axial else "radial",
        total="total" in words,
        circles=toleranced.get("circles", toleranced.get("sections")),
    )


def symmetry_case(case: Case) -> Evaluation:
    """Symmetry of a median surface, line or point about a datum plane or axis."""
    toleranced = case.get("toleranced", {})
    labels = toleranced.get("features")
    if labels and len(labels) == 2:
        points = median_points(case.points(str(labels[0])), case.points(str(labels[1])))
    else:
        points = _toleranced_points(case, median=True)
    return symmetry(points, _frame(case, override_of(case)))


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
