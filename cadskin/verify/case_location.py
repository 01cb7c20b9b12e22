"""Cases of location and run-out, and what all cases with datums need."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, cast

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import Line, Pose, associate
from cadskin.verify.case_datums import datum_features, override_of, standard_of
from cadskin.verify.datums import DatumFrame, establish
from cadskin.verify.location import Target, material_report, position, symmetry
from cadskin.verify.median import median_line, median_points
from cadskin.verify.runout import runout

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors
    from cadskin.verify.cases import Case
    from cadskin.verify.evaluation import Evaluation

__all__ = [
    "coaxiality_case",
    "frame_of",
    "position_case",
    "runout_case",
    "symmetry_case",
    "toleranced_points",
]


def frame_of(case: Case, criterion: Any = None) -> DatumFrame:
    """Return the datum system of a case, by the standard that it names."""
    features = datum_features(case, criterion)
    return establish(features, standard=standard_of(case))


def toleranced_points(case: Case, *, median: bool) -> Points:
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
    if ted is None:
        raise SpecificationError(f"case {case.id}: a position needs its theoretically exact place, TED")
    exact = np.atleast_1d(np.asarray(ted, dtype=np.float64))
    toleranced = case.get("toleranced", {})
    kind = str(toleranced.get("type", "cylinder")).lower()
    frame = frame_of(case, override_of(case))
    pose = Pose(frame.origin, _position_axes(case, frame), np.zeros(2))
    target = _plane_target(case, pose, exact) if "plane" in kind or "surface" in kind else None
    if target is None:
        target = _axis_target(case, frame, pose, kind, exact)
    found = position(
        [target], pose, free=frame.free, certified=frame.certified, operations=frame.operations()
    )
    if "cylinder" not in kind or str(toleranced.get("feature", "T")) not in case.features:
        return found
    axes = np.asarray(found.zone["axes"])
    line = Line(
        np.asarray(found.zone["origin"]) + axes @ target.place, np.ascontiguousarray(axes @ target.direction)
    )
    return replace(found, details={**found.details, **_material(case, line)})


def _axis_target(case: Case, frame: DatumFrame, pose: Pose, kind: str, exact: Floats) -> Target:
    """Return an axis or a point and its exact place."""
    place = np.zeros(3)
    place[: len(exact)] = exact
    is_point = len(exact) == 3 and bool(re.search(r"sphere|point|centre|center", kind))
    points = toleranced_points(case, median=not is_point)
    if "sphere" in kind:
        points = associate(points, "sphere", "least squares").pose.origin[None, :]
    return Target(points, place, _axis_direction(case, frame, pose), "point" if is_point else "line")


def _axis_direction(case: Case, frame: DatumFrame, pose: Pose) -> Vectors:
    """Return the direction of an exact axis in the frame: z, or the normal of the datum that is named."""
    named = re.search(r"normal of (\w+)", str(case.get("TED_axes", "")))
    for datum in frame.datums:
        if named and datum.label == named.group(1) and datum.kind != "sphere":
            return np.asarray(pose.axes.T @ datum.direction)
    return np.array([0.0, 0.0, 1.0])


def _plane_target(case: Case, pose: Pose, exact: Floats) -> Target:
    """Return a plane or median plane: its normal is the axis of the frame that is nearest to its points."""
    labels = case.get("toleranced", {}).get("features")
    if labels and len(labels) == 2:
        points = median_points(case.points(str(labels[0])), case.points(str(labels[1])))
    else:
        points = toleranced_points(case, median=False)
    normal = associate(points, "plane", "least squares").pose.axis
    k = int(np.argmax(np.abs(pose.axes.T @ normal)))
    place = np.zeros(3)
    place[k] = exact[0] if len(exact) == 1 else exact[k] if k < len(exact) else 0.0
    return Target(points, place, np.eye(3)[k], "plane")


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
        frame = frame_of(case, override_of(case))
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
    frame = frame_of(case, override_of(case))
    found = symmetry(toleranced_points(case, median=True), frame, characteristic=case.characteristic)
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
    frame = frame_of(case, override_of(case))
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
        points = toleranced_points(case, median=True)
    return symmetry(points, frame_of(case, override_of(case)))
