"""Location: position, coaxiality, symmetry (ISO 1101), with material requirements (ISO 2692)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import Line, Pose, associate
from cadskin.verify.evaluation import Evaluation, active_of
from cadskin.verify.zones import FREEDOMS, free_columns, line_patch, plane_patch, point_patch, solve

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.shape.association import Patch
    from cadskin.verify.datums import DatumFrame

__all__ = ["MaterialReport", "Target", "material_report", "position", "symmetry", "target_patch"]

LocationShape: TypeAlias = Literal["line", "point", "plane"]


@dataclass(frozen=True, eq=False)
class Target:
    """One feature of a position tolerance: its points and its theoretically exact place in the datum frame.

    Parameters
    ----------
    points : (n, 3) float
        Median line, centre point or median surface, in the world [mm].
    place : (3,) float
        A point of the exact feature, in the frame [mm].
    direction : (3,) float
        Direction of an exact line, normal of an exact plane, in the frame.
    shape : {"line", "point", "plane"}
    """

    points: Points
    place: Points
    direction: Vectors
    shape: LocationShape = "line"


def position(
    targets: list[Target],
    frame: Pose,
    *,
    free: tuple[str, ...] = (),
    certified: bool = True,
    characteristic: str = "position",
    operations: tuple[str, ...] = (),
    limit: float | None = None,
) -> Evaluation:
    """Evaluate a position tolerance: twice the largest distance from the exact place.

    Parameters
    ----------
    targets : list of Target
        Several for a pattern: they move together (CZ).
    frame : Pose
        The datum frame.
    free : tuple of str
        Motions that the datums leave and that are optimised: ``tx`` ... ``rz``.
    certified : bool
        Of the datum system.
    characteristic : str
    operations : tuple of str
        Of the datum system.
    limit : float, optional
    """
    if not targets:
        raise SpecificationError(f"{characteristic} needs at least one feature")
    parts, planes = [], all(target.shape == "plane" for target in targets)
    for target in targets:
        parts.append((target_patch(target), np.asarray(target.points)))
    mode: Literal["symmetric", "upper"] = "symmetric" if planes else "upper"
    columns = free_columns(name for name in FREEDOMS if name in free)
    found = solve(parts, frame, columns, mode, what=characteristic)
    return Evaluation(
        characteristic=characteristic,
        value=2.0 * found.value,
        quantity="2 x the largest distance from the exact place",
        certified=found.certified and certified,
        n_points=sum(len(target.points) for target in targets),
        limit=limit,
        zone={
            "kind": "two parallel planes" if planes else "cylinder or sphere",
            "width": 2.0 * found.value,
            "origin": found.pose.origin,
            "axes": found.pose.axes,
        },
        active=active_of(found),
        operations=(*operations, "extraction: the given points", "filtration: none"),
        details={"unique": found.unique},
    )


def target_patch(target: Target) -> Patch:
    """Return the exact feature of a target, in the datum frame."""
    if target.shape == "line":
        return line_patch(target.direction, target.place)
    if target.shape == "plane":
        return plane_patch(target.direction, target.place)
    return point_patch(target.place)


@dataclass(frozen=True)
class MaterialReport:
    """Sizes and verdicts of a hole or shaft at a position with a material requirement.

    Parameters
    ----------
    unrelated_diameter : float or None
        Of the unrelated mating envelope; None where none exists.
    related_diameter : float or None
        Of the envelope with the exact direction.
    diameter_at_place : float
        Of the largest inscribed (smallest circumscribed) cylinder about the exact axis.
    envelope_position : float or None
        ASME: twice the largest distance of the unrelated envelope's axis from the exact axis.
    virtual_size : float or None
        MMVS = MMS - t (internal), MMS + t (external).
    conforms_iso : bool or None
        ISO 2692: the surface does not violate the virtual boundary.
    bonus : float or None
        ASME: departure of the mating size from the maximum material size.
    allowed : float or None
        ASME: tolerance and bonus.
    conforms_bonus : bool or None
        ASME, axis method.
    """

    unrelated_diameter: float | None
    related_diameter: float | None
    diameter_at_place: float
    envelope_position: float | None
    virtual_size: float | None = None
    conforms_iso: bool | None = None
    bonus: float | None = None
    allowed: float | None = None
    conforms_bonus: bool | None = None
    certified: bool = True


def material_report(
    points: Points,
    exact: Line,
    *,
    internal: bool,
    tolerance: float | None = None,
    maximum_material: float | None = None,
    length: float | None = None,
) -> MaterialReport:
    """Compare a cylinder with its virtual boundary (ISO 2692) and by the bonus method (ASME Y14.5).

    The two can disagree: the boundary is a question about the surface, the bonus one about an axis.

    Parameters
    ----------
    points : (n, 3) float
        The integral feature.
    exact : Line
        The theoretically exact axis.
    internal : bool
    tolerance : float, optional
        t [mm].
    maximum_material : float, optional
        Maximum material size, a diameter [mm].
    length : float, optional
        Length of the feature [mm], about the middle of the points; by default the extent of the points.
    """
    criterion = "maximum inscribed" if internal else "minimum circumscribed"
    radii = exact.distance(np.asarray(points))
    at_place = 2.0 * float(radii.min() if internal else radii.max())
    unrelated, related, envelope, certified = None, None, None, True
    try:
        mating = associate(points, "cylinder", criterion, axis=exact.direction)
        unrelated, certified = 2.0 * mating.value, mating.certified
        envelope = 2.0 * _axis_distance(
            np.asarray(points), Line(mating.pose.origin, mating.pose.axis), exact, length
        )
        fixed = associate(points, "cylinder", criterion, fixed_axis=exact.direction)
        related, certified = 2.0 * fixed.value, certified and fixed.certified
    except AssociationError:
        certified = False
    if tolerance is None or maximum_material is None:
        return MaterialReport(unrelated, related, at_place, envelope, certified=certified)
    sign = -1.0 if internal else 1.0
    virtual = maximum_material + sign * tolerance
    bonus = None if unrelated is None else max(0.0, -sign * (unrelated - maximum_material))
    allowed = None if bonus is None else tolerance + bonus
    return MaterialReport(
        unrelated,
        related,
        at_place,
        envelope,
        virtual,
        bool(sign * (at_place - virtual) <= 0),
        bonus,
        allowed,
        None if allowed is None or envelope is None else bool(envelope <= allowed),
        certified,
    )


def _axis_distance(points: Points, axis: Line, exact: Line, length: float | None) -> float:
    """Return the largest distance of an axis from the exact one over the length of the feature [mm]."""
    heights = (points - exact.origin) @ exact.direction
    low, high = float(heights.min()), float(heights.max())
    if length is not None:
        middle = 0.5 * (low + high)
        low, high = middle - 0.5 * length, middle + 0.5 * length
    start = (axis.origin - exact.origin) @ exact.direction
    along = (np.array([low, high]) - start) / float(axis.direction @ exact.direction)
    ends = axis.origin + np.outer(along, axis.direction)
    return float(exact.distance(ends).max())


def symmetry(
    points: Points, datums: DatumFrame, *, limit: float | None = None, characteristic: str = "symmetry"
) -> Evaluation:
    """Evaluate the symmetry of median points about a datum plane or axis: twice the largest distance."""
    datum = datums.datums[0]
    origin, shape = datum.point, "plane" if datum.kind in ("plane", "width") else "line"
    frame = Pose(origin, np.eye(3), np.zeros(2))
    target = Target(points, np.zeros(3), datum.direction, "plane" if shape == "plane" else "line")
    return position(
        [target],
        frame,
        certified=datums.certified,
        characteristic=characteristic,
        operations=datums.operations(),
        limit=limit,
    )
