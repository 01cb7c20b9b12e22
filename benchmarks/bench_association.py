"""Time and accuracy of every association, in CPU seconds and as ratios measured in the same run.

Run: ``python benchmarks/bench_association.py [--largest 6] [--markdown docs/associations.md]``. The ratio is
the association over the least-squares fit of the same points; the last lines compare flatness with one HiGHS
program over all points. The error is the largest of five planted reference sets (`cadskin.verify.reference`).
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from cadskin.shape.association import Association, associate, rotation
from cadskin.verify.reference import CHARACTERISTICS, reference_set

LP, QP = "linear programs + Newton", "least distance programs"
ALL_AROUND = "contacts and points all around"
CASES = [
    ("plane", "C", "flatness", LP, "contacts, near points and extent, else hull width"),
    ("plane", "GE", None, QP, "quasi-convex"),
    ("plane", "GI", None, QP, "quasi-convex"),
    ("profile line", "C", "straightness", LP, "contacts, near points and extent, else hull width"),
    ("profile line", "GE", None, QP, "quasi-convex"),
    ("profile line", "GI", None, QP, "quasi-convex"),
    ("line", "C", "straightness of a median line", LP, "dual bound"),
    ("circle", "C", "roundness", LP, ALL_AROUND),
    ("circle", "N", "circumscribed circle", LP, "convex"),
    ("circle", "X", "inscribed circle", LP, ALL_AROUND),
    ("circle", "GE", None, QP, "local"),
    ("circle", "GI", None, QP, "local"),
    ("sphere", "C", "sphericity", LP, ALL_AROUND),
    ("sphere", "N", "circumscribed sphere", LP, "convex"),
    ("sphere", "X", "inscribed sphere", LP, ALL_AROUND),
    ("sphere", "GE", None, QP, "local"),
    ("sphere", "GI", None, QP, "local"),
    ("cylinder", "C", "cylindricity", LP, "local"),
    ("cylinder", "N", "circumscribed cylinder", LP, "dual bound"),
    ("cylinder", "X", "inscribed cylinder", LP, "local"),
    ("cylinder", "GE", None, QP, "local"),
    ("cylinder", "GI", None, QP, "local"),
    ("cone", "C", "conicity", LP, "local"),
    ("cone", "GE", None, QP, "local"),
    ("cone", "GI", None, QP, "local"),
    ("torus", "C", "toricity", LP, "local"),
    ("torus", "GE", None, QP, "local"),
    ("torus", "GI", None, QP, "local"),
]


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


def seconds(work: Callable[[], Association]) -> tuple[float, Association]:
    """CPU seconds of the faster of two runs, and the result."""
    start = time.process_time()
    result = work()
    best = time.process_time() - start
    start = time.process_time()
    work()
    return min(best, time.process_time() - start), result


def nearly_symmetric(n: int) -> dict[str, np.ndarray]:
    """Bowls, gutters and saddles (about n, 3) that many contacts tie in, by name."""
    x, y = (axis.ravel() for axis in np.meshgrid(*2 * [np.linspace(-1, 1, round(n**0.5))]))
    noise = np.random.default_rng(1).standard_normal(len(x))
    heights = {"bow": x**2, "dish": x**2 + y**2 / 3, "saddle": x**2 - y**2, "waves": np.cos(np.pi * x) * y}
    return {
        f"{name}, noise {level:g} mm": np.column_stack([50 * x, 50 * y, 0.3 * height + level * noise])
        for name, height in heights.items()
        for level in (0.0, 1e-9, 1e-6, 1e-3)
    }


def worst_symmetric(n: int) -> str:
    """Return the longest time over that of the least-squares fit, in words."""
    worst, name, proved = 0.0, "", True
    for field, points in nearly_symmetric(n).items():
        squares, _ = seconds(lambda: associate(points, "plane", "G"))  # noqa: B023
        used, found = seconds(lambda: associate(points, "plane", "C"))  # noqa: B023
        proved &= found.certificate.holds and found.certificate.scope == "global"
        if used / squares > worst:
            worst, name = used / squares, field
    word = "all" if proved else "not all"
    return (
        f"Flatness of nearly symmetric fields of {n:,} points: at most {worst:.1f} times the least-squares "
        f"fit ({name}), {word} proved globally."
    )


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


def planted_error(characteristic: str | None) -> float | None:
    """Largest error over five reference sets [mm]."""
    if characteristic is None:
        return None
    kind = CHARACTERISTICS[characteristic]
    criterion = {"minimum zone": "C", "minimum circumscribed": "N", "maximum inscribed": "X"}[kind.criterion]
    worst = 0.0
    for seed in range(5):
        made = reference_set(characteristic, 0.05 if kind.is_zone else 20.0, rng=seed)
        found = associate(made.points, kind.name, criterion, section_normal=made.section_normal)
        worst = max(worst, abs((1.0 if kind.is_zone else 2.0) * found.value - made.value))
    return worst


def measure(largest: int) -> list[tuple]:
    """Rows: kind, criterion, n, seconds of least squares, seconds, certified, scope."""
    rng = np.random.default_rng(1)
    rows = []
    for kind, criterion, *_ in CASES:
        associate(surface(kind, 300, rng), kind, criterion)
        for exponent in range(3, largest + 1):
            points = surface(kind, 10**exponent, rng)
            squares, _ = seconds(lambda: associate(points, kind, "G"))  # noqa: B023
            used, found = seconds(lambda: associate(points, kind, criterion))  # noqa: B023
            certificate = found.certificate
            rows.append((kind, criterion, 10**exponent, squares, used, certificate.holds, certificate.scope))
            print(
                f"{kind + ' ' + criterion:18}{10**exponent:9}{squares:9.4f}{used:9.4f}{used / squares:7.2f}"
                f"  {certificate.holds} {certificate.scope}",
                flush=True,
            )
    return rows


def markdown(rows: list[tuple], versus: str) -> str:
    """Return the tables of the documentation."""
    sizes = sorted({row[2] for row in rows})
    head = ["association", "algorithm", "global by", "proved", "error [mm]"]
    first = [*head, *(f"{n:,} points [s]" for n in sizes)]
    lines, ratios = [_row(first), _row(["---"] * len(first))], []
    for kind, criterion, planted, algorithm, proof in CASES:
        own = {row[2]: row for row in rows if row[:2] == (kind, criterion)}
        error, proved = planted_error(planted), {own[n][6] for n in sizes}
        cells = [f"{kind} {criterion}", algorithm, proof, " or ".join(sorted(proved))]
        cells.append("" if error is None else f"{max(error, 1e-16):.0e}")
        lines.append(_row([*cells, *(f"{own[n][4]:.4f}" for n in sizes)]))
        ratios.append(_row([f"{kind} {criterion}", *(f"{own[n][4] / own[n][3]:.2f}" for n in sizes)]))
    second = ["association", *(f"{n:,} points" for n in sizes)]
    return INTRODUCTION.format(
        table="\n".join(lines),
        ratios="\n".join([_row(second), _row(["---"] * len(second)), *ratios]),
        versus=versus,
    )


def _row(cells: list[str]) -> str:
    return "| " + " | ".join(cells) + " |"


INTRODUCTION = """# Associations: algorithm, accuracy, time

