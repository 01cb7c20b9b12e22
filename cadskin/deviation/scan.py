"""Deviations read off a scan: the distance along the normals to a measured cloud of points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.spatial import cKDTree

from cadskin._jit import kernel
from cadskin.deviation._parameters import array_of, positive, whole
from cadskin.deviation._point_cells import cell_bounds, find_cell, point_cells
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.registry import register
from cadskin.errors import DeviationError
from cadskin.shape._tangents import fill_tangents

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points
    from cadskin.deviation._point_cells import PointCells
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["FromScan"]

_PROBED = 20_000  # points of the scan that tell its density


@register
@dataclass(frozen=True, eq=False, repr=False)
class FromScan(DeviationModel):
    """The deviations of a scanned part: points measured on it, already registered to the nominal model.

    At each sample the nearest points, seen along the normal, carry a local quadric
    ``d = a + b s + c t + e s² + f s t + g t²`` over the tangent plane, weighted by their distance; a is the
    deviation. Points further away along the normal than ``reach`` belong to other faces.

    Parameters
    ----------
    points : (k, 3) float
        [mm].
    reach : float
        Largest deviation that is looked for [mm], > 0.
    neighbours : int
        Points of a local fit, 8 or more; more of them smooth the noise of the scan.

    Raises
    ------
    DeviationError
        Samples that the scan does not cover: fewer than six points within twice the usual distance of the
        ``neighbours``-th neighbour; restrict the model to the faces that were scanned.

    Examples
    --------
    >>> FromScan(np.zeros((20, 3)), reach=0.5)
    FromScan(<20 points> mm, reach=0.5 mm)
    """

    name: ClassVar[str] = "scan"
    points: Points = field(metadata=MM)
    reach: float = field(metadata=MM)
    neighbours: int = 12

    def __post_init__(self) -> None:
        """Check the points."""
        object.__setattr__(self, "points", array_of(self.points, (None, 3), "points", self))
        object.__setattr__(self, "reach", positive(self.reach, "reach", "mm", self))
        object.__setattr__(self, "neighbours", whole(self.neighbours, "neighbours", 8, self))
        if len(self.points) < self.neighbours:
            raise DeviationError(
                f"FromScan: {len(self.points)} points, at least {self.neighbours} are needed"
            )

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Fit the scan around every sample."""
        some = self.points[:: max(1, len(self.points) // _PROBED)]
        tree = cKDTree(self.points, balanced_tree=False, compact_nodes=False)
        nearest, _ = tree.query(some, k=[self.neighbours])
        radius = 2.0 * float(np.median(nearest))  # a corner sees a quarter of this disc: enough points
        cloud = point_cells(self.points, 2.0 * radius)
        return form_sampler(nominal, features, lambda feature: self._on(feature, cloud, radius))

    def _on(self, feature: Feature, cloud: PointCells, radius: float) -> Floats:
        values = np.zeros(feature.n_points)
        covered = np.zeros(feature.n_points, dtype=bool)
        _fit_heights(
            np.ascontiguousarray(feature.points),
            np.ascontiguousarray(feature.normals),
            (cloud.points, cloud.grid, cloud.counts, cloud.starts, cloud.keys, cloud.cells),
            np.array([self.reach, radius]),
            self.neighbours,
            values,
            covered,
        )
        if not covered.all():
            raise DeviationError(
                f"FromScan: the scan does not cover {(~covered).sum()} of {feature.n_points} samples of "
                f"{feature.name} (reach {self.reach:.4g} mm, {radius:.4g} mm around the normal); restrict "
                "the model with .on(...), register the scan, or raise reach"
            )
        return values

    def __str__(self) -> str:
        more = "" if self.neighbours == 12 else f", neighbours={self.neighbours}"
        return f"FromScan(<{len(self.points)} points> mm, reach={self.reach:.12g} mm{more})"

    __repr__ = __str__


@kernel
def _fit_heights(
    points: Any, normals: Any, cloud: Any, limits: Any, neighbours: int, values: Any, covered: Any
) -> None:
    """Height of the weighted quadric over the tangent plane at each point, from the cloud points around it.

    ``cloud`` holds the arrays of `PointCells`; ``limits`` are the reach along the normal and the radius about
    it.
    """
    axes = np.zeros((3, 3))  # two tangents and the normal
    seen = np.zeros((neighbours, 4))  # squared distance from the normal, s, t, height: the nearest first
    basis = np.zeros((neighbours, 6))
    right = np.zeros(neighbours)
    for i in range(points.shape[0]):
        axes[2] = normals[i]
        fill_tangents(normals[i], axes[0], axes[1])
        count = _around_normal(points[i], axes, cloud, limits, seen)
        if count < 6:
            continue
        covered[i] = True
        used = min(count, neighbours)
        scale = math.sqrt(seen[used - 1, 0])
        scale = scale if scale > 0.0 else 1.0
        for k in range(used):
            s, t = seen[k, 1] / scale, seen[k, 2] / scale
            weight = 1.0 - 0.75 * (s * s + t * t)
            basis[k, 0], basis[k, 1], basis[k, 2] = weight, weight * s, weight * t
            basis[k, 3], basis[k, 4], basis[k, 5] = weight * s * s, weight * s * t, weight * t * t
            right[k] = weight * seen[k, 3]
        values[i] = _first_coefficient(basis, right, used)


@kernel
def _around_normal(point: Any, axes: Any, cloud: Any, limits: Any, seen: Any) -> int:
    """Count the cloud points in the cylinder about a normal; keep those nearest to it, in order, in ``seen``.

    The cells are visited layer by layer along the coordinate axis that is nearest to the normal: in a layer
    the cylinder is short, whatever its direction.
    """
    points, grid, counts, starts, keys, cells = cloud
    normal, reach, radius = axes[2], limits[0], limits[1]
    m = 0
    for k in range(1, 3):
        if abs(normal[k]) > abs(normal[m]):
            m = k
    a, b = (m + 1) % 3, (m + 2) % 3
    wide = radius * math.sqrt(max(1.0 - normal[m] ** 2, 0.0))
    length = reach * abs(normal[m]) + wide
    place = np.zeros(3, dtype=np.int64)
    count = 0
    begin, end = cell_bounds(point[m] - length, point[m] + length, m, grid, counts)
    for layer in range(begin, end):
        place[m] = layer
        bottom = grid[m] + layer * grid[3] - point[m]
        one, other = (bottom - wide) / normal[m], (bottom + grid[3] + wide) / normal[m]
        low, high = max(min(one, other), -reach), min(max(one, other), reach)
        begin_a, end_a = _lateral(point, normal, low, high, radius, a, grid, counts)
        begin_b, end_b = _lateral(point, normal, low, high, radius, b, grid, counts)
        for place_a in range(begin_a, end_a):
            place[a] = place_a
            for place_b in range(begin_b, end_b):
                place[b] = place_b
                number = (place[0] * counts[1] + place[1]) * counts[2] + place[2]
                cell = find_cell(number, keys, cells)
                if cell >= 0:
                    count = _keep_nearest(
                        point, axes, points, starts[cell], starts[cell + 1], limits, seen, count
                    )
    return count


@kernel
def _lateral(
    point: Any, normal: Any, low: float, high: float, radius: float, axis: int, grid: Any, counts: Any
) -> Any:
    """Cells along an axis that the cylinder touches between two heights."""
    one, other = low * normal[axis], high * normal[axis]
    wide = radius * math.sqrt(max(1.0 - normal[axis] ** 2, 0.0))
    return cell_bounds(
        point[axis] + min(one, other) - wide, point[axis] + max(one, other) + wide, axis, grid, counts
    )


@kernel
def _keep_nearest(
    point: Any, axes: Any, points: Any, start: int, stop: int, limits: Any, seen: Any, count: int
) -> int:
    """Sort the points from start to stop that lie in the cylinder into those seen; return how many did."""
    for p in range(start, stop):
        x, y, z = points[p, 0] - point[0], points[p, 1] - point[1], points[p, 2] - point[2]
        height = x * axes[2, 0] + y * axes[2, 1] + z * axes[2, 2]
        s = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
        t = x * axes[1, 0] + y * axes[1, 1] + z * axes[1, 2]
        squared = s * s + t * t
        if abs(height) > limits[0] or squared > limits[1] * limits[1]:
            continue
        at = min(count, seen.shape[0])
        count += 1
        if at == seen.shape[0]:
            if squared >= seen[at - 1, 0]:
                continue
            at -= 1
        while at > 0 and seen[at - 1, 0] > squared:
            for k in range(4):
                seen[at, k] = seen[at - 1, k]
            at -= 1
        seen[at, 0], seen[at, 1], seen[at, 2], seen[at, 3] = squared, s, t, height
    return count


@kernel
def _first_coefficient(basis: Any, right: Any, used: int) -> float:
    """Least squares by the normal equations and Cholesky, a ridge of 1e-12 where points lie in a row."""
    size = basis.shape[1]
    factor = np.zeros((size, size))
    solution = np.zeros(size)
    for k in range(used):
        for a in range(size):
            solution[a] += basis[k, a] * right[k]
            for b in range(a + 1):
                factor[a, b] += basis[k, a] * basis[k, b]
    ridge = 1e-12 * used
    for a in range(size):
        for b in range(a + 1):
            total = factor[a, b] + (ridge if a == b else 0.0)
            for c in range(b):
                total -= factor[a, c] * factor[b, c]
            factor[a, b] = total / factor[b, b] if b < a else math.sqrt(max(total, ridge))
        for c in range(a):
            solution[a] -= factor[a, c] * solution[c]
        solution[a] /= factor[a, a]
    for a in range(size - 1, -1, -1):
        for c in range(a + 1, size):
            solution[a] -= factor[c, a] * solution[c]
        solution[a] /= factor[a, a]
    return float(solution[0])
