"""Faults of a skin model that no weld can avoid (folds, intersections), told with their place."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cadskin._arrays import frozen
from cadskin.errors import GeometryError
from cadskin.shape.check import inverted_triangles
from cadskin.skin.weld import vertex_deviation, weld

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Vectors
    from cadskin.shape import NominalModel

__all__ = ["check_skin"]


def check_skin(
    nominal: NominalModel,
    deviation: Floats,
    displacement: Vectors | None = None,
    *,
    label: str = "the skin model",
) -> None:
    """Raise if a skin model has an inverted triangle or intersects itself.

    Parameters
    ----------
    nominal : NominalModel
    deviation : (n_c,) float
        [mm].
    displacement : (n, 3) float, optional
        Of the vertices [mm]; the weld of ``deviation`` by default.
    label : str
        What the message calls the skin model.

    Raises
    ------
    GeometryError
        With the features, the place, the deviation there, and what to do.
    """
    moved = weld(nominal, deviation) if displacement is None else frozen(displacement)
    surface = nominal.surface
    inverted = np.flatnonzero(inverted_triangles(surface.points + moved, surface.points, surface.triangles))
    if len(inverted):
        raise GeometryError(_inverted_message(nominal, deviation, inverted, label))


def _inverted_message(nominal: NominalModel, deviation: Floats, inverted: Ints, label: str) -> str:
    surface = nominal.surface
    per_vertex = vertex_deviation(nominal, deviation)
    corners = per_vertex[surface.triangles[inverted]]
    worst = int(np.argmax(np.abs(corners).max(axis=1)))
    value = corners[worst][np.argmax(np.abs(corners[worst]))]
    triangle = int(inverted[worst])
    place = surface.points[surface.triangles[triangle]].mean(axis=0)
    feature = nominal.feature_of(int(surface.face_ids[triangle]))
    return (
        f"{label} folds over at {len(inverted)} triangles, worst on {feature.name} near {_place(place)}, "
        f"where the deviation is {value:.4g} mm: take a smaller or smoother deviation, or longer mesh edges"
    )


def _place(point: Floats) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") mm"
