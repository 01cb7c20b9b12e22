"""Circular and total run-out, radial and axial (ISO 1101), about a datum axis."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np

from cadskin.errors import SpecificationError
from cadskin.shape.association.associate import checked_points
from cadskin.verify.evaluation import Evaluation
from cadskin.verify.median import split_sections

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Points
    from cadskin.verify.datums import DatumFrame, EstablishedDatum

__all__ = ["RunoutDirection", "datum_axis", "runout"]

RunoutDirection: TypeAlias = Literal["radial", "axial"]


def runout(
    points: Points,
    datums: DatumFrame,
    *,
    direction: RunoutDirection = "radial",
    total: bool = False,
    circles: Sequence[Points] | int | None = None,
    limit: float | None = None,
) -> Evaluation:
    """Evaluate a run-out: the range of the indicator about the datum axis.

    Parameters
    ----------
    points : (n, 3) float
        The toleranced surface.
    datums : DatumFrame
        With an axis.
    direction : {"radial", "axial"}
        Perpendicular to or along the axis.
    total : bool
        One range over the whole surface; else the largest over single circles.
    circles : sequence of (k, 3) float, or int, optional
        For circular run-out: the points of each circle, or how many there are; by default found by gaps.
    limit : float, optional
    """
    datum = datum_axis(datums)
    cloud = checked_points(points, least=2, what="run-out")

    def indicator(part: Points) -> Floats:
        relative = part - datum.point
        height = relative @ datum.direction
        if direction == "axial":
            return np.asarray(height)
        return np.asarray(np.linalg.norm(relative - height[:, None] * datum.direction, axis=1))

    if total:
        parts: list[Points] = [cloud]
    elif circles is None or isinstance(circles, int):
        parts = _circles(cloud, datum.direction, datum.point, direction, circles)
    else:
        parts = [np.asarray(part) for part in circles]
    ranges = [float(np.ptp(indicator(part))) for part in parts]
    name = f"{'total' if total else 'circular'} run-out, {direction}"
    return Evaluation(
        characteristic="total run-out" if total else "circular run-out",
        value=max(ranges),
        quantity=name,
        certified=datums.certified,
        n_points=len(cloud),
        limit=limit,
        zone={"kind": "run-out", "direction": datum.direction, "point": datum.point, "width": max(ranges)},
        operations=(*datums.operations(), "extraction: the given points", "filtration: none"),
        details={"circles": len(parts), "ranges": ranges},
    )


def datum_axis(datums: DatumFrame) -> EstablishedDatum:
    """Return the first axis of a datum system (a plane may stand before it).

    Raises
    ------
    SpecificationError
        There is none.
    """
    found = next((datum for datum in datums.datums if datum.kind == "cylinder"), None)
    if found is None:
        first = datums.datums[0]
        raise SpecificationError(f"run-out needs a datum axis; datum {first.label} is a {first.kind}")
    return found


def _circles(
    cloud: Points, axis: Points, point: Points, direction: RunoutDirection, count: int | None
) -> list[Points]:
    if direction == "radial":
        return split_sections(cloud, axis, count)
    relative = cloud - point
    radii = np.linalg.norm(relative - np.outer(relative @ axis, axis), axis=1)
    # Circles of a face differ in radius: split along a line on which the radius is the coordinate.
    carrier = np.column_stack([radii, np.arange(len(cloud)), np.zeros(len(cloud))])
    rings = split_sections(carrier, np.array([1.0, 0, 0]), count)
    return [cloud[ring[:, 1].astype(np.int64)] for ring in rings]
