"""Principal modes of populations: `StatisticalShapeModel.fit` against scikit-learn's PCA in the same run.

One thread, CPU seconds, best of some runs; both get the same array and keep the same number of modes. For few
modes of many, scikit-learn's "auto" is the randomised, approximate solver; "full" is the exact one. Run

    python benchmarks/bench_stats.py [--large]
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable
from typing import Any

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before numpy loads

import numpy as np  # noqa: E402

from cadskin.stats import StatisticalShapeModel  # noqa: E402

SIZES = [(10, 30_000), (100, 30_000), (10, 300_000), (100, 300_000)]
LARGE = [(1000, 30_000), (10, 3_000_000), (100, 3_000_000), (1000, 300_000)]


def parts(n: int, d: int) -> np.ndarray:
    """Make smooth fields of 30 modes with falling variance, a mean far above the spread, and white noise."""
    rng = np.random.default_rng(1)
    x = np.linspace(0, 1, d, dtype=np.float32)
    modes = np.stack([np.cos(np.pi * k * x) for k in range(1, 31)])
    out = np.zeros((n, d), dtype=np.float32)
    scores = (rng.standard_normal((n, 30)) * 0.05 * 0.8 ** np.arange(30)).astype(np.float32)
    for i in range(n):
        out[i] = 0.5 * x + scores[i] @ modes + 0.002 * rng.standard_normal(d, dtype=np.float32)
    return out


def best(work: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Least CPU time of some runs, and the last result."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        result = work()
        times.append(time.process_time() - start)
    return min(times), result


def compare(n: int, d: int) -> str:
    from sklearn.decomposition import PCA

    k = min(20, n - 1)
    single = parts(n, d)
    repeats = 5 if n * d < 1e7 else 2 if n * d < 1e8 else 1
    ours32, model32 = best(lambda: StatisticalShapeModel.fit(single, modes=k), repeats)
    theirs32, _ = best(lambda: PCA(k).fit(single), repeats)
    row = f"{n:5d} x {d:8d}  float32 {ours32:8.4f} s, sklearn auto {theirs32:8.4f} s"
    row += f" = {theirs32 / ours32:5.1f} x"
    if n * d < 4e7:
        full, _ = best(lambda: PCA(k, svd_solver="full").fit(single), 1)
        row += f", full {full / ours32:5.1f} x"
    if n * d > 2e8:
        return row
    double = single.astype(np.float64)
    ours64, model64 = best(lambda: StatisticalShapeModel.fit(double, modes=k), repeats)
    theirs64, reference = best(lambda: PCA(k, svd_solver="auto").fit(double), repeats)
    top = slice(0, min(5, k))
    error = np.abs(model32.variances / model64.variances - 1)[top].max()
    oracle = np.abs(model64.variances * d / reference.explained_variance_ - 1)[top].max()
    return (
        f"{row}; float64 {ours64:8.4f} s, sklearn {theirs64:8.4f} s = {theirs64 / ours64:5.1f} x; "
        f"eigenvalues: float32 from float64 {error:.1e}, from sklearn {oracle:.1e}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--large", action="store_true", help="up to 1000 x 3e5 (1.2 GB)")
    for n, d in SIZES + (LARGE if parser.parse_args().large else []):
        print(compare(n, d), flush=True)


if __name__ == "__main__":
    main()