Written by `benchmarks/bench_association.py`. CPU seconds of one thread, the least-squares start included.
The error is the largest of five reference sets with planted values. C minimum zone (of a line: smallest
enclosing cylinder), N minimum circumscribed, X maximum inscribed, GE and GI constrained least squares
outside and inside of the material.

"Proved" is the scope of the certificate of the measured sets: *local* says that the Kuhn-Tucker conditions
hold to rounding, so that no small motion is better; *global* that nothing anywhere is, and
`certificate.reason` says by what:

- planes and lines in a plane: the contacts bound the width of slightly tilted slabs, the extent of the
  points that of strongly tilted ones, points near the contacts that of those between; where that leaves a
  gap, the width of the convex hull over the tilts that are left;
- constrained squares of planes and lines: quasi-convex while their mean is below the variance along the
  feature;
- circumscribed circles and spheres: the problem is convex; enclosing cylinders: the dual bound `trace(M) -
  lambda_max(M)` of the weighted contacts;
- zones and inscribed circles and spheres: the contacts for near centres, points all around for far ones. On
  an arc, on a cap or with a saddle of two contacts it stays local;
- cylinders, cones and tori by minimum zone or inscribed, and constrained squares of round features: local
  only. On random sets many starts never found a better cylinder, sphere or torus; of a cone with a slice of
  0.5 mm once one by 2e-9 mm.

{table}

Time over that of the least-squares fit of the same points, in the same run:

{ratios}

{versus}
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--largest", type=int, default=6, help="largest power of ten of points")
    parser.add_argument("--markdown", type=Path, help="file for the table")
    options = parser.parse_args()
    print(f"{'association':18}{'points':>9}{'LS s':>9}{'s':>9}{'ratio':>7}  certified")
    rows = measure(options.largest)
    points = surface("plane", 100_000, np.random.default_rng(1))
    ours, found = seconds(lambda: associate(points, "plane"))
    start = time.process_time()
    value = highs_flatness(points)
    theirs = time.process_time() - start
    versus = (
        f"Flatness of 100,000 points: {ours:.4f} s; one HiGHS program over all points {theirs:.3f} s, "
        f"{theirs / ours:.0f} times as long; the values differ by {abs(found.value - value):.0e} mm."
    )
    versus += "\n\n" + " ".join(worst_symmetric(n) for n in (2_000, 20_000))
    print(versus)
    if options.markdown:
        options.markdown.write_text(markdown(rows, versus), encoding="utf-8")


if __name__ == "__main__":
    main()
