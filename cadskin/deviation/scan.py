"""Deviations read off a scan: the distance along the normals to a measured cloud of points."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from scipy.spatial import cKDTree

from cadskin._arrays import frozen
from cadskin._jit import kernel
from cadskin.deviation._parameters import positive
from cadskin.deviation._tangent import form_sampler
from cadskin.deviation.base import MM, DeviationModel
from cadskin.deviation.registry import register
from cadskin.errors import DeviationError

if TYPE_CHECKING:
    from cadskin._typing import Floats, Points
    from cadskin.deviation.samplers import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["FromScan"]

_CHUNK = 20_000  # samples whose neighbours are listed at once
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
        object.__setattr__(self, "points", frozen(self.points, shape=(None, 3), name="FromScan: points"))
        object.__setattr__(self, "reach", positive(self.reach, "reach", "mm", self))
        if int(self.neighbours) != self.neighbours or self.neighbours < 8:
            raise DeviationError(f"FromScan: neighbours must be 8 or more, got {self.neighbours}")
        if len(self.points) < self.neighbours:
            raise DeviationError(
                f"FromScan: {len(self.points)} points, at least {self.neighbours} are needed"
            )

    def prepare(self, nominal: NominalModel, features: Sequence[Feature] | None = None) -> Sampler:
        """Fit the scan around every sample."""
        tree = cKDTree(self.points)
        some = self.points[:: max(1, len(self.points) // _PROBED)]
        nearest, _ = tree.query(some, k=[self.neighbours])
        radius = 2.0 * float(np.median(nearest))  # a corner sees a quarter of this disc: enough points
        return form_sampler(nominal, features, lambda feature: self._on(feature, tree, radius))

    def _on(self, feature: Feature, tree: cKDTree, radius: float) -> Floats:
        """Fit in chunks, which bounds the memory of the neighbour lists."""
        values = np.zeros(feature.n_points)
        covered = np.zeros(feature.n_points, dtype=bool)
        ball = float(np.hypot(self.reach, radius))
        for start in range(0, feature.n_points, _CHUNK):
            points = feature.points[start : start + _CHUNK]
            found = tree.query_ball_point(points, ball, return_sorted=False)
            counts = np.fromiter((len(ids) for ids in found), dtype=np.int64, count=len(points))
            ids = np.concatenate([*found, []]).astype(np.int64)
            _fit_heights(
                points,
                feature.normals[start : start + _CHUNK],
                self.points,
                ids,
                np.concatenate([[0], np.cumsum(counts)]),
                np.array([self.reach, radius]),
                int(self.neighbours),
                values[start : start + _CHUNK],
                covered[start : start + _CHUNK],
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
    points: Any,
    normals: Any,
    cloud: Any,
    ids: Any,
    starts: Any,
    limits: Any,
    neighbours: int,
    values: Any,
    covered: Any,
) -> None:
    """Height of the weighted quadric over the tangent plane at each point, from the cloud points around it.

    ``ids[starts[i] : starts[i + 1]]`` are those around point i; ``limits`` are the reach along the normal and
    the radius about it.
    """
    most = 0
    for i in range(points.shape[0]):
        most = max(most, starts[i + 1] - starts[i])
    seen = np.zeros((most, 4))  # s, t, height, squared distance from the normal
    basis = np.zeros((neighbours, 6))
    right = np.zeros(neighbours)
    for i in range(points.shape[0]):
        first, second = _tangents(normals[i])
        count = 0
        for p in range(starts[i], starts[i + 1]):
            offset = cloud[ids[p]] - points[i]
            height = (offset * normals[i]).sum()
            s, t = (offset * first).sum(), (offset * second).sum()
            if abs(height) <= limits[0] and s * s + t * t <= limits[1] * limits[1]:
                seen[count, 0], seen[count, 1], seen[count, 2], seen[count, 3] = s, t, height, s * s + t * t
                count += 1
        if count < 6:
            continue
        covered[i] = True
        order = np.argsort(seen[:count, 3])
        used = min(count, neighbours)
        scale = math.sqrt(seen[order[used - 1], 3])
        scale = scale if scale > 0.0 else 1.0
        for k in range(used):
            s, t = seen[order[k], 0] / scale, seen[order[k], 1] / scale
            weight = 1.0 - 0.75 * (s * s + t * t)
            basis[k, 0], basis[k, 1], basis[k, 2] = weight, weight * s, weight * t
            basis[k, 3], basis[k, 4], basis[k, 5] = weight * s * s, weight * s * t, weight * t * t
            right[k] = weight * seen[order[k], 2]
        values[i] = _first_coefficient(basis, right, used)


@kernel
def _first_coefficient(basis: Any, right: Any, used: int) -> float:
    """Least squares by the normal equations and Cholesky, a ridge of 1e-12 where points lie in a row."""
    size = basis.shape[1]
    factor = np.zeros((size, size))
    solution = np.zeros(size)
    for a in range(size):
        for k in range(used):
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


@kernel
def _tangents(normal: Any) -> Any:
    """Two unit vectors across a normal."""
    axis = 0
    for k in range(1, 3):
        if abs(normal[k]) < abs(normal[axis]):
            axis = k
    unit = np.zeros(3)
    unit[axis] = 1.0
    first = np.cross(normal, unit)
    first /= math.sqrt((first * first).sum())
    return first, np.cross(normal, first)
