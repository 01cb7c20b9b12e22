"""From measured points to one signed deviation per nominal sample; what was not measured is NaN.

At each nominal sample a plane is fitted robustly to the signed distances of the points around it and read at
the sample. A plain mean of the neighbours would be biased wherever they lie to one side.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from cadskin._arrays import frozen
from cadskin.errors import StatisticsError
from cadskin.shape import DiscreteShape
from cadskin.skin import SkinModel
from cadskin.skin.provenance import provenance_of
from cadskin.skin.weld import vertex_deviation
from cadskin.stats._steps import tukey
from cadskin.stats.registration import Registration
from cadskin.stats.robust import pointwise_median
from cadskin.stats.surface_distance import contacts, signed_distances

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import ArrayLike

    from cadskin._typing import Bools, Floats, Ints, Points
    from cadskin.shape import NominalModel
    from cadskin.stats.rigid import RigidMotion

__all__ = ["MeasuredPart", "local_plane_at", "measure", "nearest_samples"]

_NEIGHBOURS = 24
_FEWEST = 5
_REACH = 4.685
_ROUNDS = 6
_ROW = 0.01  # ratio of second moments below which neighbours lie in a row


@dataclass(frozen=True, eq=False)
class MeasuredPart:
    """A measured part as deviations from its nominal model.

    Parameters
    ----------
    nominal : NominalModel
    deviation : (n_c,) float
        Deviation along the nominal normal [mm], + = material added; NaN where nothing was measured.
    uncertainty : (n_c,) float
        Standard deviation of it from the scatter of the points [mm]; NaN with it.
    counts : (n_c,) int
        Points that each value rests on.
    faces : (n,) int
        B-rep face of each measured point; -1 for an outlier or a point whose foot is on an edge.
    distances : (n,) float
        Signed distance of each measured point [mm].
    registration : Registration or None
        How the points came into the frame of the nominal model.
    """

    nominal: NominalModel
    deviation: Floats
    uncertainty: Floats
    counts: Ints
    faces: Ints
    distances: Floats
    registration: Registration | None = None

    def __post_init__(self) -> None:
        """Check and freeze."""
        size = (self.nominal.n_samples,)
        for key in ("deviation", "uncertainty"):
            object.__setattr__(self, key, frozen(getattr(self, key), shape=size, name=key, finite=False))
        object.__setattr__(self, "counts", frozen(self.counts, dtype=np.int64, shape=size, name="counts"))
        object.__setattr__(self, "faces", frozen(self.faces, dtype=np.int64, name="faces"))
        object.__setattr__(self, "distances", frozen(self.distances, name="distances", finite=False))

    @property
    def measured(self) -> Bools:
        """Where there is a value (n_c,)."""
        return np.isfinite(self.deviation)

    @property
    def coverage(self) -> float:
        """Share of the samples that were measured."""
        return float(self.measured.mean())

    @property
    def outliers(self) -> Bools:
        """Measured points (n,) that count for no face."""
        return np.asarray(self.faces < 0)

    @cached_property
    def surface(self) -> DiscreteShape:
        """The nominal mesh at its measured place; where nothing was measured it is the nominal one."""
        return SkinModel(self.nominal, np.nan_to_num(self.deviation)).surface

    @property
    def vertex_deviation(self) -> Floats:
        """Deviation per vertex (n,) [mm]: the one of largest magnitude of the features that were measured."""
        known = vertex_deviation(self.nominal, np.nan_to_num(self.deviation))
        seen = np.zeros(self.nominal.surface.n_points, dtype=bool)
        seen[self.nominal.samples.vertex_ids[self.measured]] = True
        return np.where(seen, known, np.nan)

    @cached_property
    def measured_surface(self) -> DiscreteShape:
        """The triangles of `surface` whose three corners were measured, with their labels; it is open.

        What an evaluation gets to see: ``cadskin.verify(part.measured_surface, spec, nominal=part.nominal)``.

        Raises
        ------
        StatisticsError
            There is none.
        """
        whole = self.surface
        kept = self.measured[self.nominal.corner_samples].all(axis=1)
        if not kept.any():
            raise StatisticsError("no triangle of the part was measured at all three corners")
        used, corners = np.unique(whole.triangles[kept], return_inverse=True)
        return DiscreteShape(whole.points[used], corners.reshape(-1, 3), whole.face_ids[kept])

    def save(self, path: str | Path, **options: Any) -> Path:
        """Write the measured triangles to a mesh file (see `cadskin.export.write`)."""
        from cadskin.export import write

        return write(path, self.measured_surface, **options)

    def picture(self, path: str | Path, **options: Any) -> Path:
        """Draw the deviation in colours, grey where nothing was measured (see `cadskin.view.picture`)."""
        from cadskin.view import picture

        return picture(path, self, **options)

    def skin_model(self) -> SkinModel:
        """Return the part as a `SkinModel`.

        Raises
        ------
        StatisticsError
            Samples were not measured: they are not invented. A statistical model can predict them
            (`StatisticalShapeModel.posterior`).
        """
        if not self.measured.all():
            missing = [f.name for f in self.nominal.features if not self.measured[f.rows].any()]
            raise StatisticsError(
                f"{100 * (1 - self.coverage):.3g} % of the samples were not measured"
                + (f" (nothing of {', '.join(missing[:5])})" if missing else "")
                + "; a skin model needs all: measure them, or predict them with a statistical shape model"
            )
        alignment = "given" if self.registration is None else self.registration.alignment
        record = provenance_of(self.nominal, "measured", None, alignment=alignment)
        return SkinModel(self.nominal, self.deviation, record)


def measure(
    points: ArrayLike,
    nominal: NominalModel,
    *,
    motion: Registration | RigidMotion | None = None,
    radius: float | None = None,
    limit: float | None = None,
    probe_radius: float = 0.0,
    thinnest: float = 0.1,
) -> MeasuredPart:
    """Return the deviation of a measured part at every nominal sample.

    Parameters
    ----------
    points : (n, 3) array_like of float
        Measured points [mm].
    nominal : NominalModel
    motion : Registration or RigidMotion, optional
        Takes the points to the frame of the nominal model; see `register`. None: they are there already.
    radius : float, optional
        Points within this distance along the surface tell a sample [mm]; default 1.5 times the median edge.
    limit : float, optional
        Points further from the surface are outliers [mm]; default eight robust standard deviations of all.
    probe_radius : float
        The points are centres of a probe ball of this radius [mm].
    thinnest : float
        A sample around which the points lie thinner than this share of the part's median density counts as
        not measured: such points are stray ones. 0 takes all, for hand-picked probing points.

    Raises
    ------
    StatisticsError
        No point is near the part.
    """
    registration = motion if isinstance(motion, Registration) else None
    move = motion.motion if isinstance(motion, Registration) else motion
    cloud = np.asarray(getattr(points, "points", points), dtype=np.float64)
    cloud = cloud if move is None else move.apply(cloud)
    finite: Bools = np.asarray(np.isfinite(cloud).all(axis=1), dtype=np.bool_)
    faces = np.full(len(cloud), -1, dtype=np.int64)
    distances = np.full(len(cloud), np.nan)
    where = contacts(nominal, cloud[finite])
    signed = signed_distances(nominal, cloud[finite], where) - probe_radius
    gate = limit if limit is not None else _gate(signed[~where.on_edge], nominal)
    good = ~where.on_edge & (np.abs(signed) <= gate)
    if not good.any():
        raise StatisticsError(
            f"no measured point lies within {gate:.3g} mm of the part; register the scan first"
        )
    faces[finite] = np.where(good, where.faces, -1)
    distances[finite] = signed
    feet = cloud - (np.nan_to_num(distances) + probe_radius)[:, None] * _all_normals(where.normals, finite)
    values = _at_samples(nominal, feet, faces, distances, radius or 1.5 * _median_edge(nominal), thinnest)
    return MeasuredPart(nominal, *values, faces, distances, registration)


def nearest_samples(nominal: NominalModel, points: ArrayLike) -> tuple[Ints, Floats]:
    """Return the nearest sample row of each probed point (m, 3) [mm], and its deviation.

    For `StatisticalShapeModel.posterior`: each point counts as a measurement of its nearest sample.
    """
    probed = np.atleast_2d(np.asarray(points, dtype=np.float64))
    where = contacts(nominal, probed)
    nearest = np.argmax(where.weights, axis=1)
    rows = nominal.corner_samples[where.triangles, nearest]
    return rows, signed_distances(nominal, probed, where)


def local_plane_at(offsets: Floats, values: Floats, radius: float) -> tuple[Floats, Floats, Ints]:
    """Fit ``value = a + b x + c y`` robustly around many places at once and return a.

    Parameters
    ----------
    offsets : (m, k, 2) float
        Coordinates of k neighbours about each place [mm]; NaN for none.
    values : (m, k) float
        [mm].
    radius : float
        Kernel ``(1 - (r / radius)²)²``.

    Returns
    -------
    value, uncertainty : (m,) float
        NaN where fewer than five points count, or where they lie to one side: that would be extrapolation.
    count : (m,) int
    """
    x = np.nan_to_num(offsets / radius, nan=9.0)
    kernel = np.maximum(1.0 - (x**2).sum(axis=2), 0.0) ** 2
    kernel = np.where(np.isfinite(values), kernel, 0.0)
    y = np.nan_to_num(values)
    design = np.concatenate([np.ones((*x.shape[:2], 1)), np.where(kernel[..., None] > 0, x, 0.0)], axis=2)
    weights = kernel * _about_the_median(y, kernel)
    fit = np.zeros((len(x), 3))
    held = _held_across_a_row(design[..., 1:], kernel)
    for _ in range(_ROUNDS):
        inner = np.einsum("mka,mk,mkb->mab", design, weights, design)
        inner += 1e-9 * (weights.sum(axis=1)[:, None, None] + 1e-30) * np.eye(3)
        inner[:, 1:, 1:] += held
        fit = np.linalg.solve(inner, np.einsum("mka,mk->ma", design, weights * y)[..., None])[..., 0]
        rest = y - np.einsum("mka,ma->mk", design, fit)
        weights = kernel * _biweight(rest, kernel)
    counts = (weights > 0).sum(axis=1)
    total = np.maximum(weights.sum(axis=1), 1e-30)
    lean = np.linalg.norm((weights[..., None] * design[..., 1:]).sum(axis=1), axis=1) / total
    spread = (weights * rest**2).sum(axis=1) / total * counts / np.maximum(counts - 3, 1)
    factor = np.linalg.inv(inner)
    middle = np.einsum(
        "ma,mk,mkab->mb", factor[:, 0], weights**2, design[..., :, None] * design[..., None, :]
    )
    variance = spread * np.einsum("mb,mb->m", middle, factor[:, :, 0])
    known = (counts >= _FEWEST) & (lean < 0.5)
    return (
        np.where(known, fit[:, 0], np.nan),
        np.where(known, np.sqrt(np.maximum(variance, 0.0)), np.nan),
        np.where(known, counts, 0),
    )


def _held_across_a_row(offsets: Floats, kernel: Floats) -> Floats:
    """Return what holds the slope across a row of neighbours at zero: an addition to the normal equations.

    Points in a row do not tell that slope; (m, 2, 2), zero where they lie around.
    """
    total = np.maximum(kernel.sum(axis=1), 1e-30)
    middle = np.einsum("mk,mka->ma", kernel, offsets) / total[:, None]
    away = np.where(kernel[..., None] > 0, offsets - middle[:, None], 0.0)
    moments = np.einsum("mka,mk,mkb->mab", away, kernel, away)
    values, vectors = np.linalg.eigh(moments)
    weak = values[:, 0] < _ROW * values[:, 1]
    across = vectors[:, :, 0]
    return np.asarray((weak * values[:, 1])[:, None, None] * across[:, :, None] * across[:, None, :])


def _about_the_median(values: Floats, kernel: Floats) -> Floats:
    """First weights: without them one bad point near the place could tilt the plane and hide itself."""
    middle = np.nan_to_num(pointwise_median(np.where(kernel > 0, values, np.nan).T))
    return _biweight(values - middle[:, None], kernel)


def _biweight(rest: Floats, kernel: Floats) -> Floats:
    scale = 1.4826 * pointwise_median(np.where(kernel > 0, np.abs(rest), np.nan).T)[:, None]
    return tukey(rest / np.maximum(_REACH * np.nan_to_num(scale), 1e-12))


def _at_samples(
    nominal: NominalModel, feet: Points, faces: Ints, distances: Floats, radius: float, thinnest: float
) -> tuple[Floats, Floats, Ints]:
    """Read every feature's samples from the points of its own faces."""
    deviation = np.full(nominal.n_samples, np.nan)
    uncertainty = np.full(nominal.n_samples, np.nan)
    counts = np.zeros(nominal.n_samples, dtype=np.int64)
    density = np.zeros(nominal.n_samples)
    for feature in nominal.features:
        own = np.flatnonzero(np.isin(faces, feature.face_indices))
        if len(own) < _FEWEST:
            continue
        tree = cKDTree(feet[own])
        _, near = tree.query(feature.points, k=min(_NEIGHBOURS, len(own)), distance_upper_bound=radius)
        near = np.atleast_2d(near)
        there = near < len(own)
        chosen = own[np.where(there, near, 0)]
        away = feet[chosen] - feature.points[:, None]
        offsets = np.einsum("mkd,mad->mka", away, feature.directions)
        offsets = np.where(there[..., None], offsets, np.nan)
        values = np.where(there, distances[chosen], np.nan)
        reach = np.where(there, np.linalg.norm(away, axis=2), 0.0).max(axis=1)
        reach = np.maximum(reach, 1e-9)
        found = _by_reach(offsets, values, reach, radius)
        deviation[feature.rows], uncertainty[feature.rows], counts[feature.rows] = found
        density[feature.rows] = counts[feature.rows] / reach**2
    thin = density < thinnest * np.median(density[counts > 0]) if counts.any() else counts < 0
    return (
        np.where(thin, np.nan, deviation),
        np.where(thin, np.nan, uncertainty),
        np.where(thin, 0, counts),
    )


def _by_reach(offsets: Floats, values: Floats, reach: Floats, radius: float) -> tuple[Floats, Floats, Ints]:
    """Scale each place's neighbours by their own reach, so that dense scans use near points only."""
    own = np.minimum(1.05 * reach, radius)
    return local_plane_at(offsets / own[:, None, None], values, 1.0)


def _all_normals(normals: Floats, finite: Bools) -> Floats:
    out = np.zeros((len(finite), 3))
    out[finite] = normals
    return out


def _gate(distances: Floats, nominal: NominalModel) -> float:
    scale = 1.4826 * float(np.median(np.abs(distances))) if len(distances) else 0.0
    return max(8.0 * scale, 1e-6 * nominal.surface.diagonal)


def _median_edge(nominal: NominalModel) -> float:
    points, edges = nominal.surface.points, nominal.surface.edges
    return float(np.median(np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)))
