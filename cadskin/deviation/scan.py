"""Deviations read off a scan: the distance along the normals to a measured cloud of points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from scipy.spatial import cKDTree

from cadskin._arrays import frozen
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
        nearest, _ = tree.query(self.points, k=[self.neighbours])
        radius = 2.0 * float(np.median(nearest))  # a corner sees a quarter of this disc: enough points
        return form_sampler(nominal, features, lambda feature: self._on(feature, tree, radius))

    def _on(self, feature: Feature, tree: cKDTree, radius: float) -> Floats:
        values = np.zeros(feature.n_points)
        uncovered = 0
        for i, (point, normal) in enumerate(zip(feature.points, feature.normals, strict=True)):
            around = self.points[tree.query_ball_point(point, np.hypot(self.reach, radius))] - point
            height = around @ normal
            along = around - height[:, None] * normal
            distance = np.linalg.norm(along, axis=1)
            near = np.abs(height) <= self.reach
            near[near] = distance[near] <= radius
            if near.sum() < 6:
                uncovered += 1
                continue
            chosen = np.flatnonzero(near)[np.argsort(distance[near])[: self.neighbours]]
            values[i] = _height_at_origin(along[chosen], height[chosen], distance[chosen], normal)
        if uncovered:
            raise DeviationError(
                f"FromScan: the scan does not cover {uncovered} of {feature.n_points} samples of "
                f"{feature.name} (reach {self.reach:.4g} mm, {radius:.4g} mm around the normal); restrict "
                "the model with .on(...), register the scan, or raise reach"
            )
        return values

    def __str__(self) -> str:
        more = "" if self.neighbours == 12 else f", neighbours={self.neighbours}"
        return f"FromScan(<{len(self.points)} points> mm, reach={self.reach:.12g} mm{more})"

    __repr__ = __str__


def _height_at_origin(along: Points, height: Floats, distance: Floats, normal: Points) -> float:
    """Height of the weighted least-squares quadric over the tangent plane, at the origin."""
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    s, t = along @ first, along @ np.cross(normal, first)
    scale = float(distance.max()) or 1.0
    s, t = s / scale, t / scale
    basis = np.stack([np.ones_like(s), s, t, s * s, s * t, t * t], axis=1)
    weight = 1.0 - 0.75 * (distance / scale) ** 2
    return float(np.linalg.lstsq(basis * weight[:, None], height * weight, rcond=None)[0][0])
