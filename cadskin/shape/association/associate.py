"""Associate an ideal feature with points: one function for all kinds and criteria."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import AssociationError
from cadskin.shape.association import _kernels as kernels
from cadskin.shape.association.bounds import is_arc_open
from cadskin.shape.association.constrained import constrained
from cadskin.shape.association.least_squares import fit, principal_axes
from cadskin.shape.association.minimax import Minimax, Mode, minimax
from cadskin.shape.association.models import SurfaceModel
from cadskin.shape.association.packing import pack, pack_squares
from cadskin.shape.association.pose import Pose, frame_about
from cadskin.shape.association.slabs import hull_proof, tilt_proof
from cadskin.shape.association.starts import best_start, coarse_start, start_poses
from cadskin.shape.association.widths import hull_width

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors
    from cadskin.shape.association.result import Association, Criterion, Kind, Proof

__all__ = ["CRITERIA", "associate", "checked_points"]

_EPS = float(np.finfo(np.float64).eps)

# Letters of ISO 1101 after the tolerance value, and their words.
CRITERIA: dict[str, Criterion] = {
    "G": "least squares",
    "C": "minimum zone",
    "N": "minimum circumscribed",
    "X": "maximum inscribed",
    "GE": "constrained least squares",
    "GI": "constrained least squares, inside",
}


@dataclass(frozen=True)
class _Family:
    """How a kind is solved: kernel, least number of points, columns of least squares and of the minimax."""

    kind: int
    least: int
    squares: tuple[int, ...]
    zone: tuple[int, ...]


_FAMILIES: dict[str, _Family] = {
    "plane": _Family(kernels.PLANE, 3, (3, 4, 6), (3, 4)),
    "profile line": _Family(kernels.PLANE, 2, (3, 6), (3,)),
    "line": _Family(kernels.CYLINDER, 2, (), (0, 1, 3, 4)),
    "circle": _Family(kernels.CYLINDER, 3, (0, 1, 6), (0, 1)),
    "cylinder": _Family(kernels.CYLINDER, 5, (0, 1, 3, 4, 6), (0, 1, 3, 4)),
    "sphere": _Family(kernels.SPHERE, 4, (0, 1, 2, 6), (0, 1, 2)),
    "cone": _Family(kernels.CONE, 6, (0, 1, 3, 4, 6, 7), (0, 1, 3, 4, 7)),
    "torus": _Family(kernels.TORUS, 7, (0, 1, 2, 3, 4, 6, 7), (0, 1, 2, 3, 4, 7)),
}
_ROUND = ("circle", "cylinder", "sphere")  # kinds with a radius to circumscribe or inscribe


def associate(
    points: Points,
    kind: Kind,
    criterion: Criterion | str = "minimum zone",
    *,
    axis: Vectors | None = None,
    fixed_axis: Vectors | None = None,
    section_normal: Vectors | None = None,
    start: Pose | None = None,
    internal: bool = False,
) -> Association:
    """Associate an ideal feature with points.

    Parameters
    ----------
    points : (n, 3) float
        Extracted points [mm].
    kind : {"plane", "line", "profile line", "circle", "cylinder", "sphere", "cone", "torus"}
        A "line" is a line in space (a median line); a "profile line" lies in a section plane.
    criterion : str
        "least squares" (G), "minimum zone" (C), "minimum circumscribed" (N), "maximum inscribed" (X),
        "constrained least squares" (GE, outside of the material) or "constrained least squares, inside" (GI).
    axis : (3,) float, optional
        A guess of the direction: outward normal of a plane, axis of a cylinder. It sets the sign.
    fixed_axis : (3,) float, optional
        The direction is given and not optimised (a secondary datum).
    section_normal : (3,) float, optional
        Normal of the section plane of a circle or profile line; by default that of the points.
    start : Pose, optional
        Where to start instead of the search.
    internal : bool
        The material is around a round feature (a hole): only GE and GI need to know. The material of a plane
        lies against ``axis``.

    Raises
    ------
    GeometryError
        Wrong shape, NaN or infinity.
    AssociationError
        Too few points, a degenerate cloud, no convergence, or none exists.

    Examples
    --------
    >>> square = [[0, 0, 0], [10, 0, 0.1], [10, 10, 0], [0, 10, 0.1]]
    >>> found = associate(square, "plane")
    >>> round(found.value, 12), found.certified, found.certificate.scope
    (0.1, True, 'global')
    """
    family = _family(kind)
    word = _criterion(criterion)
    cloud = checked_points(points, least=family.least, what=kind)
    base = np.round(cloud[:: max(1, len(cloud) // 1000)].mean(axis=0))  # whole millimetres lose no digit
    local = np.ascontiguousarray(cloud - base)
    direction = fixed_axis if fixed_axis is not None else axis
    columns = _columns(family, fixed_axis is not None)
    request = _Request(kind, direction, fixed_axis is not None, section_normal, word == "least squares")
    begin = None if start is None else Pose(start.origin - base, start.axes, start.shape)
    pose = _least_squares(local, request, columns[0], begin)
    rounding = 2 * _EPS * _largest(cloud) + 4 * _EPS * _largest(local)
    if word in ("constrained least squares", "constrained least squares, inside"):
        if kind == "line":
            raise AssociationError("a line in space has no side; use least squares or the minimum zone")
        sign = 1.0 if (word == "constrained least squares") != internal else -1.0
        model = SurfaceModel(family.kind, local)
        return replace(constrained(model, base, kind, pose, columns[0], sign=sign), criterion=word)
    return _finish(local, base, kind, word, pose, columns, rounding)


def _largest(points: Points) -> float:
    """Return the largest coordinate, without its sign."""
    return float(max(points.max(), -points.min()))


def _columns(family: _Family, fixed: bool) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Columns of least squares and of the minimax; no rotation where the direction is given."""
    if not fixed:
        return family.squares, family.zone
    return (
        tuple(c for c in family.squares if c not in (3, 4, 5)),
        tuple(c for c in family.zone if c not in (3, 4, 5)),
    )


