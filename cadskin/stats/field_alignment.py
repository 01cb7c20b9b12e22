"""Alignment of fields in correspondence: a small rigid motion taken off each deviation field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import StatisticsError
from cadskin.skin import SkinEnsemble
from cadskin.skin.provenance import provenance_of
from cadskin.stats._steps import chebyshev_step, free_directions, least_squares_step, tukey
from cadskin.stats.population import feature_rows, population, sample_areas

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin._typing import Floats, Ints
    from cadskin.shape import FeatureRef, NominalModel
    from cadskin.stats.registration import Alignment

__all__ = ["align_fields", "aligned_ensemble", "rigid_basis"]

_REACH = 4.685


def rigid_basis(nominal: NominalModel) -> Floats:
    """Return what six small motions do to a deviation field (n_c, 6).

    Three translations [1] and three rotations about the centre of the points, in radii of gyration: each
    column is of order 1, and ``basis @ step`` is a field in mm for a step in mm.
    """
    points = nominal.surface.points[nominal.samples.vertex_ids]
    away = points - nominal.surface.points.mean(axis=0)
    radius = float(np.sqrt((away**2).sum(axis=1).mean()))
    normals = nominal.samples.normals
    return np.concatenate([normals, np.cross(away, normals) / radius], axis=1)


def align_fields(
    fields: Any,
    nominal: NominalModel,
    *,
    alignment: Alignment,
    features: FeatureRef | Sequence[FeatureRef] | None = None,
) -> Floats:
    """Return deviation fields (n, n_c) [mm] with a small rigid motion of each part taken off.

    Parameters
    ----------
    fields : SkinEnsemble, (n, n_c) array, or sequence of parts
        NaN stays NaN and does not count.
    nominal : NominalModel
    alignment, features
        As for `register`; first order in the rotation, which is exact to 1e-6 for 1 mrad.

    Raises
    ------
    StatisticsError
        No value on the features of the alignment.
    """
    people = population(fields, nominal=nominal)
    values = np.array(people.columns.read(0, people.columns.d), dtype=np.float64)
    if alignment == "none":
        return values
    stages: list[Any] = [None] if features is None else [features]
    if alignment == "datum_frame":
        if features is None:
            raise StatisticsError("alignment 'datum_frame' needs features=[primary, secondary, tertiary]")
        stages = list(features) if isinstance(features, (list, tuple)) else [features]
    rows = [
        np.arange(nominal.n_samples) if stage is None else feature_rows(nominal, stage) for stage in stages
    ]
    basis, areas = rigid_basis(nominal), sample_areas(nominal)
    for i, value in enumerate(values):
        values[i] = value + basis @ _step(value, basis, areas, rows, alignment)
    return values


def aligned_ensemble(ensemble: SkinEnsemble, *, alignment: Alignment, **options: Any) -> SkinEnsemble:
    """Return `align_fields` of an ensemble as an ensemble that records its alignment."""
    fields = align_fields(ensemble, ensemble.nominal, alignment=alignment, **options)
    record = provenance_of(
        ensemble.nominal,
        ensemble.provenance.model,
        None,
        alignment=alignment,
        of=ensemble.provenance.to_dict(),
    )
    return SkinEnsemble(ensemble.nominal, fields, record)


def _step(field: Floats, basis: Floats, areas: Floats, rows: list[Ints], alignment: Alignment) -> Floats:
    step, free = np.zeros(6), np.eye(6)
    for own in rows:
        seen = own[np.isfinite(field[own])]
        if not len(seen):
            raise StatisticsError("a feature of the alignment has no value on one of the parts")
        design = basis[seen] @ free
        rest = field[seen] + basis[seen] @ step
        step = step + free @ _one_step(design, rest, areas[seen], alignment)
        free = free @ free_directions(design)
        if not free.shape[1]:
            break
    return step


def _one_step(design: Floats, rest: Floats, areas: Floats, alignment: Alignment) -> Floats:
    if alignment in ("least_squares", "datum_frame"):
        return least_squares_step(design, rest, areas)
    if alignment == "minimum_zone":
        return chebyshev_step(design, rest)
    if alignment != "robust":
        raise StatisticsError(f"unknown alignment {alignment!r}")
    step = least_squares_step(design, rest, areas)
    for _ in range(50):
        left = rest + design @ step
        scale = 1.4826 * float(np.median(np.abs(left)))
        if scale <= 0.0:
            break
        new = least_squares_step(design, rest, areas * tukey(left / (_REACH * scale)))
        if np.abs(new - step).max() < 1e-9:
            break
        step = new
    return step
