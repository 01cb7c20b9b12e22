"""Exact conforming fields: time per independent sample, against one unconstrained GSTools field.

A 120 x 80 mm plane, squared exponential, length 12 mm, flatness 0.3 mm; sigma sets the acceptance. One
thread, CPU seconds; the field is conditioned, not yet welded. "part" is the same through
the whole chain: welded and evaluated on the mesh. GSTools (if it
is installed) runs in the same process, with its default 1000 modes.

    python benchmarks/bench_conform.py [--large]
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before numpy loads

import numpy as np  # noqa: E402
from bench_fields import plane  # noqa: E402

from cadskin.conform import ConformingSampler, prepare_conforming  # noqa: E402
from cadskin.conform.chain import Chain  # noqa: E402
from cadskin.conform.rejection import draw_cluster  # noqa: E402
from cadskin.conform.simulate import Tally  # noqa: E402
from cadskin.conform.streams import FIRST_SAMPLES, first_fields  # noqa: E402
from cadskin.deviation import GaussianField  # noqa: E402
from cadskin.shape import NominalModel  # noqa: E402
from cadskin.skin.simulate import child_seed  # noqa: E402
from cadskin.spec import Specification, flatness  # noqa: E402

LENGTH, LIMIT = 12.0, 0.3


def median_flatness(part: NominalModel, count: int = 200) -> float:
    """Return the median flatness of the unit field."""
    sampler = prepare_conforming(part, GaussianField(1.0, LENGTH), Specification(flatness(0, LIMIT)))
    places = sampler.requirements[0].flat
    fields = sampler.setup.samplers.whole.sample(size=count, rng=1)
    return float(np.median([places.bounds(field)[1] for field in fields]))


def conditioned(sampler: ConformingSampler, seconds: float) -> tuple[float, float, Tally]:
    """Return milliseconds per conditioned field, acceptance, and the last tally."""
    seed = np.random.SeedSequence(7)
    attempts = accepted = done = 0
    tally = Tally()
    start = time.process_time()
    while done < 5 or time.process_time() - start < seconds:
        seeds = [child_seed(seed, done + i) for i in range(FIRST_SAMPLES)]
        for own, first in zip(seeds, first_fields(sampler.setup.samplers, seeds), strict=True):
            chain = Chain(sampler.setup, own, first)
            for cluster in sampler.setup.clusters:
                draw_cluster(chain, cluster)
            tally, done = chain.tally, done + 1
            attempts, accepted = attempts + tally.attempts, accepted + tally.accepted
    return 1e3 * (time.process_time() - start) / done, accepted / max(attempts, 1), tally


def per_call(function: Callable[[int], object], seconds: float) -> float:
    """Return milliseconds per call."""
    function(0)
    start, done = time.process_time(), 0
    while done < 3 or time.process_time() - start < seconds:
        done += 1
        function(done)
    return 1e3 * (time.process_time() - start) / done


def gstools_field(part: NominalModel) -> Callable[[int], object] | None:
    try:
        import gstools
    except ImportError:
        return None
    x, y = part.surface.points[:, :2].T
    model = gstools.Gaussian(dim=2, var=1.0, len_scale=LENGTH * np.sqrt(np.pi / 2))
    field = gstools.SRF(model)
    return lambda seed: field.unstructured((x, y), seed=seed)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--large", action="store_true", help="also 100 000 points")
    parser.add_argument("--seconds", type=float, default=2.0)
    request = parser.parse_args()
    print("points | sigma / median | acceptance | sampler | ms per field | ms per part | GSTools ms | ratio")
    for count in (2400, 100_000) if request.large else (2400,):
        part = plane(count)
        middle = median_flatness(part, 200 if count < 10_000 else 40)
        other = gstools_field(part)
        reference = None if other is None else per_call(other, request.seconds)
        for share in (0.8, 1.0, 1.2, 1.4, 1.7):
            model = GaussianField(share * LIMIT / middle, LENGTH)
            sampler = prepare_conforming(part, model, Specification(flatness(0, LIMIT)))
            conditioned(sampler, 0.1)
            cost, accepted, tally = conditioned(sampler, request.seconds)
            seed = np.random.SeedSequence(9)
            whole = per_call(lambda i, s=sampler, r=seed: s.draw(child_seed(r, i)), request.seconds)
            ratio = "-" if reference is None else f"{reference / cost:.0f}"
            gs = "-" if reference is None else f"{reference:.1f}"
            names = "+".join(sorted(tally.samplers))
            cells = (part.surface.n_points, f"{share:.2f}", f"{accepted:.3f}", names, f"{cost:.3f}")
            print(
                " | ".join(map(str, (*cells, f"{whole:.2f}", gs, ratio))),
                flush=True,
            )


if __name__ == "__main__":
    main()