def _family(kind: str) -> _Family:
    try:
        return _FAMILIES[kind]
    except KeyError:
        raise AssociationError(f"unknown kind {kind!r}; choose one of {', '.join(_FAMILIES)}") from None


def _criterion(criterion: str) -> Criterion:
    for letter, word in CRITERIA.items():
        if criterion in (letter, word):
            return word
    raise AssociationError(f"unknown criterion {criterion!r}; choose one of {', '.join(CRITERIA.values())}")


def checked_points(points: Points, *, least: int, what: str) -> Points:
    """Return points (n, 3), finite, of at least ``least`` different places.

    Raises
    ------
    GeometryError
        Wrong shape, NaN or infinity.
    AssociationError
        Fewer different points than unknowns.
    """
    cloud: Points = frozen(points, shape=(None, 3), name=f"points of the {what}")
    different = len(cloud)
    if different <= 1000 or len(np.unique(cloud[:1000], axis=0)) < least:
        different = len(np.unique(cloud, axis=0))
    if different < least:
        raise AssociationError(
            f"a {what} needs at least {least} different points, got {different} (of {len(cloud)} given); "
            "extract more points"
        )
    return cloud


@dataclass(frozen=True, eq=False)
class _Request:
    """What is known before the fit."""

    kind: Kind
    direction: Vectors | None
    fixed: bool
    section_normal: Vectors | None
    must_converge: bool


def _least_squares(local: Points, request: _Request, squares: tuple[int, ...], start: Pose | None) -> Pose:
    """Return the least-squares pose."""
    kind, direction, fixed, section_normal = (
        request.kind, request.direction, request.fixed, request.section_normal
    )  # fmt: skip
    family = _FAMILIES[kind]
    centre, directions, spread = principal_axes(local)
    _refuse_degenerate(kind, spread, local, fixed=fixed)
    if start is not None:
        return fit(local, family.kind, start, squares)
    if kind == "plane":
        return _plane_pose(centre, directions, direction, fixed)
    if kind == "line":
        along = directions[:, 0] if not fixed else np.asarray(direction, dtype=np.float64)
        if direction is not None and along @ np.asarray(direction) < 0:
            along = -along
        return Pose(centre, frame_about(along), np.zeros(2))
    if kind == "profile line":
        return _profile_line_pose(centre, directions, direction, section_normal)
    if kind == "circle":
        normal = directions[:, 2] if section_normal is None else np.asarray(section_normal, dtype=np.float64)
        direction = normal
    starts = start_poses(local, family.kind, axis=direction)
    try:
        pose = fit(local, family.kind, best_start(local, family.kind, starts, squares), squares)
    except AssociationError:
        if request.must_converge:
            raise
        pose = coarse_start(local, family.kind, starts)
    if kind == "cylinder":
        pose = _centred_along(pose, local)
    return _oriented(pose, direction)


def _plane_pose(centre: Points, directions: Vectors, direction: Vectors | None, fixed: bool) -> Pose:
    if fixed:
        return Pose(centre, frame_about(np.asarray(direction)), np.zeros(2))
    normal = directions[:, 2]
    if direction is not None and normal @ np.asarray(direction, dtype=np.float64) < 0:
        normal = -normal
    return Pose(centre, frame_about(normal, directions[:, 0]), np.zeros(2))


def _profile_line_pose(
    centre: Points, directions: Vectors, direction: Vectors | None, section_normal: Vectors | None
) -> Pose:
    """Return the pose whose first axis is the section normal and whose third axis is normal to the line."""
    along = directions[:, 0]
    section = directions[:, 2] if section_normal is None else np.asarray(section_normal, dtype=np.float64)
    section = section / np.linalg.norm(section)
    up = np.cross(section, along)
    if float(np.linalg.norm(up)) < 1e-9:
        raise AssociationError(
            "the line is perpendicular to its section plane; give the right section_normal"
        )
    if direction is not None and up @ np.asarray(direction, dtype=np.float64) < 0:
        up = -up
    return Pose(centre, frame_about(up, section), np.zeros(2))


