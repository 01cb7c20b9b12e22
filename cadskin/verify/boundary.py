"""Virtual boundaries (ISO 2692): maximum and least material requirements as one minimax over what may move.

A hole conforms to a maximum material requirement when none of its points lies inside the maximum material
virtual cylinder (MMVS) at its theoretically exact place; a shaft when none lies outside. Datum features with
the requirement are boundaries too, so that the frame may move within them: all boundaries are stacked into
one problem, ``min over the free motions of the largest violation``, and the part conforms when that is not
positive.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association import Patch
from cadskin.verify.evaluation import Evaluation, active_of
from cadskin.verify.zones import FREEDOMS, free_columns, line_patch, solve

if TYPE_CHECKING:
    from cadskin._typing import Points, Vectors
    from cadskin.shape import Feature
    from cadskin.shape.association import Pose
    from cadskin.spec import Specification

__all__ = ["Boundary", "Requirement", "boundary_patch", "boundary_violation", "material_size", "virtual_size"]

Requirement: TypeAlias = Literal["MMR", "LMR"]


@dataclass(frozen=True, eq=False)
class Boundary:
    """A virtual cylinder and the points that must respect it.

    Parameters
    ----------
    points : (n, 3) float
        The integral feature, in the world [mm].
    place : (3,) float
        A point of the exact axis, in the frame [mm].
    direction : (3,) float
        Of the exact axis, in the frame.
    diameter : float
        Virtual size [mm].
    keeps_out : bool
        True where the points must stay outside of the cylinder (a hole at maximum, a shaft at least
        material).
    """

    points: Points
    place: Points
    direction: Vectors
    diameter: float
    keeps_out: bool


def virtual_size(size: float, tolerance: float, *, internal: bool, requirement: Requirement = "MMR") -> float:
    """Return the virtual size [mm] of a material requirement.

    Parameters
    ----------
    size : float
        Maximum (MMR) or least (LMR) material size, a diameter [mm].
    tolerance : float
        Geometrical tolerance [mm].
    internal : bool
    requirement : {"MMR", "LMR"}

    Examples
    --------
    >>> virtual_size(10.0, 0.1, internal=True), virtual_size(10.0, 0.1, internal=False)
    (9.9, 10.1)
    """
    if tolerance < 0 or size <= 0:
        raise SpecificationError(
            f"a virtual size needs size > 0 and tolerance >= 0, got {size} and {tolerance}"
        )
    inward = internal == (requirement == "MMR")
    return size - tolerance if inward else size + tolerance


def boundary_violation(
    boundaries: list[Boundary],
    frame: Pose,
    *,
    free: tuple[str, ...] = (),
    certified: bool = True,
    operations: tuple[str, ...] = (),
) -> Evaluation:
    """Return the smallest worst violation of virtual boundaries that the free motions allow.

    Parameters
    ----------
    boundaries : list of Boundary
        Of the toleranced features and of datum features with a material requirement; they move together.
    frame : Pose
        Datum frame.
    free : tuple of str
        Motions that are left, ``tx`` ... ``rz``.
    certified : bool
        Of the datum system.
    operations : tuple of str

    Returns
    -------
    Evaluation
        Its value is the violation as a radius [mm], negative where there is room; the limit is 0.
    """
    if not boundaries:
        raise SpecificationError("a material requirement needs at least one boundary")
    parts = [(boundary_patch(boundary), np.asarray(boundary.points)) for boundary in boundaries]
    columns = free_columns(name for name in FREEDOMS if name in free)
    found = solve(parts, frame, columns, "upper", what="material requirement")
    return Evaluation(
        characteristic="material requirement",
        value=found.value,
        quantity="worst violation of the virtual boundary",
        certified=found.certified and certified,
        n_points=len(found.distances),
        limit=0.0,
        zone={"kind": "virtual boundary", "origin": found.pose.origin, "axes": found.pose.axes},
        active=active_of(found),
        operations=(*operations, "extraction: the given points", "filtration: none"),
        details={"unique": found.unique},
    )


def boundary_patch(boundary: Boundary) -> Patch:
    """Return the virtual cylinder as a patch: the distance is the violation."""
    sign = -1.0 if boundary.keeps_out else 1.0
    return line_patch(boundary.direction, boundary.place, radius=0.5 * boundary.diameter, sign=sign)


def material_size(spec: Specification, feature: Feature, requirement: Requirement, name: str) -> float:
    """Return the maximum or least material size of a feature, a diameter [mm]."""
    faces = set(feature.face_indices)
    for dimension in spec.dimensions:
        if dimension.kind != "size" or not faces & set(dimension.feature.faces):
            continue
        # The most material: the largest shaft, the smallest hole.
        limit = dimension.lower if feature.internal == (requirement == "MMR") else dimension.upper
        if limit is not None:
            return 2.0 * limit if dimension.name == "radius" else limit
    raise SpecificationError(
        f"tolerance {name}: {requirement} needs a size with limits on {feature.name}; the "
        "specification has none"
    )
