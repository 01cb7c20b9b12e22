"""Linear size of cylinders, circles and spheres (ISO 14405-1)."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import associate, frame_about
from cadskin.verify.evaluation import Evaluation, active_of

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points, Vectors

__all__ = ["RANKS", "SizeCriterion", "diameters_about", "global_size", "local_diameters", "rank"]

SizeCriterion: TypeAlias = Literal["GG", "GX", "GN"]
_CRITERION = {"GG": "least squares", "GX": "maximum inscribed", "GN": "minimum circumscribed"}
RANKS: dict[str, Callable[[Floats], Any]] = {
    "SX": np.max,
    "SN": np.min,
    "SA": np.mean,
    "SM": np.median,
    "SD": lambda d: 0.5 * (np.max(d) + np.min(d)),
    "SR": np.ptp,
    "SQ": np.std,
}


def global_size(
    points: Points,
    kind: Literal["circle", "cylinder", "sphere"],
    criterion: SizeCriterion = "GG",
    *,
    section_normal: Vectors | None = None,
    axis: Vectors | None = None,
    limit: float | None = None,
) -> Evaluation:
    """Return a global size, a diameter [mm].

    Parameters
    ----------
    points : (n, 3) float
    kind : {"circle", "cylinder", "sphere"}
    criterion : {"GG", "GX", "GN"}
        Least squares, maximum inscribed, minimum circumscribed.
    section_normal, axis : (3,) float, optional
    limit : float, optional

    Raises
    ------
    AssociationError
        No maximum inscribed element exists on an arc of 180 degrees or less.
    """
    found = associate(points, kind, _CRITERION[criterion], axis=axis, section_normal=section_normal)
    radius = found.radius
    if radius is None:
        raise SpecificationError(f"a {kind} has no size")
    return Evaluation(
        characteristic="size",
        value=2.0 * radius,
        quantity=f"{criterion} diameter",
        certified=found.certified,
        n_points=found.n_points,
        limit=limit,
        zone={"kind": kind, "diameter": 2.0 * radius},
        active=active_of(found),
        operations=("extraction: the given points", "filtration: none", f"association: {found.criterion}"),
        details={"unique": found.unique, "scope": found.certificate.scope},
        notes=(found.certificate.reason,),
    )


def local_diameters(points: Points, normal: Vectors | None = None) -> Floats:
    """Return the two-point sizes LP (n,) of a section through the centre of its Gaussian circle [mm].

    For each point the opposite radius is interpolated between the two nearest points in angle.

    Raises
    ------
    AssociationError
        The section is not a full turn.
    """
    circle = associate(points, "circle", "least squares", section_normal=normal)
    flat = (np.asarray(points) - circle.pose.origin) @ frame_about(circle.pose.axis)[:, :2]
    sizes = diameters_about(flat)
    if sizes is None:
        raise AssociationError("two-point sizes need a full turn of the section")
    return sizes


def diameters_about(flat: Floats) -> Floats | None:
    """Return the two-point sizes (n,) [mm] of a section (n, 2) about the origin; None for no full turn."""
    angle = np.mod(np.arctan2(flat[:, 1], flat[:, 0]), 2 * np.pi)
    order = np.argsort(angle)
    angle, radius = angle[order], np.linalg.norm(flat, axis=1)[order]
    if np.diff(angle, append=angle[0] + 2 * np.pi).max() > 0.5 * np.pi:
        return None
    opposite = np.interp(np.mod(angle + np.pi, 2 * np.pi), angle, radius, period=2 * np.pi)
    return np.asarray(radius + opposite)


def rank(diameters: Floats, statistic: str) -> float:
    """Return a rank-order size: SX largest, SN smallest, SA mean, SM median, SD mid-range, SR range.

    Examples
    --------
    >>> rank(np.array([9.0, 10.0, 12.0]), "SD")
    10.5
    """
    if statistic not in RANKS:
        raise SpecificationError(f"unknown rank-order size {statistic!r}; choose one of {', '.join(RANKS)}")
    return float(RANKS[statistic](np.asarray(diameters)))