def _refuse_degenerate(kind: Kind, spread: Floats, local: Points, *, fixed: bool) -> None:
    largest = _largest(local)
    if spread[0] <= 4 * _EPS * max(largest, 1.0):
        raise AssociationError(f"all points coincide; a {kind} cannot be associated")
    if kind in ("line", "profile line"):
        return
    if spread[1] <= 1e-12 * spread[0]:
        raise AssociationError(f"the points are collinear; a {kind} cannot be associated")
    if kind in ("sphere", "cylinder", "cone", "torus") and not fixed and spread[2] <= 1e-12 * spread[0]:
        raise AssociationError(f"the points lie in one plane; a {kind} is not determined by them")


def _centred_along(pose: Pose, local: Points) -> Pose:
    """Move the origin along the axis to the middle of the points."""
    height = (local - pose.origin) @ pose.axis
    middle = 0.5 * float(height.min() + height.max())
    return Pose(pose.origin + middle * pose.axis, pose.axes, pose.shape)


def _oriented(pose: Pose, direction: Vectors | None) -> Pose:
    """Flip the axis of a symmetric kind to the side of a given direction."""
    if direction is None or pose.axis @ np.asarray(direction, dtype=np.float64) >= 0 or pose.shape[1] != 0:
        return pose
    return Pose(pose.origin, np.ascontiguousarray(pose.axes * np.array([1.0, -1.0, -1.0])), pose.shape)


def _finish(
    local: Points,
    base: Points,
    kind: Kind,
    criterion: Criterion,
    pose: Pose,
    columns: tuple[tuple[int, ...], tuple[int, ...]],
    rounding: float,
) -> Association:
    """Solve for the criterion from the least-squares pose and pack the result."""
    model = SurfaceModel(_FAMILIES[kind].kind, local)
    squares, free = columns
    if criterion == "least squares":
        return pack_squares(model, base, kind, pose, list(squares))
    if criterion in ("minimum circumscribed", "maximum inscribed") and kind not in (*_ROUND, "line"):
        raise AssociationError(f"a {kind} has no {criterion} element; use the minimum zone")
    if criterion == "maximum inscribed":
        if kind == "line":
            raise AssociationError("a line has no maximum inscribed element; use the minimum zone")
        _refuse_open_arc(kind, pose, local)
    mode: Mode = "zone"
    if kind == "line" or criterion == "minimum circumscribed":
        mode = "upper"
    elif criterion == "maximum inscribed":
        mode = "lower"
    if mode != "zone":
        pose = Pose(pose.origin, pose.axes, np.array([0.0, pose.shape[1]]))
    perfect = _perfect(model, kind, criterion, pose, rounding)
    if perfect is not None:
        return pack(perfect, model, base, kind, criterion, mode, exact=True)
    found = minimax(model, pose, free, mode)
    if kind == "plane" and len(free) == 2:
        found, proof = _narrowest_slab(model, found)
        return pack(found, model, base, kind, criterion, mode, proof=proof)
    return pack(found, model, base, kind, criterion, mode)


def _narrowest_slab(model: SurfaceModel, found: Minimax) -> tuple[Minimax, Proof]:
    """Return the narrowest slab of all and its proof; the hull is asked where the points do not say it."""
    proof, angle = tilt_proof(model.points, found, "plane")
    if proof is not None:
        return found, proof
    hull = hull_width(model.points, about=found.pose.axis, angle=angle)
    if hull is None:
        return found, hull_proof(found, None)
    width, direction = hull
    if direction is not None and width < found.value * (1 - 1e-12):
        start = Pose(found.pose.origin, frame_about(direction), np.zeros(2))
        better = minimax(model, start, (3, 4), "zone")
        found = better if better.value < found.value else found
    return found, hull_proof(found, width)


def _perfect(
    model: SurfaceModel, kind: Kind, criterion: Criterion, pose: Pose, rounding: float
) -> Minimax | None:
    """Return the trivial optimum where the points are on one ideal feature to rounding."""
    values = model.distances(pose)
    spread = float(values.max()) if kind == "line" else float(np.ptp(values))
    if spread > rounding:
        return None
    value = {"minimum circumscribed": float(values.max()), "maximum inscribed": -float(values.min())}
    none = np.zeros(0, dtype=np.int64)
    return Minimax(
        pose=pose,
        value=0.0 if kind == "line" else value.get(criterion, 0.0),
        distances=values,
        active=none,
        sides=none,
        multipliers=np.zeros(0),
        kkt=0.0,
        violation=spread,
        unique=True,
        certified=True,
        iterations=0,
    )


def _refuse_open_arc(kind: Kind, pose: Pose, local: Points) -> None:
    if kind == "sphere":
        return
    opened, gap = is_arc_open((pose.local(local))[:, :2])
    if opened:
        raise AssociationError(
            f"none exists: the points leave a gap of {np.degrees(gap):.6g} degrees, and on an arc of 180 "
            f"degrees or less no maximum inscribed {kind} exists; use least squares or the minimum zone"
        )
