"""Blocks: groups of features whose deviations are independent of all others under a model."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from cadskin._arrays import frozen
from cadskin.deviation import GaussianField, ScaledModel, SumModel, WhiteNoise
from cadskin.deviation.algebra import RestrictedModel
from cadskin.deviation.forms import FormModel
from cadskin.deviation.samplers import FixedSampler
from cadskin.shape.patches import smooth_patches

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from cadskin._typing import Floats, Ints
    from cadskin.deviation import DeviationModel, Sampler
    from cadskin.shape import Feature, NominalModel

__all__ = ["Blocks", "gaussian_mean", "has_independent_patches", "independent_blocks"]


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
    """Return the blocks of a part under a model: features joined by smooth patches, or the whole part.

    Parameters
    ----------
    nominal : NominalModel
    model : DeviationModel
        A class that is not known here may couple patches: the part is then one block.
    whole : bool
        One block in any case.
    """
    count = len(nominal.features)
    if whole or not has_independent_patches(model):
        labels = np.zeros(count, dtype=np.int64)
    else:
        patches = smooth_patches(nominal)
        patch_of_sample = patches.patch_of_node[patches.node_of_sample]
        size = count + patches.n_patches
        graph = coo_array(
            (np.ones(nominal.n_samples), (nominal.feature_ids(), count + patch_of_sample)), shape=(size, size)
        )
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


def has_independent_patches(model: DeviationModel) -> bool:
    """Tell whether the fields of a model on different smooth patches are known to be independent."""
    if isinstance(model, SumModel):
        return all(has_independent_patches(term) for term in model.terms)
    if isinstance(model, ScaledModel | RestrictedModel):
        return has_independent_patches(model.model)
    return isinstance(model, GaussianField | WhiteNoise | FormModel)


def gaussian_mean(
    model: DeviationModel, nominal: NominalModel, features: Sequence[Feature] | None = None
) -> Floats | None:
    """Return the mean field (n_c,) [mm] of a Gaussian model; None where it is not known to be Gaussian.

    Only the values on ``features`` (all by default) count, as in `DeviationModel.prepare`.
    """
    if isinstance(model, GaussianField | WhiteNoise):
        return np.zeros(nominal.n_samples)
    if isinstance(model, ScaledModel):
        inner = gaussian_mean(model.model, nominal, features)
        return None if inner is None else model.factor * inner
    if isinstance(model, SumModel):
        parts = [gaussian_mean(term, nominal, features) for term in model.terms]
        known = [part for part in parts if part is not None]
        return np.sum(known, axis=0) if len(known) == len(parts) else None
    if isinstance(model, RestrictedModel):
        chosen = nominal.select(model.ref, **model.filters)
        wanted = {feature.id for feature in (chosen if features is None else features)}
        chosen = tuple(feature for feature in chosen if feature.id in wanted)
        inner = gaussian_mean(model.model, nominal, chosen)
        if inner is None:
            return None
        mean = np.zeros(nominal.n_samples)
        for feature in chosen:
            mean[feature.rows] = inner[feature.rows]
        return mean
    sampler: Sampler | None = model.prepare(nominal, features) if isinstance(model, FormModel) else None
    return sampler.values if isinstance(sampler, FixedSampler) else None
