"""The paper's case, 273 points and 1000 Gibbs sweeps, against NumPy; the exact sampler beside it.

Both run the same Whittle field on a 120 x 72 mm plane, length 18 mm; one thread, CPU seconds. NumPy's
loop is a straight transcript: one dot product and one normal number per site, chain by chain. Ours runs 32
chains at once; the time is that of one of them. Effective sample sizes are those of the field's mean. Run

    python benchmarks/bench_gibbs.py
"""

from __future__ import annotations

import time
import warnings

from bench_fields import plane  # sets the number of threads before numpy loads

import numpy as np  # isort: skip

from cadskin.deviation import GaussianField, Gibbs
from cadskin.deviation._surface import SurfaceField
from cadskin.deviation.diagnostics import diagnose

SWEEPS, CHAINS, LENGTH = 1000, 32, 18.0


def numpy_chain(precision: np.ndarray, sweeps: int) -> np.ndarray:
    """One chain, site by site."""
    rng = np.random.default_rng(0)
    diagonal = precision.diagonal()
    weights = -precision / diagonal[:, None]
    np.fill_diagonal(weights, 0.0)
    deviation = 1.0 / np.sqrt(diagonal)
    x = np.zeros(len(precision))
    for _ in range(sweeps):
        for i in range(len(x)):
            x[i] = weights[i] @ x + deviation[i] * rng.standard_normal()
    return x


def main() -> None:
    part = plane(240, (120.0, 72.0))  # 21 x 13 = 273 points
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # too few sweeps for this length, which is what is shown
        sampler = Gibbs(1.0, LENGTH, sweeps=SWEEPS).prepare(part)
        exact = GaussianField(1.0, LENGTH, "whittle", metric="surface").prepare(part)
    seeds = np.random.SeedSequence(1).spawn(1024)
    start = time.process_time()
    run = sampler.run(seeds[:CHAINS], sweeps=SWEEPS, burn_in=SWEEPS // 2, starts=np.linspace(-10, 10, CHAINS))
    chained = time.process_time() - start
    surface = part.surface
    unit = SurfaceField(surface.points / LENGTH, surface.triangles, "whittle", collar=False)
    dense = unit.precision().toarray()
    start = time.process_time()
    numpy_chain(dense, SWEEPS // 10)
    site_loop = 10 * (time.process_time() - start)
    exact.draw(seeds[:CHAINS])
    start = time.process_time()
    exact.draw(seeds)
    drawn = (time.process_time() - start) / len(seeds)
    found = diagnose(run.traces["patch 0 mean"])
    print(f"{part.n_samples} points, {SWEEPS} sweeps")
    print(f"  NumPy, site by site   {site_loop:9.4f} s per chain (a tenth of it was run)")
    print(
        f"  ours, {CHAINS} chains      {chained / CHAINS:9.6f} s per chain: "
        f"{site_loop / chained * CHAINS:.0f} times faster"
    )
    states = f"{CHAINS} x {SWEEPS // 2} states"
    print(f"  split R-hat {found.rhat:.3f}; effective samples of {states}: {found.bulk:.0f}")
    print(f"  one effective sample  {chained / found.bulk:9.6f} s by the chains, {drawn:.7f} s exactly")
    print(
        f"  the exact sampler is {chained / found.bulk / drawn:.0f} times faster; each of its fields counts"
    )


if __name__ == "__main__":
    main()
