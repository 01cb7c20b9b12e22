"""Several targets at once: features scaled in turn until every characteristic has its value."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cadskin.conform.chain import Chain
    from cadskin.conform.requirements import Requirement

__all__ = ["on_target"]

_SWEEPS = 40  # over the targets of a part, each scaling its own feature


def on_target(chain: Chain, targets: Sequence[Requirement]) -> list[Requirement]:
    """Scale features in turn until all targets are met to 1e-12 mm; return those that are not met to 1e-9.

    One target is met by one root search. Targets that share a feature or a datum disturb each other: the
    turns are repeated as long as the largest error at least halves from one to the next.
    """
    errors = [np.inf] * len(targets)
    for _ in range(_SWEEPS):
        for item in targets:
            chain.scaled_to(item, chain.wanted(item))
        before, errors = errors, [abs(chain.value(item) - chain.wanted(item)) for item in targets]
        if max(errors, default=0.0) <= 1e-12 or max(errors) > 0.5 * max(before):
            break
    return [item for item, error in zip(targets, errors, strict=True) if error > 1e-9 * chain.wanted(item)]
