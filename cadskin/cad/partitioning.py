"""Partition (ISO 17450): which B-rep faces count as one feature."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any

import numpy as np
from OCP.TopAbs import TopAbs_ShapeEnum

from cadskin._typing import Points
from cadskin.cad._occ import edges_of, faces_of, index_map
from cadskin.shape.ideal import Cone, Cylinder, Plane, Sphere, Torus
from cadskin.shape.nominal import Face

__all__ = ["face_neighbours", "partition", "same_surface"]

RELATIVE_TOLERANCE = 1e-6
"""Two surfaces count as one when they differ by less than this part of the shape's diagonal."""


def partition(shape: Any, faces: Sequence[Face]) -> tuple[tuple[int, ...], ...]:
    """Return the faces of each feature: faces of one analytic surface that hang together are one.

    Two faces are joined when they share an edge, lie on the same plane, cylinder, cone, sphere or torus (to
    1e-6 of the part's diagonal) and have the material on the same side. B-spline faces are never joined.

    Parameters
    ----------
    shape : TopoDS_Shape
    faces : sequence of Face
        Of `describe_faces`.

    Returns
    -------
    tuple of tuple of int
        Face indices of each feature, ascending; every face exactly once; ordered by their first face.

    Examples
    --------
    >>> import cadquery as cq
    >>> from cadskin.cad.faces import describe_faces
    >>> box = cq.Workplane().box(1, 1, 1).val().wrapped
    >>> partition(box, describe_faces(box))
    ((0,), (1,), (2,), (3,), (4,), (5,))
    """
    if not faces:
        return ()
    corners = np.concatenate([face.bounds for face in faces])
    tolerance = max(RELATIVE_TOLERANCE * float(np.linalg.norm(np.ptp(corners, axis=0))), 1e-9)
    parent = list(range(len(faces)))

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for a, b in face_neighbours(shape):
        if same_surface(faces[a], faces[b], tolerance=tolerance):
            low, high = sorted((root(a), root(b)))
            parent[high] = low
    groups: dict[int, list[int]] = defaultdict(list)
    for i in range(len(faces)):
        groups[root(i)].append(i)
    return tuple(tuple(groups[key]) for key in sorted(groups))


def face_neighbours(shape: Any) -> list[tuple[int, int]]:
    """Return the pairs of different faces that share an edge, each once, the smaller index first."""
    edges = index_map(shape, TopAbs_ShapeEnum.TopAbs_EDGE)
    owners: dict[int, list[int]] = defaultdict(list)
    for i, face in enumerate(faces_of(shape)):
        for edge in edges_of(face):
            owners[edges.FindIndex(edge)].append(i)
    pairs = {(a, b) for shared in owners.values() for k, a in enumerate(shared) for b in shared[k + 1 :]}
    return sorted(pairs)


def same_surface(one: Face, other: Face, *, tolerance: float) -> bool:
    """Return True if two faces lie on one analytic surface, material on the same side.

    Parameters
    ----------
    one, other : Face
    tolerance : float
        Largest distance [mm] between the two surfaces over the extent of the two faces.
    """
    if one.kind != other.kind or one.internal != other.internal:
        return False
    reach = float(np.linalg.norm(np.ptp(np.concatenate([one.bounds, other.bounds]), axis=0)))
    a: Any = one.ideal
    b: Any = other.ideal
    match a:
        case Plane():
            tilt = float(np.linalg.norm(a.normal - b.normal)) * reach
            return tilt <= tolerance and abs(float((other.centre - one.centre) @ a.normal)) <= tolerance
        case Cylinder():
            same_radius = abs(a.radius - b.radius) <= tolerance
            return same_radius and _coaxial(a, b, near=one.centre, reach=reach, tolerance=tolerance)
        case Cone():
            turn = float(np.linalg.norm(a.axis - b.axis)) + abs(a.half_angle - b.half_angle)
            far = reach + float(np.linalg.norm(one.centre - a.apex))
            return turn * far <= tolerance and float(np.linalg.norm(a.apex - b.apex)) <= tolerance
        case Sphere():
            apart = float(np.linalg.norm(a.centre - b.centre))
            return bool(abs(a.radius - b.radius) + apart <= tolerance)
        case Torus():
            radii = abs(a.major_radius - b.major_radius) + abs(a.minor_radius - b.minor_radius)
            tilt = float(np.linalg.norm(np.cross(a.axis, b.axis))) * reach
            return bool(radii + tilt + float(np.linalg.norm(a.centre - b.centre)) <= tolerance)
        case _:
            return False


def _coaxial(a: Cylinder, b: Cylinder, *, near: Points, reach: float, tolerance: float) -> bool:
    """Return True if two axes agree near a point (3,) over a length ``reach`` [mm]."""
    if float(np.linalg.norm(np.cross(a.axis, b.axis))) * reach > tolerance:
        return False
    foot_a = a.origin + ((near - a.origin) @ a.axis) * a.axis
    foot_b = b.origin + ((near - b.origin) @ b.axis) * b.axis
    return float(np.linalg.norm(foot_a - foot_b)) <= tolerance
