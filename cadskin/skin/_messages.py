"""The words for the faults of a skin model: which features, where, which deviation, how thick."""

from __future__ import annotations

import warnings
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import CadskinWarning
from cadskin.shape.discrete import triangle_normals
from cadskin.skin.weld import vertex_deviation

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points
    from cadskin.shape import NominalModel

__all__ = ["crossing", "fold", "wall", "warn_of_nominal"]


def wall(nominal: NominalModel, deviation: Floats, pairs: Ints, label: str) -> str:
    """Describe a wall or gap that the deviations close, where they exceed it most; ``pairs`` (k, 2)."""
    surface = nominal.surface
    centres = surface.points[surface.triangles[pairs]].mean(axis=2)
    normals = triangle_normals(surface.points, surface.triangles[pairs[:, 0]])
    across = np.einsum("ki,ki->k", normals, centres[:, 1] - centres[:, 0])
    values = _largest(nominal, deviation, pairs)
    worst = int(np.argmax(np.round(np.abs(values).sum(axis=1) - np.abs(across), 9)))
    width = float(across[worst])
    what = f"wall is {-width:.4g} mm thick" if width <= 0 else f"gap is {width:.4g} mm wide"
    return (
        f"{label} passes through itself at {len(pairs)} pairs of triangles, worst between "
        f"{_name(nominal, pairs[worst, 0])} and {_name(nominal, pairs[worst, 1])} near "
        f"{_place(centres[worst].mean(axis=0))}: the {what} there, the deviations are "
        f"{values[worst, 0]:.4g} and {values[worst, 1]:.4g} mm; take a smaller deviation"
    )


def fold(nominal: NominalModel, deviation: Floats, inverted: Ints, label: str) -> str:
    """Describe triangles (k,) that are turned over."""
    triangle, _, values = _worst(nominal, deviation, np.stack([inverted, inverted], axis=1))
    place = nominal.surface.points[nominal.surface.triangles[triangle]].mean(axis=0)
    return (
        f"{label} folds over at {len(inverted)} triangles, worst on {_name(nominal, triangle)} near "
        f"{_place(place)}: the deviation is {values[0]:.4g} mm{_radius_text(nominal, triangle)} there; "
        f"take a smaller or smoother deviation, or longer mesh edges"
    )


def crossing(nominal: NominalModel, deviation: Floats, pairs: Ints, label: str) -> str:
    """Describe an intersection of triangles (k, 2) that is neither a wall nor a fold."""
    one, two, values = _worst(nominal, deviation, pairs)
    place = nominal.surface.points[nominal.surface.triangles[[one, two]]].mean(axis=(0, 1))
    return (
        f"{label} intersects itself at {len(pairs)} pairs of triangles, worst between "
        f"{_name(nominal, one)} and {_name(nominal, two)} near {_place(place)}: the deviations are "
        f"{values[0]:.4g} and {values[1]:.4g} mm{_radius_text(nominal, one)} there; "
        f"take a smaller or smoother deviation, or longer mesh edges"
    )


def warn_of_nominal(nominal: NominalModel, pairs: Ints) -> None:
    """Warn that triangles (k, 2) of the nominal mesh intersect."""
    one, two = (int(triangle) for triangle in pairs[0])
    place = nominal.surface.points[nominal.surface.triangles[[one, two]]].mean(axis=(0, 1))
    warnings.warn(
        f"the nominal mesh already intersects itself at {len(pairs)} pairs of triangles, first between "
        f"{_name(nominal, one)} and {_name(nominal, two)} near {_place(place)}; take shorter mesh edges",
        CadskinWarning,
        stacklevel=4,
    )


def _worst(nominal: NominalModel, deviation: Floats, pairs: Ints) -> tuple[int, int, tuple[float, float]]:
    """Return the pair of triangles with the largest deviations, and these."""
    values = _largest(nominal, deviation, pairs)
    worst = int(np.abs(values).sum(axis=1).argmax())
    one, two = (int(triangle) for triangle in pairs[worst])
    return one, two, (float(values[worst, 0]), float(values[worst, 1]))


def _largest(nominal: NominalModel, deviation: Floats, pairs: Ints) -> Floats:
    """Return the largest deviation in magnitude at each triangle of the pairs (k, 2) [mm]."""
    corners = vertex_deviation(nominal, deviation)[nominal.surface.triangles[pairs]]  # (k, 2, 3)
    chosen = np.abs(corners).argmax(axis=2)
    values = np.take_along_axis(corners, chosen[:, :, None], axis=2)[:, :, 0]
    return np.asarray(values, dtype=np.float64)


def _radius_text(nominal: NominalModel, triangle: int) -> str:
    """Return the smallest radius of curvature at a triangle as text, nothing on a plane."""
    curvature = float(np.abs(nominal.samples.curvatures[nominal.corner_samples[triangle]]).max())
    return f" and the radius {1 / curvature:.4g} mm" if curvature > 0 else ""


def _name(nominal: NominalModel, triangle: int | np.int64) -> str:
    return nominal.feature_of(int(nominal.surface.face_ids[triangle])).name


def _place(point: Points) -> str:
    return "(" + ", ".join(f"{x:.4g}" for x in point) + ") mm"
