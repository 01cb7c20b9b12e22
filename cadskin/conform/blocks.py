"""Blocks: groups of features whose deviations are independent of all others under a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cadskin._arrays import frozen
from cadskin.deviation import (
    BasisForm,
    DeviationModel,
    Fractal,
    FromArray,
    FromFE,
    FromFunction,
    FromScan,
    FromSpectrum,
    GaussianField,
    Gibbs,
    KarhunenLoeve,
    LayerSteps,
    Lobing,
    Modes,
    Quadric,
    Randomised,
    RestrictedModel,
    ScaledModel,
    SizeOffset,
    SumModel,
    Taper,
    Towards,
    VibrationModes,
    Waviness,
    WhiteNoise,
)
from cadskin.deviation.forms import FormModel
from cadskin.deviation.rigid import DisplacementModel
from cadskin.deviation.samplers import FixedSampler
from cadskin.shape.patches import smooth_patches

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cadskin._typing import Floats, Ints
    from cadskin.deviation import Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = [
    "BY_SAMPLE",
    "COMPOSED",
    "PATCHWISE",
    "TOGETHER",
    "Blocks",
    "coupled_features",
    "gaussian_mean",
    "independent_blocks",
]

PATCHWISE: tuple[type[DeviationModel], ...] = (
    *(GaussianField, WhiteNoise, KarhunenLoeve, Modes, VibrationModes, Gibbs, FromSpectrum, Fractal),
)
"""Models whose fields on different smooth patches are independent."""

BY_SAMPLE: tuple[type[DeviationModel], ...] = (
    *(FormModel, Quadric, BasisForm, Waviness, Lobing, Taper, SizeOffset, LayerSteps),
    *(FromFunction, FromFE, FromScan, Towards),
)
"""Systematic models whose values on a feature do not depend on which others are selected."""

TOGETHER: tuple[type[DeviationModel], ...] = (DisplacementModel, Randomised, FromArray)
"""Models that treat the selected features as one: a common centre, a common random factor, a common row."""

COMPOSED: tuple[type[DeviationModel], ...] = (SumModel, ScaledModel, RestrictedModel)
"""Models made of others."""

CENTRED: tuple[type[DeviationModel], ...] = (GaussianField, WhiteNoise, KarhunenLoeve, FromSpectrum, Fractal)
"""Gaussian models of mean zero."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """A partition of the features; different blocks are independent.

    Parameters
    ----------
    features : tuple of tuple of Feature
    of_feature : (f,) int
        Block of each feature.
    rows : tuple of (k,) int
        Samples of each block.
    """

    features: tuple[tuple[Feature, ...], ...]
    of_feature: Ints
    rows: tuple[Ints, ...]

    def __len__(self) -> int:
        return len(self.features)

    def touched(self, features: Iterable[Feature]) -> frozenset[int]:
        """Return the blocks of features."""
        return frozenset(int(self.of_feature[feature.id]) for feature in features)


def independent_blocks(nominal: NominalModel, model: DeviationModel, *, whole: bool = False) -> Blocks:
    """Return the blocks of a part under a model: features joined by smooth patches or by the model itself.

    Parameters
    ----------
    nominal : NominalModel
    model : DeviationModel
        A class that is not known here may couple all features that it is on; see `coupled_features`.
    whole : bool
        One block in any case.
    """
    count = len(nominal.features)
    labels = np.zeros(count, dtype=np.int64)
    if not whole:
        patches = smooth_patches(nominal)
        first = nominal.feature_ids()
        second = count + patches.patch_of_node[patches.node_of_sample]
        groups = coupled_features(model, nominal)
        more = [(group[0].id, item.id) for group in groups for item in group]
        pairs = np.concatenate(
            [np.column_stack([first, second]), np.array(more, dtype=np.int64).reshape(-1, 2)]
        )
        size = count + patches.n_patches
        graph = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(size, size))
        found = connected_components(graph, directed=False)[1][:count]
        labels = np.unique(found, return_inverse=True)[1].astype(np.int64)
    members = [
        tuple(feature for feature in nominal.features if labels[feature.id] == block)
        for block in range(int(labels.max(initial=-1)) + 1)
    ]
    rows = tuple(
        frozen(np.concatenate([np.arange(f.start, f.stop) for f in group]), dtype=np.int64)
        for group in members
    )
    return Blocks(tuple(members), frozen(labels, dtype=np.int64), rows)


def coupled_features(
    model: DeviationModel, nominal: NominalModel, features: Sequence[Feature] | None = None
) -> tuple[tuple[Feature, ...], ...]:
    """Return the groups of features that a model couples beyond their smooth patches.

    What is on `PATCHWISE` or `BY_SAMPLE` couples none. What is on `TOGETHER`, and any class that is not known
    here, couples all features that it is on: the selected ones under ``.on(...)``, else the whole part.

    Parameters
    ----------
    model : DeviationModel
    nominal : NominalModel
    features : sequence of Feature, optional
        Where the model is.
    """
    chosen = tuple(nominal.features if features is None else features)
    if isinstance(model, SumModel):
        return tuple(group for term in model.terms for group in coupled_features(term, nominal, chosen))
    if isinstance(model, ScaledModel):
        return coupled_features(model.model, nominal, chosen)
    if isinstance(model, RestrictedModel):
        return coupled_features(model.model, nominal, _restricted(model, nominal, chosen))
    if isinstance(model, FromArray) and model.values.ndim == 1:
        return ()
    if isinstance(model, (*PATCHWISE, *BY_SAMPLE)) or len(chosen) < 2:
        return ()
    return (chosen,)


def _restricted(
    model: RestrictedModel, nominal: NominalModel, features: Sequence[Feature]
) -> tuple[Feature, ...]:
    wanted = {feature.id for feature in features}
    return tuple(item for item in nominal.select(model.ref, **model.filters) if item.id in wanted)


def gaussian_mean(
    model: DeviationModel, nominal: NominalModel, features: Sequence[Feature] | None = None
) -> Floats | None:
    """Return the mean field (n_c,) [mm] of a Gaussian model; None where it is not known to be Gaussian.

    Only the values on ``features`` (all by default) count, as in `DeviationModel.prepare`.
    """
    if isinstance(model, ScaledModel):
        inner = gaussian_mean(model.model, nominal, features)
        return None if inner is None else model.factor * inner
    if isinstance(model, SumModel):
        parts = [gaussian_mean(term, nominal, features) for term in model.terms]
        known = [part for part in parts if part is not None]
        return np.sum(known, axis=0) if len(known) == len(parts) else None
    if isinstance(model, RestrictedModel):
        chosen = _restricted(model, nominal, nominal.features if features is None else features)
        inner = gaussian_mean(model.model, nominal, chosen)
        if inner is None:
            return None
        mean = np.zeros(nominal.n_samples)
        for feature in chosen:
            mean[feature.rows] = inner[feature.rows]
        return mean
    if isinstance(model, Randomised):
        inner = gaussian_mean(model.model, nominal, features) if _is_systematic(model.model) else None
        normal = model.distribution == "norm" and len(model.arguments) == 2
        return model.arguments[0] * inner if normal and inner is not None else None
    if isinstance(model, CENTRED) or getattr(model, "random", False):
        return np.zeros(nominal.n_samples)
    if not _is_systematic(model):
        return None
    sampler: Sampler = model.prepare(nominal, features)
    return sampler.values if isinstance(sampler, FixedSampler) else None


def _is_systematic(model: DeviationModel) -> bool:
    """Tell whether every part has the same field under a model that stands alone."""
    if isinstance(model, ScaledModel | RestrictedModel):
        return _is_systematic(model.model)
    if isinstance(model, FromArray):
        return model.values.ndim == 1
    if isinstance(model, Modes | VibrationModes):
        return not model.random
    return isinstance(model, (*BY_SAMPLE, DisplacementModel))
