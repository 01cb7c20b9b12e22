"""Gaussian fields: set-up and time per further sample, against numpy's white noise of the same size.

One thread, CPU seconds, noise included, both sides write into an array that is already there. Run

    python benchmarks/bench_fields.py
    python benchmarks/bench_fields.py --gstools     # also one field of GSTools (1000 modes), where installed
    python benchmarks/bench_fields.py --thousand    # 1000 fields against a plain fill of the array
    python benchmarks/bench_fields.py --docs        # keep the table in docs/deviations.md
"""

from __future__ import annotations

import argparse
import os
import resource
import textwrap
import time
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

for variable in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS"):
    os.environ.setdefault(variable, "1")  # before numpy loads

import numpy as np  # noqa: E402
from scipy.spatial import Delaunay  # noqa: E402

from cadskin.deviation import DeviationModel, GaussianField, WhiteNoise, correlation  # noqa: E402
from cadskin.deviation._linear import LinearSampler  # noqa: E402
from cadskin.shape import DiscreteShape, Face, NominalModel, Plane, Samples  # noqa: E402
from cadskin.shape.nominal import build_features  # noqa: E402

SIZE = (120.0, 80.0)
SIGMA = 0.01
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


def covariance_error(sampler: LinearSampler, part: NominalModel, length: float, kernel: str) -> float:
    """Largest error of the exact covariance, in units of the variance, over 300 points and their pairs."""
    rows = np.unique(np.linspace(0, part.n_samples - 1, 300).astype(int))
    near = np.argsort(np.linalg.norm(part.surface.points - part.surface.points[rows[100]], axis=1))[:100]
    rows = np.union1d(rows, near)
    factor = np.zeros((sampler.latent, len(rows)))
    for start in range(0, sampler.latent, 256):
        unit = np.eye(sampler.latent, dtype=np.float32)[start : start + 256]
        factor[start : start + 256] = sampler.transform(unit)[:, rows]
    points = part.surface.points[rows]
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    return float(np.abs(factor.T @ factor / SIGMA**2 - correlation(distance, length, kernel)).max())


def thousand_fields(count: int, gstools: bool) -> list[str]:
    """1000 fields of the squared exponential, written to one array, against filling it with a number."""
    part = plane(count)
    seeds = [np.random.SeedSequence(1, spawn_key=(i,)) for i in range(1000)]
    lines = []
    theirs = gstools_time(part, "SE l=12") if gstools else None
    out = np.ones((1000, part.n_samples))
    single = np.ones((1000, part.n_samples), dtype=np.float32)
    for method in ("grid", "two_level"):
        sampler = GaussianField(SIGMA, 12, method=method).prepare(part)
        ours = best(sampler.fill, seeds, out)
        filled, filled_single = best(out.fill, 1.0), best(single.fill, 1.0)
        error = covariance_error(sampler, part, 12.0, "squared_exponential")
        line = (
            f"1000 fields on {part.n_samples} points ({method}): {ours:.3f} s, {ours / filled:.1f} times a "
            f"plain fill of the array (float64; {ours / filled_single:.1f} times one of float32), largest "
            f"covariance error {error:.1e}"
        )
        if theirs is not None:
            line += f"; GSTools' SRF with its 1000 modes takes {theirs * 1000 / ours:.0f} times as long"
        lines.append(line)
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--points", type=int, nargs="+", default=[2_400, 10_000, 100_000])
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--gstools", action="store_true")
    parser.add_argument("--thousand", action="store_true")
    parser.add_argument("--docs", action="store_true")
    arguments = parser.parse_args()
    models = {
        "white": WhiteNoise(SIGMA),
        "SE l=12": GaussianField(SIGMA, 12),
        "SE l=12 two_level": GaussianField(SIGMA, 12, method="two_level"),
        "Matern 5/2 l=12": GaussianField(SIGMA, 12, "matern52"),
        "Matern 3/2 l=12": GaussianField(SIGMA, 12, "matern32"),
        "Whittle l=12": GaussianField(SIGMA, 12, "whittle"),
        "exponential l=12": GaussianField(SIGMA, 12, "exponential"),
        "Matern 3/2 l=4": GaussianField(SIGMA, 4, "matern32"),
        "Whittle, surface": GaussianField(SIGMA, 12, "whittle", metric="surface"),
        "SE l=12, surface": GaussianField(SIGMA, 12, metric="surface"),
    }
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # coarse meshes have few vertices per length
        for model in models.values():  # compile
            model.sample(plane(1_000), size=2)
        history, references = one_more_field(models, arguments.points, arguments.samples, arguments.gstools)
    for label, rows in history.items():
        if len(rows) > 1:
            grown = growth(rows)
            print(f"{label:18s} grows like n^{grown[0]:.2f} (set-up) and n^{grown[1]:.2f} (further samples)")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print(f"peak memory of the process {peak:.2f} GiB")
    thousand = thousand_fields(100_000, arguments.gstools) if arguments.thousand else []
    print(*thousand, sep="\n")
    if arguments.docs:
        keep_table(history, references, arguments.samples, peak, thousand)


def one_more_field(
    models: dict[str, DeviationModel], sizes: Sequence[int], samples: int, gstools: bool
) -> tuple[dict[str, list[tuple[float, float, float]]], list[tuple[int, float, float]]]:
    """Return (points, set-up, time per field) of each model, and (points, white noise, fill) of each size."""
    seeds = [np.random.SeedSequence(1, spawn_key=(i,)) for i in range(samples)]
    history: dict[str, list[tuple[float, float, float]]] = {label: [] for label in models}
    references: list[tuple[int, float, float]] = []
    for count in sizes:
        part = plane(count)
        out = np.ones((samples, part.n_samples))
        generator = np.random.default_rng(0)
        reference = best(generator.standard_normal, None, np.float64, out) / samples
        filled = best(out.fill, 1.0) / samples
        references.append((part.n_samples, reference, filled))
        print(
            f"{part.n_samples} points: numpy white noise {reference * 1e3:.4f} ms per sample, "
            f"memory fill {filled * 1e3:.4f} ms"
        )
        for label, model in models.items():
            start = time.process_time()
            sampler = model.prepare(part)
            setup = time.process_time() - start
            each = best(sampler.fill, seeds, out) / samples
            history[label].append((part.n_samples, setup, each))
            print(
                f"  {label:18s} set-up {setup:7.3f} s, {each * 1e3:8.4f} ms per sample, "
                f"{reference / each:5.2f} x numpy's white noise; {'; '.join(sampler.notes)}"
            )
            theirs = gstools_time(part, label) if gstools else None
            if theirs is not None:
                print(f"  {'':18s} GSTools {theirs * 1e3:.1f} ms, {theirs / each:.0f} times as long")
    return history, references


def growth(rows: list[tuple[float, float, float]]) -> list[float]:
    """Exponents of the growth of set-up and of further samples with the number of points."""
    points, setups, times = np.log(np.array(rows)).T
    return [float(np.polyfit(points, cost, 1)[0]) for cost in (setups, times)]


def keep_table(
    history: dict[str, list[tuple[float, float, float]]],
    references: list[tuple[int, float, float]],
    samples: int,
    peak: float,
    thousand: Sequence[str],
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
    lines += [part for line in thousand for part in ("", *textwrap.wrap(f"{line}.", 120))]
    page = Path(__file__).parents[1] / "docs" / "deviations.md"
    before, _, rest = page.read_text(encoding="utf-8").partition(BEGIN)
    page.write_text(
        before + BEGIN + "\n" + "\n".join(lines) + "\n" + END + rest.partition(END)[2], encoding="utf-8"
    )


if __name__ == "__main__":
    main()
