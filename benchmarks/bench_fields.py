"""Gaussian fields: set-up and time per further sample, against numpy's white noise of the same size.

One thread, CPU seconds, noise included, both sides write into an array that is already there. Run

    python benchmarks/bench_fields.py
    python benchmarks/bench_fields.py --gstools     # also one field of GSTools (1000 modes), where installed
    python benchmarks/bench_fields.py --docs        # keep the table in docs/deviations.md
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Callable
from pathlib import Path

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before numpy loads

import numpy as np  # noqa: E402
from scipy.spatial import Delaunay  # noqa: E402

from cadskin.deviation import GaussianField, WhiteNoise  # noqa: E402
from cadskin.shape import DiscreteShape, Face, NominalModel, Plane, Samples  # noqa: E402
from cadskin.shape.nominal import build_features  # noqa: E402

SIZE = (120.0, 80.0)
BEGIN, END = "<!-- begin bench_fields -->", "<!-- end bench_fields -->"


def plane(count: int, size: tuple[float, float] = SIZE) -> NominalModel:
    """Make an irregular mesh of a rectangle with about ``count`` points."""
    h = np.sqrt(size[0] * size[1] / count)
    nx, ny = (round(side / h) + 1 for side in size)
    x, y = (
        a.ravel() for a in np.meshgrid(*(np.linspace(0, s, n) for s, n in zip(size, (nx, ny), strict=True)))
    )
    rng = np.random.default_rng(1)
    inside = (x > 0) & (x < size[0]) & (y > 0) & (y < size[1])
    x, y = (axis + 0.3 * h * inside * rng.uniform(-1, 1, len(axis)) for axis in (x, y))
    triangles = Delaunay(np.column_stack([x, y])).simplices.astype(np.int64)
    points = np.column_stack([x, y, np.zeros(len(x))])
    normals = np.tile([0.0, 0.0, 1.0], (len(x), 1))
    surface = DiscreteShape(points, triangles, np.zeros(len(triangles), dtype=np.int64))
    face = Face(
        0,
        Plane([0, 0, 0], [0, 0, 1]),
        size[0] * size[1],
        [size[0] / 2, size[1] / 2, 0],
        [0, 0, 1],
        [[0, 0, 0], [*size, 0]],
    )
    samples = Samples(
        vertex_ids=np.arange(len(x)),
        face_ids=np.zeros(len(x)),
        uv=points[:, :2],
        normals=normals,
        curvatures=np.zeros((len(x), 2)),
        directions=np.tile(np.eye(3)[:2], (len(x), 1, 1)),
        singular=np.zeros(len(x), dtype=bool),
    )
    return NominalModel(
        surface, (face,), build_features(surface, [[0]], [face], samples, np.array([0, len(x)])), samples
    )


def best(work: Callable[..., object], *arguments: object, repeats: int = 3) -> float:
    """Least CPU time of some runs."""
    times = []
    for _ in range(repeats):
        start = time.process_time()
        work(*arguments)
        times.append(time.process_time() - start)
    return min(times)


def gstools_time(part: NominalModel, label: str) -> float | None:
    """CPU time of one field of GSTools with the same law; None for laws that it is not asked for."""
    import gstools

    laws = {
        "SE l=12": gstools.Gaussian(dim=2, len_scale=12 * np.sqrt(2.0), rescale=1.0),
        "Matern 5/2 l=12": gstools.Matern(dim=2, len_scale=12, nu=2.5, rescale=1.0),
        "Matern 3/2 l=12": gstools.Matern(dim=2, len_scale=12, nu=1.5, rescale=1.0),
    }
    if label not in laws:
        return None
    x, y = part.surface.points[:, :2].T
    generator = gstools.SRF(laws[label], seed=1)
    generator((x[:100], y[:100]))
    start = time.process_time()
    generator((x, y), seed=2)
    return time.process_time() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, nargs="+", default=[2_400, 10_000, 100_000])
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--gstools", action="store_true")
    parser.add_argument("--docs", action="store_true")
    arguments = parser.parse_args()
    models = {
        "white": WhiteNoise(0.01),
        "SE l=12": GaussianField(0.01, 12),
        "SE l=12 two_level": GaussianField(0.01, 12, method="two_level"),
        "Matern 5/2 l=12": GaussianField(0.01, 12, "matern52"),
        "Matern 3/2 l=12": GaussianField(0.01, 12, "matern32"),
        "Whittle, surface": GaussianField(0.01, 12, "whittle", metric="surface"),
        "SE l=12, surface": GaussianField(0.01, 12, metric="surface"),
    }
    seeds = [np.random.SeedSequence(1, spawn_key=(i,)) for i in range(arguments.samples)]
    for model in models.values():  # compile
        model.sample(plane(1_000), size=2)
    history: dict[str, list[tuple[float, float, float]]] = {label: [] for label in models}
    references: list[tuple[int, float, float]] = []
    for count in arguments.points:
        part = plane(count)
        out = np.ones((arguments.samples, part.n_samples))
        generator = np.random.default_rng(0)
        reference = best(generator.standard_normal, None, np.float64, out) / arguments.samples
        filled = best(out.fill, 1.0) / arguments.samples
        references.append((part.n_samples, reference, filled))
        print(
            f"{part.n_samples} points: numpy white noise {reference * 1e3:.4f} ms per sample, "
            f"memory fill {filled * 1e3:.4f} ms"
        )
        for label, model in models.items():
            start = time.process_time()
            sampler = model.prepare(part)
            setup = time.process_time() - start
            each = best(sampler.fill, seeds, out) / arguments.samples
            history[label].append((part.n_samples, setup, each))
            print(
                f"  {label:18s} set-up {setup:7.3f} s, {each * 1e3:8.4f} ms per sample, "
                f"{reference / each:5.2f} x numpy's white noise; {'; '.join(sampler.notes)}"
            )
            theirs = gstools_time(part, label) if arguments.gstools else None
            if theirs is not None:
                print(f"  {'':18s} GSTools {theirs * 1e3:.1f} ms, {theirs / each:.0f} times as long")
    for label, rows in history.items():
        if len(rows) > 1:
            grown = growth(rows)
            print(f"{label:18s} grows like n^{grown[0]:.2f} (set-up) and n^{grown[1]:.2f} (further samples)")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"peak memory of the process {peak:.2f} GiB")
    if arguments.docs:
        keep_table(history, references, arguments.samples, peak)


def growth(rows: list[tuple[float, float, float]]) -> list[float]:
    """Exponents of the growth of set-up and of further samples with the number of points."""
    points, setups, times = np.log(np.array(rows)).T
    return [float(np.polyfit(points, cost, 1)[0]) for cost in (setups, times)]


def keep_table(
    history: dict[str, list[tuple[float, float, float]]],
    references: list[tuple[int, float, float]],
    samples: int,
    peak: float,
) -> None:
    """Write the table between its markers in docs/deviations.md."""
    sizes = [f"{count:,} points".replace(",", " ") for count, _, _ in references]
    lines = ["| model | " + " | ".join(sizes) + " | growth |", "|---|" + "---|" * (len(sizes) + 1)]
    for label, rows in history.items():
        cells = [
            f"{setup:.2g} s, {each * 1e3:.3g} ms ({white / each:.1f})"
            for (_, setup, each), (_, white, _) in zip(rows, references, strict=True)
        ]
        grown = growth(rows) if len(rows) > 1 else [float("nan")] * 2
        lines.append(f"| {label} | {' | '.join(cells)} | {grown[0]:.2f}, {grown[1]:.2f} |")
    lines += ["", f"Peak memory of the process, which holds {samples} fields: {peak:.1f} GiB."]
    page = Path(__file__).parents[1] / "docs" / "deviations.md"
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    page.write_text(
        before + BEGIN + "\n" + "\n".join(lines) + "\n" + END + rest.partition(END)[2], encoding="utf-8"
    )


if __name__ == "__main__":
    main()
