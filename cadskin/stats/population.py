"""What a population is: the fields of n parts, their nominal model, the rows and the area weights used."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from cadskin.errors import StatisticsError
from cadskin.shape import NominalModel
from cadskin.skin import SkinEnsemble
from cadskin.stats._gram import Columns

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from cadskin._typing import Floats, Ints
    from cadskin.shape import FeatureRef

__all__ = ["Population", "feature_rows", "population", "sample_areas"]


@dataclass(frozen=True, eq=False)
class Population:
    """The fields of n parts in correspondence.

    Parameters
    ----------
    columns : Columns
        The deviations (n, d) [mm], read by chunks.
    nominal : NominalModel or None
    rows : (d,) int or None
        Samples of the nominal model that the columns stand for; None without a nominal model.
    weights : (d,) float
        Share of the area of each sample; they sum to 1.
    """

    columns: Columns
    nominal: NominalModel | None
    rows: Ints | None
    weights: Floats


def population(
    parts: Any,
    *,
    nominal: NominalModel | None = None,
    features: FeatureRef | None = None,
    weights: ArrayLike | None = None,
) -> Population:
    """Bring parts into one form.

    Parameters
    ----------
    parts : SkinEnsemble, (n, d) array, or sequence of parts or of (d,) arrays
        A part is anything with ``nominal`` and ``deviation`` (a `SkinModel`, a `MeasuredPart`). An array may
        be a `numpy.memmap`; it is not copied. NaN means "not measured".
    nominal : NominalModel, optional
        For arrays whose columns are the samples of this model.
    features : selector or iterable of selectors, optional
        Only these features; None for the whole part.
    weights : (d,) array_like, optional
        Area of each column (before ``features`` is applied); default the sample areas of the nominal
        model, or equal.

    Raises
    ------
    StatisticsError
        No part, parts of different length or of different nominal models, weights that are not positive.
    """
    fields, found = _fields(parts)
    nominal = found if nominal is None else nominal
    if nominal is not None and np.ndim(fields) == 2 and fields.shape[1] != nominal.n_samples:
        raise StatisticsError(
            f"the fields have {fields.shape[1]} columns, the nominal model has {nominal.n_samples} samples"
        )
    rows = None
    if features is not None:
        if nominal is None:
            raise StatisticsError("features can be selected only where the nominal model is known")
        rows = feature_rows(nominal, features)
    columns = Columns(fields, rows)
    if columns.n == 0 or columns.d == 0:
        raise StatisticsError(f"an empty population: {columns.n} parts of {columns.d} samples")
    if rows is None and nominal is not None:
        rows = np.arange(nominal.n_samples)
    return Population(columns, nominal, rows, _weights(weights, nominal, rows, columns.d))


def sample_areas(nominal: NominalModel) -> Floats:
    """Return the area (n_c,) [mm²] that belongs to each sample: a third of each triangle of its feature."""
    third = np.repeat(nominal.surface.triangle_areas / 3.0, 3)
    corners = nominal.corner_samples.ravel()
    return np.bincount(corners, weights=third, minlength=nominal.n_samples).astype(np.float64)


def feature_rows(nominal: NominalModel, features: FeatureRef) -> Ints:
    """Return the sample rows of all features that the selectors match, in the order of the model."""
    chosen = sorted(nominal.select(features), key=lambda feature: feature.id)
    return np.concatenate([np.arange(feature.start, feature.stop) for feature in chosen])


def _fields(parts: Any) -> tuple[Any, NominalModel | None]:
    if isinstance(parts, SkinEnsemble):
        return parts.deviations, parts.nominal
    if isinstance(parts, np.ndarray):
        return parts, None
    items = list(parts)
    if not items:
        raise StatisticsError("an empty population: there is no part")
    nominal = getattr(items[0], "nominal", None)
    for i, item in enumerate(items):
        if getattr(item, "nominal", None) is not nominal:
            raise StatisticsError(
                f"parts 0 and {i} have different nominal models; measure all parts against one model"
            )
    fields = [np.asarray(getattr(item, "deviation", item)) for item in items]
    lengths = [field.shape for field in fields]
    if any(shape != lengths[0] or len(shape) != 1 for shape in lengths):
        i = next((i for i, shape in enumerate(lengths) if shape != lengths[0]), 0)
        raise StatisticsError(
            f"parts 0 and {i} have fields of shape {lengths[0]} and {lengths[i]}; a population needs one "
            "value per sample in the same order: bring the parts into correspondence first"
        )
    return np.stack(fields), nominal


def _weights(given: Any, nominal: NominalModel | None, rows: Ints | None, d: int) -> Floats:
    if given is None:
        areas = np.ones(d) if nominal is None else sample_areas(nominal)[rows]
        areas = np.maximum(areas, 1e-12 * areas.max())  # a sample of slivers only still counts
    else:
        areas = np.asarray(given, dtype=np.float64)
        if nominal is not None and rows is not None and len(areas) == nominal.n_samples:
            areas = areas[rows]
    if areas.shape != (d,) or not np.isfinite(areas).all() or (areas <= 0).any():
        raise StatisticsError(f"weights must be {d} positive numbers, one per sample")
    shares = np.asarray(areas / areas.sum(), dtype=np.float64)
    shares.flags.writeable = False
    return shares
