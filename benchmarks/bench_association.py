"""Time of every association at 10^3 to 10^6 points, in CPU seconds and as ratios measured in the same run.

Run: ``python benchmarks/bench_association.py [largest exponent]``. The ratio is the minimum zone over the
least-squares fit of the same points; the last lines compare flatness with one HiGHS program over all points.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable

import numpy as np

from cadskin.shape.association import associate, rotation


def surface(kind: str, n: int, rng: np.random.Generator) -> np.ndarray:
    """Points (n, 3) with waviness of 20 um and noise of 2 um."""
    u, v = rng.uniform(0, 2 * np.pi, n), rng.uniform(-20, 20, n)
    e = 0.02 * np.sin(3 * u) * np.cos(v / 5) + 0.002 * rng.standard_normal(n)
    if kind in ("plane", "profile line"):
        x = rng.uniform(-50, 50, n)
        y = rng.uniform(-50, 50, n) if kind == "plane" else np.zeros(n)
        z = 0.02 * np.sin(x / 9) * np.cos(y / 7) + 0.002 * rng.standard_normal(n)
        points = np.column_stack([x, y, z])
    elif kind == "line":
        points = np.column_stack([0.02 * np.sin(v / 9), 0.02 * np.cos(v / 7), v])
    elif kind == "sphere":
        d = rng.standard_normal((n, 3))
        points = d / np.linalg.norm(d, axis=1)[:, None] * (12 + e)[:, None]
    elif kind == "torus":
        w, r = rng.uniform(0, 2 * np.pi, n), 5 + e
        ring = 20 + r * np.cos(w)
        points = np.column_stack([ring * np.cos(u), ring * np.sin(u), r * np.sin(w)])
    else:
        radius = 10 + e + (0.3 * v if kind == "cone" else 0.0)
        points = np.column_stack([radius * np.cos(u), radius * np.sin(u), 0 * v if kind == "circle" else v])
    return points @ rotation(np.array([0.3, -0.5, 0.2])).T + np.array([10.0, -20.0, 30.0])


def seconds(work: Callable[[], object]) -> tuple[float, object]:
    """CPU seconds of the faster of two runs, and the result."""
    best, result = np.inf, None
    for _ in range(2):
        start = time.process_time()
        result = work()
        best = min(best, time.process_time() - start)
    return best, result


def highs_flatness(points: np.ndarray) -> float:
    """One linear program over all points, the way a script would do it."""
    from scipy.optimize import linprog

    n = len(points)
    frame = np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2]
    local = (points - points.mean(axis=0)) @ frame.T
    up = np.column_stack([-local[:, :2], -np.ones(n), np.zeros(n)])
    down = np.column_stack([local[:, :2], np.zeros(n), np.ones(n)])
    found = linprog(
        [0, 0, 1, -1],
        A_ub=np.concatenate([up, down]),
        b_ub=np.concatenate([-local[:, 2], local[:, 2]]),
        bounds=(None, None),
        method="highs",
    )
    return float(found.fun / np.sqrt(1 + found.x[0] ** 2 + found.x[1] ** 2))


def main() -> None:
    largest = int(sys.argv[1]) if len(sys.argv) > 1 else 6
    rng = np.random.default_rng(1)
    cases = [
        ("plane", "C"), ("profile line", "C"), ("line", "C"), ("circle", "C"), ("circle", "N"),
        ("circle", "X"),
        ("sphere", "C"), ("sphere", "N"), ("sphere", "X"), ("cylinder", "C"), ("cylinder", "N"),
        ("cylinder", "X"),
        ("cone", "C"), ("torus", "C"), ("plane", "GE"),
    ]  # fmt: skip
    print(f"{'association':18}{'points':>9}{'LS s':>9}{'s':>9}{'ratio':>7}  certified")
    for kind, criterion in cases:
        associate(surface(kind, 300, rng), kind, criterion)
        for exponent in range(3, largest + 1):
            points = surface(kind, 10**exponent, rng)
            squares, _ = seconds(lambda: associate(points, kind, "G"))  # noqa: B023
            time_used, found = seconds(lambda: associate(points, kind, criterion))  # noqa: B023
            ratio = time_used / squares
            print(
                f"{kind + ' ' + criterion:18}{10**exponent:9}{squares:9.4f}{time_used:9.4f}{ratio:7.2f}"
                f"  {found.certified} {found.certificate.scope}",
                flush=True,
            )
    points = surface("plane", 100_000, rng)
    ours, found = seconds(lambda: associate(points, "plane"))
    theirs, value = seconds(lambda: highs_flatness(points))
    print(f"flatness of 100 000 points: {ours:.4f} s, one HiGHS program {theirs:.3f} s")
    print(f"ratio {theirs / ours:.0f}")
    print(f"values differ by {abs(found.value - value):.1e} mm")


if __name__ == "__main__":
    main()
