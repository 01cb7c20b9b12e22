"""One value where features meet tangentially, for forms that every feature has in its own coordinates.

The rule is that of the weld: a node shared by tangent features takes the mean of their values. A model that
is restricted with ``.on(...)`` takes the mean over the selected features.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING

import numpy as np

from cadskin.deviation.samplers import FixedSampler
from cadskin.shape.patches import smooth_patches

if TYPE_CHECKING:
    from cadskin._typing import Floats, Ints
    from cadskin.shape import Feature, NominalModel

__all__ = ["form_sampler", "shared_mean"]


def form_sampler(
    nominal: NominalModel, features: Iterable[Feature] | None, form: Callable[[Feature], Floats]
) -> FixedSampler:
    """Return the sampler of a form (k,) [mm] that is evaluated on one feature after the other."""
    chosen = tuple(nominal.features if features is None else features)
    values = np.zeros(nominal.n_samples)
    for feature in chosen:
        values[feature.rows] = form(feature)
    rows = np.concatenate([np.arange(f.start, f.stop) for f in chosen] or [np.zeros(0, dtype=np.int64)])
    values[rows] = shared_mean(smooth_patches(nominal).node_of_sample[rows], values[rows])
    return FixedSampler(values)


def shared_mean(nodes: Ints, values: Floats) -> Floats:
    """Return the values (k,) with the mean over all that have the same node (k,).

    Examples
    --------
    >>> shared_mean(np.array([0, 1, 0]), np.array([1.0, 5.0, 3.0])).tolist()
    [2.0, 5.0, 2.0]
    """
    number = np.bincount(nodes)
    mean = np.bincount(nodes, weights=values) / np.maximum(number, 1)
    return np.where(number[nodes] > 1, mean[nodes], values)
