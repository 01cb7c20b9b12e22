"""23 The paper's case: 273 points, 1000 Gibbs sweeps, and the exact sampler beside it.

Zhang et al. 2013 (doi:10.1177/0954405412466987) draw a Gaussian field on 273 points of a plane by 1000 sweeps
of a Gibbs sampler. Here 32 chains run at once, and `GaussianField` draws a field with the same parameters
without a chain (its law carries on beyond the free edges, where the Markov field ends).
A script run prints the time of both and the effective sample size of the field's mean. `main` returns the
split R-hat of the chains: above 1.1, from starts at -10 to 10 sigma they have not met after 1000 sweeps.
"""

from __future__ import annotations

import time
import warnings

import cadquery as cq
import numpy as np

import cadskin as cs
from cadskin.deviation.diagnostics import diagnose

LENGTH, SIGMA, SWEEPS = 18.0, 0.1, 1000
CHAINS = 32


def part() -> tuple[cs.NominalModel, cs.Feature]:
    plate = cs.nominal(cq.Workplane().box(120, 84, 10), edge_length=6.9)
    return plate, plate.feature(">Z")


def main(report: bool = False) -> float:
    plate, top = part()
    seeds = np.random.SeedSequence(3).spawn(1000)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", cs.CadskinWarning)  # the mesh is as coarse as the paper's
        gibbs = cs.Gibbs(SIGMA, LENGTH, sweeps=SWEEPS).prepare(plate, [top])
        exact = cs.GaussianField(SIGMA, LENGTH, "whittle", metric="surface").prepare(plate, [top])
    start = time.process_time()
    run = gibbs.run(seeds[:CHAINS], sweeps=SWEEPS, starts=np.linspace(-10, 10, CHAINS), burn_in=SWEEPS // 2)
    chained = time.process_time() - start
    (mean,) = (trace for key, trace in run.traces.items() if key.endswith("mean"))
    found = diagnose(mean)
    start = time.process_time()
    fields = exact.draw(seeds)
    drawn = time.process_time() - start
    if report:
        print(f"{top.n_points} points: {chained / CHAINS:.5f} s per chain, R-hat {found.rhat:.3f}")
        print(f"{found.bulk:.0f} effective samples in {mean.size} draws of {CHAINS} chains")
        means = fields[:, top.rows].mean(axis=1)
        print(f"exact: {drawn:.4f} s for {len(fields)} independent fields")
        print(f"standard deviation of the mean: {mean.std():.4f} (Gibbs), {means.std():.4f} mm (exact)")
        print(
            f"effective samples per second: exact {len(fields) / drawn / (found.bulk / chained):.0f} x Gibbs"
        )
    return found.rhat


if __name__ == "__main__":
    main(report=True)
