"""Datums and datum systems from points (ISO 5459): the criterion is explicit and recorded.

References
----------
.. [1] ISO 5459:2011: planes minimax outside of the material, cylinders, spheres and widths maximum inscribed
   (internal) or minimum circumscribed (external), secondary and tertiary datums constrained in orientation.
.. [2] ASME Y14.5.1-2019: planes by constrained least squares.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import Association, Pose, associate, frame_about
from cadskin.verify.datum_types import (
    DatumCriterion,
    DatumFeature,
    DatumFrame,
    DatumKind,
    EstablishedDatum,
    Standard,
    criterion_of,
)
from cadskin.verify.part_geometry import Memory
from cadskin.verify.zones import line_patch, plane_patch, solve

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Points, Vectors

__all__ = [
    "DatumCriterion",
    "DatumFeature",
    "DatumFrame",
    "DatumKind",
    "EstablishedDatum",
    "Standard",
    "establish",
    "establish_one",
]


def establish_one(
    feature: DatumFeature, *, standard: Standard = "ISO 5459:2011", along: Vectors | None = None
) -> EstablishedDatum:
    """Associate one datum.

    Parameters
    ----------
    feature : DatumFeature
    standard : str
    along : (3,) float, optional
        Direction of a datum of higher precedence: the result is kept parallel or perpendicular to it,
        whichever is nearer.

    Raises
    ------
    AssociationError
        A degenerate feature, or one neither parallel nor perpendicular to ``along``.
    """
    criterion = criterion_of(feature, standard)
    functions = {"plane": _plane, "width": _width}
    try:
        found = functions.get(feature.kind, _round)(feature, criterion, along)
    except AssociationError as error:
        raise AssociationError(f"datum {feature.label}: {error}") from error
    return replace(found, orientation_only=True) if feature.orientation_only else found


def _plane(feature: DatumFeature, criterion: DatumCriterion, along: Vectors | None) -> EstablishedDatum:
    word = {"minimax": "minimum zone", "least squares": "least squares"}.get(
        criterion, "constrained least squares"
    )
    certified = True
    if feature.levels is not None:
        return _stepped_plane(feature, criterion, along)
    if along is None:
        found = associate(feature.points, "plane", word, axis=feature.hint)
        normal, certified = found.pose.axis, found.certified
    else:
        squares = associate(feature.points, "plane", "least squares", axis=feature.hint)
        normal = squares.pose.axis
        relation = abs(float(normal @ along))
        if relation > 0.98:
            normal = along * np.sign(normal @ along)
        elif relation < 0.17:
            normal, certified = _perpendicular_normal(feature, criterion, along, normal)
        else:
            raise AssociationError(
                f"the plane stands at {np.degrees(np.arccos(relation)):.1f} degrees to the datum before "
                "it; only parallel and perpendicular planes are constrained in orientation"
            )
    heights = feature.points @ normal
    level = float(heights.mean() if criterion == "least squares" else heights.max())
    centre = feature.points.mean(axis=0)
    point = centre + (level - centre @ normal) * normal
    return EstablishedDatum(feature.label, "plane", point, normal, None, criterion, certified)


def _stepped_plane(
    feature: DatumFeature, criterion: DatumCriterion, along: Vectors | None
) -> EstablishedDatum:
    """Return the common datum of parallel planes at different heights, associated together (ISO 5459)."""
    levels, points = np.asarray(feature.levels), np.asarray(feature.points)
    if criterion != "minimax" or feature.hint is None or along is not None:
        raise SpecificationError(
            f"datum {feature.label}: a common datum of planes at different heights is supported as the "
            "primary datum, by minimax, with a known normal"
        )
    up = np.array([0.0, 0.0, 1.0])
    parts = [(plane_patch(up, offset=float(level)), points[levels == level]) for level in np.unique(levels)]
    centre = points.mean(axis=0)
    start = Pose(centre, frame_about(np.asarray(feature.hint)), np.zeros(2))
    found = solve(parts, start, (3, 4), "zone", what=f"datum {feature.label}")
    normal = found.pose.axis
    top = float((points @ normal - levels).max())
    point = centre + (top - centre @ normal) * normal
    return EstablishedDatum(feature.label, "plane", point, normal, None, criterion, found.certified)


def _perpendicular_normal(
    feature: DatumFeature, criterion: DatumCriterion, along: Vectors, normal: Vectors
) -> tuple[Vectors, bool]:
    """Return the normal perpendicular to ``along``: one rotation is left."""
    centre = feature.points.mean(axis=0)
    axes = frame_about(along, normal)
    if criterion == "minimax":
        found = solve(
            [(plane_patch(np.array([1.0, 0, 0])), feature.points)],
            Pose(centre, axes, np.zeros(2)),
            (5,),
            "zone",
            what=f"datum {feature.label}",
        )
        return found.pose.axes[:, 0], found.certified
    flat = (feature.points - centre) @ axes[:, :2]
    if criterion == "least squares":
        _, _, right = np.linalg.svd(flat, full_matrices=False)
        direction = right[1] if right[1][0] > 0 else -right[1]
        return np.asarray(axes[:, :2] @ direction), True
    points = np.column_stack([flat, np.zeros(len(flat))])
    found_line = associate(
        points, "profile line", "GE", section_normal=np.array([0, 0, 1.0]), axis=np.array([1.0, 0, 0])
    )
    return np.asarray(axes @ found_line.pose.axis), found_line.certified


def _width(feature: DatumFeature, criterion: DatumCriterion, along: Vectors | None) -> EstablishedDatum:
    """Return the median plane of two opposite faces: the narrowest slab around, or the widest within."""
    if feature.opposite is None:
        raise SpecificationError(f"datum {feature.label}: a width needs the points of its two faces")
    first, second = np.asarray(feature.points), np.asarray(feature.opposite)
    normal = associate(first, "plane", "least squares").pose.axis
    middle = 0.5 * (first.mean(axis=0) + second.mean(axis=0))
    if (first.mean(axis=0) - second.mean(axis=0)) @ normal < 0:
        normal = -normal
    if feature.hint is not None and normal @ np.asarray(feature.hint) < 0:
        normal, first, second = -normal, second, first
    size = float(np.abs((first.mean(axis=0) - second.mean(axis=0)) @ normal))
    outer = criterion != "inscribed"
    if criterion == "least squares":
        raise SpecificationError(f"datum {feature.label}: a width is associated from outside or from inside")
    # Inside, the faces are set apart so far that their outer sides cannot bind.
    shift = 0.0 if outer else 8.0 * (size + float(np.ptp(np.concatenate([first, second]), axis=0).max()))
    frame, local, free = _width_frame(middle, normal, along)
    found = solve(
        [(plane_patch(local, offset=shift), first), (plane_patch(local, offset=-shift), second)],
        frame,
        free,
        "zone",
        what=f"datum {feature.label}",
    )
    normal = found.pose.axes @ local
    high, low = (first @ normal, second @ normal)
    edges = (high.max(), low.min()) if outer else (high.min(), low.max())
    point = middle + (0.5 * float(edges[0] + edges[1]) - middle @ normal) * normal
    width = float(edges[0] - edges[1])
    return EstablishedDatum(feature.label, "width", point, normal, width, criterion, found.certified)


def _width_frame(
    middle: Points, normal: Vectors, along: Vectors | None
) -> tuple[Pose, Vectors, tuple[int, ...]]:
    if along is None:
        return Pose(middle, frame_about(normal), np.zeros(2)), np.array([0, 0, 1.0]), (3, 4)
    if abs(float(normal @ along)) > 0.98:
        return (
            Pose(middle, frame_about(along * np.sign(normal @ along)), np.zeros(2)),
            np.array([0, 0, 1.0]),
            (),
        )
    return Pose(middle, frame_about(along, normal), np.zeros(2)), np.array([1.0, 0, 0]), (5,)


def _round(feature: DatumFeature, criterion: DatumCriterion, along: Vectors | None) -> EstablishedDatum:
    word = {
        "inscribed": "maximum inscribed",
        "circumscribed": "minimum circumscribed",
        "least squares": "least squares",
        "minimax": "minimum zone",
    }.get(criterion)
    if word is None:
        raise SpecificationError(f"datum {feature.label}: no {criterion} of a {feature.kind}")
    if feature.radii is not None:
        return _common_axis(feature, criterion)
    if feature.kind == "sphere":
        ball = associate(feature.points, "sphere", word)
        return _established(feature, ball, np.zeros(3), criterion)
    if along is None:
        found = associate(feature.points, "cylinder", word, axis=feature.hint)
        return _established(feature, found, found.pose.axis, criterion)
    squares = associate(feature.points, "cylinder", "least squares", axis=feature.hint)
    relation = float(squares.pose.axis @ along)
    if abs(relation) > 0.98:
        fixed = along * np.sign(relation)
        found = associate(feature.points, "cylinder", word, fixed_axis=fixed)
        return _established(feature, found, fixed, criterion)
    raise AssociationError(
        "only a secondary cylinder parallel to the direction before it is constrained in orientation"
    )


def _common_axis(feature: DatumFeature, criterion: DatumCriterion) -> EstablishedDatum:
    """Return the axis of several coaxial cylinders associated together, each from its nominal radius.

    External: the largest overshoot over the nominal radii is least; internal: the largest intrusion is.
    """
    radii, points = np.asarray(feature.radii), np.asarray(feature.points)
    if criterion not in ("inscribed", "circumscribed") or feature.hint is None:
        raise SpecificationError(
            f"datum {feature.label}: a common axis is associated from inside or outside, "
            "from a known direction"
        )
    sign = -1.0 if criterion == "inscribed" else 1.0
    along = np.array([0.0, 0.0, 1.0])
    parts = [
        (line_patch(along, radius=float(radius), sign=sign), points[radii == radius])
        for radius in np.unique(radii)
    ]
    found = solve(
        parts, _seat_frame(points, radii, feature.hint), (0, 1, 3, 4), "upper", what=f"datum {feature.label}"
    )
    return EstablishedDatum(
        feature.label, "cylinder", found.pose.origin, found.pose.axis, None, criterion, found.certified
    )


def _seat_frame(points: Points, radii: Floats, hint: Vectors) -> Pose:
    """Return a start: the line of least squares through the circle centres of the seats."""
    axes = frame_about(hint)
    centres, weights = [], []
    for radius in np.unique(radii):
        part = points[radii == radius]
        local = (part - part.mean(axis=0)) @ axes
        design = np.column_stack([2 * local[:, :2], np.ones(len(part))])
        middle = np.linalg.lstsq(design, (local[:, :2] ** 2).sum(axis=1), rcond=None)[0]
        centres.append(part.mean(axis=0) + axes[:, :2] @ middle[:2])
        weights.append(len(part))
    centre = np.average(centres, axis=0, weights=weights)
    spread = np.array(centres) - centre
    direction = axes[:, 2]
    if np.abs(spread @ direction).max() > 1.0:
        across = spread @ axes
        slope = (across[:, 2] @ across[:, :2]) / (across[:, 2] @ across[:, 2])
        direction = axes @ np.array([slope[0], slope[1], 1.0])
    return Pose(centre, frame_about(direction), np.zeros(2))


def _established(
    feature: DatumFeature, found: Association, direction: Vectors, criterion: str
) -> EstablishedDatum:
    return EstablishedDatum(
        feature.label, feature.kind, found.pose.origin, direction, found.radius, criterion, found.certified
    )


def establish(
    features: Sequence[DatumFeature],
    *,
    standard: Standard = "ISO 5459:2011",
    memory: Memory | None = None,
) -> DatumFrame:
    """Establish a datum system of one to three datums in their order of precedence.

    Parameters
    ----------
    features : sequence of DatumFeature
    standard : {"ISO 5459:2011", "ASME Y14.5.1-2019", "custom"}
    memory : Memory, optional
        Associations of the same points are taken from there.

    Returns
    -------
    DatumFrame
        z is against the outward normal of a primary plane, or along a primary axis; y then comes from the
        secondary datum and x from the tertiary one, each pointing away from it into the material.

    Raises
    ------
    SpecificationError, AssociationError

    Examples
    --------
    >>> floor = DatumFeature("A", "plane", np.array([[0, 0, 0], [9, 0, 0], [0, 9, 0.0]]), hint=[0, 0, -1])
    >>> frame = establish([floor])
    >>> frame.axes[:, 2].tolist(), frame.free
    ([0.0, 0.0, 1.0], ('tx', 'ty', 'rz'))
    """
    if not 1 <= len(features) <= 3:
        raise SpecificationError(f"a datum system has one to three datums, got {len(features)}")
    memory = Memory() if memory is None else memory
    primary = _remembered(features[0], standard, None, memory)
    if primary.kind == "sphere":
        if len(features) > 1:
            raise SpecificationError("a datum system with a sphere first and further datums is not supported")
        return DatumFrame(primary.point, np.eye(3), ("rx", "ry", "rz"), (primary,), standard)
    z = -primary.direction if primary.kind == "plane" else primary.direction
    datums = [primary]
    for feature in features[1:]:
        datums.append(_constrained(feature, z, datums, standard, memory))
    return _frame(z, datums, standard)


def _remembered(
    feature: DatumFeature, standard: Standard, along: Vectors | None, memory: Memory
) -> EstablishedDatum:
    key = (
        "datum",
        feature.label,
        feature.kind,
        feature.internal,
        feature.criterion,
        feature.orientation_only,
    )
    arrays = (feature.points, feature.hint, feature.opposite, feature.radii, feature.levels, along)
    return memory.recall(
        ("datum", *key, standard), arrays, lambda: establish_one(feature, standard=standard, along=along)
    )


def _constrained(
    feature: DatumFeature, z: Vectors, datums: list[EstablishedDatum], standard: Standard, memory: Memory
) -> EstablishedDatum:
    """Establish a secondary or tertiary datum in the orientation that the datums before leave."""
    across = [d.direction for d in datums[1:] if d.kind in ("plane", "width") and abs(d.direction @ z) < 0.5]
    if not across or feature.kind not in ("plane", "width"):
        return _remembered(feature, standard, z, memory)
    second = across[0]
    third = np.cross(second, z)
    normal = memory.recall(
        ("normal of datum", feature.label),
        (feature.points, feature.hint),
        lambda: associate(feature.points, "plane", "least squares", axis=feature.hint).pose.axis,
    )
    for fixed in (z, second, third):
        if abs(float(normal @ fixed)) > 0.98:
            return _remembered(feature, standard, fixed, memory)
    raise AssociationError(f"datum {feature.label} is parallel to no direction of the datum system")


def _frame(z: Vectors, datums: list[EstablishedDatum], standard: Standard) -> DatumFrame:
    """Assemble origin, axes and the freedoms that are left."""
    y: Vectors | None = None
    x: Vectors | None = None
    planes: list[tuple[Vectors, float]] = []
    axis_points: list[Points] = []
    for datum in datums:
        if datum.kind in ("plane", "width"):
            if not datum.orientation_only:
                planes.append((datum.direction, float(datum.direction @ datum.point)))
            if abs(float(datum.direction @ z)) < 0.5:
                inward = -datum.direction if datum.kind == "plane" else datum.direction
                y, x = (inward, x) if y is None else (y, inward)
        else:
            axis_points.append(datum.point)
    if y is None and len(axis_points) > 1:
        between = axis_points[1] - axis_points[0]
        x = between - (between @ z) * z
        x = x / np.linalg.norm(x)
        y = np.cross(z, x)
    turned = y is not None
    if y is None:
        y = frame_about(z)[:, 1]
    if x is None:
        x = np.cross(y, z)
    axes = np.ascontiguousarray(np.stack([x, y, z], axis=1))
    located = [
        datum.point for datum in datums if datum.kind not in ("plane", "width") and not datum.orientation_only
    ]
    origin, held = _origin(axes, planes, located, datums[0].point)
    free = [name for name, fixed in zip(("tx", "ty", "tz"), held, strict=True) if not fixed]
    if not turned:
        free.append("rz")
    return DatumFrame(origin, axes, tuple(free), tuple(datums), standard)


def _origin(
    axes: Vectors, planes: list[tuple[Vectors, float]], axis_points: list[Points], anchor: Points
) -> tuple[Points, list[bool]]:
    """Return the origin, and which translations the datums hold; the first datum to hold one wins."""
    origin, held = np.asarray(anchor, dtype=np.float64), [False] * 3
    for normal, level in planes:
        k = int(np.argmax(np.abs(axes.T @ normal)))
        if not held[k]:
            origin = origin + (level - origin @ normal) * normal
            held[k] = True
    for point in axis_points[:1]:
        for k in (0, 1):
            if not held[k]:
                origin = origin + ((point - origin) @ axes[:, k]) * axes[:, k]
                held[k] = True
    return origin, held
