"""Statistical comparison of conformed populations with plain rejection."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import ks_2samp

from cadskin._random import seed_sequence
from cadskin.skin.simulate import child_seed, simulate_ensemble
from cadskin.verify import verify

# A test fails by chance once in 10 000 runs per population; the seeds are fixed, so it fails never or always.
ERROR_LEVEL = 1e-4


@pytest.fixture(scope="session")
def plain_rejection():
    """``(accepted fields, acceptance)`` of whole parts: raw samples that the evaluator accepts."""

    def draw(part, model, spec, *, size, rng):
        raw = simulate_ensemble(part, model, size=size, rng=rng, check=False)
        kept = verify(raw, spec).conforming
        return raw.deviations[kept], float(kept.mean())

    return draw


@pytest.fixture(scope="session")
def conformed():
    """Fields of a prepared sampler."""

    def draw(sampler, *, size, rng):
        seed = seed_sequence(rng)
        made = [sampler.draw(child_seed(seed, i)) for i in range(size)]
        return np.array([one.deviation for one in made]), made

    return draw


@pytest.fixture(scope="session")
def same_law():
    """Assert that two populations agree in several statistics, at `ERROR_LEVEL` for all of them together."""

    def check(fields, reference, statistics):
        for name, statistic in statistics.items():
            found = ks_2samp(
                [statistic(field) for field in fields], [statistic(field) for field in reference]
            )
            assert found.pvalue > ERROR_LEVEL / len(statistics), f"{name}: p = {found.pvalue:.2g}"

    return check
