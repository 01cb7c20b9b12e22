"""Flatness of every area of a stated size (ISO 1101, per unit area)."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cadskin.errors import AssociationError, SpecificationError
from cadskin.shape.association import frame_about
from cadskin.verify.form import form

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints, Points, Vectors
    from cadskin.shape import Feature
    from cadskin.spec import AreaUnit, Tolerance
    from cadskin.verify.evaluation import Evaluation
    from cadskin.verify.extraction import MadePart

__all__ = ["flatness_per_area"]

_PER_SIDE = 4  # points along the smaller side of an area
_LEAST = 4  # three points are always flat


def flatness_per_area(tolerance: Tolerance, part: MadePart, faces: tuple[int, ...]) -> Evaluation:
    """Return the worst flatness of the areas of a plane, which follow each other in steps of half their size.

    The mesh of the face is refined until four of its points lie along a side; areas are aligned with the
    longer side of the face. An area may reach over the rim, as long as four points are left.

    Raises
    ------
    SpecificationError
        An area of another shape than a square, a rectangle or a circle.
    AssociationError
        No area holds four points.
    """
    area, feature = tolerance.zone.per_area, part.features(faces)[0]
    assert area is not None
    size = _size(tolerance.id, area)
    normal = np.asarray(feature.faces[0].normal)

    def layout() -> tuple[Ints, Floats, list[Ints]]:
        points, triangles = part.nominal.surface.points, part.geometry.triangles(faces)
        return _layout(points, triangles, _frame(feature, normal), size, circular=area.shape == "circular")

    if part.same_vertices:
        corners, weights, areas = part.geometry.of_nominal(("areas", faces, area), layout)
    else:
        corners, weights, areas = _layout(
            part.surface.points,
            part.triangles(faces),
            _frame(feature, normal),
            size,
            circular=area.shape == "circular",
        )
    cloud = np.einsum("nk,nkj->nj", weights, part.surface.points[corners])
    found = _worst(cloud, areas, normal)
    across = f"a diameter of {size[0]:g} mm" if area.shape == "circular" else f"{size[0]:g} x {size[1]:g} mm"
    note = f"the worst of {len(areas)} areas of {across}, in steps of half of it"
    return replace(found, notes=(*found.notes, note), details={**found.details, "areas": len(areas)})


def _size(name: str, area: AreaUnit) -> tuple[float, float]:
    if area.shape not in ("square", "rectangular", "circular") or not area.size:
        raise SpecificationError(f"tolerance {name}: a value per {area.shape} area is not supported")
    return area.size, area.second or area.size


def _frame(feature: Feature, normal: Vectors) -> Vectors:
    centred = feature.points - feature.points.mean(axis=0)
    return frame_about(normal, np.linalg.svd(centred, full_matrices=False)[2][0])


def _layout(
    points: Points, triangles: Ints, axes: Vectors, size: tuple[float, float], *, circular: bool
) -> tuple[Ints, Floats, list[Ints]]:
    """Return corners and weights (n, 3) of the refined points, and the points of each area."""
    from scipy.spatial import cKDTree

    sides = points[triangles[:, [1, 2, 0]]] - points[triangles]
    longest = float(np.linalg.norm(sides, axis=2).max())
    corners, weights = _refined(triangles, max(1, int(np.ceil(longest * _PER_SIDE / min(size)))))
    flat = np.einsum("nk,nkj->nj", weights, points[corners]) @ axes[:, :2]
    scaled = 2.0 * (flat - flat.min(axis=0)) / np.array(size)  # an area has the half side 1
    counts = np.maximum(np.ceil(scaled.max(axis=0)).astype(np.int64) - 1, 1)
    grid = np.stack(np.meshgrid(*(1.0 + np.arange(count) for count in counts), indexing="ij"), axis=-1)
    tree, order = cKDTree(scaled), 2.0 if circular else np.inf
    near = tree.query_ball_point(grid.reshape(-1, 2), 1.0 + 1e-9, p=order)
    areas = [np.array(sorted(ids)) for ids in near if len(ids) >= _LEAST]
    if not areas:
        raise AssociationError(f"no area of {size[0]:g} x {size[1]:g} mm of the face holds four points")
    return corners, weights, areas


def _refined(triangles: Ints, parts: int) -> tuple[Ints, Floats]:
    """Return corners and weights (n, 3) of the lattice of each triangle with ``parts`` steps along a side."""
    lattice = [(i, j, parts - i - j) for i in range(parts + 1) for j in range(parts + 1 - i)]
    weights = np.tile(np.array(lattice, dtype=np.float64) / parts, (len(triangles), 1))
    corners = np.repeat(triangles, len(lattice), axis=0)
    return _without_copies(corners, weights)


def _without_copies(corners: Ints, weights: Floats) -> tuple[Ints, Floats]:
    """Drop points that neighbouring triangles share: same corners with the same weights."""
    order = np.argsort(np.where(weights > 0, corners, -1), axis=1)
    keys = np.where(weights > 0, corners, -1)
    sorted_keys = np.take_along_axis(keys, order, axis=1)
    sorted_weights = np.round(np.take_along_axis(weights, order, axis=1) * 2**20)
    table = np.concatenate([sorted_keys.astype(np.float64), sorted_weights], axis=1)
    _, first = np.unique(table, axis=0, return_index=True)
    first.sort()
    return corners[first], weights[first]


def _worst(cloud: Points, areas: list[Ints], normal: Vectors) -> Evaluation:
    """Return the worst flatness: areas in the order of an upper bound, until no other can be worse."""
    bounds = np.array([_range(cloud[ids], normal) for ids in areas])
    best: Evaluation | None = None
    for index in np.argsort(-bounds):
        if best is not None and bounds[index] <= best.value:
            break
        found = form(cloud[areas[index]], "flatness", axis=normal)
        if best is None or found.value > best.value:
            best = found
    assert best is not None
    return replace(best, n_points=len(cloud))


def _range(points: Points, normal: Vectors) -> float:
    """Return the range about the plane of least squares, not less than the flatness."""
    axes = frame_about(normal)
    local = (points - points.mean(axis=0)) @ axes
    slope = np.linalg.lstsq(local[:, :2], local[:, 2], rcond=None)[0]
    return float(np.ptp(local[:, 2] - local[:, :2] @ slope))
