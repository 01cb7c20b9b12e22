"""Fingerprints of faces: find the same face again after the CAD model was exported once more.

Face indices and STEP entity numbers change from export to export; what a face *is* (kind, size, place) does
not. Where two faces answer to one fingerprint nothing is guessed: the match says so and lists them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, cast

import numpy as np

from cadskin._typing import Bools, Floats
from cadskin.errors import GeometryError
from cadskin.shape.face import Face

__all__ = ["FaceFingerprint", "FaceMatch", "MatchStatus", "fingerprint", "match_faces"]

MatchStatus: TypeAlias = Literal["matched", "moved", "ambiguous", "lost"]
Triple: TypeAlias = tuple[float, float, float]


@dataclass(frozen=True)
class FaceFingerprint:
    """What a face is, in plain numbers (mm, mm², rad) that can be written to a file.

    Parameters
    ----------
    kind : str
        Kind of its ideal surface.
    internal : bool
        True for a hole.
    area : float
    centre : tuple of 3 float
        Centre of area.
    normal : tuple of 3 float
        Outward normal at the middle of the face.
    axis : tuple of 3 float or None
        Direction of the axis, its first sizeable component positive.
    radius : float or None
        Radius, or minor radius of a torus.
    size : float or None
        Half angle of a cone [rad] or major radius of a torus.
    """

    kind: str
    internal: bool
    area: float
    centre: Triple
    normal: Triple
    axis: Triple | None = None
    radius: float | None = None
    size: float | None = None

    def quantised(self, step: float = 1e-3) -> tuple[Any, ...]:
        """Return a hashable key: lengths rounded to ``step`` [mm], directions to 1e-4.

        Equal keys mean equal faces to the step; faces that differ by less may still fall on two sides of a
        rounding limit, so compare with `distance` where that matters.
        """
        if not step > 0:
            raise GeometryError(f"the step of a fingerprint must be positive, got {step}")

        def lengths(*values: float) -> tuple[int, ...]:
            return tuple(round(value / step) for value in values)

        axis = None if self.axis is None else tuple(round(c * 1e4) for c in self.axis)
        sizes = tuple(None if v is None else round(v / step) for v in (self.radius, self.size))
        return self.kind, self.internal, *lengths(self.area**0.5, *self.centre), axis, *sizes

    def distance(self, other: FaceFingerprint) -> float:
        """Return how far two faces are apart [mm]; infinite between different kinds.

        Root of the squared differences of centre, square root of the area, radius, and of the turn of normal
        and axis times the square root of the area.
        """
        if self.kind != other.kind or self.internal != other.internal:
            return float("inf")
        extent = float(np.sqrt(max(self.area, other.area)))
        terms = [
            *np.subtract(self.centre, other.centre),
            self.area**0.5 - other.area**0.5,
            *_differences(self, other, extent),
        ]
        if self.kind == "plane":
            terms.extend(extent * np.subtract(self.normal, other.normal))
        return float(np.linalg.norm(terms))


@dataclass(frozen=True)
class FaceMatch:
    """What became of one old face.

    Parameters
    ----------
    old : int
        Position in the old fingerprints.
    status : {"matched", "moved", "ambiguous", "lost"}
        ``matched``: the same place and size. ``moved``: one face only can be it, with another outline on the
        same plane or cylinder, or else of the same size elsewhere. ``ambiguous``: several could be it.
        ``lost``: none.
    new : int or None
        Index of the new face where the status is matched or moved.
    candidates : tuple of int
        The new faces that could be it.
    """

    old: int
    status: MatchStatus
    new: int | None = None
    candidates: tuple[int, ...] = ()


def fingerprint(face: Face) -> FaceFingerprint:
    """Return the fingerprint of a face.

    Examples
    --------
    >>> from cadskin.shape import Cylinder
    >>> hole = Face(index=4, ideal=Cylinder([0, 0, 0], [0, 0, -1], 2.0), area=62.8, centre=[0, 0, 2.5],
    ...             normal=[1, 0, 0], bounds=[[-2, -2, 0], [2, 2, 5]], internal=True)
    >>> fingerprint(hole).axis
    (0.0, 0.0, 1.0)
    """
    ideal: Any = face.ideal
    axis = getattr(ideal, "axis", None)
    size = getattr(ideal, "half_angle", getattr(ideal, "major_radius", None))
    return FaceFingerprint(
        kind=face.kind,
        internal=face.internal,
        area=float(face.area),
        centre=_triple(face.centre),
        normal=_triple(face.normal),
        axis=None if axis is None else _triple(_unsigned(axis)),
        radius=face.radius,
        size=None if size is None else float(size),
    )


def match_faces(
    old: Sequence[FaceFingerprint],
    new: Sequence[Face | FaceFingerprint],
    *,
    tolerance: float | None = None,
) -> tuple[FaceMatch, ...]:
    """Return for each old fingerprint which new face it is, without ever choosing between two.

    Parameters
    ----------
    old : sequence of FaceFingerprint
    new : sequence of Face or FaceFingerprint
        The faces of the part as it is now, in the order of their index.
    tolerance : float, optional
        Distance [mm] up to which a face counts as the same; 1e-4 of the part's size by default.

    Returns
    -------
    tuple of FaceMatch
        One per old fingerprint, in their order.
    """
    now = [fingerprint(face) if isinstance(face, Face) else face for face in new]
    if not old:
        return ()
    limit = 1e-4 * _extent(now) if tolerance is None else float(tolerance)
    if not now:
        return tuple(FaceMatch(i, "lost") for i in range(len(old)))
    apart = np.array([[a.distance(b) for b in now] for a in old])
    here: Bools = np.asarray(apart <= limit)
    missing: Bools = np.asarray(~here.any(axis=1))
    claims, status = here.copy(), ["matched"] * len(old)
    for test in (_same_surface, _same_size):
        free: Bools = np.asarray(~claims.any(axis=0))
        found = np.array([[test(a, b, limit) for b in now] for a in old]) & missing[:, None] & free[None, :]
        claims |= found
        for i in np.flatnonzero(found.any(axis=1)):
            missing[i], status[i] = False, "moved"
    return tuple(_verdict(i, claims, cast("MatchStatus", status[i])) for i in range(len(old)))


def _verdict(i: int, claims: Bools, status: MatchStatus) -> FaceMatch:
    """Return the match of old face ``i`` from the table of claims (old, new)."""
    candidates = tuple(int(j) for j in np.flatnonzero(claims[i]))
    if not candidates:
        return FaceMatch(i, "lost")
    if len(candidates) > 1 or claims[:, candidates[0]].sum() > 1:
        return FaceMatch(i, "ambiguous", candidates=candidates)
    return FaceMatch(i, status, new=candidates[0], candidates=candidates)


def _same_surface(a: FaceFingerprint, b: FaceFingerprint, limit: float) -> bool:
    """Return True if two faces lie on one plane or cylinder, whatever their outlines."""
    if a.kind != b.kind or a.internal != b.internal:
        return False
    extent = float(np.sqrt(max(a.area, b.area)))
    apart = np.subtract(a.centre, b.centre)
    if a.kind == "plane":
        turned = extent * float(np.linalg.norm(np.subtract(a.normal, b.normal)))
        return turned <= limit and abs(float(apart @ np.asarray(a.normal))) <= limit
    if a.kind == "cylinder" and a.axis is not None:
        across = apart - (apart @ np.asarray(a.axis)) * np.asarray(a.axis)
        return float(np.linalg.norm([*_differences(a, b, extent), *across])) <= limit
    return False


def _same_size(a: FaceFingerprint, b: FaceFingerprint, limit: float) -> bool:
    """Return True if two faces have one kind, area and radius, wherever they are."""
    if a.kind != b.kind or a.internal != b.internal:
        return False
    pairs = ((a.area**0.5, b.area**0.5), (a.radius, b.radius), (a.size, b.size))
    return all(abs(x - y) <= limit for x, y in pairs if x is not None and y is not None)


def _differences(a: FaceFingerprint, b: FaceFingerprint, extent: float) -> list[float]:
    """Return the differences [mm] of radius and size, and the turn of the axes over the extent."""
    terms = [x - y for x, y in ((a.radius, b.radius),) if x is not None and y is not None]
    if a.size is not None and b.size is not None:
        terms.append((a.size - b.size) * (extent if a.kind == "cone" else 1.0))
    if a.axis is not None and b.axis is not None:
        terms.append(extent * float(np.linalg.norm(np.cross(a.axis, b.axis))))
    return terms


def _extent(faces: Sequence[FaceFingerprint]) -> float:
    if not faces:
        return 1.0
    centres = np.array([face.centre for face in faces])
    return float(np.linalg.norm(np.ptp(centres, axis=0)) + np.sqrt(max(face.area for face in faces)))


def _unsigned(axis: Floats) -> Floats:
    lead = axis[int(np.argmax(np.abs(axis) > 0.1))]
    return axis if lead > 0 else -axis


def _triple(values: Floats) -> Triple:
    x, y, z = (float(v) + 0.0 for v in values)
    return x, y, z
